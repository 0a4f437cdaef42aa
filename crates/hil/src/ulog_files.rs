//! The black box in files: one for each start of the vehicle.

use crate::log_file::LogFile;
use crate::stored_logs::StoredLogs;
use afbc_files::{Error, Output};
use std::path::{Path, PathBuf};

/// Logs of earlier starts that may still be on their way to the disk.
const ENDING_MAX: usize = 8;
/// Most starts that are logged: stations may ask for any number of them.
const STARTS_MAX: u32 = 1000;
/// Numbers of files that are tried, one after the other, until one is free.
const NUMBERS_TRIED: u32 = 1000;

/// The ULog of a vehicle. A log that cannot be written any more ends, and the flight goes on.
#[derive(Clone, Debug)]
pub struct UlogFiles {
    place: LogPlace,
    stored: StoredLogs,
    is_live: bool,
    /// That of the last start.
    path: PathBuf,
    /// Number of starts.
    starts: u32,
    /// The last start's, until it has failed.
    file: Option<LogFile>,
    /// Those of earlier starts that are not written yet.
    ending: Vec<(PathBuf, LogFile)>,
    /// A failure of which nobody knows yet, and the first of all.
    untold: Option<String>,
    failure: Option<String>,
}

/// Where the logs of a vehicle are.
#[derive(Clone, Debug)]
enum LogPlace {
    /// In a file for the first start; the others are beside it.
    File(PathBuf),
    /// In a folder, with those of all earlier runs, by number; the last one.
    Folder(PathBuf, u32),
}

impl UlogFiles {
    /// Creates the file at `path`, where there must be none; that of the second start has `-2` behind its name, and so
    /// on. In a folder, each start has the next file that is free: `log001.ulg`, `log002.ulg` ...
    ///
    /// # Errors
    /// One line on why it cannot be created.
    pub fn create(path: &Path) -> Result<Self, String> {
        let (mut place, stored) = if path.is_dir() {
            let stored = StoredLogs::read(path);
            let number = |name: &String| name.strip_prefix("log")?.strip_suffix(".ulg")?.parse::<u32>().ok();
            // By the largest number and not by how many there are: stations may have erased some.
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

    /// The same of a flight that goes on by itself ([`LogFile::live`]).
    #[must_use]
    pub fn live(self) -> Self {
        UlogFiles { is_live: true, file: self.file.map(LogFile::live), ..self }
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
        self.stored.clone()
    }

    /// Ends the file, and creates that of the next start. Waits for no disk.
    pub fn next_start(&mut self) {
        self.look();
        if let Some(file) = self.file.take() {
            file.close();
            self.ending.push((self.path.clone(), file));
        }
        self.starts += 1;
        let refused = match () {
            () if self.starts > STARTS_MAX => Some("there were too many starts"),
            () if self.ending.len() > ENDING_MAX => Some("the logs of earlier starts are not written yet"),
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

    /// Returns a line on why the log has ended early, once.
    pub fn take_failure(&mut self) -> Option<String> {
        self.look();
        self.untold.take()
    }

    /// Writes what is left.
    ///
    /// # Errors
    /// A line on why a log has ended early, told or not.
    pub fn finish(mut self) -> Result<(), String> {
        self.end();
        self.failure.map_or(Ok(()), Err)
    }

    /// Writes what is left; returns a line on why a log has ended early, unless that was told.
    pub fn end(&mut self) -> Option<String> {
        let last = self.file.take().map(|file| (self.path.clone(), file));
        for (path, file) in self.ending.split_off(0).into_iter().chain(last) {
            if let Err(error) = file.finish() {
                self.fail(ended(&path, &error.to_string()));
            }
        }
        self.untold.take()
    }

    /// Notes what has failed, and forgets what is written.
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
    /// Creates a start's file.
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
            match Output::new(&path, "--ulog").and_then(|output| LogFile::create(&output)) {
                Ok(file) => return Ok((path, file)),
                // Somebody else logs into the folder, too.
                Err(Error::Exists { .. }) if matches!(self, LogPlace::Folder(..)) && tried < NUMBERS_TRIED => {}
                Err(error) => return Err(error.to_string()),
            }
        }
    }
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
