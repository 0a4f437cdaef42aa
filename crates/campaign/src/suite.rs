//! Suites: named lists of flights, with published results for comparison. `docs/suites.md` describes the format.

use crate::compare;
use crate::file::named;
use afbc_files::read::{BuiltIn, Example, FileError, LIKE, Table};
use afbc_scenario::Scenario;
use afbc_scenario::contender::Contender;
use afbc_types::Range;
use std::ffi::OsStr;
use std::path::Path;

const SAMPLE: Example = Example { command: "suites field", text: "" };

/// A named list of flights.
#[derive(Clone, Debug, PartialEq)]
pub struct Suite {
    /// Short name, used in file names.
    pub name: String,
    /// Description in one line.
    pub description: String,
    /// Sources of the published figures.
    pub sources: Vec<Citation>,
    /// Flights, in order. The contenders of each scenario are replaced by those that fly the suite.
    pub flights: Vec<SuiteFlight>,
}

/// Source of published figures.
#[derive(Clone, Debug, PartialEq)]
pub struct Citation {
    /// Short name, to which published figures refer.
    pub name: String,
    /// The publication, and where in it the figures are.
    pub citation: String,
    /// Difference between the published flights and these.
    pub differs: String,
}

/// A flight of a suite.
#[derive(Clone, Debug, PartialEq)]
pub struct SuiteFlight {
    /// Scenario to fly.
    pub scenario: Scenario,
    /// Tilt limit that every contender gets at least \[rad\]; none leaves the limits as they are.
    pub tilt_max_rad: Option<f64>,
    /// Published figures of this flight.
    pub published: Vec<PublishedFigure>,
}

/// A published figure.
#[derive(Clone, Debug, PartialEq)]
pub struct PublishedFigure {
    /// Name of the law that was flown.
    pub law: String,
    /// Root mean square distance from the reference \[m\].
    pub rms_m: f64,
    /// Index of the figure's source in the suite's list.
    pub source: usize,
}

/// All built-in suites.
pub static SUITES: [BuiltIn<Suite>; 3] = [
    BuiltIn::new("field", include_str!("../suites/field.toml"), read),
    BuiltIn::new("faults", include_str!("../suites/faults.toml"), read),
    BuiltIn::new("sensors", include_str!("../suites/sensors.toml"), read),
];

/// Accepted tilt limits \[rad\].
const TILT_MAX: Range = Range::new("tilt_max_rad", 0.05, 1.2);
/// Accepted published distances \[m\].
const RMS: Range = Range::new("rms_m", 0.0, 1000.0);
/// Keys of a flight that a flight with `like` does not copy.
const OWN: [&str; 4] = ["name", "description", "published", LIKE];

impl Suite {
    /// Returns the suite's scenarios with `contenders`, each with its gains for the scenario's vehicle.
    ///
    /// # Errors
    /// One line about a gain or setting out of range.
    pub fn under(&self, contenders: &[Contender]) -> Result<Vec<Scenario>, FileError> {
        let put = |flight: &SuiteFlight| {
            let mut scenario = flight.scenario.clone();
            compare::fly_under(&mut scenario, contenders)?;
            if let Some(tilt_max_rad) = flight.tilt_max_rad {
                compare::free_to_tilt(&mut scenario, tilt_max_rad);
            }
            Ok(scenario)
        };
        self.flights.iter().map(put).collect()
    }
}

/// Reads and checks a suite from its `text`. `file` is its path in error messages, `name` its name unless the text
/// gives one. Paths of scenario files are relative to `folder`.
///
/// # Errors
/// The first mistake, as one line.
pub fn parse(file: &str, text: &str, name: &str, folder: &Path) -> Result<Suite, FileError> {
    afbc_files::read::document_with_inheritance(file, text, SAMPLE, ("flight", &OWN), |mut root| {
        let [name, description] = afbc_files::read::title(&mut root, name)?;
        let sources: Vec<Citation> = root.few_tables("source")?.into_iter().map(source).collect::<Result<_, _>>()?;
        let mut flights: Vec<SuiteFlight> = Vec::new();
        for table in root.few_tables("flight")? {
            flights.push(flight(table, &sources, &flights, folder)?);
        }
        if flights.is_empty() {
            return Err(root.missing("flight", "add a [[flight]] with a name and a scenario for each flight"));
        }
        root.finish()?;
        Ok(Suite { name, description, sources, flights })
    })
}

