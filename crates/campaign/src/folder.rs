//! The folder of a campaign's results. It keeps finished flights even if the program is killed.
//!
//! Each finished chunk of flights becomes a file. The file is flushed to the disk before it gets its name. At the end,
//! all chunks are joined in `results.parquet`. Starting again in the same folder resumes the campaign. Every file has a
//! checksum that is verified before use.

use crate::error::Error;
use crate::manifest::Manifest;
use crate::parquet::{ReopenedFile, RowReader, RowWriter};
use crate::row::ResultRow;
use afbc_files::seal::{self, SealingWriter};
use afbc_files::{self as files, Folder};
use bytes::Bytes;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::fmt;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

/// Number of flights per chunk, which take one core some seconds.
pub(super) const CHUNK: u64 = 16;
/// Number of chunks that are read at once while they are joined.
const BATCH: u64 = 64;
/// Name of the file with the results of all flights.
const RESULTS: &str = "results.parquet";
/// Name of the manifest's file, present from the beginning.
const MANIFEST: &str = "campaign.json";
const CHUNKS: &str = "chunks";
/// Command that the folder records as its writer.
const COMMAND: &str = "campaign";

/// Folder with the results of one campaign or shard, locked against other programs.
pub struct CampaignFolder {
    folder: Folder,
    manifest: Manifest,
}

/// Contents of `campaign.json`.
#[derive(Serialize, Deserialize)]
struct CampaignFile<M> {
    #[serde(flatten)]
    manifest: M,
    checksum: String,
}

impl CampaignFolder {
    /// Opens the folder at `path` for the results of `manifest`, and creates it if needed. With `force`, files of the
    /// same names are replaced.
    ///
    /// # Errors
    /// If the folder cannot be written, is in use, or holds anything other than results of `manifest`. Nothing has been
    /// changed then.
    pub fn open(path: &Path, manifest: Manifest, force: bool) -> Result<Self, Error> {
        let name = manifest.name.clone();
        Folder::find(path, COMMAND, &name, force)?;
        let is_known = match found(&path.join(MANIFEST)) {
            Ok(Some(found)) if manifest.is_same(&found) => true,
            Ok(None) => false,
            // `force` also replaces a manifest that cannot be read.
            _ if force => false,
            Ok(Some(_)) => return Err(Error::Changed(path.into())),
            Err(error) => return Err(error),
        };
        let folder = Folder::open(path, COMMAND, &name, force)?;
        folder.add(&[MANIFEST, RESULTS, CHUNKS, "summary.json", "report.html"])?;
        let opened = CampaignFolder { folder, manifest };
        if force && opened.results().is_err() {
            // The results are damaged or belong to another campaign.
            fs::remove_file(path.join(RESULTS)).map_err(|source| opened.folder.error(RESULTS, source))?;
        }
        if !is_known {
            let page = CampaignFile { manifest: &opened.manifest, checksum: seal::OPEN.into() };
            opened.write_sealed(MANIFEST, |out| seal::json(out, &page))?;
        }
        // Sweeping is safe under the lock: no running program owns any of the temporary files.
        files::remove_temporary_files(&path.join(CHUNKS));
        Ok(opened)
    }

    /// Returns the folder's path.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Returns the underlying folder, to write other files of the campaign into.
    pub fn output_folder(&self) -> &Folder {
        &self.folder
    }

    /// Returns the paths of the two files with their own checksums: the manifest and all rows.
    pub fn sealed(&self) -> [PathBuf; 2] {
        [MANIFEST, RESULTS].map(|name| self.path().join(name))
    }

    /// Returns the manifest of the results.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// Writes a file with a checksum of its own, which locates damage better than the folder's checksum.
    fn write_sealed(
        &self,
        name: &str,
        fill: impl FnOnce(&mut (dyn Write + Send)) -> io::Result<()>,
    ) -> Result<(), files::Error> {
        files::write_atomically(&self.path().join(name), fill).map_err(|source| self.folder.error(name, source))
    }

    /// Returns the number of all chunks.
    pub(super) fn chunks(&self) -> u64 {
        self.manifest.shard.count(self.manifest.flights).div_ceil(CHUNK)
    }

    /// Returns the flights of a chunk. The time does not depend on the chunk's number.
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

    /// Returns the chunks that have a file, judging by its name.
    fn named_chunks(&self) -> impl Iterator<Item = u64> + use<> {
        let chunks = self.chunks();
        let entries = fs::read_dir(self.path().join(CHUNKS)).into_iter().flatten().flatten();
        entries.filter_map(move |entry| {
            let name = entry.file_name().into_string().ok()?;
            let chunk = name.strip_suffix(".parquet")?.parse().ok().filter(|chunk| *chunk < chunks)?;
            // Only the exact spelling counts: "1.parquet" is somebody else's file.
            (name == Self::chunk_name(chunk)).then_some(chunk)
        })
    }

    /// Returns the chunks that are present, complete and of this campaign.
    pub(super) fn kept(&self, stop: &AtomicBool) -> BTreeSet<u64> {
        let named: Vec<u64> = self.named_chunks().collect();
        let is_kept = |chunk: &u64| !stop.load(Ordering::Relaxed) && self.read_chunk(*chunk).is_ok();
        named.into_par_iter().filter(is_kept).collect()
    }

