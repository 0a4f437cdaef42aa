//! Tests the files and metadata that a host serves.
#![allow(clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs, reason = "tests")]

use afbc_comms::services::ftp::crc32;
use afbc_comms::services::storage::{FileAccess, FileChange, FilePath, FileStore, LogInfo, LogStore};
use afbc_hil::{MetadataFiles, ServedFiles, UlogFiles};
use afbc_mavlink::FtpError;
use afbc_onboard::Configuration;
use afbc_onboard::parameters::{Kind, ParameterTable};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;
use std::task::Poll;
use std::time::{Duration, SystemTime};

fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("made");
    folder
}

fn path(text: &str) -> FilePath {
    FilePath::of(text.as_bytes()).expect("a path")
}

fn names(files: &mut ServedFiles, directory: &str) -> Vec<(String, Option<u32>)> {
    let entry = |place| files.entry(&path(directory), place).expect("listed");
    (0..).map_while(entry).map(|entry| (entry.name.as_str().to_owned(), entry.size)).collect()
}

fn read(files: &mut ServedFiles, name: &str) -> Result<Vec<u8>, FtpError> {
    let (file, size) = files.open(&path(name), FileAccess::Read)?;
    let (mut read, mut block) = (Vec::new(), [0; 100]);
    loop {
        let count = files.read(file, read.len() as u32, &mut block)?;
        if count == 0 {
            break;
        }
        read.extend_from_slice(&block[..count]);
    }
    assert_eq!(read.len(), size as usize);
    files.close(file);
    assert_eq!(files.read(file, 0, &mut block), Err(FtpError::INVALID_SESSION));
    Ok(read)
}

#[test]
fn a_folders_logs_are_served_and_nothing_else_of_it() {
    let folder = folder("logs");
    let old: Vec<u8> = (0..1000_u32).map(|it| (it * 7) as u8).collect();
    fs::write(folder.join("old.ulg"), &old).expect("written");
    let written = SystemTime::UNIX_EPOCH + Duration::from_secs(1_700_000_001);
    let file = fs::File::options().write(true).open(folder.join("old.ulg")).expect("open");
    file.set_modified(written).expect("set");
    fs::write(folder.join("secret.txt"), "not served").expect("written");
    fs::create_dir(folder.join("sub.ulg")).expect("made");
    let mut logs = UlogFiles::create(&folder).expect("created");
    let mut files = ServedFiles::new(Some(logs.stored()), vec![("general.json".into(), b"{}".to_vec())]);
    assert_eq!(names(&mut files, "/"), [("etc".into(), None), ("log".into(), None)]);
    assert_eq!(names(&mut files, "/etc"), [("general.json".into(), Some(2))]);
    assert_eq!(names(&mut files, "/log"), [("old.ulg".into(), Some(1000)), ("log001.ulg".into(), Some(0))]);
    assert_eq!(read(&mut files, "/log/old.ulg"), Ok(old.clone()));
    assert_eq!(read(&mut files, "etc/general.json"), Ok(b"{}".to_vec()));
    for name in ["log/secret.txt", "log/sub.ulg", "log", "etc", "", "secret.txt", "log/none.ulg", "etc/none"] {
        assert_eq!(read(&mut files, name), Err(FtpError::FILE_NOT_FOUND), "{name}");
    }
    // Logs are read by number. A number or an offset beyond the end gives nothing.
    assert_eq!(files.count_logs(), Poll::Ready(2));
    assert_eq!(files.log(0), Poll::Ready(Some(LogInfo { size: 1000, utc_s: 1_700_000_001 })));
    assert_eq!(files.log(2), Poll::Ready(None));
    let mut block = [0; 90];
    assert_eq!((files.read_log(0, 950, &mut block), &block[..50]), (Poll::Ready(50), &old[950..]));
    assert_eq!([files.read_log(0, 1000, &mut block), files.read_log(7, 0, &mut block)], [Poll::Ready(0); 2]);
    // Nothing can be changed, but old logs can be removed.
    assert!(matches!(files.open(&path("log/new.ulg"), FileAccess::Create), Err(FtpError::FILE_PROTECTED)));
    assert!(matches!(files.open(&path("log/old.ulg"), FileAccess::Write), Err(FtpError::FILE_PROTECTED)));
    for change in [FileChange::CreateDirectory(&path("log/x")), FileChange::Truncate(&path("log/old.ulg"), 1)] {
        assert_eq!(files.change(change), Err(FtpError::FILE_PROTECTED));
    }
    for name in ["log/log001.ulg", "etc/general.json"] {
        assert_eq!(files.change(FileChange::Remove(&path(name))), Err(FtpError::FILE_PROTECTED));
    }
    assert_eq!(files.change(FileChange::Remove(&path("log/secret.txt"))), Err(FtpError::FILE_NOT_FOUND));
    files.change(FileChange::Remove(&path("log/old.ulg"))).expect("removed");
    assert!(!folder.join("old.ulg").exists());
    // Erases all logs that are not being written.
    logs.next_start();
    let mut files = ServedFiles::new(Some(logs.stored()), Vec::new());
    assert_eq!(names(&mut files, "log").len(), 2);
    assert_eq!(files.erase_logs(), Poll::Ready(true));
    assert_eq!(names(&mut files, "log"), [("log002.ulg".into(), Some(0))]);
    assert!(folder.join("secret.txt").exists() && folder.join("sub.ulg").exists());
    assert_eq!(ServedFiles::new(None, Vec::new()).erase_logs(), Poll::Ready(false));
}

