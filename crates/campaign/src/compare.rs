//! Comparison of contenders: every contender flies every scenario.

use crate::statistics::Median;
use afbc::Profile;
use afbc_files::read::FileError;
use afbc_files::read::words::cure;
use afbc_scenario::Scenario;
use afbc_scenario::contender::{Contender, ControllerKind, MONITORED};
use afbc_sim::flight::Lost;
use afbc_sim::flown::ScenarioFlight;
use afbc_sim::metrics::Metrics;
use afbc_sim::run::{FlightResult, MonitorTrip};
use afbc_types::OutOfRange;
use rayon::prelude::*;

/// Returns the default contenders: every law with its flight profile, and AFBC also with the paper's profile.
pub fn standard() -> Vec<Contender> {
    let flying = |kind| Contender::standard(kind, Profile::Flight);
    let printed = Contender::standard(ControllerKind::Afbc, Profile::Paper);
    let others = ControllerKind::all().into_iter().filter(|kind| *kind != ControllerKind::Afbc);
    [flying(ControllerKind::Afbc), printed].into_iter().chain(others.map(flying)).collect()
}

/// Returns the contenders of a suite: the default ones, and AFBC under its monitor.
pub fn standard_and_monitored() -> Vec<Contender> {
    let guarded = Contender::of(ControllerKind::Afbc, Profile::Flight).monitored();
    let guarded = Contender { name: MONITORED.into(), ..guarded };
    standard().into_iter().chain([guarded]).collect()
}

/// Returns the contenders called `names`, in that order. A name is looked up in `own` first, then among the standard
/// contenders.
///
/// # Errors
/// One line about a name that is unknown or given twice.
pub fn choose(own: &[Contender], names: &[String]) -> Result<Vec<Contender>, FileError> {
    let mut chosen: Vec<Contender> = Vec::new();
    for name in names {
        let called = own.iter().find(|contender| &contender.name == name).cloned();
        let Some(contender) = called.or_else(|| Contender::named(name)) else {
            let mut known: Vec<_> = own.iter().map(|contender| contender.name.clone()).collect();
            known.extend(Contender::all_standard().map(|contender| contender.name));
            known.sort_unstable();
            known.dedup();
            let cure = cure(name, known.iter().map(String::as_str));
            return Err(unchosen(name, format!("no such controller; {cure}")));
        };
        if chosen.iter().any(|other| other.name == contender.name) {
            return Err(unchosen(name, "the controller is named twice; name it once".into()));
        }
        chosen.push(contender);
    }
    Ok(chosen)
}

fn unchosen(name: &str, problem: String) -> FileError {
    FileError::whole(&format!("controllers {}", name.escape_debug()), problem)
}

/// Replaces the contenders of `scenario` by `contenders`, each with its gains for the scenario's vehicle, and checks
/// them. A contender that the scenario already has keeps the gains of the scenario's file.
///
/// # Errors
/// One line about the mistake in the vehicle file's gains, or the first gain or setting out of range.
pub fn fly_under(scenario: &mut Scenario, contenders: &[Contender]) -> Result<(), FileError> {
    let put = |contender: &Contender| match scenario.contenders.iter().any(|own| is_same(own, contender)) {
        true => Ok(contender.clone()),
        false => scenario.carried(contender.clone()),
    };
    scenario.contenders = contenders.iter().map(put).collect::<Result<_, _>>()?;
    scenario.check().map_err(|error| FileError::whole(&scenario.name, error.to_string()))
}

/// True if both contenders fly alike, regardless of their names.
fn is_same(a: &Contender, b: &Contender) -> bool {
    (&a.law, &a.settings, a.monitored) == (&b.law, &b.settings, b.monitored)
}

