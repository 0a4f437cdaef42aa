//! Searches for the gains of several laws on several vehicles, kept in a folder.
//!
//! Each finished search is a file of its own, which is on the disk before it gets its name. Starting again in the same
//! folder does only what is missing. The manifest holds what decides the results.

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

/// File of the manifest, present from the beginning.
const MANIFEST: &str = "manifest.json";
/// Folder of the gains of each vehicle.
pub const GAINS: &str = "gains";
/// Command recorded in the folder, and what it made.
const COMMAND: &str = "tune";
const NAME: &str = "fleet";

/// One law on one vehicle.
pub struct Search {
    vehicle: Vehicle,
    start: Contender,
    training: Vec<Scenario>,
    held_out: Vec<Scenario>,
    conditions: Vec<Condition>,
}

/// Name and two costs of each flight.
pub type Costs = Vec<(String, [f64; 2])>;

/// A failure that can cross threads.
type Failure = Box<dyn Error + Send + Sync>;

/// What decides the results in a folder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FleetManifest {
    /// Version of the program.
    pub program: String,
    /// Tries of each search.
    pub budget: usize,
    /// Initial step size.
    pub step: f64,
    /// Seed of each search.
    pub seed: u64,
    /// Where the searches start: `by hand` or `flying`.
    pub start: String,
    /// The searches.
    pub searches: Vec<Planned>,
}

/// One search of a [`FleetManifest`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Planned {
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
    /// What was searched.
    #[serde(flatten)]
    pub planned: Planned,
    /// Number of contenders tried.
    pub tries: usize,
    /// Cost over the training flights, times the factors of the conditions, of start and result.
    pub cost: [f64; 2],
    /// Mean cost over the held-out flights of both.
    pub held_out: [f64; 2],
    /// Cost of each training flight of both.
    pub training_flights: Costs,
    /// Cost of each held-out flight of both.
    pub held_out_flights: Costs,
    /// Conditions that the result does not meet.
    pub unmet: Vec<String>,
    /// The gains, as tables of a vehicle's file.
    pub gains: String,
}

/// A file with a checksum.
#[derive(Serialize, Deserialize)]
struct Page<T> {
    #[serde(flatten)]
    page: T,
    checksum: String,
}

impl Search {
    /// Prepares the search for the gains of this law on `vehicle`, from hand-tuned gains by rule or, if `flying`, from
    /// those that fly.
    ///
    /// # Errors
    /// What the vehicle cannot fly.
    pub fn new(kind: ControllerKind, vehicle: &Vehicle, flying: bool) -> Result<Self, Box<dyn Error>> {
        let start = if flying {
            Contender::of(kind, Profile::Flight).on(vehicle, Profile::Flight)?.monitored()
        } else {
            by_hand_on(kind, vehicle)
        };
        let bare = |scenario| without_gains(scenario, vehicle);
        let conditions = conditions_on(vehicle)?.into_iter();
        Ok(Search {
            vehicle: vehicle.clone(),
            start,
            training: training_on(vehicle)?.into_iter().map(bare).collect(),
            held_out: held_out_on(vehicle)?.into_iter().map(bare).collect(),
            conditions: conditions
                .map(|condition| Condition { scenario: bare(condition.scenario), ..condition })
                .collect(),
        })
    }

    /// Returns its entry in a manifest.
    pub fn planned(&self) -> Planned {
        let conditions: Vec<_> = self
            .conditions
            .iter()
            .map(|Condition { scenario, rmse, end_m, jumps_n, of_afbc, by_rule }| {
                (scenario, rmse, end_m, jumps_n, of_afbc, by_rule)
            })
            .collect();
        Planned {
            vehicle: self.vehicle.name.clone(),
            law: self.start.kind().name().into(),
            fingerprint: afbc_files::seal::hash_of(&(&self.training, &self.held_out, conditions, &self.start)),
        }
    }

