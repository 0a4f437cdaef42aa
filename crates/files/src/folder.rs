//! An output folder that belongs to one command.

use crate::atomic::{HIDDEN, remove_temporary_files, write_atomically};
use crate::error::Error;
use crate::seal::{self, HashingWriter};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// File in every output folder that records the command and the files it wrote.
const MARKER: &str = ".sitl.json";
/// File that is locked while a program writes into the folder.
const LOCK: &str = ".sitl.lock";

#[derive(Serialize, Deserialize)]
struct Marker {
    /// The command line after `sitl`.
    command: String,
    /// Name of the scenario or campaign.
    name: String,
    #[serde(flatten)]
    own: OwnFiles,
    checksum: String,
}

/// Files written by one command.
#[derive(Default, Serialize, Deserialize)]
struct OwnFiles {
    /// Names of the files that the command has written, or is about to write.
    files: BTreeSet<String>,
    /// Hashes of the complete files. A file without a hash has its own checksum, or was being written when the program
    /// was killed.
    #[serde(default)]
    hashes: BTreeMap<String, String>,
}

/// An output folder that belongs to one command. Each file appears in it complete or not at all.
///
/// Files of others, and files that were changed since the command wrote them, are never replaced or removed, unless
/// with `--force`. While a folder is open, no other program can open it.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    command: String,
    name: String,
    force: bool,
    /// Lock file, locked until it is closed. None if the folder was only examined.
    _lock: Option<File>,
    /// Locked while the marker file is read and written.
    marking: Mutex<()>,
}

impl Folder {
    /// Opens the folder at `path` for the results of `sitl <command>` for `name`. Creates the folder and its parents if
    /// needed. With `force`, files with the same names may be replaced.
    ///
    /// # Errors
    /// If the folder cannot be written, is in use, is neither empty nor the command's own, or has a file that was
    /// changed since the command wrote it. Nothing is changed then.
    pub fn open(path: &Path, command: &str, name: &str, force: bool) -> Result<Self, Error> {
        Folder::find(path, command, name, force)?;
        fs::create_dir_all(path).map_err(|source| Error::Write { path: path.into(), source })?;
        // Does not truncate: with `force`, the file may belong to somebody else.
        let lock = File::options().write(true).create(true).truncate(false).open(path.join(LOCK));
        let lock = lock.map_err(|source| Error::Write { path: path.join(LOCK), source })?;
        match lock.try_lock() {
            Err(TryLockError::WouldBlock) => return Err(Error::Busy(path.into())),
            // Some network file systems have no locks; there, two programs must not use the same folder.
            Err(TryLockError::Error(_)) | Ok(()) => {}
        }
        // Checks again: another program may have written into the folder before it was locked.
        let folder = Folder { _lock: Some(lock), ..Folder::find(path, command, name, force)? };
        // This is only done under the lock, when no running program owns any of the temporary files.
        remove_temporary_files(path);
        folder.add::<&str>(&[])?;
        Ok(folder)
    }

    /// Checks the folder like [`open`](Self::open), without creating, changing or locking anything.
    ///
    /// # Errors
    /// If it is neither empty nor the command's own, or has a file that was changed since the command wrote it.
    pub fn find(path: &Path, command: &str, name: &str, force: bool) -> Result<Self, Error> {
        let (command, name) = (command.into(), name.into());
        let folder = Folder { path: path.into(), command, name, force, _lock: None, marking: Mutex::default() };
        let own = folder.own()?;
        match own.hashes.keys().find(|name| !force && folder.is_changed(&own, name)) {
            Some(name) => Err(Error::Foreign {
                path: path.join(name),
                whose: format!("the file was changed after `sitl {}` wrote it", folder.command),
            }),
            None => Ok(folder),
        }
    }

    /// Returns the folder's path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the error for a failure to write the file `name`.
    pub fn error(&self, name: &str, source: io::Error) -> Error {
        Error::Write { path: self.path.join(name), source }
    }

    fn foreign(&self, whose: String) -> Error {
        Error::Foreign { path: self.path.clone(), whose }
    }

