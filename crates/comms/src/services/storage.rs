//! Interfaces of storage that the file and log services need. A shell implements them.

use afbc_mavlink::{FILE_DATA_MAX, FtpError};
use core::task::Poll;
use heapless::String;

/// Longest name of a listed file or directory \[bytes\].
pub const NAME_MAX: usize = 128;

/// A path that a station has sent. It is relative to the served root and never leads above it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FilePath(String<FILE_DATA_MAX>);

impl FilePath {
    /// Parses a path up to its first zero byte. Leading, trailing and repeated slashes and parts "." are dropped.
    /// Returns none if the path is not UTF-8 or has a part "..", a control character, a backslash or a colon.
    pub fn of(bytes: &[u8]) -> Option<Self> {
        let text = bytes.split(|byte| *byte == 0).next().unwrap_or_default();
        let text = core::str::from_utf8(text).ok()?;
        // On some hosts, a backslash or a colon leads to another folder or drive.
        if text.contains(|letter: char| letter.is_control() || letter == '\\' || letter == ':') {
            return None;
        }
        let mut path = String::new();
        for part in text.split('/').filter(|part| !part.is_empty() && *part != ".") {
            if part == ".." {
                return None;
            }
            if !path.is_empty() {
                path.push('/').ok()?;
            }
            path.push_str(part).ok()?;
        }
        Some(FilePath(path))
    }

    /// Returns the path without leading and trailing slashes; empty for the root.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

/// Purpose for which a file is opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileAccess {
    /// The file is read.
    Read,
    /// An existing file is written.
    Write,
    /// A new file is created and written.
    Create,
}

/// A change of files or directories.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileChange<'a> {
    /// Removes a file.
    Remove(&'a FilePath),
    /// Creates a directory.
    CreateDirectory(&'a FilePath),
    /// Removes an empty directory.
    RemoveDirectory(&'a FilePath),
    /// Truncates a file to this number of bytes.
    Truncate(&'a FilePath, u32),
    /// Moves a file from the first path to the second.
    Rename(&'a FilePath, &'a FilePath),
}

/// An entry of a directory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DirectoryEntry {
    /// Name of the entry.
    pub name: String<NAME_MAX>,
    /// Size of a file \[bytes\]; none for a directory.
    pub size: Option<u32>,
}

/// Storage of files. A read-only store keeps the default methods, which refuse changes.
pub trait FileStore {
    /// An open file.
    type File: Copy;

    /// Opens a file. Returns the file and its size.
    ///
    /// # Errors
    /// Returns the protocol's error.
    fn open(&mut self, path: &FilePath, access: FileAccess) -> Result<(Self::File, u32), FtpError>;

    /// Closes a file.
    fn close(&mut self, file: Self::File);

    /// Reads as many bytes from `offset` on as exist and fit. Returns their number.
    ///
    /// # Errors
    /// Returns the protocol's error.
    fn read(&mut self, file: Self::File, offset: u32, into: &mut [u8]) -> Result<usize, FtpError>;

    /// Returns the directory entry with this index. Returns none after the last one.
    ///
    /// # Errors
    /// Returns the protocol's error.
    fn entry(&mut self, directory: &FilePath, place: u32) -> Result<Option<DirectoryEntry>, FtpError>;

    /// Writes bytes from `offset` on.
    ///
    /// # Errors
    /// Returns the protocol's error.
    fn write(&mut self, _file: Self::File, _offset: u32, _bytes: &[u8]) -> Result<(), FtpError> {
        Err(FtpError::FILE_PROTECTED)
    }

    /// Changes a file or directory.
    ///
    /// # Errors
    /// Returns the protocol's error.
    fn change(&mut self, _change: FileChange<'_>) -> Result<(), FtpError> {
        Err(FtpError::FILE_PROTECTED)
    }
}

/// Size and date of a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LogInfo {
    /// Size \[bytes\].
    pub size: u32,
    /// Unix time at which the log was written \[s\]; 0 if unknown.
    pub utc_s: u32,
}

/// Storage of logs. The index of a log does not change until the logs are counted again.
///
/// Storage that is busy answers [`Poll::Pending`]. The same request is then repeated until it is answered or another
/// request replaces it.
pub trait LogStore {
    /// Counts the logs.
    fn count_logs(&mut self) -> Poll<u16>;

    /// Returns the size and date of a log.
    fn log(&mut self, place: u16) -> Poll<Option<LogInfo>>;

    /// Reads as many bytes from `offset` on as exist and fit. Returns their number.
    fn read_log(&mut self, place: u16, offset: u32, into: &mut [u8]) -> Poll<usize>;

    /// Erases all logs but the one being written. Returns false on failure.
    fn erase_logs(&mut self) -> Poll<bool>;
}

/// Source of the flight log while it is written. A vehicle without a log keeps the default methods.
pub trait LogSource {
    /// Begins a log. Returns false if there is none.
    fn start_log(&mut self) -> bool {
        false
    }

    /// Ends the log.
    fn stop_log(&mut self) {}

    /// Returns the next bytes of the log; empty if there are none yet.
    fn log_bytes(&self) -> &[u8] {
        &[]
    }

    /// Removes this many of the next bytes.
    fn consume_log(&mut self, _bytes: usize) {}
}

#[cfg(test)]
#[allow(clippy::expect_used, reason = "a test that cannot go on should say why")]
mod tests {
    use super::*;

    #[test]
    fn paths_stay_below_the_root() {
        let of = |bytes: &[u8]| FilePath::of(bytes);
        for (text, path) in
            [("", ""), ("/", ""), ("//", ""), ("/./", ""), ("/log/a.ulg", "log/a.ulg"), ("etc//./b/\0c", "etc/b")]
        {
            assert_eq!(of(text.as_bytes()).expect("a path").as_str(), path, "{text:?}");
        }
        for text in ["..", "/..", "log/../..", "log/..", "../log", "a\\..", "c:", "a\nb", "\u{1b}[2J"] {
            assert_eq!(of(text.as_bytes()), None, "{text:?}");
        }
        assert_eq!(of(&[b'a', 0xFF]), None);
        assert_eq!(of(b"...").expect("a name").as_str(), "...");
    }
}
