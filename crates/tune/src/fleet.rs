//! Searches for the gains of several laws on several vehicles, with results kept in a folder.
//!
//! Each finished search becomes a file. The file is flushed to the disk before it gets its name. Starting again in the
//! same folder runs only the missing searches. The manifest lists everything that determines the results.

use crate::conditions::{Condition, conditions_on};
use crate::cost::{costs, mean};
use crate::flights::{held_out_on, training_on};
use crate::gains::vehicle_fragment;
use crate::search::{SearchOptions, search};
use crate::start::by_hand_on;
use afbc::Profile;
use afbc_files::seal;
use afbc_files::{self as files, Folder};
use afbc_scenario::Scenario;
use afbc_scenario::contender::{Contender, ControllerKind};
use afbc_vehicles::Vehicle;
use serde::{Deserialize, Serialize};
use std::error::Error;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// Name of the manifest's file, present from the beginning.
const MANIFEST: &str = "manifest.json";
/// Name of the folder with the gains of each vehicle.
pub const GAINS: &str = "gains";
/// Command that the folder records as its writer. `NAME` is the recorded name of the results.
const COMMAND: &str = "tune";
const NAME: &str = "fleet";

/// A search for the gains of one law on one vehicle.
pub struct GainSearch {
    vehicle: Vehicle,
    start: Contender,
    training: Vec<Scenario>,
    held_out: Vec<Scenario>,
    conditions: Vec<Condition>,
}

/// Name of each flight, with its costs before and after the search.
pub type Costs = Vec<(String, [f64; 2])>;

/// An error that can cross threads.
type SendError = Box<dyn Error + Send + Sync>;

/// Everything that determines the results in a folder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FleetManifest {
    /// Version of the program.
    pub program: String,
    /// Number of contenders that each search tries.
    pub budget: usize,
    /// Initial step size.
    pub step: f64,
    /// Seed of each search.
    pub seed: u64,
    /// Starting gains of the searches: `by hand` or `flying`.
    pub start: String,
    /// The folder's searches.
    pub searches: Vec<PlannedSearch>,
}

/// One search of a [`FleetManifest`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlannedSearch {
    /// Name of the vehicle.
    pub vehicle: String,
    /// Name of the law.
    pub law: String,
    /// Fingerprint of the vehicle, its flights and conditions, and the gains at the start.
    pub fingerprint: String,
}

/// Result of one search.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FleetOutcome {
    /// Description of the search.
    #[serde(flatten)]
    pub planned: PlannedSearch,
    /// Number of contenders tried.
    pub tries: usize,
    /// Costs of the starting and the found gains over the training flights, times the factors of the conditions.
    pub cost: [f64; 2],
    /// Mean costs of the starting and the found gains over the held-out flights.
    pub held_out: [f64; 2],
    /// Costs of the starting and the found gains in each training flight.
    pub training_flights: Costs,
    /// Costs of the starting and the found gains in each held-out flight.
    pub held_out_flights: Costs,
    /// Names of the conditions that the found gains do not meet.
    pub unmet: Vec<String>,
    /// Gains found, as tables of a vehicle file.
    pub gains: String,
}

/// A file with a checksum.
#[derive(Serialize, Deserialize)]
struct ChecksummedFile<T> {
    #[serde(flatten)]
    page: T,
    checksum: String,
}

impl GainSearch {
    /// Prepares a search for the gains of a law on `vehicle`. It starts at hand-tuned gains scaled by rule or, if
    /// `flying`, at the vehicle's present gains.
    ///
    /// # Errors
    /// The first number out of range, if the vehicle cannot fly one of the flights.
    pub fn new(kind: ControllerKind, vehicle: &Vehicle, flying: bool) -> Result<Self, Box<dyn Error>> {
        let start = if flying {
            Contender::of(kind, Profile::Flight).on(vehicle, Profile::Flight)?.monitored()
        } else {
            by_hand_on(kind, vehicle)
        };
        let bare = |scenario| without_gains(scenario, vehicle);
        let conditions = conditions_on(vehicle)?.into_iter();
        Ok(GainSearch {
            vehicle: vehicle.clone(),
            start,
            training: training_on(vehicle)?.into_iter().map(bare).collect(),
            held_out: held_out_on(vehicle)?.into_iter().map(bare).collect(),
            conditions: conditions
                .map(|condition| Condition { scenario: bare(condition.scenario), ..condition })
                .collect(),
        })
    }