    /// Searches. `tried` is called with the number of new tries, and ends the search by returning false: then there is
    /// no result.
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

/// Returns `scenario` without what does not decide how a given contender flies it: other contenders, and the gains in
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
pub struct Results {
    place: Folder,
    course: SearchOptions,
    manifest: FleetManifest,
}

impl Results {
    /// Opens the folder at `path`, created if needed, for the results of `searches`.
    ///
    /// # Errors
    /// One line, if it cannot be written or holds anything else; nothing has been changed then.
    pub fn open(path: &Path, searches: &[Search], course: SearchOptions, flying: bool) -> Result<Self, Box<dyn Error>> {
        let manifest = FleetManifest {
            program: env!("CARGO_PKG_VERSION").into(),
            budget: course.budget,
            step: course.step,
            seed: course.seed,
            start: if flying { "flying" } else { "by hand" }.into(),
            searches: searches.iter().map(Search::planned).collect(),
        };
        let cured = |error| match error {
            files::Error::Foreign { path, whose } => {
                format!("{}: {whose}; choose another folder, or delete it", path.display())
            }
            error => error.to_string(),
        };
        Folder::find(path, COMMAND, NAME, false).map_err(cured)?;
        let held = read::<FleetManifest>(&path.join(MANIFEST))?;
        if let Some(held) = held.as_ref().filter(|held| **held != manifest) {
            let what = held.differs(&manifest);
            return Err(
                format!("{}: holds searches {what}; choose another folder, or delete it", path.display()).into()
            );
        }
        let place = Folder::open(path, COMMAND, NAME, false).map_err(cured)?;
        if held.is_none() {
            place.add(&manifest.searches.iter().map(file_name).collect::<Vec<_>>())?;
            place.add(&[MANIFEST, GAINS])?;
            place_sealed(&place, MANIFEST, |out| put(out, &manifest))?;
        }
        Ok(Results { place, course, manifest })
    }

    /// Returns the result of a search, if it is finished.
    ///
    /// # Errors
    /// One line, if its file cannot be read, is damaged or not of this search.
    pub fn outcome(&self, search: &Search) -> Result<Option<FleetOutcome>, Box<dyn Error>> {
        let planned = search.planned();
        let path = self.place.path().join(file_name(&planned));
        match read::<FleetOutcome>(&path)? {
            Some(outcome) if outcome.planned != planned => {
                Err(format!("{}: the result of another search; delete it, and start again", path.display()).into())
            }
            outcome => Ok(outcome),
        }
    }

