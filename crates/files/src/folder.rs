//! An output folder that belongs to one command.

use crate::error::Error;
use crate::place::{HIDDEN, place, sweep};
use crate::seal::{self, Hashing};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// File in every folder that this program writes, which records the command and its files.
const MARKER: &str = ".sitl.json";
/// File that is locked while a program writes into the folder.
const LOCK: &str = ".sitl.lock";

#[derive(Serialize, Deserialize)]
struct Marker {
    /// The command, as after `sitl` on the command line.
    command: String,
    /// Name of the scenario or campaign flown.
    name: String,
    #[serde(flatten)]
    own: OwnFiles,
    checksum: String,
}

/// Files of a command.
#[derive(Default, Serialize, Deserialize)]
struct OwnFiles {
    /// Names of the files that it has written, or is about to write.
    files: BTreeSet<String>,
    /// Hashes of those that are complete. A file of which there is none has its own checksum, or was being written when
    /// the program was killed.
    #[serde(default)]
    hashes: BTreeMap<String, String>,
}

/// An output folder that belongs to one command. Files appear in it whole or not at all.
///
/// Files that the command has not written, or that were changed since, are never replaced or removed, unless by force.
/// While a folder is open, no other program can open it.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    command: String,
    name: String,
    force: bool,
    /// Holds the lock until it is closed; none of a folder that was only found.
    _lock: Option<File>,
    /// Held while the marker is read and written.
    marking: Mutex<()>,
}

impl Folder {
    /// Opens the folder at `path` for the results of `sitl <command>` for `name`, created with its parents if needed.
    /// With `force`, files of the same names may be replaced.
    ///
    /// # Errors
    /// If it cannot be written, is in use, is neither empty nor the command's own, or has a file that was changed since
    /// the command wrote it; nothing has been changed then.
    pub fn open(path: &Path, command: &str, name: &str, force: bool) -> Result<Self, Error> {
        Folder::find(path, command, name, force)?;
        fs::create_dir_all(path).map_err(|source| Error::Write { path: path.into(), source })?;
        // Without truncation: with `force`, it may be somebody else's file.
        let lock = File::options().write(true).create(true).truncate(false).open(path.join(LOCK));
        let lock = lock.map_err(|source| Error::Write { path: path.join(LOCK), source })?;
        match lock.try_lock() {
            Err(TryLockError::WouldBlock) => return Err(Error::Busy(path.into())),
            // Some network file systems have no locks: there, two programs must not use the same folder.
            Err(TryLockError::Error(_)) | Ok(()) => {}
        }
        // Again: until now another program may have written into it.
        let folder = Folder { _lock: Some(lock), ..Folder::find(path, command, name, force)? };
        // Under the lock: none of a program that still runs is among them.
        sweep(path);
        folder.add::<&str>(&[])?;
        Ok(folder)
    }

    /// As [`open`](Self::open), without creating, changing or locking anything.
    ///
    /// # Errors
    /// If it is neither empty nor the command's own, or has a file that was changed since.
    pub fn find(path: &Path, command: &str, name: &str, force: bool) -> Result<Self, Error> {
        let (command, name) = (command.into(), name.into());
        let folder = Folder { path: path.into(), command, name, force, _lock: None, marking: Mutex::default() };
        let own = folder.own()?;
        match own.hashes.keys().find(|name| !force && folder.is_changed(&own, name)) {
            Some(name) => Err(Error::Foreign {
                path: path.join(name),
                whose: format!("changed since `sitl {}` wrote it", folder.command),
            }),
            None => Ok(folder),
        }
    }

    /// Returns its path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the error that its file `name` could not be written.
    pub fn error(&self, name: &str, source: io::Error) -> Error {
        Error::Write { path: self.path.join(name), source }
    }

    fn foreign(&self, whose: String) -> Error {
        Error::Foreign { path: self.path.clone(), whose }
    }

    /// Returns the files that the command has written here before; by force, those of any command.
    fn own(&self) -> Result<OwnFiles, Error> {
        match self.marker() {
            Ok(Some(Marker { command, own, .. })) if self.force || command == self.command => Ok(own),
            _ if self.force => Ok(OwnFiles::default()),
            // A command that was interrupted before it had anything to write is in nobody's way.
            Ok(_) if self.is_empty()? => Ok(OwnFiles::default()),
            Ok(Some(Marker { command, name, .. })) => {
                Err(self.foreign(format!("holds what `sitl {command}` made of {name}")))
            }
            Ok(None) => Err(self.foreign(format!("not empty, and not from `sitl {}`", self.command))),
            Err(error) => Err(Error::Damaged { path: self.path.join(MARKER), problem: error.to_string() }),
        }
    }

