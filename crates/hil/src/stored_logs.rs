//! The logs that stations may download.

use afbc_comms::services::storage::NAME_MAX;
use std::cell::RefCell;
use std::fs::{self, File, Metadata, OpenOptions};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::SystemTime;

/// The logs of a vehicle that stations may download: those in its folder at the start, and its own new ones.
///
/// The folder is read only once, at the start, because a flight has no time to read it. Afterwards, this type keeps
/// track of the logs that the vehicle writes and erases. Each name must be a regular file; symbolic links are not
/// followed.
#[derive(Clone, Debug)]
pub struct StoredLogs(Rc<RefCell<Shelf>>);

#[derive(Debug)]
struct Shelf {
    folder: PathBuf,
    /// Names, oldest first. A listing keeps its own copy, which later changes do not affect.
    names: Rc<Vec<String>>,
    /// Name of the log being written.
    current: String,
}

impl StoredLogs {
    /// Reads the names of the logs in a folder.
    pub(crate) fn read(folder: &Path) -> Self {
        let entries = fs::read_dir(folder).into_iter().flatten().flatten();
        let mut logs: Vec<(SystemTime, String)> = entries
            .filter_map(|entry| {
                let name = entry.file_name().into_string().ok()?;
                // Leaves out names that cannot be sent to stations.
                let is_name = name.len() <= NAME_MAX && !name.contains(char::is_control);
                let is_log = is_name && Path::new(&name).extension().is_some_and(|it| it == "ulg");
                let data = fs::symlink_metadata(entry.path()).ok().filter(|data| is_log && data.is_file())?;
                Some((data.modified().unwrap_or(SystemTime::UNIX_EPOCH), name))
            })
            .collect();
        logs.sort();
        Self::of(folder, logs.into_iter().map(|(_, name)| name).collect())
    }

    /// Returns an empty list for logs that will be written into this folder.
    pub(crate) fn none_in(folder: &Path) -> Self {
        Self::of(folder, Vec::new())
    }

    fn of(folder: &Path, names: Vec<String>) -> Self {
        StoredLogs(Rc::new(RefCell::new(Shelf {
            folder: folder.into(),
            names: Rc::new(names),
            current: String::new(),
        })))
    }

    /// Adds the log at `path`, which is now being written.
    pub(crate) fn begin(&self, path: &Path) {
        let name = path.file_name().and_then(|name| name.to_str()).filter(|name| name.len() <= NAME_MAX);
        let Some(name) = name else { return };
        let mut shelf = self.0.borrow_mut();
        name.clone_into(&mut shelf.current);
        Rc::make_mut(&mut shelf.names).push(name.into());
    }

    /// Returns the names of the logs, oldest first.
    pub fn names(&self) -> Rc<Vec<String>> {
        Rc::clone(&self.0.borrow().names)
    }

    /// Returns true for the log being written.
    pub fn is_current(&self, name: &str) -> bool {
        self.0.borrow().current == name
    }

    /// Returns the file system's metadata of a log.
    ///
    /// # Errors
    /// If there is no such log.
    pub fn metadata(&self, name: &str) -> io::Result<Metadata> {
        only_file(fs::symlink_metadata(self.path(name)?)?)
    }

    /// Opens a log for reading.
    ///
    /// # Errors
    /// If there is no such log, or it cannot be read.
    pub fn open(&self, name: &str) -> io::Result<File> {
        let path = self.path(name)?;
        only_file(fs::symlink_metadata(&path)?)?;
        let mut options = OpenOptions::new();
        do_not_follow(options.read(true));
        let file = options.open(path)?;
        // The file is checked again, because it may have been replaced before it was opened.
        only_file(file.metadata()?)?;
        Ok(file)
    }

    /// Removes a log.
    ///
    /// # Errors
    /// If there is no such log, or it cannot be removed.
    pub fn remove(&self, name: &str) -> io::Result<()> {
        let path = self.path(name)?;
        match fs::remove_file(path) {
            // A file that somebody else has removed counts as removed.
            Err(error) if error.kind() != ErrorKind::NotFound => Err(error),
            _ => {
                Rc::make_mut(&mut self.0.borrow_mut().names).retain(|own| own != name);
                Ok(())
            }
        }
    }

    /// Returns the path of a known log. Other names are refused, so that no name leads out of the folder.
    fn path(&self, name: &str) -> io::Result<PathBuf> {
        let shelf = self.0.borrow();
        let known = shelf.names.iter().any(|own| own == name);
        if known { Ok(shelf.folder.join(name)) } else { Err(ErrorKind::NotFound.into()) }
    }
}

/// Refuses anything but a regular file, for example a symbolic link.
fn only_file(data: Metadata) -> io::Result<Metadata> {
    if data.is_file() { Ok(data) } else { Err(ErrorKind::NotFound.into()) }
}

/// Makes opening fail for a symbolic link, and not wait for the other end of a pipe.
#[cfg(unix)]
fn do_not_follow(options: &mut OpenOptions) {
    use std::os::unix::fs::OpenOptionsExt;
    options.custom_flags(libc::O_NOFOLLOW | libc::O_NONBLOCK);
}

#[cfg(windows)]
fn do_not_follow(options: &mut OpenOptions) {
    use std::os::windows::fs::OpenOptionsExt;
    const FILE_FLAG_OPEN_REPARSE_POINT: u32 = 0x0020_0000;
    options.custom_flags(FILE_FLAG_OPEN_REPARSE_POINT);
}

#[cfg(not(any(unix, windows)))]
fn do_not_follow(_: &mut OpenOptions) {}
