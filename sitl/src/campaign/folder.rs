//! Where results gather, so that what has been flown stays whatever happens.
//!
//! While a campaign is flown, each chunk of it that is finished becomes one file, at once and on the disk before it has a
//! name. At the end all become `results.parquet`. Whoever starts again in the same folder goes on with what is missing.

use super::parquet::{Reader, Writer};
use super::{Error, Manifest, Row};
use crate::output::Folder as Place;
use std::fmt;
use std::fs::{self, File, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Flights of one chunk: seconds of work for one core.
const CHUNK: usize = 16;
/// All rows.
const RESULTS: &str = "results.parquet";
/// The manifest, there from the beginning.
const MANIFEST: &str = "campaign.json";
const CHUNKS: &str = "chunks";
const LOCK: &str = ".lock";

/// A folder that the results of one campaign, or of one shard, gather in. It is held against other programs.
pub struct Folder {
    path: PathBuf,
    manifest: Manifest,
    /// Locked until it is closed.
    _lock: File,
}

impl Folder {
    /// The folder at `path`, created if need be, for the results of `manifest`.
    ///
    /// # Errors
    /// If it cannot be written, is in use, or holds results of something else.
    pub fn open(path: &Path, manifest: Manifest) -> Result<Self, Error> {
        let place = Place::create(path)?;
        let lock = File::create(path.join(LOCK)).map_err(|source| place.error(LOCK, source))?;
        match lock.try_lock() {
            Err(TryLockError::WouldBlock) => return Err(Error::Busy(path.into())),
            // Some network file systems know no locks: there, two must not be started at once.
            Err(TryLockError::Error(_)) | Ok(()) => {}
        }
        match fs::read_to_string(path.join(MANIFEST)) {
            Ok(found) if serde_json::from_str(&found).is_ok_and(|found| manifest.is_same(&found)) => {}
            Ok(_) => return Err(Error::Changed(path.into())),
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                place.place(MANIFEST, |out| {
                    serde_json::to_writer_pretty(&mut *out, &manifest)?;
                    writeln!(out)
                })?;
            }
            Err(error) => return Err(damaged(&path.join(MANIFEST), error)),
        }
        let folder = Folder { path: path.into(), manifest, _lock: lock };
        folder.sweep()?;
        Ok(folder)
    }

    /// Removes what a killed program has left half written.
    fn sweep(&self) -> Result<(), Error> {
        let chunks = self.path.join(CHUNKS);
        Place::create(&chunks)?;
        for entry in [&self.path, &chunks].into_iter().filter_map(|dir| fs::read_dir(dir).ok()).flatten().flatten() {
            let name = entry.file_name();
            let name = name.to_string_lossy();
            if name.starts_with('.') && name.ends_with(".tmp") {
                // What cannot be removed does no harm either.
                let _ = fs::remove_file(entry.path());
            }
        }
        Ok(())
    }

    /// Where the folder is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What the results are of.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// The flights of this folder's shard.
    fn flights(&self) -> impl ExactSizeIterator<Item = usize> + use<> {
        self.manifest.shard.flights(self.manifest.flights)
    }

    /// How many chunks there are when all are there.
    pub(super) fn chunks(&self) -> usize {
        self.flights().len().div_ceil(CHUNK)
    }

    /// The flights of one chunk.
    pub(super) fn chunk(&self, chunk: usize) -> Vec<u64> {
        self.flights().skip(chunk * CHUNK).take(CHUNK).map(|flight| flight as u64).collect()
    }

    fn chunk_name(chunk: usize) -> String {
        format!("{chunk:06}.parquet")
    }

    fn chunk_path(&self, chunk: usize) -> PathBuf {
        self.path.join(CHUNKS).join(Self::chunk_name(chunk))
    }

    /// Whether this chunk is there, whole and of this campaign.
    pub(super) fn has_chunk(&self, chunk: usize) -> bool {
        let Ok(rows) = Reader::open(&self.chunk_path(chunk)) else { return false };
        if !self.manifest.is_same(rows.manifest()) {
            return false;
        }
        let contenders = &self.manifest.contenders;
        let wanted = self.chunk(chunk).into_iter().flat_map(|flight| contenders.iter().map(move |name| (flight, name)));
        let mut rows = rows.map(|row| row.ok());
        wanted.into_iter().all(|(flight, name)| {
            rows.next().flatten().is_some_and(|row| row.flight == flight && &row.contender == name)
        }) && rows.next().is_none()
    }

    /// Keeps the rows of one chunk.
    pub(super) fn put_chunk(&self, chunk: usize, rows: impl Iterator<Item = Row>) -> Result<(), Error> {
        Place::create(&self.path.join(CHUNKS))?
            .place(&Self::chunk_name(chunk), |out| write(out, &self.manifest, rows))?;
        Ok(())
    }

    /// Whether all rows are in one file already.
    pub fn is_complete(&self) -> bool {
        Reader::open(&self.path.join(RESULTS)).is_ok_and(|rows| self.manifest.is_same(rows.manifest()))
    }

    /// Makes one file of all chunks, if it is not there yet, and shows each of its rows.
    pub(super) fn collect(&self, observe: &mut dyn FnMut(&Row)) -> Result<(), Error> {
        if self.is_complete() {
            return Rows::open(&self.path.join(RESULTS))?.try_for_each(|row| row.map(|row| observe(&row)));
        }
        let chunks = (0..self.chunks()).map(|chunk| Rows::open(&self.chunk_path(chunk)));
        let rows = chunks.flat_map(|rows| {
            let (rows, error) = match rows {
                Ok(rows) => (Some(rows), None),
                Err(error) => (None, Some(Err(error))),
            };
            rows.into_iter().flatten().chain(error)
        });
        self.write(rows, observe)
    }

    /// Makes one file of `rows`, and shows each on the way.
    pub(super) fn write(
        &self,
        rows: impl Iterator<Item = Result<Row, Error>>,
        observe: &mut dyn FnMut(&Row),
    ) -> Result<(), Error> {
        let mut failure = None;
        let written = Place::create(&self.path)?.place(RESULTS, |out| {
            let rows = rows.map_while(|row| row.map_err(|error| failure = Some(error)).ok());
            write(out, &self.manifest, rows.inspect(|row| observe(row)))?;
            // Without this, an error on the way would leave a file that looks whole.
            if failure.is_some() { Err(io::ErrorKind::InvalidData.into()) } else { Ok(()) }
        });
        if let Some(error) = failure {
            return Err(error);
        }
        written?;
        // They have done their duty; if they stay, they take room and nothing else.
        let _ = fs::remove_dir_all(self.path.join(CHUNKS));
        Ok(())
    }
}

