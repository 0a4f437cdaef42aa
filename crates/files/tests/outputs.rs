//! Writing never replaces files of others, in folders or as single files.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs, reason = "tests")]

use afbc_files::{Error, Folder, OutputFile};
use std::fs;
use std::io;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

fn folder(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("outputs").join(test);
    if folder.exists() {
        fs::remove_dir_all(&folder).unwrap();
    }
    fs::create_dir_all(&folder).unwrap();
    folder
}

fn names(folder: &Path) -> Vec<String> {
    let names = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<_> = names.filter(|name| !name.starts_with(".sitl")).collect();
    names.sort();
    names
}

/// Function that puts something in the way, at a path.
type Make = fn(&Path);

/// Things that may be in the way of a file. Links point to a target in the same folder.
const IN_THE_WAY: [(&str, Make); 4] = [
    ("file", |path| fs::write(path, "mine").unwrap()),
    ("empty", |path| fs::write(path, "").unwrap()),
    ("link", |path| symlink("target", path).unwrap()),
    ("lost", |path| symlink("nowhere", path).unwrap()),
];

#[test]
fn nothing_is_replaced_unless_by_force() {
    let folder = folder("single");
    fs::write(folder.join("target"), "theirs").unwrap();
    for (name, make) in IN_THE_WAY {
        let path = folder.join(name);
        make(&path);
        let before = (fs::symlink_metadata(&path).unwrap().file_type(), fs::read(&path).ok());
        for error in [OutputFile::new(&path, "--it"), OutputFile::forcible(&path, "--it", false)] {
            let error = error.unwrap_err().to_string();
            assert!(error.contains("exists already; choose another file for --it, or "), "{error}");
        }
        assert_eq!((fs::symlink_metadata(&path).unwrap().file_type(), fs::read(&path).ok()), before);
        let forced = OutputFile::forcible(&path, "--it", true).unwrap();
        // A failure leaves the file as it was.
        forced.write(|_| Err(io::ErrorKind::StorageFull.into())).unwrap_err();
        assert_eq!((fs::symlink_metadata(&path).unwrap().file_type(), fs::read(&path).ok()), before);
        assert!(matches!(forced.create(), Err(Error::Exists { .. })), "logs are not forced");
        forced.write(|out| out.write_all(b"new")).unwrap();
        assert!(fs::symlink_metadata(&path).unwrap().is_file());
        assert_eq!(fs::read(&path).unwrap(), b"new");
    }
    assert_eq!(fs::read(folder.join("target")).unwrap(), b"theirs");
    for path in ["", "..", ".", "no/such"] {
        let error = OutputFile::forcible(&folder.join(path), "--it", true).unwrap_err().to_string();
        assert!(error.contains("cannot be written (") && error.contains("--it"), "{error}");
    }
    assert_eq!(names(&folder), ["empty", "file", "link", "lost", "target"]);
}

/// A file that appears between the check and the write is not replaced, either.
#[test]
fn what_appears_meanwhile_is_kept() {
    let folder = folder("meanwhile");
    for (name, make) in IN_THE_WAY {
        let path = folder.join(name);
        let output = OutputFile::new(&path, "--it").unwrap();
        output.write(|_| Err(io::ErrorKind::StorageFull.into())).unwrap_err();
        assert!(names(&folder).iter().all(|known| known != name), "nothing stays of a failure");
        make(&path);
        let before = fs::read(&path).ok();
        assert!(matches!(output.write(|out| out.write_all(b"new")), Err(Error::Exists { .. })), "{name}");
        assert!(matches!(output.create(), Err(Error::Exists { .. })), "{name}");
        assert_eq!(fs::read(&path).ok(), before);
    }
    assert_eq!(names(&folder), ["empty", "file", "link", "lost"]);
    assert!(!fs::read_dir(&folder).unwrap().any(|it| it.unwrap().file_name().to_string_lossy().ends_with(".tmp")));
}

fn written(path: &Path, command: &str, force: bool, files: &[&str]) -> Result<(), Error> {
    let folder = Folder::open(path, command, "it", force)?;
    folder.only(files)?;
    files.iter().try_for_each(|name| folder.write(name, |out| out.write_all(command.as_bytes())).map(drop))
}

#[test]
fn results_are_replaced_by_the_same_command_as_long_as_nobody_has_changed_them() {
    let path = folder("changed").join("results");
    let files = ["a.csv", "b.json", "c.html"];
    written(&path, "fly x", false, &files).unwrap();
    let refused = |command: &str| written(&path, command, false, &files).unwrap_err().to_string();
    assert!(refused("fly x --seed 2").contains("the folder holds the results of `sitl fly x` for it"));
    for name in files {
        written(&path, "fly x", false, &files).unwrap();
        fs::write(path.join(name), "fly y").unwrap();
        let error = refused("fly x");
        assert!(error.contains(&format!("{name}: the file was changed after `sitl fly x` wrote it")), "{error}");
        assert_eq!(fs::read(path.join(name)).unwrap(), b"fly y");
        // A file that is restored or gone does not count as changed.
        fs::write(path.join(name), "fly x").unwrap();
        written(&path, "fly x", false, &files).unwrap();
        fs::remove_file(path.join(name)).unwrap();
    }
    // With `force`, another command takes over all files, including those that it does not write. Changed files stay.
    written(&path, "fly x", false, &files).unwrap();
    fs::write(path.join("b.json"), "mine").unwrap();
    written(&path, "fly z", true, &["a.csv"]).unwrap();
    assert_eq!(names(&path), ["a.csv", "b.json"]);
    assert_eq!(fs::read(path.join("b.json")).unwrap(), b"mine");
    assert!(refused("fly x").contains("the folder holds the results of `sitl fly z` for it"));
}

/// A folder of a command that was interrupted before it wrote anything is free for any command.
#[test]
fn a_folder_without_results_is_anybodys() {
    let folder = folder("interrupted").join("results");
    drop(Folder::open(&folder, "compare --suite field", "suite", false).unwrap());
    written(&folder, "compare --suite faults", false, &["suite.csv"]).unwrap();
    assert!(matches!(Folder::open(&folder, "compare --suite field", "suite", false), Err(Error::Foreign { .. })));
    fs::remove_file(folder.join("suite.csv")).unwrap();
    fs::write(folder.join("mine.txt"), "mine").unwrap();
    assert!(matches!(Folder::open(&folder, "compare --suite field", "suite", false), Err(Error::Foreign { .. })));
}

#[test]
fn a_folder_that_is_being_written_cannot_be_opened() {
    let path = folder("busy").join("results");
    let open = Folder::open(&path, "fly x", "it", false).unwrap();
    for force in [false, true] {
        let error = Folder::open(&path, "fly x", "it", force).unwrap_err();
        assert!(matches!(error, Error::Busy(_)), "{error}");
    }
    drop(open);
    Folder::open(&path, "fly x", "it", false).unwrap();
}