    /// Returns the search's entry in a manifest.
    pub fn planned(&self) -> PlannedSearch {
        let conditions: Vec<_> = self
            .conditions
            .iter()
            .map(|Condition { scenario, rmse, end_m, jumps_n, of_afbc, by_rule }| {
                (scenario, rmse, end_m, jumps_n, of_afbc, by_rule)
            })
            .collect();
        PlannedSearch {
            vehicle: self.vehicle.name.clone(),
            law: self.start.kind().name().into(),
            fingerprint: afbc_files::seal::hash_of(&(&self.training, &self.held_out, conditions, &self.start)),
        }
    }

    /// Searches for gains. Calls `tried` with the number of new tries. If `tried` returns false, the search ends
    /// without a result.
    fn run(
        &self,
        course: SearchOptions,
        tried: impl Fn(usize) -> bool,
    ) -> Result<Option<FleetOutcome>, Box<dyn Error>> {
        let (mut before, mut goes_on) = (0, true);
        let found = search(&self.start, &self.training, &self.conditions, course, |tries, _| {
            goes_on = tried(tries - before);
            before = tries;
            goes_on
        })?;
        if !goes_on {
            return Ok(None);
        }
        let both = |flights: &[Scenario]| -> Result<Costs, Box<dyn Error>> {
            let (old, new) = (costs(flights, &self.start)?, costs(flights, &found.contender)?);
            let names = flights.iter().map(|flight| flight.name.clone());
            Ok(names.zip(old.into_iter().zip(new).map(|(old, new)| [old, new])).collect())
        };
        let (training_flights, held_out_flights) = (both(&self.training)?, both(&self.held_out)?);
        let mean_of = |pick: fn(&[f64; 2]) -> f64| {
            mean(&held_out_flights.iter().map(|(_, costs)| pick(costs)).collect::<Vec<_>>())
        };
        let held_out = [mean_of(|[old, _]| *old), mean_of(|[_, new]| *new)];
        let mut unmet = Vec::new();
        for condition in &self.conditions {
            if condition.factor(&found.contender)? > 1.0 {
                unmet.push(condition.scenario.name.clone());
            }
        }
        Ok(Some(FleetOutcome {
            planned: self.planned(),
            tries: found.evaluations,
            cost: [found.before, found.after],
            held_out,
            training_flights,
            held_out_flights,
            unmet,
            gains: vehicle_fragment(&found.contender, &self.vehicle),
        }))
    }
}

/// Returns `scenario` without parts that do not affect a given contender's flight: other contenders, and the gains in
/// the file of `vehicle`.
fn without_gains(mut scenario: Scenario, vehicle: &Vehicle) -> Scenario {
    scenario.contenders.clear();
    if let Some(file) = scenario.vehicle_file.as_mut().filter(|file| file.name == vehicle.name) {
        file.flight_gains = Profile::Flight.gains_for(&vehicle.parameters.to_f32(), vehicle.lag_s());
        file.flight_settings = Profile::Flight.settings_for(vehicle.force_max_n as f32, vehicle.lag_s());
    }
    scenario
}

/// A folder of results.
pub struct FleetResults {
    folder: Folder,
    course: SearchOptions,
    manifest: FleetManifest,
}

impl FleetResults {
    /// Opens the folder at `path` for the results of `searches`, and creates it if needed.
    ///
    /// # Errors
    /// One line if the folder cannot be written or holds anything else. Nothing has been changed then.
    pub fn open(
        path: &Path,
        searches: &[GainSearch],
        course: SearchOptions,
        flying: bool,
    ) -> Result<Self, Box<dyn Error>> {
        let manifest = FleetManifest {
            program: env!("CARGO_PKG_VERSION").into(),
            budget: course.budget,
            step: course.step,
            seed: course.seed,
            start: if flying { "flying" } else { "by hand" }.into(),
            searches: searches.iter().map(GainSearch::planned).collect(),
        };
        let cured = |error| match error {
            files::Error::Foreign { path, whose } => {
                format!("{}: {whose}; choose another folder, or delete the old one", path.display())
            }
            error => error.to_string(),
        };
        Folder::find(path, COMMAND, NAME, false).map_err(cured)?;
        let held = read::<FleetManifest>(&path.join(MANIFEST))?;
        if let Some(held) = held.as_ref().filter(|held| **held != manifest) {
            let what = held.differs(&manifest);
            return Err(format!(
                "{}: the folder holds searches {what}; choose another folder, or delete the old one",
                path.display()
            )
            .into());
        }
        let folder = Folder::open(path, COMMAND, NAME, false).map_err(cured)?;
        if held.is_none() {
            folder.add(&manifest.searches.iter().map(file_name).collect::<Vec<_>>())?;
            folder.add(&[MANIFEST, GAINS])?;
            write_sealed(&folder, MANIFEST, |out| put(out, &manifest))?;
        }
        Ok(FleetResults { folder, course, manifest })
    }

