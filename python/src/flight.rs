//! The class `Flight` and the functions `fly` and `compare`.

use crate::argument::{self, CallArg, optional};
use crate::error::error;
use crate::scenario::{ScenarioArgument, changed};
use crate::vehicle::{self, VehicleArgument};
use crate::work::{WorkProgress, watched};
use afbc::Profile;
use afbc_campaign::compare as comparison;
use afbc_report::flights;
use afbc_scenario::Scenario;
use afbc_scenario::contender::Contender;
use afbc_sim::LogRate;
use afbc_sim::flown::ScenarioFlight;
use afbc_sim::metrics::{Metrics, SETTLED_S};
use afbc_sim::run::FlightResult;
use numpy::{PyArray1, ToPyArray};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyDict;
use rayon::prelude::*;

/// One flight under one contender: its log as columns, and its figures of merit.
#[pyclass(name = "Flight", module = "afbc", frozen)]
pub(crate) struct PyFlight {
    told: FlightSummary,
    /// The flight itself, whose log is converted to columns when they are asked for; none if `pickle` restored the
    /// columns.
    flown: Option<ScenarioFlight>,
    columns: PyOnceLock<Py<PyDict>>,
}

/// Time [s] and reason.
type TimedReason = (f64, String);
/// Name and value of a figure of merit; no value if nothing could be measured.
type NamedFigure = (String, Option<f64>);
/// Summary of a flight: contender, scenario, rows of the log, loss, trip, figures of merit.
type FlightSummary = (String, String, usize, Option<TimedReason>, Option<TimedReason>, Vec<NamedFigure>);
/// Function and arguments that restore a flight in another process.
type PickledFlight<'py> = (Bound<'py, PyAny>, (FlightSummary, Bound<'py, PyDict>));

impl PyFlight {
    fn of(flown: ScenarioFlight) -> Self {
        let ScenarioFlight { scenario, run } = &flown;
        let lost = run.lost.map(|lost| (lost.time_s, lost.reason.to_owned()));
        let tripped = run.tripped.map(|tripped| (tripped.time_s, tripped.reason.to_owned()));
        let figures = named(&run.metrics).into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
        let told = (run.contender.name.clone(), scenario.name.clone(), run.log.len(), lost, tripped, figures);
        PyFlight { told, flown: Some(flown), columns: PyOnceLock::new() }
    }
}

/// Restores a flight from the data that `pickle` kept.
#[pyfunction]
pub(crate) fn _flight(py: Python<'_>, told: FlightSummary, columns: Py<PyDict>) -> PyResult<PyFlight> {
    let kept = PyOnceLock::new();
    // The call cannot fail, since the cell is new and empty.
    let _ = kept.set(py, columns);
    Ok(PyFlight { told, flown: None, columns: kept })
}

#[pymethods]
impl PyFlight {
    /// Name of the contender.
    #[getter]
    fn contender(&self) -> &str {
        &self.told.0
    }

    /// Name of the scenario.
    #[getter]
    fn scenario(&self) -> &str {
        &self.told.1
    }

    /// Time [s] and reason of the vehicle's loss; None if it was not lost.
    #[getter]
    fn lost(&self) -> Option<TimedReason> {
        self.told.3.clone()
    }

    /// Time [s] and reason of the monitor's switch to the fallback law; None if it did not switch.
    #[getter]
    fn tripped(&self) -> Option<TimedReason> {
        self.told.4.clone()
    }

    /// Figures of merit from 5 s on, by name; None where nothing could be measured.
    #[getter]
    fn metrics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        self.told.5.iter().try_for_each(|(name, value)| dict.set_item(name, value))?;
        Ok(dict)
    }

    /// Log of the flight: an array for each column, with one value per row. Columns are named as in `sitl`'s CSV file.
    #[getter]
    fn columns<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let columns = self.columns.get_or_try_init(py, || {
            let columns = py.detach(|| self.flown.as_ref().map_or_else(Vec::new, flights::columns));
            let dict = PyDict::new(py);
            for (name, values) in columns {
                dict.set_item(name, PyArray1::from_vec(py, values))?;
            }
            Ok::<_, PyErr>(dict.unbind())
        })?;
        Ok(columns.bind(py).clone())
    }

    fn __getitem__<'py>(&self, py: Python<'py>, column: CallArg<'py, String>) -> PyResult<Bound<'py, PyAny>> {
        let column = column.named("column")?;
        let columns = self.columns(py)?;
        columns.get_item(&column)?.ok_or_else(|| {
            let known = columns.keys();
            PyKeyError::new_err(format!("no column {column:?}; the columns are {known}"))
        })
    }

    fn __len__(&self) -> usize {
        self.told.2
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<PickledFlight<'py>> {
        Ok((py.import("afbc._afbc")?.getattr("_flight")?, (self.told.clone(), self.columns(py)?)))
    }

    fn __repr__(&self) -> String {
        let (contender, scenario, _, lost, _, figures) = &self.told;
        let rms = figures.iter().find(|(name, _)| name == RMS).and_then(|(_, value)| *value);
        let what = match (lost, rms) {
            (Some((time_s, reason)), _) => format!("lost at {time_s} s: {reason}"),
            (None, Some(rms_m)) => format!("{:.3} mm rms", 1000.0 * rms_m),
            (None, None) => format!("the flight ended before {SETTLED_S} s, from which on errors count"),
        };
        format!("Flight({scenario}, {contender}, {what})")
    }
}

