//! `sitl params`: converts the parameters of a vehicle from and to files of ground stations.

use super::terminal::{CommandError, print, say};
use afbc_files::read::params::{ParameterEntry, ParameterFormat, read, written};
use afbc_files::read::words::out_of_range;
use afbc_files::read::{FileError, SourceFile};
use afbc_files::{FlashFile, OutputFile};
use afbc_onboard::parameters::{Kept, Parameter, ParameterTable, RecordChange};
use afbc_scenario::vehicle_named;
use afbc_store::{Error, RecordName, Store, hash};
use afbc_vehicles::Vehicle;
use clap::{Args, Subcommand, ValueEnum};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Export, import or compare the parameters of a vehicle, as files of QGroundControl (.params) and MAVProxy (.parm)
///
/// See docs/storage.md.
#[derive(Args, Debug)]
pub(crate) struct ParamsArgs {
    #[command(subcommand)]
    action: ParamsAction,
}

#[derive(Debug, Subcommand)]
enum ParamsAction {
    /// Print all parameters, or write them to a file
    Export {
        #[command(flatten)]
        of: ParameterSourceArgs,
        /// File to write; the ending .parm selects MAVProxy's format, any other QGroundControl's [default: standard
        /// output]
        #[arg(long, short, value_name = "FILE")]
        out: Option<PathBuf>,
        /// Replace an existing file
        #[arg(long, requires = "out")]
        force: bool,
        /// Format, regardless of the file's name
        #[arg(long, value_enum)]
        format: Option<ParameterFormatArg>,
    },
    /// Put the values of a file into a store, which is created if missing; if one value is refused, none is stored
    Import {
        /// File of parameters, in either format
        file: PathBuf,
        #[command(flatten)]
        of: ParameterSourceArgs,
    },
    /// Print the parameters that differ from the vehicle's defaults, in a parameter file or in the store
    Diff {
        /// File of parameters, in either format
        file: Option<PathBuf>,
        #[command(flatten)]
        of: ParameterSourceArgs,
    },
}