    /// True of a file that is not as the command has left it; one that is gone is not.
    fn is_changed(&self, own: &OwnFiles, name: &str) -> bool {
        own.hashes.get(name).is_some_and(|then| match seal::hash_of_file(&self.path.join(name)) {
            Ok(now) => now != *then,
            Err(error) => error.kind() != io::ErrorKind::NotFound,
        })
    }

    fn marker(&self) -> io::Result<Option<Marker>> {
        let bytes = match fs::read(self.path.join(MARKER)) {
            Err(error) if matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory) => {
                return Ok(None);
            }
            bytes => bytes?,
        };
        seal::verify(&mut io::Cursor::new(&bytes))?;
        let marker: Marker = serde_json::from_slice(&bytes)?;
        // They will be removed some day, so none may be outside the folder.
        let is_plain = |name: &String| Path::new(name).file_name().is_some_and(|plain| plain == name.as_str());
        if marker.own.files.iter().chain(marker.own.hashes.keys()).all(is_plain) {
            Ok(Some(marker))
        } else {
            Err(io::Error::other("a path in it"))
        }
    }

    /// True if the folder is empty or missing; temporary files of a killed program do not count.
    fn is_empty(&self) -> Result<bool, Error> {
        let entries = match fs::read_dir(&self.path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(true),
            entries => entries.map_err(|source| Error::Write { path: self.path.clone(), source })?,
        };
        Ok(entries.flatten().all(|entry| entry.file_name().to_string_lossy().starts_with(HIDDEN)))
    }

    /// Records `names` as the command's own, before they are written.
    ///
    /// # Errors
    /// If one of them exists and is not the command's.
    pub fn add<N: AsRef<str>>(&self, names: &[N]) -> Result<(), Error> {
        self.change(|own| {
            for name in names.iter().map(N::as_ref) {
                let path = self.path.join(name);
                // Of the link itself: one that leads nowhere is somebody's, too.
                if own.files.insert(name.into()) && !self.force && fs::symlink_metadata(&path).is_ok() {
                    let whose = format!("in the way, and not from `sitl {}`", self.command);
                    return Err(Error::Foreign { path, whose });
                }
            }
            Ok(())
        })
    }

    /// As [`add`](Self::add), and removes all other files that the command has written here before, since they belong
    /// to earlier results.
    pub fn only<N: AsRef<str>>(&self, names: &[N]) -> Result<(), Error> {
        let before = self.own()?;
        self.add(names)?;
        let now: BTreeSet<String> = names.iter().map(|name| name.as_ref().into()).collect();
        // Meanwhile the marker names old and new files: what a killed program leaves is still the command's own.
        for stale in before.files.difference(&now) {
            let path = self.path.join(stale);
            // By force, files of others may be among them, and folders of campaigns.
            let is_file = fs::symlink_metadata(&path).is_ok_and(|data| !data.is_dir());
            if is_file && !self.is_changed(&before, stale) {
                fs::remove_file(path).map_err(|source| self.error(stale, source))?;
            }
        }
        self.change(|own| {
            // Those to come are written over, and their hashes are not known until then.
            *own = OwnFiles { files: now, hashes: BTreeMap::new() };
            Ok(())
        })
    }

    /// Changes what the marker says of the files.
    fn change(&self, change: impl FnOnce(&mut OwnFiles) -> Result<(), Error>) -> Result<(), Error> {
        let _alone = self.marking.lock().unwrap_or_else(PoisonError::into_inner);
        let mut own = self.own()?;
        change(&mut own)?;
        let (command, name) = (self.command.clone(), self.name.clone());
        let marker = Marker { command, name, own, checksum: seal::OPEN.into() };
        let path = self.path.join(MARKER);
        place(&path, |out| seal::json(out, &marker)).map_err(|source| Error::Write { path, source })
    }

    /// Lets `fill` write a file under a temporary name, and then renames it; an interrupted or failed run leaves the
    /// previous file. A file with its final name is on the disk, even after a power cut.
    pub fn place(
        &self,
        name: &str,
        fill: impl FnOnce(&mut (dyn Write + Send)) -> io::Result<()>,
    ) -> Result<PathBuf, Error> {
        let path = self.path.join(name);
        let mut hash = String::new();
        let hashed = |out: &mut (dyn Write + Send)| {
            let mut out = Hashing::new(out);
            fill(&mut out)?;
            hash = out.finish();
            Ok(())
        };
        place(&path, hashed).map_err(|source| Error::Write { path: path.clone(), source })?;
        self.change(|own| {
            own.files.insert(name.into());
            own.hashes.insert(name.into(), hash);
            Ok(())
        })?;
        Ok(path)
    }
}
