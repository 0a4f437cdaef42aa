//! Scenarios.

use crate::error::error;
use crate::vehicle::VehicleArgument;
use afbc::Profile;
use afbc_campaign::subject;
use afbc_scenario::trajectory::polynomial::COEFFICIENTS;
use afbc_scenario::trajectory::{PolynomialPiece, Reference, Trajectory};
use afbc_scenario::{BUILT_IN, DURATION, Scenario};
use nalgebra::Vector3;
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;

/// A scenario: one vehicle, one trajectory, one environment, the contenders to compare. Of the built-in ones by name,
/// or of a file by path; docs/scenarios.md describes the files.
#[pyclass(name = "Scenario", module = "afbc", frozen)]
pub(crate) struct PyScenario(pub(crate) Scenario);

/// Start and length [s] of a piece of a path, and its coefficients.
type Piece<'py> = (f64, f64, Bound<'py, PyArray2<f64>>);

/// A scenario, or what names one.
#[derive(FromPyObject)]
pub(crate) enum ScenarioArgument<'py> {
    Scenario(Bound<'py, PyScenario>),
    Path(PathBuf),
}

impl ScenarioArgument<'_> {
    pub(crate) fn scenario(&self) -> PyResult<Scenario> {
        match self {
            ScenarioArgument::Scenario(scenario) => Ok(scenario.get().0.clone()),
            ScenarioArgument::Path(path) => subject::scenario(path).map_err(error),
        }
    }
}

/// The flight on another vehicle, or with another seed or length.
pub(crate) fn changed(
    scenario: Scenario,
    vehicle: Option<&VehicleArgument<'_>>,
    seed: Option<u64>,
    duration_s: Option<f64>,
) -> PyResult<Scenario> {
    let mut scenario = match vehicle {
        Some(vehicle) => scenario.on(&vehicle.vehicle()?, Profile::Flight).map_err(error)?,
        None => scenario,
    };
    scenario.seed = seed.unwrap_or(scenario.seed);
    if let Some(duration_s) = duration_s {
        DURATION.check(duration_s).map_err(error)?;
        scenario.duration_s = duration_s;
    }
    Ok(scenario)
}

#[pymethods]
impl PyScenario {
    #[new]
    fn new(name: PathBuf) -> PyResult<Self> {
        subject::scenario(&name).map(PyScenario).map_err(error)
    }

    /// Reads the text of a scenario file (TOML).
    #[staticmethod]
    #[pyo3(signature = (text, name="scenario"))]
    fn from_toml(text: &str, name: &str) -> PyResult<Self> {
        afbc_scenario::parse(name, text, name).map(PyScenario).map_err(error)
    }

    /// Returns it on another vehicle, with another seed, or of another length.
    #[pyo3(signature = (*, vehicle=None, seed=None, duration_s=None))]
    fn replace(
        &self,
        vehicle: Option<VehicleArgument<'_>>,
        seed: Option<u64>,
        duration_s: Option<f64>,
    ) -> PyResult<Self> {
        changed(self.0.clone(), vehicle.as_ref(), seed, duration_s).map(PyScenario)
    }

    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    #[getter]
    fn description(&self) -> &str {
        &self.0.description
    }

    #[getter]
    fn duration_s(&self) -> f64 {
        self.0.duration_s
    }

    #[getter]
    fn seed(&self) -> u64 {
        self.0.seed
    }

    /// Number of rotors.
    #[getter]
    fn rotors(&self) -> usize {
        self.0.rotors.len()
    }

    /// Names of its contenders.
    #[getter]
    fn contenders(&self) -> Vec<String> {
        self.0.contenders.iter().map(|contender| contender.name.clone()).collect()
    }

    /// Nominal masses, inertia, arm and rotor factors by name, in SI.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        crate::vehicle::parameters(py, &self.0.vehicle)
    }

    /// The polynomials of a path of minimum snap, or of one from a file: for each piece its start [s], its length [s]
    /// and the coefficients of x, y, z, yaw, lowest power first, over the time since its start. None for others.
    #[getter]
    fn polynomials<'py>(&self, py: Python<'py>) -> PyResult<Option<Vec<Piece<'py>>>> {
        let Trajectory::Polynomials(pieces) = &self.0.trajectory else { return Ok(None) };
        let piece = |piece: &PolynomialPiece| {
            let coefficients: Vec<f64> = piece.coefficients.iter().flatten().copied().collect();
            let coefficients = PyArray1::from_vec(py, coefficients).reshape([4, COEFFICIENTS])?;
            Ok((piece.start_s, piece.duration_s, coefficients))
        };
        pieces.iter().map(piece).collect::<PyResult<_>>().map(Some)
    }

    /// The reference at these times [s]: a column for each coordinate and derivative, named as in a flight's log.
    fn reference<'py>(&self, py: Python<'py>, time_s: PyReadonlyArray1<'py, f64>) -> PyResult<Bound<'py, PyDict>> {
        let at: Vec<Reference> = time_s.as_array().iter().map(|time_s| self.0.trajectory.at(*time_s)).collect();
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
        format!("Scenario('{}')", self.0.name)
    }
}

/// Names of the built-in scenarios.
#[pyfunction]
pub(crate) fn scenarios() -> Vec<&'static str> {
    BUILT_IN.iter().map(|known| known.name).collect()
}
