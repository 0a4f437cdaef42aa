//! Files that a host serves to stations: metadata in `/etc`, logs in `/log`, and a streamed log.

use crate::host_black_box::HostBlackBox;
use crate::stored_logs::StoredLogs;
use afbc_comms::services::storage::{
    DirectoryEntry, FileAccess, FileChange, FilePath, FileStore, LogInfo, LogSource, LogStore,
};
use afbc_mavlink::FtpError;
use std::fs::File;
use std::io::{ErrorKind, Read, Seek, SeekFrom};
use std::rc::Rc;
use std::task::Poll;
use std::time::UNIX_EPOCH;

/// Directories of the metadata and of the logs.
const ETC: &str = "etc";
const LOG: &str = "log";
/// Largest number of logs erased in one call.
const ERASED_MAX: usize = 16;

/// The files of a host. None can be written. Logs can be removed, except the one being written.
#[derive(Default)]
pub struct ServedFiles {
    /// Files in `/etc`: name and content.
    etc: Vec<(String, Vec<u8>)>,
    logs: Option<StoredLogs>,
    open: Vec<Option<Opened>>,
    /// The logs in the last listing and in the last count, and the open log.
    listed: Rc<Vec<String>>,
    counted: Rc<Vec<String>>,
    reading: Option<(u16, File)>,
    /// Logs still to be erased, and true if an erasure has failed.
    erasing: Option<(Vec<String>, bool)>,
    /// True while a log is to be streamed, and the black box that writes it.
    streams: bool,
    stream: Option<HostBlackBox>,
}

#[derive(Debug)]
enum Opened {
    /// Index of the file in `/etc`.
    Etc(usize),
    Log(File),
}

/// Handle of an open file.
#[derive(Clone, Copy, Debug)]
pub struct OpenFile(usize);

impl ServedFiles {
    /// Creates the served files: `logs`, and the files in `/etc` by name and content.
    pub fn new(logs: Option<StoredLogs>, etc: Vec<(String, Vec<u8>)>) -> Self {
        ServedFiles { etc, logs, ..ServedFiles::default() }
    }

    /// Returns the black box of the streamed log, if a log is to be streamed. A new stream's black box is made by
    /// `begin`.
    pub(crate) fn streamed(&mut self, begin: impl FnOnce() -> HostBlackBox) -> Option<&mut HostBlackBox> {
        self.streams.then(|| self.stream.get_or_insert_with(begin))
    }

    fn names(&self) -> Rc<Vec<String>> {
        self.logs.as_ref().map_or_else(Rc::default, StoredLogs::names)
    }

    fn find_etc(&self, name: &str) -> Result<usize, FtpError> {
        self.etc.iter().position(|(own, _)| own == name).ok_or(FtpError::FILE_NOT_FOUND)
    }

    /// Opens the log with this name. Returns it with its size.
    fn open_log(&self, name: &str) -> Result<(File, u32), FtpError> {
        let logs = self.logs.as_ref().ok_or(FtpError::FILE_NOT_FOUND)?;
        let file = logs.open(name).map_err(|error| refusal(&error))?;
        let size = file.metadata().map_or(0, |data| size(data.len()));
        Ok((file, size))
    }
}

impl FileStore for ServedFiles {
    type File = OpenFile;

    fn open(&mut self, path: &FilePath, access: FileAccess) -> Result<(OpenFile, u32), FtpError> {
        if access != FileAccess::Read {
            return Err(FtpError::FILE_PROTECTED);
        }
        let (opened, size) = match path.as_str().split_once('/') {
            Some((ETC, name)) => {
                let place = self.find_etc(name)?;
                (Opened::Etc(place), self.etc.get(place).map_or(0, |(_, bytes)| bytes.len() as u32))
            }
            Some((LOG, name)) => {
                let (file, size) = self.open_log(name)?;
                (Opened::Log(file), size)
            }
            _ => return Err(FtpError::FILE_NOT_FOUND),
        };
        let place = self.open.iter().position(Option::is_none).unwrap_or_else(|| {
            self.open.push(None);
            self.open.len() - 1
        });
        if let Some(free) = self.open.get_mut(place) {
            *free = Some(opened);
        }
        Ok((OpenFile(place), size))
    }

    fn close(&mut self, OpenFile(place): OpenFile) {
        self.open.get_mut(place).and_then(Option::take);
    }

    fn read(&mut self, OpenFile(place): OpenFile, offset: u32, into: &mut [u8]) -> Result<usize, FtpError> {
        match self.open.get_mut(place).and_then(Option::as_mut).ok_or(FtpError::INVALID_SESSION)? {
            Opened::Etc(place) => {
                let bytes = self.etc.get(*place).and_then(|(_, bytes)| bytes.get(offset as usize..));
                let mut bytes = bytes.unwrap_or_default();
                bytes.read(into).map_err(|error| refusal(&error))
            }
            Opened::Log(file) => read(file, offset, into).map_err(|error| refusal(&error)),
        }
    }