/// If there is one file per start, only this run's files are served.
#[test]
fn a_files_starts_are_served() {
    let folder = folder("starts");
    fs::write(folder.join("other.ulg"), b"of somebody else").expect("written");
    let mut logs = UlogFiles::create(&folder.join("flight.ulg")).expect("created");
    logs.next_start();
    let mut files = ServedFiles::new(Some(logs.stored()), Vec::new());
    let listed: Vec<_> = names(&mut files, "log").into_iter().map(|(name, _)| name).collect();
    assert_eq!(listed, ["flight.ulg", "flight-2.ulg"]);
    assert!(files.erase_logs() == Poll::Ready(true));
    assert!(folder.join("other.ulg").exists() && !folder.join("flight.ulg").exists());
}

/// The metadata follow the published schemas and QGroundControl's needs, with each number as declared.
#[test]
fn metadata_describes_every_parameter() {
    let table = ParameterTable::new(Configuration::default());
    let MetadataFiles { files, general } = MetadataFiles::new("paper", &table);
    let [(general_name, general_bytes), (name, bytes)] = files.as_slice() else { panic!("two files") };
    assert_eq!(general.crc, crc32(0, general_bytes));
    assert!(general.uri.starts_with(format!("mftp://etc/{general_name}\0").as_bytes()));
    let told: Value = serde_json::from_slice(general_bytes).expect("JSON");
    assert_eq!((&told["version"], &told["modelName"]), (&1.into(), &"paper".into()));
    let kind = &told["metadataTypes"][0];
    assert_eq!((&kind["type"], &kind["uri"]), (&1.into(), &format!("mftp://etc/{name}").into()));
    assert_eq!(kind["fileCrc"], crc32(0, bytes));

    let told: Value = serde_json::from_slice(bytes).expect("JSON");
    assert_eq!(told["version"], 1);
    let described = told["parameters"].as_array().expect("an array");
    assert_eq!(described.len(), usize::from(table.count()));
    let keys = [
        "name",
        "type",
        "default",
        "min",
        "max",
        "group",
        "shortDesc",
        "longDesc",
        "units",
        "decimalPlaces",
        "rebootRequired",
        "values",
    ];
    let keys: BTreeSet<_> = keys.into_iter().collect();
    let (mut choices, mut switches, mut restarts) = (0, 0, BTreeSet::new());
    for (parameter, told) in table.iter().zip(described) {
        let name = parameter.name.as_str();
        assert!(told.as_object().expect("an object").keys().all(|key| keys.contains(key.as_str())), "{told}");
        assert_eq!(told["name"], name);
        assert_eq!(told["type"], if parameter.kind == Kind::Int32 { "Int32" } else { "Float" }, "{name}");
        assert_eq!(told["default"].as_f64().expect("a number") as f32, parameter.value, "{name}");
        assert_eq!(
            (told["min"].as_f64(), told["max"].as_f64()),
            (Some(parameter.range.min), Some(parameter.range.max))
        );
        assert!(!told["shortDesc"].as_str().expect("text").is_empty(), "{name}");
        if let Some(values) = told.get("values").and_then(Value::as_array) {
            let numbers = parameter.range.min as i64..=parameter.range.max as i64;
            assert!(values.iter().map(|value| value["value"].as_i64()).eq(numbers.map(Some)), "{told}");
            choices += usize::from(values.len() > 2);
            switches += usize::from(values.len() == 2);
        }
        if told.get("rebootRequired").is_some() {
            restarts.insert(name.to_owned());
        }
        if let Some(places) = told["decimalPlaces"].as_i64() {
            // The shown default equals the default to four digits.
            let default = f64::from(parameter.value);
            let shown: f64 = format!("{default:.*}", places as usize).parse().expect("a number");
            assert!((shown - default).abs() <= 5e-4 * default.abs(), "{name}: {shown} for {default}");
        }
    }
    assert!(choices > 0 && switches > 0, "{choices} choices, {switches} switches");
    for name in ["MAV_SYS_ID", "SER_TEL1_BAUD", "MOT_PROTOCOL"] {
        assert!(restarts.contains(name), "{restarts:?}");
    }
    let mass = described.iter().find(|it| it["name"] == "V_MASS").expect("there");
    assert_eq!((&mass["units"], &mass["min"], &mass["max"]), (&"kg".into(), &0.01.into(), &500.0.into()));
    assert_eq!((&mass["shortDesc"], &mass["default"]), (&"m: mass of the vehicle".into(), &0.486.into()));
}

