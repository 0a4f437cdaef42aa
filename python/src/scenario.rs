//! The class `Scenario` and the function `scenarios`.

use crate::argument::{Argument, ArgumentArray, CallArg, finite, optional, wrong};
use crate::error::error;
use crate::source::PickledFile;
use crate::vehicle::{PyVehicle, VehicleArgument};
use afbc::Profile;
use afbc_campaign::subject;
use afbc_scenario::trajectory::polynomial::COEFFICIENTS;
use afbc_scenario::trajectory::{PolynomialPiece, Reference, Trajectory};
use afbc_scenario::{BUILT_IN, DURATION, Scenario};
use afbc_vehicles::Vehicle;
use nalgebra::Vector3;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;

/// A scenario: one vehicle, one trajectory, one environment and the contenders to compare. It is built in, given by
/// name, or read from a file, given by path; docs/scenarios.md describes the files.
#[pyclass(name = "Scenario", module = "afbc", frozen)]
pub(crate) struct PyScenario {
    pub(crate) scenario: Scenario,
    source: PickledFile,
    /// Changes made by `replace`, in order.
    changes: Vec<ScenarioChange>,
}

/// Start and length [s] of a piece of a path, and its coefficients.
type PathPiece<'py> = (f64, f64, Bound<'py, PyArray2<f64>>);

/// A change by `replace`: vehicle, seed, length [s].
type ScenarioChange = (Option<Py<PyVehicle>>, Option<u64>, Option<f64>);

/// Data that `pickle` keeps of a scenario.
type PickledScenario = (String, String, String, Vec<ScenarioChange>);

/// A scenario, or the name or path of one.
#[derive(Clone)]
pub(crate) enum ScenarioArgument<'py> {
    Scenario(Bound<'py, PyScenario>),
    Path(PathBuf),
}

impl<'py> Argument<'py> for ScenarioArgument<'py> {
    fn of(name: &str, object: &Bound<'py, PyAny>) -> PyResult<Self> {
        if let Ok(scenario) = object.cast::<PyScenario>() {
            return Ok(ScenarioArgument::Scenario(scenario.clone()));
        }
        let path = object.extract().map_err(|_| wrong(name, "afbc.Scenario, a name or a path is", object))?;
        Ok(ScenarioArgument::Path(path))
    }
}

impl ScenarioArgument<'_> {
    pub(crate) fn scenario(&self) -> PyResult<Scenario> {
        match self {
            ScenarioArgument::Scenario(scenario) => Ok(scenario.get().scenario.clone()),
            ScenarioArgument::Path(path) => subject::scenario(path).map_err(error),
        }
    }
}

/// Returns the scenario of the argument `scenario`, by default the built-in one called `usual`, with the vehicle and
/// seed replaced if given.
pub(crate) fn asked(
    scenario: Option<&CallArg<'_, ScenarioArgument<'_>>>,
    usual: &str,
    vehicle: Option<&CallArg<'_, VehicleArgument<'_>>>,
    seed: Option<&CallArg<'_, u64>>,
) -> PyResult<Scenario> {
    let scenario = optional(scenario, "scenario")?.unwrap_or_else(|| ScenarioArgument::Path(usual.into()));
    let vehicle = crate::vehicle::given(vehicle)?;
    changed(scenario.scenario()?, vehicle.as_ref(), crate::argument::seed(seed)?, None)
}

/// Returns the scenario with the vehicle, seed or length replaced, if given.
pub(crate) fn changed(
    scenario: Scenario,
    vehicle: Option<&Vehicle>,
    seed: Option<u64>,
    duration_s: Option<f64>,
) -> PyResult<Scenario> {
    let mut scenario = match vehicle {
        Some(vehicle) => scenario.on(vehicle, Profile::Flight).map_err(error)?,
        None => scenario,
    };
    scenario.seed = seed.unwrap_or(scenario.seed);
    if let Some(duration_s) = duration_s {
        DURATION.check(duration_s).map_err(error)?;
        scenario.duration_s = duration_s;
    }
    Ok(scenario)
}

/// Makes the scenario of this source.
fn of(source: PickledFile) -> PyResult<PyScenario> {
    let scenario = afbc_scenario::parse(&source.file, &source.text, &source.name).map_err(error)?;
    Ok(PyScenario { scenario, source, changes: Vec::new() })
}

impl PyScenario {
    fn changed(&self, py: Python<'_>, change: ScenarioChange) -> PyResult<Self> {
        let (vehicle, seed, duration_s) = &change;
        let vehicle = vehicle.as_ref().map(|vehicle| &vehicle.get().vehicle);
        let scenario = changed(self.scenario.clone(), vehicle, *seed, *duration_s)?;
        let changes = self.changes.iter().map(|change| copied(py, change)).chain([change]).collect();
        Ok(PyScenario { scenario, source: self.source.clone(), changes })
    }
}

fn copied(py: Python<'_>, (vehicle, seed, duration_s): &ScenarioChange) -> ScenarioChange {
    (vehicle.as_ref().map(|vehicle| vehicle.clone_ref(py)), *seed, *duration_s)
}

/// Restores a scenario from the data that `pickle` kept.
#[pyfunction]
pub(crate) fn _scenario(
    py: Python<'_>,
    file: String,
    text: String,
    name: String,
    changes: Vec<ScenarioChange>,
) -> PyResult<PyScenario> {
    let scenario = of(PickledFile { file, text, name })?;
    changes.into_iter().try_fold(scenario, |scenario, change| scenario.changed(py, change))
}

#[pymethods]
impl PyScenario {
    #[new]
    fn new(name: CallArg<'_, PathBuf>) -> PyResult<Self> {
        let path = name.named("name")?;
        // Reads as the command line does first, since its errors show the path as given.
        subject::scenario(&path).map_err(error)?;
        let text = |name: &str| afbc_scenario::built_in(name).map(|known| known.text);
        of(PickledFile::at(&path, "scenario", text).map_err(error)?)
    }

