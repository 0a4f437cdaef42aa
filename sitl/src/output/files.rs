//! Names of files, and how they come into being.

use super::words::{case_words, slug};
use super::{Error, Flown};
use crate::scenario::Scenario;
use std::collections::HashSet;
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

/// A folder that files are put into whole.
pub(crate) struct Folder<'a>(&'a Path);

impl<'a> Folder<'a> {
    /// The folder at `dir`, created with its parents if need be.
    pub(crate) fn create(dir: &'a Path) -> Result<Self, Error> {
        fs::create_dir_all(dir).map_err(|source| Error { path: dir.into(), source })?;
        Ok(Folder(dir))
    }

    pub(crate) fn error(&self, name: &str, source: io::Error) -> Error {
        Error { path: self.0.join(name), source }
    }

    /// Lets `fill` write a file under a temporary name, then gives it its own; an interrupted or failed run leaves the
    /// file that was there before. What has its own name is on the disk, whatever happens to the power.
    pub(crate) fn place(
        &self,
        name: &str,
        fill: impl FnOnce(&mut (dyn Write + Send)) -> io::Result<()>,
    ) -> Result<PathBuf, Error> {
        let path = self.0.join(name);
        let temporary = self.0.join(format!(".{name}.{}.tmp", std::process::id()));
        let written = File::create(&temporary).and_then(|file| {
            let mut out = BufWriter::new(file);
            fill(&mut out)?;
            out.into_inner()?.sync_all()
        });
        written.and_then(|()| fs::rename(&temporary, &path)).map_err(|source| {
            // Nothing more can be done if this fails too.
            let _ = fs::remove_file(&temporary);
            self.error(name, source)
        })?;
        Ok(path)
    }
}
