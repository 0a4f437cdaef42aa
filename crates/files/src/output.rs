//! Single files that commands write.

use crate::created::remember;
use crate::error::Error;
use crate::place::{fresh, place};
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// A single file that a command is going to write. One that exists is never replaced, unless by force.
#[derive(Clone, Debug)]
pub struct Output {
    path: PathBuf,
    option: &'static str,
    /// Whether to replace what is there; none if the command cannot be told to.
    force: Option<bool>,
}

impl Output {
    /// Checks that `option` names a file that is not there, in a folder that is. Nothing is created or changed.
    ///
    /// # Errors
    /// If it is there, or cannot be.
    pub fn new(path: &Path, option: &'static str) -> Result<Self, Error> {
        Output { path: path.into(), option, force: None }.checked()
    }

    /// As [`new`](Self::new), for a command with `--force`: if that is given, a file that is there will be replaced.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn forcible(path: &Path, option: &'static str, force: bool) -> Result<Self, Error> {
        Output { path: path.into(), option, force: Some(force) }.checked()
    }

    fn checked(self) -> Result<Self, Error> {
        let folder = self.path.parent().filter(|folder| !folder.as_os_str().is_empty());
        if let Some(folder) = folder.filter(|folder| !folder.is_dir()) {
            return Err(self.failed(&format!("there is no folder {}", folder.display())));
        }
        if self.path.is_dir() || self.path.file_name().is_none() {
            return Err(self.failed("it is a folder"));
        }
        // Of the link itself: one that leads nowhere is somebody's, too.
        match fs::symlink_metadata(&self.path) {
            Ok(_) if self.force != Some(true) => Err(self.exists()),
            _ => Ok(self),
        }
    }

    fn exists(&self) -> Error {
        Error::Exists { path: self.path.clone(), option: self.option, forcible: self.force.is_some() }
    }

    fn failed(&self, problem: &str) -> Error {
        Error::File { path: self.path.clone(), option: self.option, problem: problem.into() }
    }

    /// Says that the file cannot be written.
    #[must_use]
    pub fn unwritten(&self, error: &io::Error) -> Error {
        match error.kind() {
            io::ErrorKind::AlreadyExists => self.exists(),
            _ => self.failed(&error.to_string()),
        }
    }

    /// Returns its path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Lets `fill` write the whole file, which appears whole or not at all.
    ///
    /// # Errors
    /// If it cannot be written, or has appeared meanwhile.
    pub fn place(&self, fill: impl FnOnce(&mut (dyn Write + Send)) -> io::Result<()>) -> Result<(), Error> {
        let placed = if self.force == Some(true) { place(&self.path, fill) } else { fresh(&self.path, fill) };
        placed.map_err(|error| self.unwritten(&error))
    }

    /// Creates the file, for a log that is written bit by bit. Even by force it must not be there. It is remembered
    /// for [`remove_created`](crate::remove_created) and [`remove_empty`](crate::remove_empty).
    ///
    /// # Errors
    /// If it cannot be created, or has appeared meanwhile.
    pub fn create(&self) -> Result<File, Error> {
        let file = File::create_new(&self.path).map_err(|error| self.unwritten(&error))?;
        remember(&self.path);
        Ok(file)
    }
}
