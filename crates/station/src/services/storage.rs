//! What the services of files and logs need of storage: a shell implements it.

use afbc_link::{FILE_DATA_MAX, FtpError};
use core::task::Poll;
use heapless::String;

/// Longest name of a file or directory that is listed \[bytes\].
pub const NAME_MAX: usize = 128;

/// A path that a station has named, from the root of what is served: never above it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FilePath(String<FILE_DATA_MAX>);

impl FilePath {
    /// Reads a path up to its first zero. Slashes at its ends and repeated ones mean nothing, nor does a part ".". None
    /// if it is no text, or has a part "..", a control character, a backslash or a colon.
    pub fn of(bytes: &[u8]) -> Option<Self> {
        let text = bytes.split(|byte| *byte == 0).next().unwrap_or_default();
        let text = core::str::from_utf8(text).ok()?;
        // Backslash and colon: on some hosts they lead to another folder, or to another drive.
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

    /// Returns the path without slashes at its ends; empty for the root.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

/// What a file is opened for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileAccess {
    /// To be read.
    Read,
    /// To be written; it is there.
    Write,
    /// To be written; it is not there yet.
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
    /// Cuts a file to so many bytes.
    Truncate(&'a FilePath, u32),
    /// Gives a file another path, the second.
    Rename(&'a FilePath, &'a FilePath),
}

/// An entry of a directory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DirectoryEntry {
    /// Its name.
    pub name: String<NAME_MAX>,
    /// Size of a file \[bytes\]; none of a directory.
    pub size: Option<u32>,
}

/// Files. What can only be read keeps the methods that change something as they are.
pub trait FileStore {
    /// An open file.
    type File: Copy;

    /// Opens a file; returns its size, too.
    ///
    /// # Errors
    /// The answer of the protocol.
    fn open(&mut self, path: &FilePath, access: FileAccess) -> Result<(Self::File, u32), FtpError>;

    /// Closes a file.
    fn close(&mut self, file: Self::File);

    /// Reads from `offset` on as much as there is and fits; returns how much.
    ///
    /// # Errors
    /// The answer of the protocol.
    fn read(&mut self, file: Self::File, offset: u32, into: &mut [u8]) -> Result<usize, FtpError>;

    /// Returns the entry of a directory at this place, none behind the last one.
    ///
    /// # Errors
    /// The answer of the protocol.
    fn entry(&mut self, directory: &FilePath, place: u32) -> Result<Option<DirectoryEntry>, FtpError>;

    /// Writes from `offset` on.
    ///
    /// # Errors
    /// The answer of the protocol.
    fn write(&mut self, _file: Self::File, _offset: u32, _bytes: &[u8]) -> Result<(), FtpError> {
        Err(FtpError::FILE_PROTECTED)
    }

    /// Changes a file or directory.
    ///
    /// # Errors
    /// The answer of the protocol.
    fn change(&mut self, _change: FileChange<'_>) -> Result<(), FtpError> {
        Err(FtpError::FILE_PROTECTED)
    }
}

/// What is known of a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LogInfo {
    /// Size \[bytes\].
    pub size: u32,
    /// When it was written, since 1970; 0 if that is unknown \[s\].
    pub utc_s: u32,
}

/// Logs, each at a place that it keeps until they are counted again.
///
/// Storage that has to be waited for answers [`Poll::Pending`], and is asked for the same again a little later, until
/// it answers or something else is asked for.
pub trait LogStore {
    /// Counts the logs.
    fn count_logs(&mut self) -> Poll<u16>;

    /// Returns what is known of the log at a place.
    fn log(&mut self, place: u16) -> Poll<Option<LogInfo>>;

    /// Reads from `offset` on as much as there is and fits; returns how much.
    fn read_log(&mut self, place: u16, offset: u32, into: &mut [u8]) -> Poll<usize>;

    /// Erases all logs but one that is being written; false if it cannot.
    fn erase_logs(&mut self) -> Poll<bool>;
}

/// The black box's log, made while it is sent. A vehicle that has none keeps the methods as they are.
pub trait LogSource {
    /// Begins a log; false if there is none.
    fn start_log(&mut self) -> bool {
        false
    }

    /// Ends it.
    fn stop_log(&mut self) {}

    /// Returns bytes of the log that wait; none if there are none now.
    fn log_bytes(&self) -> &[u8] {
        &[]
    }

    /// Removes so many of them.
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