/// Name of the figure that `repr` shows.
const RMS: &str = "rmse_position_m";

/// Returns the figures of merit of a flight by the names that campaigns use. Values are none if the flight ended before
/// errors count.
fn named(metrics: &Metrics) -> Vec<(&'static str, Option<f64>)> {
    let Metrics { rmse, max_abs, max_distance_m, mean_abs_delta_u: du, estimate, .. } = metrics;
    let settled = |value: f64| metrics.measured(value);
    let mut named = vec![
        ("rmse_x_m", settled(rmse.x)),
        ("rmse_y_m", settled(rmse.y)),
        ("rmse_z_m", settled(rmse.z)),
        ("rmse_psi_rad", settled(rmse.w)),
        (RMS, settled(rmse.xyz().norm())),
        ("max_x_m", settled(max_abs.x)),
        ("max_y_m", settled(max_abs.y)),
        ("max_z_m", settled(max_abs.z)),
        ("max_psi_rad", settled(max_abs.w)),
        ("max_position_m", settled(*max_distance_m)),
        ("mean_abs_du1_n", settled(du.x)),
        ("mean_abs_du2_n", settled(du.y)),
        ("mean_abs_du3_n", settled(du.z)),
        ("mean_abs_du4_n", settled(du.w)),
    ];
    if let Some(estimate) = estimate {
        named.extend([
            ("estimate_position_rms_m", Some(estimate.position_m.norm())),
            ("estimate_velocity_rms_m_s", Some(estimate.velocity_m_s.norm())),
            ("estimate_attitude_rms_rad", Some(estimate.attitude_rad.norm())),
            ("estimate_nees", Some(estimate.nees)),
        ]);
    }
    named
}

/// Returns the rate of log rows.
fn log_rate(log_hz: Option<&CallArg<'_, u64>>, scenario: &Scenario) -> PyResult<LogRate> {
    match log_hz.map(|log_hz| log_hz.within("log_hz", 1..=1000)).transpose()? {
        Some(hz) => hz.to_string().parse().map_err(|problem| error(format!("log_hz {hz}: {problem}"))),
        None => Ok(LogRate::usual(scenario.duration_s)),
    }
}

/// Returns the names of the argument `controllers`; none if it was not given.
fn chosen(controllers: Option<&CallArg<'_, Vec<String>>>) -> PyResult<Option<Vec<String>>> {
    match optional(controllers, "controllers")? {
        Some(names) if names.is_empty() => Err(error(
            "controllers: the list is empty; name a controller, or leave the argument out for the scenario's own \
             controllers",
        )),
        names => Ok(names),
    }
}

