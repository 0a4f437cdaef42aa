//! What a host serves of files: the component's metadata in `/etc`, its logs in `/log`, and the log that is streamed.

use crate::host_black_box::HostBlackBox;
use crate::ulog_files::StoredLogs;
use afbc_link::FtpError;
use afbc_station::services::storage::{
    DirectoryEntry, FileAccess, FileChange, FilePath, FileStore, LogInfo, LogSource, LogStore,
};
use std::fs::{self, File};
use std::io::{ErrorKind, Read, Seek, SeekFrom};
use std::path::PathBuf;
use std::task::Poll;
use std::time::UNIX_EPOCH;

/// Directory of the metadata, and of the logs.
const ETC: &str = "etc";
const LOG: &str = "log";

/// The files of a host. Nothing of them can be written; logs can be removed, except the one that is being written.
#[derive(Default)]
pub struct ServedFiles {
    /// Files in `/etc`: name, contents.
    etc: Vec<(String, Vec<u8>)>,
    logs: Option<StoredLogs>,
    open: Vec<Option<Opened>>,
    /// Entries of the directory that was listed last.
    listed: (String, Vec<DirectoryEntry>),
    /// The logs as they were counted last, and the one that is read.
    counted: Vec<PathBuf>,
    reading: Option<(u16, File)>,
    /// True while a log is to be streamed; the black box that makes it, once there is one.
    streams: bool,
    stream: Option<HostBlackBox>,
}

#[derive(Debug)]
enum Opened {
    /// The file at this place in `/etc`.
    Etc(usize),
    Log(File),
}

/// An open file.
#[derive(Clone, Copy, Debug)]
pub struct OpenFile(usize);

impl ServedFiles {
    /// The logs, or none, and files in `/etc` by name.
    pub fn new(logs: Option<StoredLogs>, etc: Vec<(String, Vec<u8>)>) -> Self {
        ServedFiles { etc, logs, ..ServedFiles::default() }
    }

    /// Returns the black box of the log that is streamed, made by `begin` if it is a new one.
    pub(crate) fn streamed(&mut self, begin: impl FnOnce() -> HostBlackBox) -> Option<&mut HostBlackBox> {
        self.streams.then(|| self.stream.get_or_insert_with(begin))
    }

    fn list_logs(&self) -> Vec<PathBuf> {
        self.logs.as_ref().map_or_else(Vec::new, StoredLogs::list)
    }

    /// Returns the log called so.
    fn find_log(&self, name: &str) -> Result<PathBuf, FtpError> {
        // Among those that are there, so that no name leads out of the folder.
        let named = |path: &PathBuf| path.file_name().is_some_and(|own| own == name);
        self.list_logs().into_iter().find(named).ok_or(FtpError::FILE_NOT_FOUND)
    }

    fn find_etc(&self, name: &str) -> Result<usize, FtpError> {
        self.etc.iter().position(|(own, _)| own == name).ok_or(FtpError::FILE_NOT_FOUND)
    }

    fn entries(&self, directory: &str) -> Result<Vec<DirectoryEntry>, FtpError> {
        // A name that does not fit, or is no text, is left out.
        let entry = |name: &str, size| Some(DirectoryEntry { name: name.try_into().ok()?, size });
        Ok(match directory {
            "" => [ETC, LOG].iter().filter_map(|name| entry(name, None)).collect(),
            ETC => self.etc.iter().filter_map(|(name, bytes)| entry(name, Some(bytes.len() as u32))).collect(),
            LOG => {
                let logs = self.list_logs().into_iter();
                logs.filter_map(|path| entry(path.file_name()?.to_str()?, Some(size(&path)))).collect()
            }
            _ => return Err(FtpError::FILE_NOT_FOUND),
        })
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
                let path = self.find_log(name)?;
                let size = size(&path);
                (Opened::Log(File::open(path).map_err(|error| refusal(&error))?), size)
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
        let directory = directory.as_str();
        // Kept from part to part of a listing: a log that comes or goes meanwhile must not shift the places.
        if place == 0 || self.listed.0 != directory {
            self.listed = (directory.into(), self.entries(directory)?);
        }
        Ok(self.listed.1.get(place as usize).cloned())
    }

    fn change(&mut self, change: FileChange<'_>) -> Result<(), FtpError> {
        let FileChange::Remove(path) = change else { return Err(FtpError::FILE_PROTECTED) };
        match path.as_str().split_once('/') {
            Some((ETC, name)) => self.find_etc(name).and(Err(FtpError::FILE_PROTECTED)),
            Some((LOG, name)) => {
                let path = self.find_log(name)?;
                if self.logs.as_ref().is_some_and(|logs| logs.is_current(&path)) {
                    return Err(FtpError::FILE_PROTECTED);
                }
                fs::remove_file(path).map_err(|error| refusal(&error))
            }
            _ => Err(FtpError::FILE_NOT_FOUND),
        }
    }
}

impl LogStore for ServedFiles {
    fn count_logs(&mut self) -> Poll<u16> {
        self.counted = self.list_logs();
        // LOG_ENTRY has 16 bits for their number.
        self.counted.truncate(u16::MAX.into());
        self.reading = None;
        Poll::Ready(self.counted.len() as u16)
    }

    fn log(&mut self, place: u16) -> Poll<Option<LogInfo>> {
        let data = self.counted.get(usize::from(place)).and_then(|path| path.metadata().ok());
        Poll::Ready(data.map(|data| {
            let written = data.modified().ok().and_then(|at| at.duration_since(UNIX_EPOCH).ok());
            let utc_s = written.map_or(0, |since| u32::try_from(since.as_secs()).unwrap_or(0));
            LogInfo { size: u32::try_from(data.len()).unwrap_or(u32::MAX), utc_s }
        }))
    }

    fn read_log(&mut self, place: u16, offset: u32, into: &mut [u8]) -> Poll<usize> {
        if self.counted.is_empty() {
            // Whoever has not asked for the list knows it from an earlier time.
            let _ = self.count_logs();
        }
        if !matches!(&self.reading, Some((open, _)) if *open == place) {
            let file = self.counted.get(usize::from(place)).and_then(|path| File::open(path).ok());
            self.reading = file.map(|file| (place, file));
        }
        Poll::Ready(self.reading.as_mut().map_or(0, |(_, file)| read(file, offset, into).unwrap_or(0)))
    }

    fn erase_logs(&mut self) -> Poll<bool> {
        let Some(logs) = &self.logs else { return Poll::Ready(false) };
        (self.reading, self.counted) = (None, Vec::new());
        let old = logs.list().into_iter().filter(|path| !logs.is_current(path));
        Poll::Ready(old.filter(|path| fs::remove_file(path).is_err()).count() == 0)
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

/// Returns the size of a file; of what is beyond 4 GB, the end is not served.
fn size(path: &PathBuf) -> u32 {
    fs::metadata(path).map_or(0, |data| u32::try_from(data.len()).unwrap_or(u32::MAX))
}

/// Reads as much as there is and fits.
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
