//! Single files that commands write.

use crate::atomic::{write_atomically, write_new};
use crate::created::remember;
use crate::error::Error;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// A single file that a command is going to write. An existing file is never replaced, unless with `--force`.
#[derive(Clone, Debug)]
pub struct OutputFile {
    path: PathBuf,
    option: &'static str,
    /// Whether to replace an existing file; none if the command has no `--force`.
    force: Option<bool>,
}

impl OutputFile {
    /// Checks that the file named by `option` does not exist yet, and that its folder does. Creates and changes
    /// nothing.
    ///
    /// # Errors
    /// If the file exists, or cannot be created.
    pub fn new(path: &Path, option: &'static str) -> Result<Self, Error> {
        OutputFile { path: path.into(), option, force: None }.checked()
    }

    /// Checks like [`new`](Self::new), for a command with `--force`: with `force`, an existing file will be replaced.
    ///
    /// # Errors
    /// The same as for [`new`](Self::new).
    pub fn forcible(path: &Path, option: &'static str, force: bool) -> Result<Self, Error> {
        OutputFile { path: path.into(), option, force: Some(force) }.checked()
    }

    fn checked(self) -> Result<Self, Error> {
        let folder = self.path.parent().filter(|folder| !folder.as_os_str().is_empty());
        if let Some(folder) = folder.filter(|folder| !folder.is_dir()) {
            return Err(self.failed(&format!("the folder {} does not exist", folder.display())));
        }
        if self.path.is_dir() || self.path.file_name().is_none() {
            return Err(self.failed("it is a folder"));
        }
        // Checks the link itself, since a dangling link is also somebody's file.
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

    /// Returns the error for a file that could not be written.
    #[must_use]
    pub fn unwritten(&self, error: &io::Error) -> Error {
        match error.kind() {
            io::ErrorKind::AlreadyExists => self.exists(),
            _ => self.failed(&error.to_string()),
        }
    }

    /// Returns the file's path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Lets `fill` write the whole file, which appears complete or not at all.
    ///
    /// # Errors
    /// If the file cannot be written, or has appeared meanwhile.
    pub fn write(&self, fill: impl FnOnce(&mut (dyn Write + Send)) -> io::Result<()>) -> Result<(), Error> {
        let placed =
            if self.force == Some(true) { write_atomically(&self.path, fill) } else { write_new(&self.path, fill) };
        placed.map_err(|error| self.unwritten(&error))
    }

    /// Creates the file for incremental writing, such as a log. Fails if the file exists, even with `--force`.
    /// Remembers it for [`remove_created`](crate::remove_created) and [`remove_empty`](crate::remove_empty).
    ///
    /// # Errors
    /// If the file cannot be created, or has appeared meanwhile.
    pub fn create(&self) -> Result<File, Error> {
        let file = File::create_new(&self.path).map_err(|error| self.unwritten(&error))?;
        remember(&self.path);
        Ok(file)
    }
}