/// Adds the contenders `own` to `scenario`, with gains scaled by rule to the scenario's vehicle, and checks them.
///
/// # Errors
/// The first gain or setting out of range.
pub(crate) fn fly_by_rule(scenario: &mut Scenario, own: &[Contender]) -> Result<(), FileError> {
    let vehicle = scenario.vehicle_file.as_ref();
    let scaled = own.iter().map(|own| vehicle.map_or_else(|| own.clone(), |vehicle| own.clone().by_rule(vehicle)));
    scenario.contenders.extend(scaled);
    scenario.check().map_err(|error| FileError::whole(&scenario.name, error.to_string()))
}

/// Raises the tilt limit of every contender of `scenario` to `tilt_max_rad` \[rad\] if it is lower.
pub(crate) fn free_to_tilt(scenario: &mut Scenario, tilt_max_rad: f64) {
    let contenders = std::mem::take(&mut scenario.contenders).into_iter();
    scenario.contenders = contenders.map(|contender| contender.free_to_tilt(tilt_max_rad as f32)).collect();
}

/// Returns all different contenders of `scenarios`. A law's plain name is reserved for its standard contender with the
/// flight profile; a law with the paper's profile is named as printed. A contender with other gains or settings whose
/// name is taken also carries its scenario's name. So the names do not depend on the order of the scenarios.
pub fn contenders(scenarios: &[Scenario]) -> Vec<Contender> {
    let own = scenarios.iter().flat_map(|scenario| scenario.contenders.iter().map(move |own| (scenario, own)));
    let all: Vec<_> = own.map(|(scenario, own)| (scenario, own, as_standard(scenario, own))).collect();
    let is_standard = |name: &str| all.iter().filter_map(|(.., standard)| standard.as_ref()).any(|it| it.name == name);
    let mut named: Vec<Contender> = Vec::new();
    for (scenario, own, standard) in &all {
        let mut contender = standard.clone().unwrap_or_else(|| (*own).clone().named_as_printed());
        if named.contains(&contender) {
            continue;
        }
        let is_taken = named.iter().any(|other| other.name == contender.name);
        if is_taken || (standard.is_none() && is_standard(&contender.name)) {
            contender.name = format!("{} ({})", contender.name, scenario.name);
        }
        named.push(contender);
    }
    named
}

/// Returns the standard contender that flies exactly like `own` on the vehicle of `scenario`. Returns none if there is
/// no such contender, or if `own` is not called by its law's name.
fn as_standard(scenario: &Scenario, own: &Contender) -> Option<Contender> {
    let kind = own.kind();
    let flies = Contender::standard(kind, Profile::Flight);
    let printed = Some(Contender::standard(kind, Profile::Paper)).filter(Contender::is_printed);
    let is_own = |standard: &Contender| scenario.carried(standard.clone()).is_ok_and(|carried| is_same(&carried, own));
    if own.name == kind.name() { [flies].into_iter().chain(printed).find(is_own) } else { None }
}

/// Default number of seeds of a comparison, if the seed changes the flight. It is the least round number with which a
/// signed rank test can distinguish eight different laws from a ninth. The smallest p is 2/2^10, times 8 by Holm's
/// correction.
pub const SEEDS: u64 = 10;

/// Returns the default number of seeds for `scenario`: one if no seed changes the flight.
pub fn usual_seeds(scenario: &Scenario) -> u64 {
    if scenario.is_random() { SEEDS } else { 1 }
}

/// Flights of one scenario under every contender.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// The scenario, with its contenders.
    pub scenario: Scenario,
    /// One entry for each of the scenario's contenders.
    pub entries: Vec<ContenderFlights>,
    /// Index of the contender that the others are compared with.
    pub baseline: usize,
}

/// One contender's flights of one scenario.
#[derive(Clone, Debug)]
pub struct ContenderFlights {
    /// The flight with the scenario's own seed, including its log.
    pub first: ScenarioFlight,
    /// Results of all flights, beginning with the first.
    pub flights: Vec<FlightOutcome>,
}

/// Result of one flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlightOutcome {
    /// Seed of the flight's noise and weather.
    pub seed: u64,
    /// Time and reason of the vehicle's loss, if any.
    pub lost: Option<Lost>,
    /// Time and reason of the monitor's switch to the fallback law, if any.
    pub tripped: Option<MonitorTrip>,
    /// Errors and smoothness up to the end of the flight or the loss.
    pub metrics: Metrics,
}