/// Flies one flight, unless the work is interrupted.
fn flown(
    scenario: &Scenario,
    contender: &Contender,
    log_every: u64,
    watch: &WorkProgress,
) -> Result<FlightResult, String> {
    let run = FlightResult::fly_unless(scenario, contender, log_every, || watch.is_over())
        .map_err(|error| error.to_string())?;
    if watch.is_over() {
        return Err("interrupted".into());
    }
    watch.add(1);
    Ok(run)
}

/// Flies a scenario under each of its contenders, or under the laws `controllers`, and returns the flights by
/// contender.
///
/// The flights equal those of `sitl fly` in every bit.
#[pyfunction]
#[pyo3(signature = (
    scenario, controllers=None, *, vehicle=None, seed=None, duration_s=None, log_hz=None, threads=None, progress=None
))]
#[expect(clippy::too_many_arguments, reason = "each by its name")]
pub(crate) fn fly<'py>(
    py: Python<'py>,
    scenario: CallArg<'py, ScenarioArgument<'py>>,
    controllers: Option<CallArg<'py, Vec<String>>>,
    vehicle: Option<CallArg<'py, VehicleArgument<'py>>>,
    seed: Option<CallArg<'py, u64>>,
    duration_s: Option<CallArg<'py, f64>>,
    log_hz: Option<CallArg<'py, u64>>,
    threads: Option<CallArg<'py, u64>>,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let mut scenario = scenario.named("scenario")?.scenario()?;
    if let Some(names) = chosen(controllers.as_ref())? {
        scenario.choose(&names).map_err(error)?;
    }
    let (vehicle, seed) = (vehicle::given(vehicle.as_ref())?, argument::seed(seed.as_ref())?);
    let scenario = changed(scenario, vehicle.as_ref(), seed, optional(duration_s.as_ref(), "duration_s")?)?;
    let rate = log_rate(log_hz.as_ref(), &scenario)?;
    let flights = watched(py, argument::threads(threads.as_ref())?, progress.as_ref(), |watch| {
        let fly = |contender| {
            let run = flown(&scenario, contender, rate.steps(&scenario, contender)?, watch)?;
            Ok::<_, String>(ScenarioFlight { scenario: scenario.clone(), run })
        };
        scenario.contenders.par_iter().map(fly).collect::<Result<Vec<_>, _>>()
    })?;
    let dict = PyDict::new(py);
    for flown in flights.map_err(error)? {
        dict.set_item(flown.run.contender.name.clone(), PyFlight::of(flown))?;
    }
    Ok(dict)
}

/// Result of one flight of a comparison.
struct ComparedFlight<'a> {
    scenario: &'a str,
    contender: &'a str,
    seed: u64,
    run: FlightResult,
}

/// A planned flight of a comparison: scenario, contender and seed.
type PlannedFlight<'a> = (&'a Scenario, &'a Contender, u64);

impl<'a> ComparedFlight<'a> {
    fn of((scenario, contender, seed): &PlannedFlight<'a>, watch: &WorkProgress) -> Result<Self, String> {
        let run = flown(&Scenario { seed: *seed, ..(*scenario).clone() }, contender, u64::MAX, watch)?;
        Ok(ComparedFlight { scenario: &scenario.name, contender: &contender.name, seed: *seed, run })
    }
}