    /// Reads the text of a scenario file (TOML).
    #[staticmethod]
    #[pyo3(signature = (text, name="scenario"))]
    fn from_toml(text: &str, name: &str) -> PyResult<Self> {
        of(PickledFile { file: name.into(), text: text.into(), name: name.into() })
    }

    /// Returns the scenario with another vehicle, seed or length.
    #[pyo3(signature = (*, vehicle=None, seed=None, duration_s=None))]
    fn replace(
        &self,
        py: Python<'_>,
        vehicle: Option<CallArg<'_, VehicleArgument<'_>>>,
        seed: Option<CallArg<'_, u64>>,
        duration_s: Option<CallArg<'_, f64>>,
    ) -> PyResult<Self> {
        let vehicle = match optional(vehicle.as_ref(), "vehicle")? {
            Some(VehicleArgument::Vehicle(vehicle)) => Some(vehicle.unbind()),
            Some(VehicleArgument::Path(path)) => Some(Py::new(py, PyVehicle::at(&path)?)?),
            None => None,
        };
        let seed = crate::argument::seed(seed.as_ref())?;
        self.changed(py, (vehicle, seed, optional(duration_s.as_ref(), "duration_s")?))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, PickledScenario)> {
        let (file, text, name) = self.source.clone().into_texts();
        let changes: Vec<ScenarioChange> = self.changes.iter().map(|change| copied(py, change)).collect();
        Ok((py.import("afbc._afbc")?.getattr("_scenario")?, (file, text, name, changes)))
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<PyScenario>().is_ok_and(|other| other.get().scenario == self.scenario)
    }

    fn __hash__(&self) -> u64 {
        crate::vehicle::hash(&self.scenario.name)
    }

    #[getter]
    fn name(&self) -> &str {
        &self.scenario.name
    }

    #[getter]
    fn description(&self) -> &str {
        &self.scenario.description
    }

    #[getter]
    fn duration_s(&self) -> f64 {
        self.scenario.duration_s
    }

    #[getter]
    fn seed(&self) -> u64 {
        self.scenario.seed
    }

    /// Number of rotors.
    #[getter]
    fn rotors(&self) -> usize {
        self.scenario.rotors.len()
    }

    /// Names of the scenario's contenders.
    #[getter]
    fn contenders(&self) -> Vec<String> {
        self.scenario.contenders.iter().map(|contender| contender.name.clone()).collect()
    }

    /// Nominal masses, inertia, arm and rotor factors by name, in SI units.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        crate::vehicle::parameters(py, &self.scenario.vehicle)
    }

    /// Polynomials of a minimum-snap path, or of one from a file: for each piece its start [s], its length [s] and the
    /// coefficients of x, y, z, yaw. The lowest power comes first, over the time since the piece's start. None for
    /// other trajectories.
    #[getter]
    fn polynomials<'py>(&self, py: Python<'py>) -> PyResult<Option<Vec<PathPiece<'py>>>> {
        let Trajectory::Polynomials(pieces) = &self.scenario.trajectory else { return Ok(None) };
        let piece = |piece: &PolynomialPiece| {
            let coefficients: Vec<f64> = piece.coefficients.iter().flatten().copied().collect();
            let coefficients = PyArray1::from_vec(py, coefficients).reshape([4, COEFFICIENTS])?;
            Ok((piece.start_s, piece.duration_s, coefficients))
        };
        pieces.iter().map(piece).collect::<PyResult<_>>().map(Some)
    }

    /// Returns the reference at these times [s]: a column for each coordinate and derivative, named as in a flight's
    /// log.
    fn reference<'py>(&self, py: Python<'py>, time_s: CallArg<'py, ArgumentArray>) -> PyResult<Bound<'py, PyDict>> {
        let times_s = time_s.named("time_s")?.shaped("time_s", [None])?;
        times_s.iter().try_for_each(|time_s| finite("time_s", *time_s).map(drop))?;
        let at: Vec<Reference> = times_s.iter().map(|time_s| self.scenario.trajectory.at(*time_s)).collect();
        let dict = PyDict::new(py);
        let add = |name: String, value: &dyn Fn(&Reference) -> f64| {
            dict.set_item(name, PyArray1::from_iter(py, at.iter().map(value)))
        };
        type Part = fn(&Reference) -> &Vector3<f64>;
        let parts: [(&str, &str, Part); 5] = [
            ("", "m", |r| &r.position_m),
            ("v", "m_s", |r| &r.velocity_m_s),
            ("a", "m_s2", |r| &r.acceleration_m_s2),
            ("j", "m_s3", |r| &r.jerk_m_s3),
            ("s", "m_s4", |r| &r.snap_m_s4),
        ];
        for (prefix, unit, part) in parts {
            for (i, axis) in ["x", "y", "z"].into_iter().enumerate() {
                add(format!("{prefix}{axis}_d_{unit}"), &|r| part(r).get(i).copied().unwrap_or_default())?;
            }
        }
        add("psi_d_rad".into(), &|r| r.yaw_rad)?;
        add("psi_d_rate_rad_s".into(), &|r| r.yaw_rate_rad_s)?;
        add("psi_d_acceleration_rad_s2".into(), &|r| r.yaw_acceleration_rad_s2)?;
        Ok(dict)
    }

    fn __repr__(&self) -> String {
        format!("Scenario('{}')", self.scenario.name)
    }
}

/// Returns the names of the built-in scenarios.
#[pyfunction]
pub(crate) fn scenarios() -> Vec<&'static str> {
    BUILT_IN.iter().map(|known| known.name).collect()
}