/// Mean and standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Average {
    /// Mean value.
    pub mean: f64,
    /// Standard deviation of the sample; 0 for a single value.
    pub deviation: f64,
}

/// A figure of merit; smaller is better.
pub struct Measure {
    /// Column name in files.
    pub name: &'static str,
    /// Name in tables and figures.
    pub title: &'static str,
    /// Decimals in tables.
    pub digits: usize,
    /// Factor from the value to the number printed in tables.
    pub scale: f64,
    /// Computes the figure from the metrics of a flight.
    pub value: fn(&Metrics) -> f64,
}

/// Figure that the test of differences between contenders uses.
pub const DISTANCE: Measure =
    Measure { name: "rms_m", title: "distance [m]", digits: 5, scale: 1.0, value: |m| m.rmse.xyz().norm() };

/// Figures by which contenders are compared.
pub const MEASURES: [Measure; 6] = [
    Measure { name: "rmse_x_m", title: "x [m]", digits: 4, scale: 1.0, value: |m| m.rmse.x },
    Measure { name: "rmse_y_m", title: "y [m]", digits: 4, scale: 1.0, value: |m| m.rmse.y },
    Measure { name: "rmse_z_m", title: "z [m]", digits: 4, scale: 1.0, value: |m| m.rmse.z },
    Measure { name: "rmse_psi_rad", title: "ψ [rad]", digits: 4, scale: 1.0, value: |m| m.rmse.w },
    Measure { name: "max_position_m", title: "max [m]", digits: 4, scale: 1.0, value: |m| m.max_abs.xyz().max() },
    Measure {
        name: "mean_abs_delta_u4_n",
        title: "|ΔU₄| [mN]",
        digits: 1,
        scale: 1000.0,
        value: |m| m.mean_abs_delta_u.w,
    },
];

impl FlightOutcome {
    /// Returns the result of a flight of `scenario`.
    pub(crate) fn of(scenario: &Scenario, run: &FlightResult) -> Self {
        FlightOutcome { seed: scenario.seed, lost: run.lost, tripped: run.tripped, metrics: run.metrics }
    }
}

impl ContenderFlights {
    /// Returns the contender.
    pub fn contender(&self) -> &Contender {
        &self.first.run.contender
    }

    /// Returns the number of vehicles lost.
    pub fn lost(&self) -> usize {
        self.flights.iter().filter(|flight| flight.lost.is_some()).count()
    }

    /// Returns a figure of every flight. A lost vehicle counts as infinite, worse than any other.
    pub fn values(&self, value: impl Fn(&Metrics) -> f64) -> Vec<f64> {
        let of = |flight: &FlightOutcome| if flight.lost.is_some() { f64::INFINITY } else { value(&flight.metrics) };
        self.flights.iter().map(of).collect()
    }

    /// Returns the median of a figure over the flights; none if the median flight is a lost one.
    pub fn median(&self, value: impl Fn(&Metrics) -> f64) -> Option<Median> {
        Median::of(&self.values(value)).filter(|median| median.value.is_finite())
    }

    /// Returns mean and standard deviation of a figure over the flights; none if a vehicle was lost.
    pub fn average(&self, value: impl Fn(&Metrics) -> f64) -> Option<Average> {
        if self.lost() > 0 {
            return None;
        }
        let values: Vec<f64> = self.flights.iter().map(|flight| value(&flight.metrics)).collect();
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let squares: f64 = values.iter().map(|value| (value - mean) * (value - mean)).sum();
        // A single flight has no spread: 0, not 0/0.
        Some(Average { mean, deviation: libm::sqrt(squares / (count - 1.0).max(1.0)) })
    }
}

impl Comparison {
    /// Sets the contender that the others are compared with: the one called `name`, else AFBC, else the first.
    #[must_use]
    pub fn with_baseline(mut self, name: Option<&str>) -> Self {
        let place = |name| self.entries.iter().position(|entry| entry.contender().name == name);
        self.baseline = name.and_then(place).or_else(|| place(ControllerKind::Afbc.name())).unwrap_or_default();
        self
    }

