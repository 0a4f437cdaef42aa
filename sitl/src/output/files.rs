//! Names of files, and how they come into being.

use super::words::{case_words, slug};
use super::{Error, Flown, seal};
use crate::scenario::Scenario;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeSet, HashSet};
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// The flights of one scenario, and what their files are called.
pub(super) struct Group<'a> {
    /// The scenario that all of them flew.
    pub(super) scenario: &'a Scenario,
    /// In the order flown; never empty.
    pub(super) flights: Vec<&'a Flown>,
    /// One for each flight.
    pub(super) csv_names: Vec<String>,
    /// Goes before `fig4-trajectory.svg`.
    pub(super) figure_prefix: String,
}

/// Sorts flights by scenario, in the order flown, and names their files.
pub(super) fn groups(flown: &[Flown]) -> Vec<Group<'_>> {
    let mut groups: Vec<Group<'_>> = Vec::new();
    for flight in flown {
        match groups.iter_mut().find(|group| group.scenario == &flight.scenario) {
            Some(group) => group.flights.push(flight),
            None => groups.push(Group {
                scenario: &flight.scenario,
                flights: vec![flight],
                csv_names: Vec::new(),
                figure_prefix: String::new(),
            }),
        }
    }
    let scenarios: Vec<_> = groups.iter().map(|group| group.scenario).collect();
    let mut taken = HashSet::new();
    for group in &mut groups {
        let stem = unique(&mut taken, distinct_stem(group.scenario, &scenarios));
        if scenarios.len() > 1 {
            group.figure_prefix = format!("{stem}-");
        }
        for flight in &group.flights {
            let name = unique(&mut taken, format!("{stem}-{}", slug(&flight.run.contender.name)));
            group.csv_names.push(format!("{name}.csv"));
        }
    }
    groups
}

/// The scenario's name with whatever tells it from others of that name.
fn distinct_stem(scenario: &Scenario, all: &[&Scenario]) -> String {
    let own = case_words(scenario);
    let mut name = slug(&scenario.name);
    let others: Vec<_> = all.iter().filter(|other| slug(&other.name) == name).map(|other| case_words(other)).collect();
    for (i, word) in own.iter().enumerate() {
        if others.iter().any(|other| other.get(i) != Some(word)) {
            name = format!("{name}-{word}");
        }
    }
    name
}

/// `name`, with a number if it is taken. Some file systems do not tell A from a.
fn unique(taken: &mut HashSet<String>, name: String) -> String {
    let mut candidate = name.clone();
    let mut number = 2;
    while !taken.insert(candidate.to_lowercase()) {
        candidate = format!("{name}-{number}");
        number += 1;
    }
    candidate
}

/// What every folder that this program writes holds: whose it is, and which files in it are.
const MARKER: &str = ".sitl.json";
/// Begins the names of what is none of the results.
const HIDDEN: &str = ".sitl.";

#[derive(Serialize, Deserialize)]
struct Marker {
    /// What follows `sitl` on the command line.
    command: String,
    /// Of what was flown.
    name: String,
    /// What the command has written, or is about to.
    files: BTreeSet<String>,
    checksum: String,
}

/// A folder that one command has for itself, and puts files into whole.
///
/// Nothing in it that the command has not written is ever replaced or removed, unless by force.
#[derive(Clone, Debug)]
pub struct Folder {
    path: PathBuf,
    command: String,
    name: String,
    force: bool,
}

impl Folder {
    /// The folder at `path` for what `sitl <command>` makes of `name`, created with its parents if need be. By `force`,
    /// files in the way may be replaced.
    ///
    /// # Errors
    /// If it cannot be written, or is neither empty nor the command's own; nothing has been touched then.
    pub fn open(path: &Path, command: &str, name: &str, force: bool) -> Result<Self, Error> {
        let folder = Folder::find(path, command, name, force)?;
        fs::create_dir_all(path).map_err(|source| Error::Write { path: path.into(), source })?;
        folder.add::<&str>(&[])?;
        Ok(folder)
    }

