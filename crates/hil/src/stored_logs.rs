//! The logs that stations may download.

use afbc_station::services::storage::NAME_MAX;
use std::cell::RefCell;
use std::fs::{self, File, Metadata, OpenOptions};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::SystemTime;

/// The logs of a vehicle that stations may download: those that were in its folder at the start, and its own since.
///
/// The folder is read once, at the start, for a flight has no time to read it: from then on this keeps account of what
/// the vehicle writes and erases. A name stands for a file itself: a symbolic link is not followed.
#[derive(Clone, Debug)]
pub struct StoredLogs(Rc<RefCell<Shelf>>);

#[derive(Debug)]
struct Shelf {
    folder: PathBuf,
    /// Names, the oldest first. Whoever lists them keeps a copy, which a change leaves as it is.
    names: Rc<Vec<String>>,
    /// The one that is being written.
    current: String,
}

impl StoredLogs {
    /// Reads the logs in a folder.
    pub(crate) fn read(folder: &Path) -> Self {
        let entries = fs::read_dir(folder).into_iter().flatten().flatten();
        let mut logs: Vec<(SystemTime, String)> = entries
            .filter_map(|entry| {
                let name = entry.file_name().into_string().ok()?;
                // A name that stations could not be told is left out.
                let is_name = name.len() <= NAME_MAX && !name.contains(char::is_control);
                let is_log = is_name && Path::new(&name).extension().is_some_and(|it| it == "ulg");
                let data = fs::symlink_metadata(entry.path()).ok().filter(|data| is_log && data.is_file())?;
                Some((data.modified().unwrap_or(SystemTime::UNIX_EPOCH), name))
            })
            .collect();
        logs.sort();
        Self::of(folder, logs.into_iter().map(|(_, name)| name).collect())
    }

    /// No logs, and the folder of those to come.
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

    /// Adds the log at `path`, which is being written from now on.
    pub(crate) fn begin(&self, path: &Path) {
        let name = path.file_name().and_then(|name| name.to_str()).filter(|name| name.len() <= NAME_MAX);
        let Some(name) = name else { return };
        let mut shelf = self.0.borrow_mut();
        name.clone_into(&mut shelf.current);
        Rc::make_mut(&mut shelf.names).push(name.into());
    }

    /// Returns their names, the oldest first.
    pub fn names(&self) -> Rc<Vec<String>> {
        Rc::clone(&self.0.borrow().names)
    }

    /// True of the log that is being written.
    pub fn is_current(&self, name: &str) -> bool {
        self.0.borrow().current == name
    }

    /// Returns what the system knows of a log.
    ///
    /// # Errors
    /// If there is no such log.
    pub fn metadata(&self, name: &str) -> io::Result<Metadata> {
        only_file(fs::symlink_metadata(self.path(name)?)?)
    }

    /// Opens a log to be read.
    ///
    /// # Errors
    /// If there is no such log, or it cannot be read.
    pub fn open(&self, name: &str) -> io::Result<File> {
        let path = self.path(name)?;
        only_file(fs::symlink_metadata(&path)?)?;
        let mut options = OpenOptions::new();
        do_not_follow(options.read(true));
        let file = options.open(path)?;
        // Once more: another file may have taken its place meanwhile.
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
            // Somebody else has removed it.
            Err(error) if error.kind() != ErrorKind::NotFound => Err(error),
            _ => {
                Rc::make_mut(&mut self.0.borrow_mut().names).retain(|own| own != name);
                Ok(())
            }
        }
    }

    /// Returns the path of a log that is known, so that no name leads out of the folder.
    fn path(&self, name: &str) -> io::Result<PathBuf> {
        let shelf = self.0.borrow();
        let known = shelf.names.iter().any(|own| own == name);
        if known { Ok(shelf.folder.join(name)) } else { Err(ErrorKind::NotFound.into()) }
    }
}

/// Refuses what is no file, such as a symbolic link.
fn only_file(data: Metadata) -> io::Result<Metadata> {
    if data.is_file() { Ok(data) } else { Err(ErrorKind::NotFound.into()) }
}

/// Opens no symbolic link, and waits for nobody at the other end of a pipe.
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