/// A symbolic link is never served as a log, whether it existed before or replaces a log.
#[cfg(unix)]
#[test]
fn links_are_not_served() {
    use std::os::unix::fs::symlink;
    let (folder, elsewhere) = (folder("links"), folder("links-elsewhere"));
    fs::write(elsewhere.join("secret.ulg"), "secret").expect("written");
    fs::write(folder.join("one.ulg"), "one").expect("written");
    symlink(elsewhere.join("secret.ulg"), folder.join("secret.ulg")).expect("linked");
    symlink(folder.join("one.ulg"), folder.join("also.ulg")).expect("linked");
    symlink(&elsewhere, folder.join("folder.ulg")).expect("linked");
    symlink(folder.join("nothing"), folder.join("log001.ulg")).expect("linked");
    let logs = UlogFiles::create(&folder).expect("created");
    let mut files = ServedFiles::new(Some(logs.stored()), Vec::new());
    assert_eq!(names(&mut files, "log"), [("one.ulg".into(), Some(3)), ("log002.ulg".into(), Some(0))]);
    for name in ["secret.ulg", "also.ulg", "folder.ulg", "folder.ulg/secret.ulg", "log001.ulg"] {
        assert_eq!(read(&mut files, &format!("log/{name}")), Err(FtpError::FILE_NOT_FOUND), "{name}");
        assert!(files.change(FileChange::Remove(&path(&format!("log/{name}")))).is_err(), "{name}");
    }
    // Replaces a served log by a link, or by a pipe that would block.
    let fifo =
        |path: &PathBuf| assert!(std::process::Command::new("mkfifo").arg(path).status().expect("run").success());
    let swaps: [&dyn Fn(&PathBuf); 2] =
        [&|path| symlink(elsewhere.join("secret.ulg"), path).expect("linked"), &|path| fifo(path)];
    for swap in swaps {
        fs::remove_file(folder.join("one.ulg")).expect("removed");
        swap(&folder.join("one.ulg"));
        assert_eq!(read(&mut files, "log/one.ulg"), Err(FtpError::FILE_NOT_FOUND));
        assert_eq!((files.count_logs(), files.log(0)), (Poll::Ready(2), Poll::Ready(None)));
        assert_eq!(files.read_log(0, 0, &mut [0; 90]), Poll::Ready(0));
    }
    assert_eq!(files.erase_logs(), Poll::Ready(true));
    assert!(elsewhere.join("secret.ulg").exists() && folder.join("secret.ulg").exists());
}

/// The folder is read only at the start. Files that others add later are not served. The vehicle's own new logs are
/// served at once.
#[test]
fn the_folder_is_read_once() {
    let folder = folder("read-once");
    (0..1000).for_each(|number| fs::write(folder.join(format!("old{number}.ulg")), "old").expect("written"));
    let mut logs = UlogFiles::create(&folder).expect("created");
    let mut files = ServedFiles::new(Some(logs.stored()), Vec::new());
    fs::write(folder.join("later.ulg"), "later").expect("written");
    assert_eq!((files.count_logs(), names(&mut files, "log").len()), (Poll::Ready(1001), 1001));
    assert_eq!(read(&mut files, "log/later.ulg"), Err(FtpError::FILE_NOT_FOUND));
    logs.next_start();
    assert_eq!((files.count_logs(), names(&mut files, "log").len()), (Poll::Ready(1002), 1002));
    assert_eq!(read(&mut files, "log/log002.ulg"), Ok(Vec::new()));
    // A listing keeps its places while logs are removed.
    let tenth = files.entry(&path("log"), 10);
    files.change(FileChange::Remove(&path("log/old999.ulg"))).expect("removed");
    assert_eq!(files.entry(&path("log"), 10), tenth);
    // Logs are erased in parts, so that each call is short.
    let mut parts = 0;
    while files.erase_logs() == Poll::Pending {
        parts += 1;
        assert!(parts < 1000);
    }
    assert!(parts > 20, "{parts}");
    assert_eq!(names(&mut files, "log"), [("log002.ulg".into(), Some(0))]);
    assert!(folder.join("later.ulg").exists() && !folder.join("old0.ulg").exists());
}
