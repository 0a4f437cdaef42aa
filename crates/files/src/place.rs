//! Atomic writing of files: whole or not at all.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Prefix of the names of temporary files.
pub(crate) const HIDDEN: &str = ".sitl.";

/// Lets a function write to a file.
type Fill<'a> = &'a mut (dyn Write + Send);

/// Writes the file at `path` as [`Folder::place`](crate::Folder::place) does, in place of any other.
///
/// # Errors
/// If it cannot be written; what was there before is there still.
pub fn place(path: &Path, fill: impl FnOnce(Fill<'_>) -> io::Result<()>) -> io::Result<()> {
    by_way_of(path, fill, |temporary| fs::rename(temporary, path))
}

/// As [`place`], where there must be no file.
pub(crate) fn fresh(path: &Path, fill: impl FnOnce(Fill<'_>) -> io::Result<()>) -> io::Result<()> {
    by_way_of(path, fill, |temporary| match fs::hard_link(temporary, path) {
        // Some file systems have no links.
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => {
            File::create_new(path)?;
            fs::rename(temporary, path)
        }
        linked => linked.map(|()| drop(fs::remove_file(temporary))),
    })
}

/// Lets `fill` write a temporary file beside `path`, and `settle` give it its name.
fn by_way_of(
    path: &Path,
    fill: impl FnOnce(Fill<'_>) -> io::Result<()>,
    settle: impl FnOnce(&Path) -> io::Result<()>,
) -> io::Result<()> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let temporary = path.with_file_name(format!("{HIDDEN}{name}.{}.tmp", std::process::id()));
    // A killed program of the same process id may have left one; usually there is nothing to remove.
    let _ = fs::remove_file(&temporary);
    let written = File::create_new(&temporary).and_then(|file| {
        let mut out = BufWriter::new(Disk { file, failure: None });
        let filled = fill(&mut out).and_then(|()| out.flush());
        // Taken apart, since a buffer that is dropped after a failure would be written once more.
        let (disk, _) = out.into_parts();
        filled.map_err(|error| disk.cause(error))?;
        disk.file.sync_all()
    });
    written.and_then(|()| settle(&temporary)).inspect_err(|_| {
        // Nothing more can be done if this fails too.
        let _ = fs::remove_file(&temporary);
    })
}

/// Removes temporary files of killed programs from the folder `dir`.
pub fn sweep(dir: &Path) {
    for entry in fs::read_dir(dir).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if name.starts_with(HIDDEN) && name.ends_with(".tmp") {
            // A file that cannot be removed does no harm.
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// A file that records why writing to it failed.
pub struct Disk {
    /// The file.
    pub file: File,
    /// The system's error number.
    pub failure: Option<i32>,
}

impl Disk {
    /// Returns the system's error, if there was one: libraries wrap it so that its kind is lost.
    pub fn cause(&self, error: io::Error) -> io::Error {
        self.failure.map_or(error, io::Error::from_raw_os_error)
    }
}

impl Write for Disk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes).inspect_err(|error| self.failure = error.raw_os_error())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}