/// Flies scenarios under the same contenders with `seeds` consecutive seeds each, as `sitl compare` does. Returns
/// columns with a row for each flight: scenario, contender, seed, time and reason of a loss, and the figures of merit.
#[pyfunction]
#[pyo3(signature = (scenarios, controllers=None, *, vehicle=None, seeds=None, threads=None, progress=None))]
pub(crate) fn compare<'py>(
    py: Python<'py>,
    scenarios: CallArg<'py, Vec<ScenarioArgument<'py>>>,
    controllers: Option<CallArg<'py, Vec<String>>>,
    vehicle: Option<CallArg<'py, VehicleArgument<'py>>>,
    seeds: Option<CallArg<'py, u64>>,
    threads: Option<CallArg<'py, u64>>,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let scenarios = scenarios.named("scenarios")?;
    let mut scenarios = scenarios.iter().map(ScenarioArgument::scenario).collect::<PyResult<Vec<_>>>()?;
    if scenarios.is_empty() {
        return Err(error("scenarios: the list is empty; name a scenario"));
    }
    let own = comparison::contenders(&scenarios);
    let contenders = match chosen(controllers.as_ref())? {
        Some(names) => comparison::choose(&own, &names).map_err(error)?,
        None => own,
    };
    let vehicle = vehicle::given(vehicle.as_ref())?;
    for scenario in &mut scenarios {
        if let Some(vehicle) = &vehicle {
            *scenario = scenario.clone().on(vehicle, Profile::Flight).map_err(error)?;
        }
        comparison::fly_under(scenario, &contenders).map_err(error)?;
    }
    let seeds = seeds.map(|seeds| seeds.within("seeds", 1..=SEEDS_MAX)).transpose()?;
    let planned = planned(&scenarios, seeds)?;
    let outcomes = watched(py, argument::threads(threads.as_ref())?, progress.as_ref(), |watch| {
        planned.par_iter().map(|planned| ComparedFlight::of(planned, watch)).collect::<Result<Vec<_>, _>>()
    })?;
    rows(py, &outcomes.map_err(error)?)
}

/// Largest number of seeds of a comparison, as on the command line.
const SEEDS_MAX: u64 = 10_000;

/// Returns the flights of a comparison, ordered by scenario, contender and seed.
fn planned(scenarios: &[Scenario], seeds: Option<u64>) -> PyResult<Vec<PlannedFlight<'_>>> {
    let mut planned = Vec::new();
    for scenario in scenarios {
        let seeds = seeds.unwrap_or_else(|| comparison::usual_seeds(scenario));
        let end = scenario.seed.checked_add(seeds);
        let end = end.ok_or_else(|| {
            error(format!(
                "seeds: {seeds} given; counted from the scenario's seed, the last one exceeds the largest seed; give \
                 fewer seeds"
            ))
        })?;
        for contender in &scenario.contenders {
            planned.extend((scenario.seed..end).map(|seed| (scenario, contender, seed)));
        }
    }
    Ok(planned)
}

/// Returns the results as columns.
fn rows<'py>(py: Python<'py>, outcomes: &[ComparedFlight<'_>]) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("scenario", outcomes.iter().map(|outcome| outcome.scenario).collect::<Vec<_>>())?;
    dict.set_item("contender", outcomes.iter().map(|outcome| outcome.contender).collect::<Vec<_>>())?;
    dict.set_item("seed", outcomes.iter().map(|outcome| outcome.seed).collect::<Vec<_>>().to_pyarray(py))?;
    let lost = |outcome: &ComparedFlight<'_>| outcome.run.lost;
    let lost_at = outcomes.iter().map(|outcome| lost(outcome).map_or(f64::NAN, |lost| lost.time_s));
    dict.set_item("lost_at_s", PyArray1::from_iter(py, lost_at))?;
    let reasons = outcomes.iter().map(|outcome| lost(outcome).map(|lost| lost.reason));
    dict.set_item("lost_reason", reasons.collect::<Vec<_>>())?;
    let figures: Vec<_> = outcomes.iter().map(|outcome| named(&outcome.run.metrics)).collect();
    let names = figures.iter().max_by_key(|figures| figures.len()).map_or(Vec::new(), Clone::clone);
    for (name, _) in names {
        let value = |figures: &Vec<(&str, Option<f64>)>| {
            figures.iter().find(|(other, _)| *other == name).and_then(|(_, value)| *value).unwrap_or(f64::NAN)
        };
        dict.set_item(name, PyArray1::from_iter(py, figures.iter().map(value)))?;
    }
    Ok(dict)
}
