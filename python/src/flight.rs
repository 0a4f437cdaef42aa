//! Flights and comparisons.

use crate::error::error;
use crate::scenario::{ScenarioArgument, changed};
use crate::vehicle::VehicleArgument;
use crate::work::watched;
use afbc::Profile;
use afbc_campaign::compare as comparison;
use afbc_report::flights;
use afbc_scenario::Scenario;
use afbc_sim::LogRate;
use afbc_sim::flown::Flown;
use afbc_sim::metrics::Metrics;
use afbc_sim::run::Run;
use numpy::{PyArray1, ToPyArray};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyDict;
use rayon::prelude::*;

/// One flight under one contender: its log by columns, and its figures of merit.
#[pyclass(name = "Flight", module = "afbc", frozen)]
pub(crate) struct PyFlight {
    flown: Flown,
    columns: PyOnceLock<Py<PyDict>>,
}

impl PyFlight {
    fn of(flown: Flown) -> Self {
        PyFlight { flown, columns: PyOnceLock::new() }
    }
}

#[pymethods]
impl PyFlight {
    /// Name of the contender.
    #[getter]
    fn contender(&self) -> &str {
        &self.flown.run.contender.name
    }

    /// Name of the scenario.
    #[getter]
    fn scenario(&self) -> &str {
        &self.flown.scenario.name
    }

    /// When [s] and why the vehicle was lost; None if it was not.
    #[getter]
    fn lost(&self) -> Option<(f64, &'static str)> {
        self.flown.run.lost.map(|lost| (lost.time_s, lost.reason))
    }

    /// When [s] and why AFBC's monitor switched to the fallback law; None if it did not.
    #[getter]
    fn tripped(&self) -> Option<(f64, &'static str)> {
        self.flown.run.tripped.map(|tripped| (tripped.time_s, tripped.reason))
    }

    /// Figures of merit from 5 s on, by name; None where there was nothing to measure.
    #[getter]
    fn metrics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for (name, value) in named(&self.flown.run.metrics) {
            dict.set_item(name, value)?;
        }
        Ok(dict)
    }

    /// The log: an array of a value a row for each column, named as in `sitl`'s CSV file.
    #[getter]
    fn columns<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let columns = self.columns.get_or_try_init(py, || {
            let columns = py.detach(|| flights::columns(&self.flown));
            let dict = PyDict::new(py);
            for (name, values) in columns {
                dict.set_item(name, PyArray1::from_vec(py, values))?;
            }
            Ok::<_, PyErr>(dict.unbind())
        })?;
        Ok(columns.bind(py).clone())
    }

    fn __getitem__<'py>(&self, py: Python<'py>, column: &str) -> PyResult<Bound<'py, PyAny>> {
        let columns = self.columns(py)?;
        columns.get_item(column)?.ok_or_else(|| {
            let known = columns.keys();
            PyKeyError::new_err(format!("no column {column:?}; there are {known}"))
        })
    }

    fn __len__(&self) -> usize {
        self.flown.run.log.len()
    }

    fn __repr__(&self) -> String {
        let (scenario, contender) = (&self.flown.scenario.name, &self.flown.run.contender.name);
        match self.flown.run.lost {
            Some(lost) => format!("Flight({scenario}, {contender}, lost at {} s: {})", lost.time_s, lost.reason),
            None => {
                let rms_mm = 1000.0 * self.flown.run.metrics.rmse.xyz().norm();
                format!("Flight({scenario}, {contender}, {rms_mm:.3} mm rms)")
            }
        }
    }
}