/// Whose parameters.
#[derive(Args, Clone, Debug)]
struct ParameterSourceArgs {
    /// Name of a built-in vehicle, or path of a vehicle file
    #[arg(long, value_name = "VEHICLE", default_value = "paper")]
    vehicle: PathBuf,
    /// File with the store of the vehicle's parameters
    #[arg(long, value_name = "FILE")]
    store: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum ParameterFormatArg {
    Qgc,
    Mavproxy,
}

impl ParamsArgs {
    /// Runs the requested action.
    pub(super) fn run(self) -> Result<ExitCode, CommandError> {
        let (ParamsAction::Export { of, .. } | ParamsAction::Import { of, .. } | ParamsAction::Diff { of, .. }) =
            &self.action;
        let vehicle = vehicle_named(&of.vehicle)?;
        act(&self.action, &vehicle)?;
        Ok(ExitCode::SUCCESS)
    }
}

fn act(action: &ParamsAction, vehicle: &Vehicle) -> Result<(), CommandError> {
    let mut table = ParameterTable::new(vehicle.configuration()?);
    match action {
        ParamsAction::Export { of, out, force, format } => {
            if let Some(path) = &of.store {
                load(&mut table, &mut open(path, vehicle, FlashFile::open_existing)?, path)?;
            }
            let mavproxy = out.as_ref().and_then(|out| out.extension()).is_some_and(|extension| extension == "parm");
            let format = match format {
                Some(ParameterFormatArg::Qgc) => ParameterFormat::Qgc,
                Some(ParameterFormatArg::Mavproxy) => ParameterFormat::Mavproxy,
                None if mavproxy => ParameterFormat::Mavproxy,
                None => ParameterFormat::Qgc,
            };
            let entries = table.iter().map(|it| (it.name, it.value, it.kind.number()));
            let text = written(format, &vehicle.name, entries);
            match out {
                Some(out) => OutputFile::forcible(out, "--out", *force)?.write(|to| to.write_all(text.as_bytes()))?,
                None => print(&text)?,
            }
        }
        ParamsAction::Import { file, of } => {
            let Some(path) = &of.store else { return Err("--store is missing; name the file to import into".into()) };
            // The file is first applied to a copy of the table, so that a rejected file neither creates nor changes a
            // store.
            let changes = take(&mut table.clone(), file)?;
            let mut store = open(path, vehicle, FlashFile::open)?;
            store.make_room().map_err(|error| failed(path, &error))?;
            load(&mut table, &mut store, path)?;
            // The file is applied again, on top of the stored values.
            take(&mut table, file)?;
            for name in &changes {
                keep(&table, &mut store, *name).map_err(|error| failed(path, &error))?;
            }
            print(&format!("{}: {} parameters, {}\n", path.display(), changes.len(), differing(&table).len()))?;
        }
        ParamsAction::Diff { file, of } => {
            if let Some(path) = &of.store {
                load(&mut table, &mut open(path, vehicle, FlashFile::open_existing)?, path)?;
            }
            if let Some(file) = file {
                take(&mut table, file)?;
            }
            let line = |(now, image): &(Parameter, f32)| format!("{:<16} {image} -> {}\n", now.name, now.value);
            print(&differing(&table).iter().map(line).collect::<String>())?;
        }
    }
    Ok(())
}

/// Stores the current value of a parameter.
fn keep(table: &ParameterTable, store: &mut Store<FlashFile>, name: RecordName) -> Result<(), StoreError> {
    let (Some(now), Some(image)) = (table.get(name), table.default_of(name)) else { return Ok(()) };
    let change = RecordChange::Set(name, (now.value.to_bits() != image.value.to_bits()).then_some(now.value));
    match Kept::NOW.keep(store, change) {
        Err(Error::NeedsErase) => {
            store.make_room()?;
            Kept::NOW.keep(store, change)
        }
        done => done,
    }
}

/// Error of storing a value in a file.
type StoreError = Error<afbc_files::FlashError>;

fn failed(path: &Path, error: &StoreError) -> String {
    format!("{}: {error}", path.display())
}

fn open(
    path: &Path,
    vehicle: &Vehicle,
    flash: fn(&Path) -> std::io::Result<FlashFile>,
) -> Result<Store<FlashFile>, CommandError> {
    let flash = flash(path).map_err(|error| format!("{}: {error}", path.display()))?;
    Ok(Store::open(flash, 0, hash(vehicle.name.as_bytes())).map_err(|error| failed(path, &error))?)
}

/// Sets `table` to the stored values; prints a notice about values that are not used.
fn load(table: &mut ParameterTable, store: &mut Store<FlashFile>, path: &Path) -> Result<(), CommandError> {
    let notice = |notice| say(&format!("{}: {notice}", path.display()));
    Ok(Kept::NOW.load(table, store, notice).map_err(|error| failed(path, &error))?)
}

/// Sets `table` to the values in a file; returns their names.
fn take(table: &mut ParameterTable, file: &Path) -> Result<Vec<RecordName>, CommandError> {
    let shown = file.display().to_string();
    let text = fs::read_to_string(file).map_err(|error| format!("{shown}: cannot be read ({error})"))?;
    let source = SourceFile { file: &shown, text: &text };
    let mut names = Vec::new();
    for ParameterEntry { name, value, at } in read(&shown, &text)? {
        let unknown = || FileError::at(source, at, &name, "no such parameter; `sitl params export` lists them");
        let known = RecordName::new(&name).ok_or_else(unknown)?;
        table.get(known).ok_or_else(unknown)?;
        // The reason already begins with the name.
        table.put(known, value).map_err(|reason| FileError::at(source, at, "", reason.as_str()))?;
        names.push(known);
    }
    table
        .check()
        .map_err(|error| FileError::whole(&shown, format!("{}; the vehicle could not fly", out_of_range(&error))))?;
    Ok(names)
}

/// Returns the parameters that differ from their defaults, with the defaults.
fn differing(table: &ParameterTable) -> Vec<(Parameter, f32)> {
    let image = |parameter: &Parameter| table.default_of(parameter.name).map_or(f32::NAN, |image| image.value);
    let both = table.iter().map(|parameter| (parameter, image(&parameter)));
    both.filter(|(now, image)| now.value.to_bits() != image.to_bits()).collect()
}
