//! Storage of files and logs in memory that checks its callers.

use afbc_comms::services::storage::{
    DirectoryEntry, FileAccess, FileChange, FilePath, FileStore, LogInfo, LogSource, LogStore,
};
use afbc_mavlink::FtpError;
use std::collections::{BTreeMap, BTreeSet};
use std::task::Poll;

/// Storage of writable files and of logs.
#[derive(Default)]
pub struct Memory {
    pub files: BTreeMap<String, Vec<u8>>,
    pub directories: BTreeSet<String>,
    /// Path of each file handle that is open.
    pub open: Vec<Option<String>>,
    pub logs: Vec<Vec<u8>>,
    /// The log to be streamed, if the vehicle has one, and whether it is being streamed.
    pub made: Option<Vec<u8>>,
    pub makes: bool,
    /// Number of changes carried out.
    pub changes: usize,
    /// Number of times a log request must be repeated, and number of log requests so far.
    pub slow: u32,
    pub asked: u32,
}

fn is_in(path: &str, directory: &str) -> bool {
    let folder = path.rsplit_once('/').map_or("", |(folder, _)| folder);
    folder == directory
}

/// Checks that a path does not lead above the root.
fn checked(path: &FilePath) -> &str {
    let path = path.as_str();
    let parts = || path.split('/');
    assert!(path.is_empty() || parts().all(|part| !["", ".", ".."].contains(&part)), "{path:?}");
    assert!(!path.contains(['\\', ':', '\0']), "{path:?}");
    path
}

impl Memory {
    /// Creates a storage with these files and their directories.
    pub fn with(files: &[(&str, Vec<u8>)]) -> Self {
        let mut memory = Memory::default();
        memory.directories.insert(String::new());
        for (path, bytes) in files {
            for (place, _) in path.match_indices('/') {
                memory.directories.insert(path[..place].into());
            }
            memory.files.insert((*path).into(), bytes.clone());
        }
        memory
    }

    /// Returns true if the storage is still busy with a log request.
    fn not_yet(&mut self) -> bool {
        self.asked += 1;
        !self.asked.is_multiple_of(self.slow + 1)
    }

    pub fn open_count(&self) -> usize {
        self.open.iter().flatten().count()
    }

    fn file(&self, handle: usize) -> &str {
        self.open[handle].as_ref().expect("open")
    }

    fn exists(&self, path: &str) -> bool {
        self.files.contains_key(path) || self.directories.contains(path)
    }
}

impl FileStore for Memory {
    type File = usize;

    fn open(&mut self, path: &FilePath, access: FileAccess) -> Result<(usize, u32), FtpError> {
        let path = checked(path);
        if access == FileAccess::Create {
            if self.exists(path) {
                return Err(FtpError::FILE_EXISTS);
            }
            self.changes += 1;
            self.files.insert(path.into(), Vec::new());
        }
        let size = self.files.get(path).ok_or(FtpError::FILE_NOT_FOUND)?.len() as u32;
        self.open.push(Some(path.into()));
        Ok((self.open.len() - 1, size))
    }

    fn close(&mut self, file: usize) {
        assert!(self.open[file].take().is_some(), "closed twice");
    }

    fn read(&mut self, file: usize, offset: u32, into: &mut [u8]) -> Result<usize, FtpError> {
        assert!(!into.is_empty());
        let bytes = self.files.get(self.file(file)).ok_or(FtpError::FAIL)?;
        let rest = bytes.get(offset as usize..).unwrap_or_default();
        let count = rest.len().min(into.len());
        into[..count].copy_from_slice(&rest[..count]);
        Ok(count)
    }

    fn entry(&mut self, directory: &FilePath, place: u32) -> Result<Option<DirectoryEntry>, FtpError> {
        let directory = checked(directory);
        if !self.directories.contains(directory) {
            return Err(FtpError::FILE_NOT_FOUND);
        }
        let name = |path: &str| path.rsplit('/').next().expect("a name").try_into().expect("short");
        let folders = self.directories.iter().filter(|path| !path.is_empty() && is_in(path, directory));
        let folders = folders.map(|path| DirectoryEntry { name: name(path), size: None });
        let files = self.files.iter().filter(|(path, _)| is_in(path, directory));
        let files = files.map(|(path, bytes)| DirectoryEntry { name: name(path), size: Some(bytes.len() as u32) });
        Ok(folders.chain(files).nth(place as usize))
    }