    fn entry(&mut self, directory: &FilePath, place: u32) -> Result<Option<DirectoryEntry>, FtpError> {
        let at = place as usize;
        let entry = |name: &str, size| Some(DirectoryEntry { name: name.try_into().ok()?, size });
        Ok(match directory.as_str() {
            "" => [ETC, LOG].get(at).and_then(|name| entry(name, None)),
            ETC => self.etc.get(at).and_then(|(name, bytes)| entry(name, Some(size(bytes.len() as u64)))),
            LOG => {
                // The list is kept during a listing, so that new or removed logs do not shift the places.
                if at == 0 {
                    self.listed = self.names();
                }
                let data = |name| self.logs.as_ref()?.metadata(name).ok();
                self.listed.get(at).and_then(|name| entry(name, Some(data(name).map_or(0, |data| size(data.len())))))
            }
            _ => return Err(FtpError::FILE_NOT_FOUND),
        })
    }

    fn change(&mut self, change: FileChange<'_>) -> Result<(), FtpError> {
        let FileChange::Remove(path) = change else { return Err(FtpError::FILE_PROTECTED) };
        match path.as_str().split_once('/') {
            Some((ETC, name)) => self.find_etc(name).and(Err(FtpError::FILE_PROTECTED)),
            Some((LOG, name)) => {
                let logs = self.logs.as_ref().ok_or(FtpError::FILE_NOT_FOUND)?;
                if logs.is_current(name) {
                    return Err(FtpError::FILE_PROTECTED);
                }
                logs.remove(name).map_err(|error| refusal(&error))
            }
            _ => Err(FtpError::FILE_NOT_FOUND),
        }
    }
}

impl LogStore for ServedFiles {
    fn count_logs(&mut self) -> Poll<u16> {
        (self.counted, self.reading) = (self.names(), None);
        // MAVLink's LOG_ENTRY has 16 bits for the number of logs.
        Poll::Ready(u16::try_from(self.counted.len()).unwrap_or(u16::MAX))
    }

    fn log(&mut self, place: u16) -> Poll<Option<LogInfo>> {
        let named = self.logs.as_ref().zip(self.counted.get(usize::from(place)));
        let data = named.and_then(|(logs, name)| logs.metadata(name).ok());
        Poll::Ready(data.map(|data| {
            let written = data.modified().ok().and_then(|at| at.duration_since(UNIX_EPOCH).ok());
            let utc_s = written.map_or(0, |since| u32::try_from(since.as_secs()).unwrap_or(0));
            LogInfo { size: size(data.len()), utc_s }
        }))
    }

    fn read_log(&mut self, place: u16, offset: u32, into: &mut [u8]) -> Poll<usize> {
        if self.counted.is_empty() {
            // A station may read a log without asking for the list. Then the present list counts.
            let _ = self.count_logs();
        }
        if !matches!(&self.reading, Some((open, _)) if *open == place) {
            let opened = self.counted.get(usize::from(place)).and_then(|name| self.open_log(name).ok());
            self.reading = opened.map(|(file, _)| (place, file));
        }
        Poll::Ready(self.reading.as_mut().map_or(0, |(_, file)| read(file, offset, into).unwrap_or(0)))
    }

    fn erase_logs(&mut self) -> Poll<bool> {
        let Some(logs) = &self.logs else { return Poll::Ready(false) };
        (self.reading, self.counted) = (None, Rc::default());
        let old = || (logs.names().iter().filter(|name| !logs.is_current(name)).cloned().collect(), false);
        let (names, failed) = self.erasing.get_or_insert_with(old);
        for name in names.drain(names.len().saturating_sub(ERASED_MAX)..) {
            // A log that a station has removed meanwhile counts as erased.
            *failed |= logs.remove(&name).is_err_and(|error| error.kind() != ErrorKind::NotFound);
        }
        if !names.is_empty() {
            return Poll::Pending;
        }
        Poll::Ready(self.erasing.take().is_none_or(|(_, failed)| !failed))
    }
}

impl LogSource for ServedFiles {
    fn start_log(&mut self) -> bool {
        (self.streams, self.stream) = (true, None);
        true
    }

    fn stop_log(&mut self) {
        (self.streams, self.stream) = (false, None);
    }

    fn log_bytes(&self) -> &[u8] {
        self.stream.as_ref().map_or(&[], HostBlackBox::waiting)
    }

    fn consume_log(&mut self, bytes: usize) {
        if let Some(stream) = &mut self.stream {
            stream.consume(bytes);
        }
    }
}

/// Returns the size of a file for stations. The part of a file beyond 4 GiB is not served.
fn size(bytes: u64) -> u32 {
    u32::try_from(bytes).unwrap_or(u32::MAX)
}

/// Reads until the buffer is full or the file ends.
fn read(file: &mut File, offset: u32, into: &mut [u8]) -> std::io::Result<usize> {
    file.seek(SeekFrom::Start(offset.into()))?;
    let mut count = 0;
    while let Some(rest) = into.get_mut(count..).filter(|rest| !rest.is_empty()) {
        match file.read(rest)? {
            0 => break,
            more => count += more,
        }
    }
    Ok(count)
}

fn refusal(error: &std::io::Error) -> FtpError {
    match error.kind() {
        ErrorKind::NotFound => FtpError::FILE_NOT_FOUND,
        ErrorKind::PermissionDenied => FtpError::FILE_PROTECTED,
        _ => FtpError::FAIL,
    }
}
