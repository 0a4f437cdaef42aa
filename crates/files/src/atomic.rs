//! Atomic writing: a file appears complete or not at all.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Prefix of the names of temporary files.
pub(crate) const HIDDEN: &str = ".sitl.";

/// Writer that is passed to a function which fills a file.
type FillWriter<'a> = &'a mut (dyn Write + Send);

/// Writes the file at `path` atomically like [`Folder::write`](crate::Folder::write); replaces an existing file.
///
/// # Errors
/// If the file cannot be written; an existing file stays as it was.
pub fn write_atomically(path: &Path, fill: impl FnOnce(FillWriter<'_>) -> io::Result<()>) -> io::Result<()> {
    by_way_of(path, fill, |temporary| fs::rename(temporary, path))
}

/// Writes the file at `path` atomically like [`write_atomically`]; fails if it exists.
pub(crate) fn write_new(path: &Path, fill: impl FnOnce(FillWriter<'_>) -> io::Result<()>) -> io::Result<()> {
    by_way_of(path, fill, |temporary| match fs::hard_link(temporary, path) {
        // Some file systems have no hard links.
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => {
            File::create_new(path)?;
            fs::rename(temporary, path)
        }
        linked => linked.map(|()| drop(fs::remove_file(temporary))),
    })
}

/// Lets `fill` write a temporary file next to `path`, then lets `settle` give it its final name.
fn by_way_of(
    path: &Path,
    fill: impl FnOnce(FillWriter<'_>) -> io::Result<()>,
    settle: impl FnOnce(&Path) -> io::Result<()>,
) -> io::Result<()> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let temporary = path.with_file_name(format!("{HIDDEN}{name}.{}.tmp", std::process::id()));
    // A killed program with the same process id may have left a temporary file; usually there is none.
    let _ = fs::remove_file(&temporary);
    let written = File::create_new(&temporary).and_then(|file| {
        let mut out = BufWriter::new(CheckedFile { file, failure: None });
        let filled = fill(&mut out).and_then(|()| out.flush());
        // Takes the buffer apart: dropping it after a failure would try to write again.
        let (disk, _) = out.into_parts();
        filled.map_err(|error| disk.cause(error))?;
        disk.file.sync_all()
    });
    written.and_then(|()| settle(&temporary)).inspect_err(|_| {
        // A failure here is ignored: nothing more can be done.
        let _ = fs::remove_file(&temporary);
    })
}

/// Removes temporary files of killed programs from the folder `dir`.
pub fn remove_temporary_files(dir: &Path) {
    for entry in fs::read_dir(dir).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if name.starts_with(HIDDEN) && name.ends_with(".tmp") {
            // Ignores files that cannot be removed; they do no harm.
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// A file that records the error of a failed write.
pub struct CheckedFile {
    /// The file.
    pub file: File,
    /// The system's error number.
    pub failure: Option<i32>,
}

impl CheckedFile {
    /// Returns the system's own error if there was one, since libraries wrap errors and lose their kind.
    pub fn cause(&self, error: io::Error) -> io::Error {
        self.failure.map_or(error, io::Error::from_raw_os_error)
    }
}

impl Write for CheckedFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes).inspect_err(|error| self.failure = error.raw_os_error())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}