/// Rows of a finished folder, and what they are of.
pub(super) fn finished(path: &Path) -> Result<Rows, Error> {
    if path.join(RESULTS).exists() { Rows::open(&path.join(RESULTS)) } else { Err(Error::Unfinished(path.into())) }
}

fn write(out: &mut (dyn Write + Send), manifest: &Manifest, mut rows: impl Iterator<Item = Row>) -> io::Result<()> {
    let mut writer = Writer::new(out, manifest).map_err(io::Error::other)?;
    rows.try_for_each(|row| writer.push(row)).and_then(|()| writer.finish().map(drop)).map_err(io::Error::other)
}

/// The rows of one file; an error names it.
pub(super) struct Rows {
    path: PathBuf,
    rows: Reader,
}

impl Rows {
    fn open(path: &Path) -> Result<Self, Error> {
        Reader::open(path).map(|rows| Rows { path: path.into(), rows }).map_err(|error| damaged(path, &error))
    }

    pub(super) fn manifest(&self) -> &Manifest {
        self.rows.manifest()
    }

    /// The file ends too early, or something else is in it.
    pub(super) fn incomplete(&self) -> Error {
        damaged(&self.path, "rows are missing")
    }
}

impl Iterator for Rows {
    type Item = Result<Row, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        Some(self.rows.next()?.map_err(|error| damaged(&self.path, &error)))
    }
}

fn damaged(path: &Path, problem: impl fmt::Display) -> Error {
    Error::Damaged { path: path.into(), problem: problem.to_string() }
}
