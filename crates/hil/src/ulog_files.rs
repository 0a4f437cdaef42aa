//! Writes the black box to files, one for each start of the vehicle.

use crate::log_file::LogFile;
use crate::stored_logs::StoredLogs;
use afbc_files::{Error, OutputFile};
use std::path::{Path, PathBuf};

/// Largest number of logs of earlier starts that may still wait for the disk.
const ENDING_MAX: usize = 8;
/// Largest number of starts that are logged, because stations may restart the vehicle any number of times.
const STARTS_MAX: u32 = 1000;
/// Largest number of file numbers that are tried until one is free.
const NUMBERS_TRIED: u32 = 1000;

/// The ULog files of a vehicle. If a log cannot be written any more, it ends, and the flight continues.
#[derive(Clone, Debug)]
pub struct UlogFiles {
    place: LogPlace,
    stored: StoredLogs,
    is_live: bool,
    /// Path of the last start's log.
    path: PathBuf,
    /// Number of starts.
    starts: u32,
    /// Log of the last start; none after a failure.
    file: Option<LogFile>,
    /// Logs of earlier starts that are not completely written.
    ending: Vec<(PathBuf, LogFile)>,
    /// The failure that was not reported yet, and the first failure.
    untold: Option<String>,
    failure: Option<String>,
}

/// Location of a vehicle's logs.
#[derive(Clone, Debug)]
enum LogPlace {
    /// Path of the first start's file. The other files are next to it.
    File(PathBuf),
    /// Folder with the logs of all runs, and the number of the last log.
    Folder(PathBuf, u32),
}

impl UlogFiles {
    /// Creates the file at `path`, which must not exist. The second start's file has `-2` after its name, and so on. If
    /// `path` is a folder, each start gets the next free file: `log001.ulg`, `log002.ulg` and so on.
    ///
    /// # Errors
    /// One line with the reason why the file cannot be created.
    pub fn create(path: &Path) -> Result<Self, String> {
        let (mut place, stored) = if path.is_dir() {
            let stored = StoredLogs::read(path);
            let number = |name: &String| name.strip_prefix("log")?.strip_suffix(".ulg")?.parse::<u32>().ok();
            // Counts from the largest number, not from the number of logs: stations may have erased some.
            let last = stored.names().iter().filter_map(number).max().unwrap_or(0);
            (LogPlace::Folder(path.into(), last), stored)
        } else {
            let folder = path.parent().unwrap_or(Path::new(""));
            (LogPlace::File(path.into()), StoredLogs::none_in(folder))
        };
        let (path, file) = place.create(1)?;
        stored.begin(&path);
        let (ending, untold, failure) = (Vec::new(), None, None);
        Ok(UlogFiles { place, stored, is_live: false, path, starts: 1, file: Some(file), ending, untold, failure })
    }

    /// Makes the logs live, for a flight in real time ([`LogFile::live`]).
    #[must_use]
    pub fn live(self) -> Self {
        UlogFiles { is_live: true, file: self.file.map(LogFile::live), ..self }
    }

    /// Returns a receiver for a host's log bytes ([`Host::log`](crate::Host::log)).
    pub fn sink(&self) -> impl FnMut(&[u8]) + 'static {
        let mut sink = self.file.as_ref().map(LogFile::sink);
        move |bytes| {
            if let Some(sink) = &mut sink {
                sink(bytes);
            }
        }
    }

    /// Returns the logs that stations may download.
    pub fn stored(&self) -> StoredLogs {
        self.stored.clone()
    }

    /// Ends the file, and creates the next start's file. Does not wait for the disk.
    pub fn next_start(&mut self) {
        self.look();
        if let Some(file) = self.file.take() {
            file.close();
            self.ending.push((self.path.clone(), file));
        }
        self.starts += 1;
        let refused = match () {
            () if self.starts > STARTS_MAX => Some("the vehicle has restarted too often"),
            () if self.ending.len() > ENDING_MAX => Some("the logs of earlier starts are still being written"),
            () => None,
        };
        if let Some(why) = refused {
            return self.fail(format!("this start is not logged: {why}"));
        }
        match self.place.create(self.starts) {
            Ok((path, file)) => {
                self.stored.begin(&path);
                self.path = path;
                self.file = Some(if self.is_live { file.live() } else { file });
            }
            Err(error) => self.fail(error),
        }
    }

    /// Returns one line with the reason why the log ended early. Reports it only once.
    pub fn take_failure(&mut self) -> Option<String> {
        self.look();
        self.untold.take()
    }

    /// Writes the rest.
    ///
    /// # Errors
    /// One line with the reason why the first log ended early, even if it was reported before.
    pub fn finish(mut self) -> Result<(), String> {
        self.end();
        self.failure.map_or(Ok(()), Err)
    }

    /// Writes the rest. Returns one line with the reason why a log ended early, unless it was reported before.
    pub fn end(&mut self) -> Option<String> {
        let last = self.file.take().map(|file| (self.path.clone(), file));
        for (path, file) in self.ending.split_off(0).into_iter().chain(last) {
            if let Err(error) = file.finish() {
                self.fail(ended(&path, &error.to_string()));
            }
        }
        self.untold.take()
    }

    /// Notes new failures, and drops logs that are completely written.
    fn look(&mut self) {
        if let Some(failure) = self.file.as_ref().and_then(LogFile::take_failure) {
            self.file = None;
            self.fail(ended(&self.path, &failure));
        }
        for (path, file) in self.ending.extract_if(.., |(_, file)| file.is_over()).collect::<Vec<_>>() {
            if let Some(failure) = file.take_failure() {
                self.fail(ended(&path, &failure));
            }
        }
    }

    fn fail(&mut self, line: String) {
        self.failure.get_or_insert_with(|| line.clone());
        self.untold = Some(line);
    }
}

impl LogPlace {
    /// Creates the file of a start.
    fn create(&mut self, start: u32) -> Result<(PathBuf, LogFile), String> {
        let mut tried = 0;
        loop {
            let path = match self {
                LogPlace::File(path) => numbered(path, start),
                LogPlace::Folder(folder, last) => {
                    *last = last.saturating_add(1);
                    folder.join(format!("log{last:03}.ulg"))
                }
            };
            tried += 1;
            match OutputFile::new(&path, "--ulog").and_then(|output| LogFile::create(&output)) {
                Ok(file) => return Ok((path, file)),
                // Another process may log into the same folder.
                Err(Error::Exists { .. }) if matches!(self, LogPlace::Folder(..)) && tried < NUMBERS_TRIED => {}
                Err(error) => return Err(error.to_string()),
            }
        }
    }
}

fn ended(path: &Path, problem: &str) -> String {
    let path = path.display();
    format!("{path}: the log ended early ({problem}); free some space, or choose another file for --ulog")
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