/// The figures of merit of a flight by the names that campaigns give them; none before errors are evaluated.
fn named(metrics: &Metrics) -> Vec<(&'static str, Option<f64>)> {
    let Metrics { rmse, max_abs, max_distance_m, mean_abs_delta_u: du, estimate, .. } = metrics;
    let settled = |value: f64| metrics.measured(value);
    let mut named = vec![
        ("rmse_x_m", settled(rmse.x)),
        ("rmse_y_m", settled(rmse.y)),
        ("rmse_z_m", settled(rmse.z)),
        ("rmse_psi_rad", settled(rmse.w)),
        ("rmse_position_m", settled(rmse.xyz().norm())),
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

/// Rows of a log per second.
fn log_rate(log_hz: Option<u16>, scenario: &Scenario) -> PyResult<LogRate> {
    match log_hz {
        Some(hz) => hz.to_string().parse().map_err(|problem| error(format!("log_hz {hz}: {problem}"))),
        None => Ok(LogRate::usual(scenario.duration_s)),
    }
}

/// Flies a scenario under each of its contenders, or under these laws, and returns the flights by contender.
///
/// The same flights as `sitl fly`, in every bit.
#[pyfunction]
#[pyo3(signature = (
    scenario, controllers=None, *, vehicle=None, seed=None, duration_s=None, log_hz=None, threads=None, progress=None
))]
#[expect(clippy::too_many_arguments, reason = "each by its name")]
pub(crate) fn fly<'py>(
    py: Python<'py>,
    scenario: ScenarioArgument<'py>,
    controllers: Option<Vec<String>>,
    vehicle: Option<VehicleArgument<'py>>,
    seed: Option<u64>,
    duration_s: Option<f64>,
    log_hz: Option<u16>,
    threads: Option<usize>,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let mut scenario = scenario.scenario()?;
    if let Some(names) = &controllers {
        scenario.choose(names).map_err(error)?;
    }
    let scenario = changed(scenario, vehicle.as_ref(), seed, duration_s)?;
    let rate = log_rate(log_hz, &scenario)?;
    let flights = watched(py, threads, progress.as_ref(), |watch| {
        let fly = |contender| {
            if watch.is_over() {
                return Err("interrupted".to_owned());
            }
            let log_every = rate.steps(&scenario, contender)?;
            let run = Run::fly(&scenario, contender, log_every).map_err(|error| error.to_string())?;
            watch.add(1);
            Ok(Flown { scenario: scenario.clone(), run })
        };
        scenario.contenders.par_iter().map(fly).collect::<Result<Vec<_>, _>>()
    })?;
    let dict = PyDict::new(py);
    for flown in flights.map_err(error)? {
        dict.set_item(flown.run.contender.name.clone(), PyFlight::of(flown))?;
    }
    Ok(dict)
}

/// Flies scenarios under the same contenders with `seeds` consecutive seeds each, and returns a row for each flight, by
/// columns: scenario, contender, seed, when and why the vehicle was lost, and the figures of merit.
#[pyfunction]
#[pyo3(signature = (scenarios, controllers=None, *, vehicle=None, seeds=1, threads=None, progress=None))]
pub(crate) fn compare<'py>(
    py: Python<'py>,
    scenarios: Vec<ScenarioArgument<'py>>,
    controllers: Option<Vec<String>>,
    vehicle: Option<VehicleArgument<'py>>,
    seeds: u64,
    threads: Option<usize>,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let mut scenarios = scenarios.iter().map(ScenarioArgument::scenario).collect::<PyResult<Vec<_>>>()?;
    let own = comparison::contenders(&scenarios);
    let contenders = match &controllers {
        Some(names) => comparison::choose(&own, names).map_err(error)?,
        None => own,
    };
    let vehicle = vehicle.map(|vehicle| vehicle.vehicle()).transpose()?;
    for scenario in &mut scenarios {
        if let Some(vehicle) = &vehicle {
            *scenario = scenario.clone().on(vehicle, Profile::Flight).map_err(error)?;
        }
        comparison::fly_under(scenario, &contenders).map_err(error)?;
    }
    let comparisons = watched(py, threads, progress.as_ref(), |watch| {
        comparison::fly(scenarios, seeds, u64::MAX, &|| watch.add(1)).map_err(|error| error.to_string())
    })?;
    let comparisons = comparisons.map_err(error)?;
    let dict = PyDict::new(py);
    let rows = || comparisons.iter().flat_map(|of| of.entries.iter().map(move |entry| (&of.scenario, entry)));
    let rows =
        || rows().flat_map(|(scenario, entry)| entry.flights.iter().map(move |flight| (scenario, entry, flight)));
    dict.set_item("scenario", rows().map(|(scenario, ..)| scenario.name.as_str()).collect::<Vec<_>>())?;
    dict.set_item("contender", rows().map(|(_, entry, _)| entry.contender().name.as_str()).collect::<Vec<_>>())?;
    dict.set_item("seed", rows().map(|(.., flight)| flight.seed).collect::<Vec<_>>().to_pyarray(py))?;
    let lost_at = rows().map(|(.., flight)| flight.lost.map_or(f64::NAN, |lost| lost.time_s));
    dict.set_item("lost_at_s", PyArray1::from_iter(py, lost_at))?;
    dict.set_item("lost_reason", rows().map(|(.., flight)| flight.lost.map(|lost| lost.reason)).collect::<Vec<_>>())?;
    let figures: Vec<_> = rows().map(|(.., flight)| named(&flight.metrics)).collect();
    let names = figures.iter().max_by_key(|figures| figures.len()).map_or(Vec::new(), Clone::clone);
    for (name, _) in names {
        let value = |figures: &Vec<(&str, Option<f64>)>| {
            figures.iter().find(|(other, _)| *other == name).and_then(|(_, value)| *value).unwrap_or(f64::NAN)
        };
        dict.set_item(name, PyArray1::from_iter(py, figures.iter().map(value)))?;
    }
    Ok(dict)
}