    /// Reads and checks the rows of one chunk.
    fn read_chunk(&self, chunk: u64) -> Result<Vec<ResultRow>, Error> {
        let path = self.chunk_path(chunk);
        let bytes = fs::read(&path).map_err(|error| unread(&path, error))?;
        seal::verify(&mut io::Cursor::new(&bytes)).map_err(|error| unread(&path, error))?;
        let reader = RowReader::new(Bytes::from(bytes)).map_err(|error| damaged(&path, error))?;
        if !self.manifest.is_same(reader.manifest()) {
            return Err(damaged(&path, "the file belongs to another campaign"));
        }
        let rows = reader.collect::<Result<Vec<ResultRow>, _>>().map_err(|error| damaged(&path, error))?;
        let contenders = &self.manifest.contenders;
        let wanted = self.chunk(chunk).flat_map(|flight| contenders.iter().map(move |name| (flight, name)));
        if wanted.eq(rows.iter().map(|row| (row.flight, &row.contender))) {
            Ok(rows)
        } else {
            Err(damaged(&path, "the file does not hold the flights that belong into it"))
        }
    }

    /// Writes the rows of one chunk.
    pub(super) fn put_chunk(&self, chunk: u64, rows: impl Iterator<Item = ResultRow>) -> Result<(), Error> {
        let path = self.chunk_path(chunk);
        let written = fs::create_dir_all(self.path().join(CHUNKS))
            .and_then(|()| files::write_atomically(&path, |out| write(out, &self.manifest, rows)));
        written.map_err(|source| files::Error::Write { path, source }.into())
    }

    /// Returns all rows, if they are already in one file.
    pub fn results(&self) -> Result<Option<ResultRows>, Error> {
        let rows = ResultRows::open(&self.path().join(RESULTS))?;
        match rows {
            Some(rows) if !self.manifest.is_same(rows.manifest()) => Err(Error::Changed(self.path().into())),
            rows => Ok(rows),
        }
    }

    /// Returns the rows of all chunks, in order. Only 64 chunks are in memory at a time.
    pub(super) fn rows(&self) -> impl Iterator<Item = Result<ResultRow, Error>> {
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

    /// Writes `rows` into `results.parquet` and removes the chunks.
    ///
    /// # Errors
    /// The first error among the rows, or of writing. No file is written then.
    pub(super) fn write(&self, rows: impl Iterator<Item = Result<ResultRow, Error>>) -> Result<(), Error> {
        let mut failure = None;
        let written = self.write_sealed(RESULTS, |out| {
            write(out, &self.manifest, rows.map_while(|row| row.map_err(|error| failure = Some(error)).ok()))?;
            // Without this error, an incomplete file would look complete.
            if failure.is_some() { Err(io::ErrorKind::InvalidData.into()) } else { Ok(()) }
        });
        if let Some(error) = failure {
            return Err(error);
        }
        written?;
        // The chunks are no longer needed. A chunk that cannot be removed only takes space. Other files are left alone.
        self.named_chunks().for_each(|chunk| drop(fs::remove_file(self.chunk_path(chunk))));
        let _ = fs::remove_dir(self.path().join(CHUNKS));
        Ok(())
    }
}

/// Reads the manifest at `path`, if there is one.
fn found(path: &Path) -> Result<Option<Manifest>, Error> {
    let bytes = match fs::read(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        bytes => bytes.map_err(|error| unread(path, error))?,
    };
    seal::verify(&mut io::Cursor::new(&bytes)).map_err(|error| unread(path, error))?;
    let page: CampaignFile<Manifest> = serde_json::from_slice(&bytes).map_err(|error| damaged(path, error))?;
    Ok(Some(page.manifest))
}

/// Returns the rows and the manifest of a finished folder.
pub(super) fn finished(path: &Path) -> Result<ResultRows, Error> {
    ResultRows::open(&path.join(RESULTS))?.ok_or_else(|| Error::Unfinished(path.into()))
}

fn write(
    out: &mut (dyn Write + Send),
    manifest: &Manifest,
    mut rows: impl Iterator<Item = ResultRow>,
) -> io::Result<()> {
    let mut writer = RowWriter::new(SealingWriter::new(out), manifest).map_err(io::Error::other)?;
    rows.try_for_each(|row| writer.push(row)).and_then(|()| writer.finish()).map_err(io::Error::other)?.finish()
}

/// Rows of one file; errors name the file.
pub struct ResultRows {
    path: PathBuf,
    rows: RowReader<ReopenedFile>,
}

impl ResultRows {
    /// Verifies the checksum of the file at `path` and opens its rows. Returns none if there is no such file.
    fn open(path: &Path) -> Result<Option<Self>, Error> {
        let mut file = match File::open(path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            file => file.map_err(|error| unread(path, error))?,
        };
        seal::verify(&mut file).map_err(|error| unread(path, error))?;
        let length = file.metadata().map_err(|error| unread(path, error))?.len();
        let rows = RowReader::new(ReopenedFile { path: path.into(), length }).map_err(|error| damaged(path, error))?;
        Ok(Some(ResultRows { path: path.into(), rows }))
    }

    pub(super) fn manifest(&self) -> &Manifest {
        self.rows.manifest()
    }

    /// Returns the error for a file that ends too early or holds other rows.
    pub(super) fn incomplete(&self) -> Error {
        damaged(&self.path, "rows are missing")
    }
}

impl Iterator for ResultRows {
    type Item = Result<ResultRow, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        Some(self.rows.next()?.map_err(|error| damaged(&self.path, error)))
    }
}

/// Returns the error for a file that cannot be read or was damaged.
fn unread(path: &Path, source: io::Error) -> Error {
    match source.kind() {
        io::ErrorKind::InvalidData | io::ErrorKind::UnexpectedEof => damaged(path, source),
        _ => Error::Unreadable { path: path.into(), source },
    }
}

fn damaged(path: &Path, problem: impl fmt::Display) -> Error {
    Error::Damaged { path: path.into(), problem: problem.to_string() }
}