    /// Returns the result of a search, if it is finished.
    ///
    /// # Errors
    /// One line if the search's file cannot be read, is damaged or belongs to another search.
    pub fn outcome(&self, search: &GainSearch) -> Result<Option<FleetOutcome>, Box<dyn Error>> {
        let planned = search.planned();
        let path = self.folder.path().join(file_name(&planned));
        match read::<FleetOutcome>(&path)? {
            Some(outcome) if outcome.planned != planned => {
                Err(format!("{}: the file is the result of another search; delete it, and start again", path.display())
                    .into())
            }
            outcome => Ok(outcome),
        }
    }

    /// Runs the missing searches and returns all results in order; none if `stop` ended them. Calls `tried` with the
    /// number of new tries, from several threads.
    ///
    /// # Errors
    /// The first error. Finished searches are kept.
    pub fn complete(
        &self,
        searches: &[GainSearch],
        stop: &AtomicBool,
        tried: impl Fn(usize) + Sync,
    ) -> Result<Option<Vec<FleetOutcome>>, Box<dyn Error>> {
        let mut missing = Vec::new();
        for search in searches {
            if self.outcome(search)?.is_none() {
                missing.push(search);
            }
        }
        let (next, failure) = (AtomicUsize::new(0), Mutex::new(None));
        let drive = || {
            while let Some(search) = missing.get(next.fetch_add(1, Ordering::Relaxed)) {
                if stop.load(Ordering::Relaxed) {
                    return;
                }
                let done = self.search(search, stop, &tried);
                if let Err(error) = done {
                    // The other searches stop too, since the same command later runs what is missing.
                    stop.store(true, Ordering::Relaxed);
                    failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
                }
            }
        };
        // A single search leaves cores idle at the end of each generation. Other searches use them.
        let drivers = 1 + rayon::current_num_threads().div_ceil(8);
        // The scope joins the threads, so their handles are not needed.
        std::thread::scope(|scope| (0..drivers).for_each(|_| drop(scope.spawn(drive))));
        if let Some(error) = failure.into_inner().unwrap_or_else(PoisonError::into_inner) {
            return Err(error);
        }
        // Results are read from the files, so that those of this run and of earlier runs are reported alike.
        let outcomes: Vec<_> = searches.iter().map(|search| self.outcome(search)).collect::<Result<_, _>>()?;
        Ok(outcomes.into_iter().collect())
    }

    /// Runs one search and writes its file.
    fn search(&self, search: &GainSearch, stop: &AtomicBool, tried: &(impl Fn(usize) + Sync)) -> Result<(), SendError> {
        let goes_on = |tries| {
            tried(tries);
            !stop.load(Ordering::Relaxed)
        };
        let outcome = search.run(self.course, goes_on).map_err(|error| error.to_string())?;
        let Some(outcome) = outcome else { return Ok(()) };
        Ok(write_sealed(&self.folder, &file_name(&outcome.planned), |out| put(out, &outcome))?)
    }

