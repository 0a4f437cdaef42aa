//! The black box in files: one for each start of the vehicle.

use crate::log_file::LogFile;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// The ULog of a vehicle. A log that cannot be written any more ends, and the flight goes on.
#[derive(Clone, Debug)]
pub struct UlogFiles {
    place: LogPlace,
    /// That of the last start.
    path: PathBuf,
    /// Number of starts.
    starts: u32,
    /// The last start's, until it has failed.
    file: Option<LogFile>,
    failure: Option<String>,
}

/// Where the logs of a vehicle are.
#[derive(Clone, Debug)]
enum LogPlace {
    /// In a file for the first start; the others are beside it.
    File(PathBuf),
    /// In a folder, with those of all earlier runs.
    Folder(PathBuf),
}

/// The logs of a vehicle that are there, for stations to download.
#[derive(Clone, Debug)]
pub struct StoredLogs {
    place: LogPlace,
    starts: u32,
    /// The one that is being written.
    current: PathBuf,
}

impl UlogFiles {
    /// Creates the file at `path`, where there must be none; that of the second start has `-2` behind its name, and so
    /// on. In a folder, each start has the next file that is free: `log001.ulg`, `log002.ulg` ...
    ///
    /// # Errors
    /// One line on why it cannot be created.
    pub fn create(path: &Path) -> Result<Self, String> {
        let place = if path.is_dir() { LogPlace::Folder(path.into()) } else { LogPlace::File(path.into()) };
        let path = place.of_start(1);
        let file = create(&path)?;
        Ok(UlogFiles { place, path, starts: 1, file: Some(file), failure: None })
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

    /// Returns the logs that there are.
    pub fn stored(&self) -> StoredLogs {
        StoredLogs { place: self.place.clone(), starts: self.starts, current: self.path.clone() }
    }

    /// Ends the file, and creates that of the next start.
    pub fn next_start(&mut self) {
        let ended = self.end();
        self.starts += 1;
        self.path = self.place.of_start(self.starts);
        match create(&self.path) {
            Ok(file) => self.file = Some(file),
            Err(error) => self.failure = Some(error),
        }
        self.failure = ended.err().or(self.failure.take());
    }

    /// Returns a line on why the log has ended early, once.
    pub fn take_failure(&mut self) -> Option<String> {
        if let Some(failure) = self.file.as_ref().and_then(LogFile::take_failure) {
            self.file = None;
            self.failure = Some(ended(&self.path, &failure));
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
        finished.map_err(|error| ended(&self.path, &error.to_string()))
    }
}

impl LogPlace {
    /// Returns the path of a start's file.
    fn of_start(&self, start: u32) -> PathBuf {
        match self {
            LogPlace::File(path) => numbered(path, start),
            LogPlace::Folder(folder) => {
                let number = |path: &PathBuf| path.file_stem()?.to_str()?.strip_prefix("log")?.parse::<u32>().ok();
                // By the largest number and not by how many there are: stations may have erased some.
                let last = logs_in(folder).iter().filter_map(number).max().unwrap_or(0);
                folder.join(format!("log{:03}.ulg", last.saturating_add(1)))
            }
        }
    }
}

impl StoredLogs {
    /// Returns the logs, the oldest first.
    pub fn list(&self) -> Vec<PathBuf> {
        match &self.place {
            LogPlace::File(path) => {
                (1..=self.starts).map(|start| numbered(path, start)).filter(|path| path.is_file()).collect()
            }
            LogPlace::Folder(folder) => logs_in(folder),
        }
    }

    /// True of the log that is being written.
    pub fn is_current(&self, path: &Path) -> bool {
        path == self.current
    }
}

/// Returns the logs in a folder, the oldest first.
fn logs_in(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let is_log = |path: &PathBuf| path.extension().is_some_and(|extension| extension == "ulg") && path.is_file();
    let written = |path: &PathBuf| path.metadata().and_then(|data| data.modified()).unwrap_or(SystemTime::UNIX_EPOCH);
    let mut logs: Vec<_> = paths.filter(is_log).map(|path| (written(&path), path)).collect();
    logs.sort();
    logs.into_iter().map(|(_, path)| path).collect()
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