    fn write(&mut self, file: usize, offset: u32, bytes: &[u8]) -> Result<(), FtpError> {
        self.changes += 1;
        let path = self.file(file).to_owned();
        let held = self.files.get_mut(&path).ok_or(FtpError::FAIL)?;
        let end = offset as usize + bytes.len();
        if end > 1 << 20 {
            return Err(FtpError::FAIL);
        }
        held.resize(held.len().max(end), 0);
        held[offset as usize..end].copy_from_slice(bytes);
        Ok(())
    }

    fn change(&mut self, change: FileChange<'_>) -> Result<(), FtpError> {
        self.changes += 1;
        match change {
            FileChange::Remove(path) => self.files.remove(checked(path)).map(drop).ok_or(FtpError::FILE_NOT_FOUND),
            FileChange::CreateDirectory(path) if self.exists(checked(path)) => Err(FtpError::FILE_EXISTS),
            FileChange::CreateDirectory(path) => {
                self.directories.insert(checked(path).into());
                Ok(())
            }
            FileChange::RemoveDirectory(path) => {
                let path = checked(path);
                let is_empty = !self.files.keys().chain(&self.directories).any(|it| !it.is_empty() && is_in(it, path));
                let removed = !path.is_empty() && is_empty && self.directories.remove(path);
                if removed { Ok(()) } else { Err(FtpError::FAIL) }
            }
            FileChange::Truncate(path, length) => {
                let held = self.files.get_mut(checked(path)).ok_or(FtpError::FILE_NOT_FOUND)?;
                held.truncate(length as usize);
                Ok(())
            }
            FileChange::Rename(from, to) => {
                let bytes = self.files.remove(checked(from)).ok_or(FtpError::FILE_NOT_FOUND)?;
                self.files.insert(checked(to).into(), bytes);
                Ok(())
            }
        }
    }
}

impl LogStore for Memory {
    fn count_logs(&mut self) -> Poll<u16> {
        if self.not_yet() { Poll::Pending } else { Poll::Ready(self.logs.len() as u16) }
    }

    fn log(&mut self, place: u16) -> Poll<Option<LogInfo>> {
        let size = self.logs.get(usize::from(place)).map(|log| log.len() as u32);
        let info = size.map(|size| LogInfo { size, utc_s: 1_700_000_000 + u32::from(place) });
        if self.not_yet() { Poll::Pending } else { Poll::Ready(info) }
    }

    fn read_log(&mut self, place: u16, offset: u32, into: &mut [u8]) -> Poll<usize> {
        if self.not_yet() {
            return Poll::Pending;
        }
        let bytes = self.logs.get(usize::from(place)).and_then(|bytes| bytes.get(offset as usize..));
        let bytes = bytes.unwrap_or_default();
        let count = bytes.len().min(into.len());
        into[..count].copy_from_slice(&bytes[..count]);
        Poll::Ready(count)
    }

    fn erase_logs(&mut self) -> Poll<bool> {
        if self.not_yet() {
            return Poll::Pending;
        }
        self.logs.clear();
        Poll::Ready(true)
    }
}

/// Returns pseudo-random bytes.
pub fn bytes(count: usize, seed: u32) -> Vec<u8> {
    let next = |state: &mut u32| {
        *state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        Some((*state >> 24) as u8)
    };
    std::iter::successors(Some(seed), |_| None)
        .flat_map(|seed| {
            let mut state = seed;
            std::iter::from_fn(move || next(&mut state))
        })
        .take(count)
        .collect()
}

impl LogSource for Memory {
    fn start_log(&mut self) -> bool {
        self.makes = self.made.is_some();
        self.makes
    }

    fn stop_log(&mut self) {
        self.makes = false;
    }

    fn log_bytes(&self) -> &[u8] {
        self.made.as_ref().filter(|_| self.makes).map_or(&[], |made| made.as_slice())
    }

    fn consume_log(&mut self, bytes: usize) {
        self.made.as_mut().expect("a log").drain(..bytes);
    }
}