    /// Writes the gains of each vehicle among `outcomes` as tables for its vehicle file. Returns the paths.
    ///
    /// # Errors
    /// If a file cannot be written, or was changed after it was written.
    pub fn write_gains(&self, outcomes: &[FleetOutcome]) -> Result<Vec<PathBuf>, Box<dyn Error>> {
        let folder = self.folder.path().join(GAINS);
        fs::create_dir_all(&folder).map_err(|source| files::Error::Write { path: folder.clone(), source })?;
        let mut paths = Vec::new();
        for vehicle in self.vehicles() {
            let path = folder.join(format!("{vehicle}.toml"));
            let text = self.gains_of(&vehicle, outcomes);
            match fs::read(&path) {
                Ok(held) if held == text.as_bytes() => {}
                // The same searches would write the same bytes, so somebody changed the file.
                Ok(_) => {
                    let cure = "move the file, and start again";
                    return Err(format!("{}: the file was changed after it was written; {cure}", path.display()).into());
                }
                Err(_) => files::write_atomically(&path, |out| out.write_all(text.as_bytes()))
                    .map_err(|source| files::Error::Write { path: path.clone(), source })?,
            }
            paths.push(path);
        }
        Ok(paths)
    }

    /// Returns the names of the vehicles, in order.
    pub fn vehicles(&self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for planned in &self.manifest.searches {
            if !names.contains(&planned.vehicle) {
                names.push(planned.vehicle.clone());
            }
        }
        names
    }

    /// Returns the gains of the laws on `vehicle`, as tables of its file. Backstepping's gains are left out, since it
    /// flies with AFBC's cascade.
    pub fn gains_of(&self, vehicle: &str, outcomes: &[FleetOutcome]) -> String {
        let FleetManifest { budget, step, seed, start, program, .. } = &self.manifest;
        let head =
            format!("# {program}: {budget} tries from gains {start}, step {step}, seed {seed} (docs/tuning.md).\n");
        let backstepping = ControllerKind::Backstepping.name();
        let own = outcomes.iter().filter(|outcome| outcome.planned.vehicle == vehicle);
        let gains = own.filter(|outcome| outcome.planned.law != backstepping).map(|outcome| outcome.gains.as_str());
        head + &gains.collect::<Vec<_>>().join("\n")
    }
}

impl FleetManifest {
    /// Returns the first difference, in words.
    fn differs(&self, wanted: &FleetManifest) -> String {
        let pairs = [
            ("program", self.program.clone(), wanted.program.clone()),
            ("budget", self.budget.to_string(), wanted.budget.to_string()),
            ("step", self.step.to_string(), wanted.step.to_string()),
            ("seed", self.seed.to_string(), wanted.seed.to_string()),
            ("start", self.start.clone(), wanted.start.clone()),
        ];
        let name = |searches: &[PlannedSearch]| searches.iter().map(file_name).collect::<Vec<_>>();
        match pairs.into_iter().find(|(_, held, wanted)| held != wanted) {
            Some((what, held, wanted)) => format!("with {what} {held}, not {wanted}"),
            None if name(&self.searches) != name(&wanted.searches) => "for other laws or vehicles".into(),
            None => "with other flights, vehicles or starting gains".into(),
        }
    }
}

fn file_name(planned: &PlannedSearch) -> String {
    format!("{}.{}.json", planned.vehicle, planned.law)
}

/// Writes a file with its own checksum. Such a checksum locates damage better than the folder's.
fn write_sealed(
    folder: &Folder,
    name: &str,
    fill: impl FnOnce(&mut (dyn Write + Send)) -> io::Result<()>,
) -> Result<(), files::Error> {
    files::write_atomically(&folder.path().join(name), fill).map_err(|source| folder.error(name, source))
}

fn put(out: &mut dyn Write, page: &impl Serialize) -> io::Result<()> {
    seal::json(out, &ChecksummedFile { page, checksum: seal::OPEN.into() })
}

/// Reads a file and verifies its checksum. Returns none if there is no file.
fn read<T: for<'a> Deserialize<'a>>(path: &Path) -> Result<Option<T>, Box<dyn Error>> {
    let bytes = match fs::read(path) {
        Err(error) if matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory) => {
            return Ok(None);
        }
        bytes => {
            bytes.map_err(|error| format!("{}: the file cannot be read ({error}); make it readable", path.display()))?
        }
    };
    let damaged =
        |problem: String| format!("{}: the file is damaged ({problem}); delete it, and start again", path.display());
    seal::verify(&mut io::Cursor::new(&bytes)).map_err(|error| damaged(error.to_string()))?;
    let page: ChecksummedFile<T> = serde_json::from_slice(&bytes).map_err(|error| damaged(error.to_string()))?;
    Ok(Some(page.page))
}