    /// As [`open`](Self::open), before anything is made.
    pub(crate) fn find(path: &Path, command: &str, name: &str, force: bool) -> Result<Self, Error> {
        let folder = Folder { path: path.into(), command: command.into(), name: name.into(), force };
        folder.files().map(|_| folder)
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    pub(crate) fn error(&self, name: &str, source: io::Error) -> Error {
        Error::Write { path: self.path.join(name), source }
    }

    fn foreign(&self, whose: String) -> Error {
        Error::Foreign { path: self.path.clone(), whose }
    }

    /// The files that the command has written here before.
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
        // They will be removed one day: nothing outside the folder may be among them.
        let is_plain = |name: &String| Path::new(name).file_name().is_some_and(|plain| plain == name.as_str());
        if marker.files.iter().all(is_plain) { Ok(Some(marker)) } else { Err(io::Error::other("a path in it")) }
    }

    /// Whether there is nothing, not even the folder; what a killed program may have left does not count.
    fn is_empty(&self) -> Result<bool, Error> {
        let entries = match fs::read_dir(&self.path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(true),
            entries => entries.map_err(|source| Error::Write { path: self.path.clone(), source })?,
        };
        Ok(entries.flatten().all(|entry| entry.file_name().to_string_lossy().starts_with(HIDDEN)))
    }

    /// Makes `names` the command's own, before they are written.
    ///
    /// # Errors
    /// If one is there already and not the command's.
    pub(crate) fn add<N: AsRef<str>>(&self, names: &[N]) -> Result<(), Error> {
        let mut files = self.files()?;
        for name in names.iter().map(N::as_ref) {
            let path = self.path.join(name);
            if files.insert(name.into()) && !self.force && fs::symlink_metadata(&path).is_ok() {
                return Err(Error::Foreign {
                    path,
                    whose: format!("in the way, and not from `sitl {}`", self.command),
                });
            }
        }
        self.mark(files)
    }

    /// As [`add`](Self::add), and removes whatever else the command has written here before: none of it belongs beside
    /// what comes now.
    pub(crate) fn only<N: AsRef<str>>(&self, names: &[N]) -> Result<(), Error> {
        let before = self.files()?;
        self.add(names)?;
        let now: BTreeSet<String> = names.iter().map(|name| name.as_ref().into()).collect();
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

    /// Lets `fill` write a file under a temporary name, then gives it its own; an interrupted or failed run leaves the
    /// file that was there before. What has its own name is on the disk, whatever happens to the power.
    pub(crate) fn place(
        &self,
        name: &str,
        fill: impl FnOnce(&mut (dyn Write + Send)) -> io::Result<()>,
    ) -> Result<PathBuf, Error> {
        let path = self.path.join(name);
        place(&path, fill).map_err(|source| Error::Write { path: path.clone(), source })?;
        Ok(path)
    }
}

/// Writes the file at `path` as [`Folder::place`] does.
pub(crate) fn place(path: &Path, fill: impl FnOnce(&mut (dyn Write + Send)) -> io::Result<()>) -> io::Result<()> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let temporary = path.with_file_name(format!("{HIDDEN}{name}.{}.tmp", std::process::id()));
    // Another program of this number may have been killed; where there is none, there is nothing to remove.
    let _ = fs::remove_file(&temporary);
    let written = File::create_new(&temporary).and_then(|file| {
        let mut out = BufWriter::new(Disk { file, failure: None });
        let filled = fill(&mut out).and_then(|()| out.flush());
        let (disk, _) = out.into_parts();
        filled.map_err(|error| disk.cause(error))?;
        disk.file.sync_all()
    });
    written.and_then(|()| fs::rename(&temporary, path)).inspect_err(|_| {
        // Nothing more can be done if this fails too.
        let _ = fs::remove_file(&temporary);
    })
}

/// Removes from the folder `dir` what a killed program has left half written.
pub(crate) fn sweep(dir: &Path) {
    for entry in fs::read_dir(dir).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if name.starts_with(HIDDEN) && name.ends_with(".tmp") {
            // What cannot be removed does no harm either.
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// A file that remembers why it could not be written.
pub(super) struct Disk {
    pub(super) file: File,
    /// The system's number.
    pub(super) failure: Option<i32>,
}

impl Disk {
    /// What the system said, if it said something: libraries wrap it so that its kind is lost.
    pub(super) fn cause(&self, error: io::Error) -> io::Error {
        self.failure.map_or(error, io::Error::from_raw_os_error)
    }
}

impl Write for Disk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes).inspect_err(|error| self.failure = error.raw_os_error())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}
