//! The black box in files: one for each start of the vehicle.

use crate::log_file::LogFile;
use std::io;
use std::path::{Path, PathBuf};

/// The ULog of a vehicle. A log that cannot be written any more ends, and the flight goes on.
#[derive(Clone, Debug)]
pub struct UlogFiles {
    path: PathBuf,
    /// Number of starts.
    starts: u32,
    /// The last start's, until it has failed.
    file: Option<LogFile>,
    failure: Option<String>,
}

impl UlogFiles {
    /// Creates the file at `path`, where there must be none; that of the second start has `-2` behind its name, and so
    /// on.
    ///
    /// # Errors
    /// One line on why it cannot be created.
    pub fn create(path: &Path) -> Result<Self, String> {
        let file = create(path)?;
        Ok(UlogFiles { path: path.into(), starts: 1, file: Some(file), failure: None })
    }

    /// Returns what takes the bytes of a host ([`Host::log`](crate::Host::log)).
    pub fn sink(&self) -> impl FnMut(&[u8]) + 'static {
        let mut sink = self.file.as_ref().map(LogFile::sink);
        move |bytes| {
            if let Some(sink) = &mut sink {
                sink(bytes);
            }
        }
    }

    /// Ends the file, and creates that of the next start.
    pub fn next_start(&mut self) {
        let ended = self.end();
        self.starts += 1;
        match create(&numbered(&self.path, self.starts)) {
            Ok(file) => self.file = Some(file),
            Err(error) => self.failure = Some(error),
        }
        self.failure = ended.err().or(self.failure.take());
    }

    /// Returns a line on why the log has ended early, once.
    pub fn take_failure(&mut self) -> Option<String> {
        if let Some(failure) = self.file.as_ref().and_then(LogFile::take_failure) {
            self.file = None;
            self.failure = Some(ended(&self.last_path(), &failure));
        }
        self.failure.take()
    }

    /// Writes what is left.
    ///
    /// # Errors
    /// A line on why the log has ended early, unless that was told.
    pub fn finish(mut self) -> Result<(), String> {
        self.end()?;
        self.failure.map_or(Ok(()), Err)
    }

    fn end(&mut self) -> Result<(), String> {
        let finished = self.file.take().map_or(Ok(()), |file| file.finish());
        finished.map_err(|error| ended(&self.last_path(), &error.to_string()))
    }

    fn last_path(&self) -> PathBuf {
        numbered(&self.path, self.starts)
    }
}

fn create(path: &Path) -> Result<LogFile, String> {
    LogFile::create_new(path).map_err(|error| {
        let path = path.display();
        match error.kind() {
            io::ErrorKind::AlreadyExists => {
                format!("{path}: exists already; choose another file for --ulog, or remove that one")
            }
            _ => format!("{path}: cannot be written ({error}); choose another file for --ulog"),
        }
    })
}

fn ended(path: &Path, problem: &str) -> String {
    let path = path.display();
    format!("{path}: the log has ended early ({problem}); make room, or choose another file for --ulog")
}

/// Returns the path of a start's file.
fn numbered(path: &Path, start: u32) -> PathBuf {
    if start == 1 {
        return path.into();
    }
    let mut name = path.file_stem().unwrap_or_default().to_os_string();
    name.push(format!("-{start}"));
    if let Some(extension) = path.extension() {
        name.push(".");
        name.push(extension);
    }
    path.with_file_name(name)
}