    /// Searches what is missing, and returns all results in order; none if `stop` ended it. `tried` is called with the
    /// number of new tries, from several threads.
    ///
    /// # Errors
    /// The first that occurs; finished searches are kept.
    pub fn complete(
        &self,
        searches: &[Search],
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
                    // The others need not go on for hours: the same command does what is missing.
                    stop.store(true, Ordering::Relaxed);
                    failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
                }
            }
        };
        // One search leaves cores idle at the end of each generation, where others fill in.
        let drivers = 1 + rayon::current_num_threads().div_ceil(8);
        // The scope joins them, so handles are of no use.
        std::thread::scope(|scope| (0..drivers).for_each(|_| drop(scope.spawn(drive))));
        if let Some(error) = failure.into_inner().unwrap_or_else(PoisonError::into_inner) {
            return Err(error);
        }
        // From the files, so that a search of this run and one of an earlier run are reported alike.
        let outcomes: Vec<_> = searches.iter().map(|search| self.outcome(search)).collect::<Result<_, _>>()?;
        Ok(outcomes.into_iter().collect())
    }

    /// Does one search and writes its file.
    fn search(&self, search: &Search, stop: &AtomicBool, tried: &(impl Fn(usize) + Sync)) -> Result<(), Failure> {
        let goes_on = |tries| {
            tried(tries);
            !stop.load(Ordering::Relaxed)
        };
        let outcome = search.run(self.course, goes_on).map_err(|error| error.to_string())?;
        let Some(outcome) = outcome else { return Ok(()) };
        Ok(place_sealed(&self.place, &file_name(&outcome.planned), |out| put(out, &outcome))?)
    }

    /// Writes the gains of each vehicle among `outcomes`, ready to go into its file; returns the files.
    ///
    /// # Errors
    /// If one cannot be written.
    pub fn write_gains(&self, outcomes: &[FleetOutcome]) -> Result<Vec<PathBuf>, Box<dyn Error>> {
        let folder = self.place.path().join(GAINS);
        fs::create_dir_all(&folder).map_err(|source| files::Error::Write { path: folder.clone(), source })?;
        let mut paths = Vec::new();
        for vehicle in self.vehicles() {
            let path = folder.join(format!("{vehicle}.toml"));
            let text = self.gains_of(&vehicle, outcomes);
            match fs::read(&path) {
                Ok(held) if held == text.as_bytes() => {}
                // The same searches write the same bytes.
                Ok(_) => {
                    let cure = "move it, and start again";
                    return Err(format!("{}: changed since it was written; {cure}", path.display()).into());
                }
                Err(_) => files::place(&path, |out| out.write_all(text.as_bytes()))
                    .map_err(|source| files::Error::Write { path: path.clone(), source })?,
            }
            paths.push(path);
        }
        Ok(paths)
    }

    /// Names of the vehicles, in order.
    pub fn vehicles(&self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for planned in &self.manifest.searches {
            if !names.contains(&planned.vehicle) {
                names.push(planned.vehicle.clone());
            }
        }
        names
    }

    /// Returns the gains of the laws on `vehicle`, as tables of its file. Those of backstepping are left out: it flies
    /// with AFBC's cascade.
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
    /// Says what differs.
    fn differs(&self, wanted: &FleetManifest) -> String {
        let pairs = [
            ("program", self.program.clone(), wanted.program.clone()),
            ("budget", self.budget.to_string(), wanted.budget.to_string()),
            ("step", self.step.to_string(), wanted.step.to_string()),
            ("seed", self.seed.to_string(), wanted.seed.to_string()),
            ("start", self.start.clone(), wanted.start.clone()),
        ];
        let name = |searches: &[Planned]| searches.iter().map(file_name).collect::<Vec<_>>();
        match pairs.into_iter().find(|(_, held, wanted)| held != wanted) {
            Some((what, held, wanted)) => format!("with {what} {held}, not {wanted}"),
            None if name(&self.searches) != name(&wanted.searches) => "of other laws or vehicles".into(),
            None => "of other flights, vehicles or starting gains".into(),
        }
    }
}

fn file_name(planned: &Planned) -> String {
    format!("{}.{}.json", planned.vehicle, planned.law)
}

/// Writes a file with a checksum of its own, which says more of damage than the folder's can.
fn place_sealed(
    place: &Folder,
    name: &str,
    fill: impl FnOnce(&mut (dyn Write + Send)) -> io::Result<()>,
) -> Result<(), files::Error> {
    files::place(&place.path().join(name), fill).map_err(|source| place.error(name, source))
}

fn put(out: &mut dyn Write, page: &impl Serialize) -> io::Result<()> {
    seal::json(out, &Page { page, checksum: seal::OPEN.into() })
}

/// Reads a file with a checksum, if there is one.
fn read<T: for<'a> Deserialize<'a>>(path: &Path) -> Result<Option<T>, Box<dyn Error>> {
    let bytes = match fs::read(path) {
        Err(error) if matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory) => {
            return Ok(None);
        }
        bytes => bytes.map_err(|error| format!("{}: cannot be read ({error}); make it readable", path.display()))?,
    };
    let damaged = |problem: String| format!("{}: damaged ({problem}); delete it, and start again", path.display());
    seal::verify(&mut io::Cursor::new(&bytes)).map_err(|error| damaged(error.to_string()))?;
    let page: Page<T> = serde_json::from_slice(&bytes).map_err(|error| damaged(error.to_string()))?;
    Ok(Some(page.page))
}