    /// Returns the files that the command has written here before; with `force`, those of any command.
    fn own(&self) -> Result<OwnFiles, Error> {
        match self.marker() {
            Ok(Some(Marker { command, own, .. })) if self.force || command == self.command => Ok(own),
            _ if self.force => Ok(OwnFiles::default()),
            // A folder of an interrupted command that has written nothing is free.
            Ok(_) if self.is_empty()? => Ok(OwnFiles::default()),
            Ok(Some(Marker { command, name, .. })) => {
                Err(self.foreign(format!("the folder holds the results of `sitl {command}` for {name}")))
            }
            Ok(None) => {
                Err(self
                    .foreign(format!("the folder is not empty, and its content is not from `sitl {}`", self.command)))
            }
            Err(error) => Err(Error::Damaged { path: self.path.join(MARKER), problem: error.to_string() }),
        }
    }

    /// True if the file differs from what the command wrote. A removed file does not count as changed.
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
        // These files may be removed later, so a name must not lead outside the folder.
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

    /// Records `names` as the command's own, before the files are written.
    ///
    /// # Errors
    /// If one of the files exists and is not the command's.
    pub fn add<N: AsRef<str>>(&self, names: &[N]) -> Result<(), Error> {
        self.change(|own| {
            for name in names.iter().map(N::as_ref) {
                let path = self.path.join(name);
                // Checks the link itself, since a dangling link is also somebody's file.
                if own.files.insert(name.into()) && !self.force && fs::symlink_metadata(&path).is_ok() {
                    let whose = format!("a file that is not from `sitl {}` is in the way", self.command);
                    return Err(Error::Foreign { path, whose });
                }
            }
            Ok(())
        })
    }

    /// Records `names` like [`add`](Self::add), and removes all other files of the command, since they belong to
    /// earlier results.
    pub fn only<N: AsRef<str>>(&self, names: &[N]) -> Result<(), Error> {
        let before = self.own()?;
        self.add(names)?;
        let now: BTreeSet<String> = names.iter().map(|name| name.as_ref().into()).collect();
        // The marker now names old and new files, so that everything a killed program leaves is still the command's
        // own.
        for stale in before.files.difference(&now) {
            let path = self.path.join(stale);
            // With `force`, these may include files of others and folders of campaigns.
            let is_file = fs::symlink_metadata(&path).is_ok_and(|data| !data.is_dir());
            if is_file && !self.is_changed(&before, stale) {
                fs::remove_file(path).map_err(|source| self.error(stale, source))?;
            }
        }
        self.change(|own| {
            // The files will be overwritten; their hashes are not known until then.
            *own = OwnFiles { files: now, hashes: BTreeMap::new() };
            Ok(())
        })
    }

    /// Changes the list of files in the marker.
    fn change(&self, change: impl FnOnce(&mut OwnFiles) -> Result<(), Error>) -> Result<(), Error> {
        let _alone = self.marking.lock().unwrap_or_else(PoisonError::into_inner);
        let mut own = self.own()?;
        change(&mut own)?;
        let (command, name) = (self.command.clone(), self.name.clone());
        let marker = Marker { command, name, own, checksum: seal::OPEN.into() };
        let path = self.path.join(MARKER);
        write_atomically(&path, |out| seal::json(out, &marker)).map_err(|source| Error::Write { path, source })
    }

    /// Lets `fill` write a file under a temporary name, then renames the file. A failed or interrupted run leaves the
    /// previous file. Once a file has its final name it is on the disk, even after a power cut.
    pub fn write(
        &self,
        name: &str,
        fill: impl FnOnce(&mut (dyn Write + Send)) -> io::Result<()>,
    ) -> Result<PathBuf, Error> {
        let path = self.path.join(name);
        let mut hash = String::new();
        let hashed = |out: &mut (dyn Write + Send)| {
            let mut out = HashingWriter::new(out);
            fill(&mut out)?;
            hash = out.finish();
            Ok(())
        };
        write_atomically(&path, hashed).map_err(|source| Error::Write { path: path.clone(), source })?;
        self.change(|own| {
            own.files.insert(name.into());
            own.hashes.insert(name.into(), hash);
            Ok(())
        })?;
        Ok(path)
    }
}