/// Returns the error for an unknown suite `name`.
pub fn unknown(name: &str) -> FileError {
    let cure = match BuiltIn::similar(&SUITES, name) {
        Some(known) => format!("did you mean {}?", known.name),
        None => "`sitl suites` lists the built-in suites; for a file, write its path, as in ./my.toml".into(),
    };
    FileError::whole(name, format!("no such suite; {cure}"))
}

/// Reads and checks the suite at `path`. A plain name means a built-in suite, else a file.
///
/// # Errors
/// The first mistake, as one line.
pub fn suite_at(path: &Path) -> Result<Suite, FileError> {
    let plain = path.to_str().filter(|text| !text.contains(['/', '\\', '.']));
    if let Some(name) = plain {
        match BuiltIn::named(&SUITES, name) {
            Some(known) => return known.read(),
            None if !path.exists() => return Err(unknown(name)),
            None => {}
        }
    }
    let text = afbc_files::read::text(path, "suite")?;
    let stem = path.file_stem().map_or("".into(), OsStr::to_string_lossy);
    parse(&path.display().to_string(), &text, &stem, path.parent().unwrap_or(Path::new("")))
}

/// Reads a built-in suite.
fn read(file: &str, text: &str, name: &str) -> Result<Suite, FileError> {
    parse(file, text, name, Path::new(""))
}

fn source(mut table: Table<'_>) -> Result<Citation, FileError> {
    let mut text = |key, cure| table.need_text(key, cure).map(str::to_owned);
    let name = text("name", "give the source a name, to which published figures refer")?;
    let citation = text("citation", "say who published what, and where")?;
    let differs = text("differs", "say how the published flights differ from this suite's")?;
    table.finish()?;
    Ok(Citation { name, citation, differs })
}

fn flight(
    mut table: Table<'_>,
    sources: &[Citation],
    earlier: &[SuiteFlight],
    folder: &Path,
) -> Result<SuiteFlight, FileError> {
    let names = || earlier.iter().map(|flight| flight.scenario.name.as_str());
    let name = table.need_text("name", "give the flight a name")?;
    if names().any(|other| other == name) {
        return Err(table.fault_at("name", format!("\"{name}\" is the name of another flight; choose another")));
    }
    if let Some(like) = table.text(LIKE)?.filter(|like| names().all(|other| other != *like)) {
        return Err(table.fault_at(
            LIKE,
            format!("no flight above is called \"{like}\"; name a flight that stands above this one"),
        ));
    }
    let published = table.few_tables("published")?.into_iter().map(|table| figure(table, sources));
    let published = published.collect::<Result<_, _>>()?;
    let tilt_max_rad = table.number(&TILT_MAX)?;
    for key in ["controllers", "contender", "profile", "monitor"] {
        table.forbid(key, "a suite is flown by the contenders of `sitl compare`; leave this key out")?;
    }
    let scenario = match table.text("scenario")? {
        Some(file) => {
            let mut scenario = Scenario { name: name.into(), ..named(&table, "scenario", file, folder)? };
            if let Some(description) = table.text("description")? {
                scenario.description = description.into();
            }
            table.finish()?;
            scenario
        }
        None => afbc_scenario::read(table, name, None)?,
    };
    Ok(SuiteFlight { scenario, tilt_max_rad, published })
}

fn figure(mut table: Table<'_>, sources: &[Citation]) -> Result<PublishedFigure, FileError> {
    let law = table.need_text("law", "say who flew")?.to_owned();
    let rms_m = table.need_number(&RMS)?;
    let name = table.need_text("source", "name a [[source]] that this file declares")?;
    let source = sources.iter().position(|source| source.name == name);
    let source =
        source.ok_or_else(|| table.fault_at("source", format!("\"{name}\" is no [[source]] of this file; add it")))?;
    table.finish()?;
    Ok(PublishedFigure { law, rms_m, source })
}
