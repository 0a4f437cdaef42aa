//! An output folder that belongs to one command.

use crate::error::Error;
use crate::place::{HIDDEN, place};
use crate::seal;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// File in every folder that this program writes, which records the command and its files.
const MARKER: &str = ".sitl.json";
#[derive(Serialize, Deserialize)]
struct Marker {
    /// The command, as after `sitl` on the command line.
    command: String,
    /// Name of the scenario or campaign flown.
    name: String,
    /// Files that the command has written, or is about to write.
    files: BTreeSet<String>,
    checksum: String,
}

/// An output folder that belongs to one command. Files appear in it whole or not at all.
///
/// Files that the command has not written are never replaced or removed, unless by force.
#[derive(Clone, Debug)]
pub struct Folder {
    path: PathBuf,
    command: String,
    name: String,
    force: bool,
}

impl Folder {
    /// Opens the folder at `path` for the results of `sitl <command>` for `name`, created with its parents if needed.
    /// With `force`, files of the same names may be replaced.
    ///
    /// # Errors
    /// If it cannot be written, or is neither empty nor the command's own; nothing has been changed then.
    pub fn open(path: &Path, command: &str, name: &str, force: bool) -> Result<Self, Error> {
        let folder = Folder::find(path, command, name, force)?;
        fs::create_dir_all(path).map_err(|source| Error::Write { path: path.into(), source })?;
        folder.add::<&str>(&[])?;
        Ok(folder)
    }

    /// As [`open`](Self::open), without creating or changing anything.
    ///
    /// # Errors
    /// If it is neither empty nor the command's own.
    pub fn find(path: &Path, command: &str, name: &str, force: bool) -> Result<Self, Error> {
        let folder = Folder { path: path.into(), command: command.into(), name: name.into(), force };
        folder.files().map(|_| folder)
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

    /// Returns the files that the command has written here before.
    fn files(&self) -> Result<BTreeSet<String>, Error> {
        let files = match self.marker() {
            Ok(Some(Marker { command, files, .. })) if command == self.command => Ok(files),
            Ok(Some(Marker { command, name, .. })) => {
                Err(self.foreign(format!("holds what `sitl {command}` made of {name}")))
            }
            Ok(None) if self.is_empty()? => Ok(BTreeSet::new()),
            Ok(None) => Err(self.foreign(format!("not empty, and not from `sitl {}`", self.command))),
            Err(error) => Err(Error::Damaged { path: self.path.join(MARKER), problem: error.to_string() }),
        };
        if self.force { Ok(files.unwrap_or_default()) } else { files }
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
        if marker.files.iter().all(is_plain) { Ok(Some(marker)) } else { Err(io::Error::other("a path in it")) }
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
        let mut files = self.files()?;
        for name in names.iter().map(N::as_ref) {
            let path = self.path.join(name);
            // Of the link itself: one that leads nowhere is somebody's, too.
            if files.insert(name.into()) && !self.force && fs::symlink_metadata(&path).is_ok() {
                return Err(Error::Foreign {
                    path,
                    whose: format!("in the way, and not from `sitl {}`", self.command),
                });
            }
        }
        self.mark(files)
    }

    /// As [`add`](Self::add), and removes all other files that the command has written here before, since they belong
    /// to earlier results.
    pub fn only<N: AsRef<str>>(&self, names: &[N]) -> Result<(), Error> {
        let before = self.files()?;
        self.add(names)?;
        let now: BTreeSet<String> = names.iter().map(|name| name.as_ref().into()).collect();
        // Meanwhile the marker names old and new files: what a killed program leaves is still the command's own.
        for stale in before.difference(&now) {
            match fs::remove_file(self.path.join(stale)) {
                Err(source) if source.kind() != io::ErrorKind::NotFound => return Err(self.error(stale, source)),
                _ => {}
            }
        }
        self.mark(now)
    }

    fn mark(&self, files: BTreeSet<String>) -> Result<(), Error> {
        let Folder { command, name, .. } = self.clone();
        let marker = Marker { command, name, files, checksum: seal::OPEN.into() };
        self.place(MARKER, |out| seal::json(out, &marker)).map(drop)
    }

    /// Lets `fill` write a file under a temporary name, and then renames it; an interrupted or failed run leaves the
    /// previous file. A file with its final name is on the disk, even after a power cut.
    pub fn place(
        &self,
        name: &str,
        fill: impl FnOnce(&mut (dyn Write + Send)) -> io::Result<()>,
    ) -> Result<PathBuf, Error> {
        let path = self.path.join(name);
        place(&path, fill).map_err(|source| Error::Write { path: path.clone(), source })?;
        Ok(path)
    }
}