    /// Returns a contender's median root mean square distance divided by backstepping's; none if either median is a
    /// lost flight.
    pub fn ratio(&self, entry: &ContenderFlights) -> Option<f64> {
        let distance = |entry: &ContenderFlights| entry.median(DISTANCE.value).map(|median| median.value);
        let classical = |entry: &&ContenderFlights| entry.contender().kind() == ControllerKind::Backstepping;
        let ratio = distance(entry)? / distance(self.entries.iter().find(classical)?)?;
        // Flights that end before errors count give 0/0.
        Some(ratio).filter(|ratio| ratio.is_finite())
    }

    /// True if every contender flew with several seeds.
    pub fn is_repeated(&self) -> bool {
        self.entries.iter().any(|entry| entry.flights.len() > 1)
    }

    /// True if `entry` has the smallest median of a figure among those that lost no vehicle.
    pub fn is_best(&self, entry: &ContenderFlights, figure: &Measure) -> bool {
        let median = |entry: &ContenderFlights| {
            entry.median(figure.value).filter(|_| entry.lost() == 0).map(|median| median.value)
        };
        median(entry).is_some_and(|own| self.entries.iter().filter_map(median).all(|other| own <= other))
    }
}

/// Flies every scenario as [`fly_seeds`] does, all with the same number of `seeds`.
///
/// # Errors
/// The first parameter, gain or setting out of range.
pub fn fly(
    scenarios: Vec<Scenario>,
    seeds: u64,
    log_every: u64,
    progress: &(dyn Fn() + Sync),
) -> Result<Vec<Comparison>, OutOfRange> {
    fly_seeds(scenarios.into_iter().map(|scenario| (scenario, seeds)).collect(), log_every, progress)
}

/// Flies every scenario under each of its contenders, on the current rayon pool. Each flies the given number of
/// consecutive seeds, starting with the scenario's own. Logs every `log_every`-th step of the first flight. Calls
/// `progress` after each flight. The result does not depend on the number of threads.
///
/// # Errors
/// The first parameter, gain or setting out of range.
pub fn fly_seeds(
    scenarios: Vec<(Scenario, u64)>,
    log_every: u64,
    progress: &(dyn Fn() + Sync),
) -> Result<Vec<Comparison>, OutOfRange> {
    let outcome = |scenario: &Scenario, contender: &Contender, number: u64| {
        let scenario = Scenario { seed: scenario.seed + number, ..scenario.clone() };
        // Only the first flight is plotted. Logs of the others would only take memory.
        let run = FlightResult::fly(&scenario, contender, if number == 0 { log_every } else { u64::MAX })?;
        progress();
        Ok((FlightOutcome::of(&scenario, &run), (number == 0).then_some(run)))
    };
    let entry = |scenario: &Scenario, contender: &Contender, seeds: u64| {
        let flown: Vec<(FlightOutcome, Option<FlightResult>)> = (0..seeds.max(1))
            .into_par_iter()
            .map(|number| outcome(scenario, contender, number))
            .collect::<Result<_, _>>()?;
        let flights = flown.iter().map(|(outcome, _)| *outcome).collect();
        let first =
            flown.into_iter().find_map(|(_, run)| Some(ScenarioFlight { scenario: scenario.clone(), run: run? }));
        Ok(first.map(|first| ContenderFlights { first, flights }))
    };
    let compare = |(scenario, seeds): (Scenario, u64)| {
        let contenders = scenario.contenders.par_iter();
        let entries: Vec<Option<ContenderFlights>> =
            contenders.map(|contender| entry(&scenario, contender, seeds)).collect::<Result<_, _>>()?;
        let entries = entries.into_iter().flatten().collect();
        Ok(Comparison { scenario, entries, baseline: 0 }.with_baseline(None))
    };
    scenarios.into_par_iter().map(compare).collect()
}
