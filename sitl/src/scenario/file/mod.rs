//! Scenario files. The format is described, key by key, in `docs/scenarios.md`.

mod contenders;
mod control;
mod environment;
mod motion;
mod realism;
mod sensors;
mod trajectory;
mod vehicle;

#[cfg(test)]
mod tests;

use super::error::{FileError, Source};
use super::reader::Table;
use super::words::out_of_range;
use super::{Contender, DURATION, Scenario};
use crate::trajectory::Trajectory;
use afbc_plant::Model;
use afbc_types::{Parameters, Range};
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;
use toml::de::DeTable;

/// Length of a flight that does not say how long it is \[s\].
const DURATION_S: f64 = 60.0;
/// Accepted seeds.
const SEED: Range = Range::new("seed", 0.0, 1e9);
/// Longest scenario name.
const NAME_LENGTH: usize = 64;
/// Largest file that is read at all \[bytes\].
const FILE_SIZE: u64 = 1 << 20;

/// Reads and checks the scenario file at `path`.
///
/// # Errors
/// One line on the first thing that is wrong.
pub fn load(path: &Path) -> Result<Scenario, FileError> {
    let text = text(path, "scenario")?;
    let stem = path.file_stem().map_or("".into(), |stem| stem.to_string_lossy());
    parse(&path.display().to_string(), &text, &stem)
}

/// The text of a file of this `kind`, of which there are built-in ones too.
pub(crate) fn text(path: &Path, kind: &str) -> Result<String, FileError> {
    let read = || {
        let mut text = String::new();
        let read = File::open(path)?.take(FILE_SIZE + 1).read_to_string(&mut text)?;
        if read as u64 > FILE_SIZE { Err(io::ErrorKind::FileTooLarge.into()) } else { Ok(text) }
    };
    read().map_err(|error: io::Error| {
        let problem = match error.kind() {
            io::ErrorKind::NotFound => format!("no such file; `sitl {kind}s` lists the built-in ones"),
            io::ErrorKind::IsADirectory => format!("it is a folder; name a {kind} file in it"),
            io::ErrorKind::InvalidData => "it is not UTF-8 text; save it as UTF-8".into(),
            io::ErrorKind::FileTooLarge => {
                format!("it is larger than 1 MiB, too large for a {kind}; name another file")
            }
            _ => format!("it cannot be read ({error}); check its permissions"),
        };
        FileError::whole(&path.display().to_string(), problem)
    })
}

/// Reads and checks a scenario from its `text`. Errors call it `file`; `name` is its name if it gives none itself.
///
/// # Errors
/// One line on the first thing that is wrong.
pub fn parse(file: &str, text: &str, name: &str) -> Result<Scenario, FileError> {
    document(file, text, "scenarios hover", |root| read(root, name, None))
}

/// Lets `read` make something of the `text` of a TOML file; `sitl SAMPLE` prints one that is right.
pub(crate) fn document<T>(
    file: &str,
    text: &str,
    sample: &str,
    read: impl FnOnce(Table<'_>) -> Result<T, FileError>,
) -> Result<T, FileError> {
    let source = Source { file, text };
    let document = DeTable::parse(text).map_err(|error| syntax(source, &error, sample))?;
    read(Table::root(source, document.get_ref()))
}

/// Name and description; `name` if there is none.
pub(crate) fn title(root: &mut Table<'_>, name: &str) -> Result<[String; 2], FileError> {
    let name = root.text("name")?.unwrap_or(name).to_owned();
    if !is_file_name(&name) {
        let cure = "it must be 1 to 64 letters, digits, '-' or '_', since file names come from it";
        return Err(root.fault_at("name", format!("\"{name}\" cannot be a name; {cure}")));
    }
    let description = root.text("description")?.unwrap_or_default().to_owned();
    if description.chars().any(char::is_control) {
        return Err(root.fault_at("description", "it has line breaks or control characters; make it one plain line"));
    }
    Ok([name, description])
}

/// The scenario in `root`; `name` and `trajectory` are its own if it gives none itself.
pub(crate) fn read(mut root: Table<'_>, name: &str, trajectory: Option<&Trajectory>) -> Result<Scenario, FileError> {
    let [name, description] = title(&mut root, name)?;
    let duration_s = root.number(&DURATION)?.unwrap_or(DURATION_S);
    let models = [Model::Simplified, Model::RigidBody];
    let seed = root.whole(&SEED)?.unwrap_or(0);
    let model = root.choice("plant", &models, Model::name)?.unwrap_or(Model::RigidBody);

    let vehicle = vehicle::read(root.table("vehicle")?, Parameters::PAPER)?;
    let truth = vehicle::read(root.table("truth")?, vehicle)?;
    let contenders = contenders::read(&mut root, &vehicle.to_f32())?;
    let trajectory = match (root.table("trajectory")?, trajectory) {
        (Some(table), _) => trajectory::read(table)?,
        (None, Some(trajectory)) => trajectory.clone(),
        (None, None) => {
            let cure = "add [trajectory] with kind = \"hover\" and position_m = [0, 0, 1]";
            return Err(root.missing("trajectory", cure));
        }
    };
    let initial = motion::initial(root.table("initial")?, &trajectory.at(0.0))?;
    let environment = environment::read(&mut root, truth)?;
    let step_s = contenders.first().map_or(afbc::cascade::DT.max, Contender::step_s);
    let realism = realism::read(&mut root, &truth, step_s)?;
    let sensing = sensors::read(root.table("sensors")?)?;
    let outages = environment::outages(&mut root)?;
    let flight_core = root.boolean("flight_core")?.unwrap_or(false);

    let scenario = Scenario {
        name,
        description,
        case: None,
        duration_s,
        model,
        vehicle,
        environment,
        realism,
        sensing,
        outages,
        flight_core,
        seed,
        initial,
        trajectory,
        contenders,
    };
    scenario.check_flight_core().map_err(|error| {
        let cure = "change that, or leave flight_core out";
        root.fault_at("flight_core", format!("it cannot fly with {}; {cure}", out_of_range(&error)))
    })?;
    // Whatever the tables have let through, no flight begins with.
    scenario.check().map_err(|error| root.fault(error.range.name, format!("{}; change it", out_of_range(&error))))?;
    root.finish()?;
    Ok(scenario)
}

/// What keeps a text from being TOML.
fn syntax(source: Source<'_>, error: &toml::de::Error, sample: &str) -> FileError {
    let span = error.span().unwrap_or_default();
    let near = source.text.get(span.clone()).and_then(|text| text.lines().next()).unwrap_or_default();
    let near: String = near.chars().take(40).collect();
    let near = if near.is_empty() { near } else { format!(" near `{near}`") };
    let problem = format!("{}{near}; `sitl {sample}` prints a file to compare with", error.message());
    FileError::at(source, span.start, "syntax", problem)
}

/// Safe as a part of a file name on every system.
fn is_file_name(name: &str) -> bool {
    let safe = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'-' || byte == b'_';
    (1..=NAME_LENGTH).contains(&name.len()) && name.bytes().all(safe)
}
