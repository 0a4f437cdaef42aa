//! Where results gather, so that what has been flown stays whatever happens.
//!
//! While a campaign is flown, each chunk of it that is finished becomes one file, at once and on the disk before it has a
//! name. At the end all become `results.parquet`. Whoever starts again in the same folder goes on with what is missing.
//! Every file carries its checksum, and none is believed without.

use crate::error::Error;
use crate::manifest::Manifest;
use crate::parquet::{OnDisk, Reader, Writer};
use crate::row::Row;
use afbc_files::seal::{self, Sealing};
use afbc_files::{self as files, Folder as Place};
use bytes::Bytes;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::fmt;
use std::fs::{self, File, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

/// Flights of one chunk: seconds of work for one core.
pub(super) const CHUNK: u64 = 16;
/// Chunks that are read at once while they become one file.
const BATCH: u64 = 64;
/// All rows.
const RESULTS: &str = "results.parquet";
/// The manifest, there from the beginning.
const MANIFEST: &str = "campaign.json";
const CHUNKS: &str = "chunks";
const LOCK: &str = ".sitl.lock";
/// What a campaign's folder is marked with.
const COMMAND: &str = "campaign";

/// A folder that the results of one campaign, or of one shard, gather in. It is held against other programs.
pub struct Folder {
    place: Place,
    manifest: Manifest,
    /// Locked until it is closed.
    _lock: File,
}

/// `campaign.json`.
#[derive(Serialize, Deserialize)]
struct Page<M> {
    #[serde(flatten)]
    manifest: M,
    checksum: String,
}

impl Folder {
    /// The folder at `path`, created if need be, for the results of `manifest`. By `force`, whatever is in the way of them
    /// is replaced.
    ///
    /// # Errors
    /// If it cannot be written, is in use, or holds anything else, or results of something else; nothing is touched then.
    pub fn open(path: &Path, manifest: Manifest, force: bool) -> Result<Self, Error> {
        let name = manifest.name.clone();
        let place = Place::find(path, COMMAND, &name, force)?;
        let is_known = match found(&path.join(MANIFEST)) {
            Ok(Some(found)) if manifest.is_same(&found) => true,
            Ok(None) => false,
            _ if force => false,
            Ok(Some(_)) => return Err(Error::Changed(path.into())),
            Err(error) => return Err(error),
        };
        fs::create_dir_all(path).map_err(|source| files::Error::Write { path: path.into(), source })?;
        // Never cut short: it might be somebody's, by force.
        let lock = File::options().write(true).create(true).truncate(false).open(path.join(LOCK));
        let lock = lock.map_err(|source| place.error(LOCK, source))?;
        match lock.try_lock() {
            Err(TryLockError::WouldBlock) => return Err(Error::Busy(path.into())),
            // Some network file systems know no locks: there, two must not be started at once.
            Err(TryLockError::Error(_)) | Ok(()) => {}
        }
        place.add(&[MANIFEST, RESULTS, CHUNKS, "summary.json", "report.html"])?;
        let folder = Folder { place, manifest, _lock: lock };
        if force && folder.results().is_err() {
            // Of something else, or damaged.
            fs::remove_file(path.join(RESULTS)).map_err(|source| folder.place.error(RESULTS, source))?;
        }
        if !is_known {
            let page = Page { manifest: &folder.manifest, checksum: seal::OPEN.into() };
            folder.place.place(MANIFEST, |out| seal::json(out, &page))?;
        }
        files::sweep(path);
        files::sweep(&path.join(CHUNKS));
        Ok(folder)
    }

    /// Where the folder is.
    pub fn path(&self) -> &Path {
        self.place.path()
    }

    /// For what else comes of the campaign.
    pub fn place(&self) -> &Place {
        &self.place
    }

    /// What the results are of.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// How many chunks there are when all are there.
    pub(super) fn chunks(&self) -> u64 {
        self.manifest.shard.count(self.manifest.flights).div_ceil(CHUNK)
    }

    /// The flights of one chunk, at no more work for the last than for the first.
    pub(super) fn chunk(&self, chunk: u64) -> impl Iterator<Item = u64> + use<> {
        let Manifest { shard, flights, .. } = self.manifest;
        (chunk * CHUNK..(chunk + 1) * CHUNK)
            .map(move |index| shard.flight(index))
            .take_while(move |flight| *flight < flights)
    }

    fn chunk_name(chunk: u64) -> String {
        format!("{chunk:06}.parquet")
    }

    fn chunk_path(&self, chunk: u64) -> PathBuf {
        self.path().join(CHUNKS).join(Self::chunk_name(chunk))
    }

    /// The chunks that have a file, by the names in the folder.
    fn named_chunks(&self) -> impl Iterator<Item = u64> + use<> {
        let chunks = self.chunks();
        let entries = fs::read_dir(self.path().join(CHUNKS)).into_iter().flatten().flatten();
        entries.filter_map(move |entry| {
            let name = entry.file_name().into_string().ok()?;
            let chunk = name.strip_suffix(".parquet")?.parse().ok().filter(|chunk| *chunk < chunks)?;
            (name == Self::chunk_name(chunk)).then_some(chunk)
        })
    }

    /// The chunks that are there, whole and of this campaign.
    pub(super) fn kept(&self, stop: &AtomicBool) -> BTreeSet<u64> {
        let named: Vec<u64> = self.named_chunks().collect();
        let is_kept = |chunk: &u64| !stop.load(Ordering::Relaxed) && self.read_chunk(*chunk).is_ok();
        named.into_par_iter().filter(is_kept).collect()
    }

    /// The rows of one chunk, which are what they should be.
    fn read_chunk(&self, chunk: u64) -> Result<Vec<Row>, Error> {
        let path = self.chunk_path(chunk);
        let bytes = fs::read(&path).map_err(|error| unread(&path, error))?;
        seal::verify(&mut io::Cursor::new(&bytes)).map_err(|error| unread(&path, error))?;
        let reader = Reader::new(Bytes::from(bytes)).map_err(|error| damaged(&path, error))?;
        if !self.manifest.is_same(reader.manifest()) {
            return Err(damaged(&path, "it is of another campaign"));
        }
        let rows = reader.collect::<Result<Vec<Row>, _>>().map_err(|error| damaged(&path, error))?;
        let contenders = &self.manifest.contenders;
        let wanted = self.chunk(chunk).flat_map(|flight| contenders.iter().map(move |name| (flight, name)));
        if wanted.eq(rows.iter().map(|row| (row.flight, &row.contender))) {
            Ok(rows)
        } else {
            Err(damaged(&path, "it holds other flights"))
        }
    }

    /// Keeps the rows of one chunk.
    pub(super) fn put_chunk(&self, chunk: u64, rows: impl Iterator<Item = Row>) -> Result<(), Error> {
        let path = self.chunk_path(chunk);
        let written = fs::create_dir_all(self.path().join(CHUNKS))
            .and_then(|()| files::place(&path, |out| write(out, &self.manifest, rows)));
        written.map_err(|source| files::Error::Write { path, source }.into())
    }

    /// All rows, if they are in one file already.
    pub(super) fn results(&self) -> Result<Option<Rows>, Error> {
        let rows = Rows::open(&self.path().join(RESULTS))?;
        match rows {
            Some(rows) if !self.manifest.is_same(rows.manifest()) => Err(Error::Changed(self.path().into())),
            rows => Ok(rows),
        }
    }

    /// The rows of all chunks, in order, a few of them in memory.
    pub(super) fn rows(&self) -> impl Iterator<Item = Result<Row, Error>> {
        let chunks = self.chunks();
        (0..chunks).step_by(BATCH as usize).flat_map(move |first| {
            let batch = first..chunks.min(first + BATCH);
            let read: Vec<_> = batch.into_par_iter().map(|chunk| self.read_chunk(chunk)).collect();
            read.into_iter().flat_map(|rows| {
                let (rows, error) = rows.map_or_else(|error| (Vec::new(), Some(Err(error))), |rows| (rows, None));
                rows.into_iter().map(Ok).chain(error)
            })
        })
    }

    /// Makes one file of `rows`.
    ///
    /// # Errors
    /// The first of the rows', or that the file cannot be written; there is none then.
    pub(super) fn write(&self, rows: impl Iterator<Item = Result<Row, Error>>) -> Result<(), Error> {
        let mut failure = None;
        let written = self.place.place(RESULTS, |out| {
            write(out, &self.manifest, rows.map_while(|row| row.map_err(|error| failure = Some(error)).ok()))?;
            // Without this, an error on the way would leave a file that looks whole.
            if failure.is_some() { Err(io::ErrorKind::InvalidData.into()) } else { Ok(()) }
        });
        if let Some(error) = failure {
            return Err(error);
        }
        written?;
        // They have done their duty; if they stay, they take room and nothing else. What else is there is not ours.
        self.named_chunks().for_each(|chunk| drop(fs::remove_file(self.chunk_path(chunk))));
        let _ = fs::remove_dir(self.path().join(CHUNKS));
        Ok(())
    }
}

/// The manifest at `path`, if there is one.
fn found(path: &Path) -> Result<Option<Manifest>, Error> {
    let bytes = match fs::read(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        bytes => bytes.map_err(|error| unread(path, error))?,
    };
    seal::verify(&mut io::Cursor::new(&bytes)).map_err(|error| unread(path, error))?;
    let page: Page<Manifest> = serde_json::from_slice(&bytes).map_err(|error| damaged(path, error))?;
    Ok(Some(page.manifest))
}

/// Rows of a finished folder, and what they are of.
pub(super) fn finished(path: &Path) -> Result<Rows, Error> {
    Rows::open(&path.join(RESULTS))?.ok_or_else(|| Error::Unfinished(path.into()))
}

fn write(out: &mut (dyn Write + Send), manifest: &Manifest, mut rows: impl Iterator<Item = Row>) -> io::Result<()> {
    let mut writer = Writer::new(Sealing::new(out), manifest).map_err(io::Error::other)?;
    rows.try_for_each(|row| writer.push(row)).and_then(|()| writer.finish()).map_err(io::Error::other)?.finish()
}

/// The rows of one file; an error names it.
pub(super) struct Rows {
    path: PathBuf,
    rows: Reader<OnDisk>,
}

impl Rows {
    /// The rows at `path`, if there is such a file, once it is sure that no bit of it has changed.
    fn open(path: &Path) -> Result<Option<Self>, Error> {
        let mut file = match File::open(path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            file => file.map_err(|error| unread(path, error))?,
        };
        seal::verify(&mut file).map_err(|error| unread(path, error))?;
        let length = file.metadata().map_err(|error| unread(path, error))?.len();
        let rows = Reader::new(OnDisk { path: path.into(), length }).map_err(|error| damaged(path, error))?;
        Ok(Some(Rows { path: path.into(), rows }))
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
        Some(self.rows.next()?.map_err(|error| damaged(&self.path, error)))
    }
}

/// Why a file is not believed: the system does not give it, or it is not what was written.
fn unread(path: &Path, source: io::Error) -> Error {
    match source.kind() {
        io::ErrorKind::InvalidData | io::ErrorKind::UnexpectedEof => damaged(path, source),
        _ => Error::Unreadable { path: path.into(), source },
    }
}

fn damaged(path: &Path, problem: impl fmt::Display) -> Error {
    Error::Damaged { path: path.into(), problem: problem.to_string() }
}
