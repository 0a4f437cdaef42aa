//! The estimator, step by step.

use crate::error::error;
use crate::motion::{PyState, array, vector};
use afbc_estimator::{Estimate, Estimator, ImuSample, Measurement, Memory, Settings, Stamped};
use numpy::{PyArray1, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Accepted times [s], so that they fit the clock.
const LATEST_S: f64 = 1e9;

/// Position, velocity, attitude and biases from an inertial sensor and whatever else measures: the one that flies on
/// board. Each measurement is fused for its own time, up to 0.3 s late.
#[pyclass(name = "Estimator", module = "afbc")]
pub(crate) struct PyEstimator {
    estimator: Estimator,
    memory: Memory,
    estimate: Estimate,
}

/// A time on the estimator's clock.
fn us(time_s: f64) -> PyResult<u64> {
    if (0.0..=LATEST_S).contains(&time_s) {
        return Ok((time_s * 1e6).round() as u64);
    }
    Err(error(format!("{time_s} s: times lie within 0 to {LATEST_S:e} s")))
}

impl PyEstimator {
    fn offer(&mut self, at_s: f64, value: Measurement) -> PyResult<()> {
        if !value.is_plausible() {
            return Err(error(format!("{value:?}: not plausible; finite numbers and positive deviations are needed")));
        }
        self.memory.offer(&Stamped { value, at_us: us(at_s)? });
        Ok(())
    }
}

#[pymethods]
impl PyEstimator {
    #[new]
    fn new() -> PyResult<Self> {
        let estimator = Estimator::new(Settings::DEFAULT).map_err(error)?;
        let memory = Memory::default();
        let estimate = estimator.estimate(&memory, 0);
        Ok(PyEstimator { estimator, memory, estimate })
    }

    /// Hands over a tracker's pose, true at `at_s`: position [m], attitude as a quaternion w, x, y, z from body to
    /// earth, and standard deviations [m, rad].
    #[pyo3(signature = (at_s, position_m, attitude, position_sigma_m=0.001, attitude_sigma_rad=0.01))]
    fn pose(
        &mut self,
        at_s: f64,
        position_m: [f64; 3],
        attitude: [f64; 4],
        position_sigma_m: f32,
        attitude_sigma_rad: f32,
    ) -> PyResult<()> {
        let attitude = attitude.map(|part| part as f32);
        let position_m = vector(position_m);
        self.offer(at_s, Measurement::Pose { position_m, attitude, position_sigma_m, attitude_sigma_rad })
    }

    /// Hands over a fix of a GNSS receiver in local coordinates: position [m], velocity [m/s], standard deviations.
    #[pyo3(signature = (
        at_s, position_m, velocity_m_s, horizontal_sigma_m=1.5, vertical_sigma_m=3.0, speed_sigma_m_s=0.2,
        climb_sigma_m_s=0.3
    ))]
    #[expect(clippy::too_many_arguments, reason = "each by its name")]
    fn gnss(
        &mut self,
        at_s: f64,
        position_m: [f64; 3],
        velocity_m_s: [f64; 3],
        horizontal_sigma_m: f32,
        vertical_sigma_m: f32,
        speed_sigma_m_s: f32,
        climb_sigma_m_s: f32,
    ) -> PyResult<()> {
        let (position_m, velocity_m_s) = (vector(position_m), vector(velocity_m_s));
        let fix = Measurement::Gnss {
            position_m,
            velocity_m_s,
            horizontal_sigma_m,
            vertical_sigma_m,
            speed_sigma_m_s,
            climb_sigma_m_s,
        };
        self.offer(at_s, fix)
    }

    /// Hands over a barometer's height [m] above any fixed reference.
    #[pyo3(signature = (at_s, height_m, sigma_m=0.1))]
    fn height(&mut self, at_s: f64, height_m: f32, sigma_m: f32) -> PyResult<()> {
        self.offer(at_s, Measurement::Height { height_m, sigma_m })
    }

    /// Hands over a magnetometer's field in the body frame, in any unit that does not change.
    fn magnetic_field(&mut self, at_s: f64, field: [f64; 3], sigma: f32) -> PyResult<()> {
        self.offer(at_s, Measurement::MagneticField { field: vector(field), sigma })
    }

    /// Hands over a heading [rad].
    #[pyo3(signature = (at_s, heading_rad, sigma_rad=0.05))]
    fn heading(&mut self, at_s: f64, heading_rad: f32, sigma_rad: f32) -> PyResult<()> {
        self.offer(at_s, Measurement::Heading { heading_rad, sigma_rad })
    }

    /// Says whether the vehicle stands on the ground, where its velocity is held at zero while it rests.
    fn set_on_ground(&mut self, on_ground: bool) {
        self.memory.set_on_ground(on_ground);
    }

    /// Performs a step at `now_s` with a sample of the inertial sensor, if there is one: rates [rad/s] and specific
    /// force [m/s2] in the body frame, true at `now_s`. Returns the state.
    #[pyo3(signature = (now_s, rates_rad_s=None, specific_force_m_s2=None))]
    fn step(
        &mut self,
        now_s: f64,
        rates_rad_s: Option<[f64; 3]>,
        specific_force_m_s2: Option<[f64; 3]>,
    ) -> PyResult<PyState> {
        let now_us = us(now_s)?;
        let sample = match (rates_rad_s, specific_force_m_s2) {
            (Some(rates), Some(force)) => {
                Some(ImuSample { at_us: now_us, rates_rad_s: vector(rates), specific_force_m_s2: vector(force) })
            }
            (None, None) => None,
            _ => return Err(error("a sample has rates and specific force; give both, or none")),
        };
        self.estimate = self.estimator.step(&mut self.memory, now_us, sample.as_ref());
        Ok(PyState(self.estimate.state))
    }

    /// The state of the last step.
    #[getter]
    fn state(&self) -> PyState {
        PyState(self.estimate.state)
    }

    /// Attitude as a quaternion w, x, y, z from body to earth, shape (4,).
    #[getter]
    fn attitude<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.estimate.attitude.map(f64::from).to_pyarray(py)
    }

    /// Biases of gyroscope [rad/s] and accelerometer [m/s2], and the barometer's offset [m].
    #[getter]
    fn biases<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("gyro_rad_s", array(py, &self.estimate.gyro_bias_rad_s))?;
        dict.set_item("accel_m_s2", array(py, &self.estimate.accel_bias_m_s2))?;
        dict.set_item("height_m", self.estimate.height_offset_m)?;
        Ok(dict)
    }

    /// Standard deviations of the errors; of the attitude about the axes of the earth frame.
    #[getter]
    fn sigmas<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (dict, sigmas) = (PyDict::new(py), &self.estimate.sigmas);
        dict.set_item("position_m", array(py, &sigmas.position_m))?;
        dict.set_item("velocity_m_s", array(py, &sigmas.velocity_m_s))?;
        dict.set_item("attitude_rad", array(py, &sigmas.attitude_rad))?;
        dict.set_item("gyro_rad_s", array(py, &sigmas.gyro_bias_rad_s))?;
        dict.set_item("accel_m_s2", array(py, &sigmas.accel_bias_m_s2))?;
        dict.set_item("height_m", sigmas.height_offset_m)?;
        Ok(dict)
    }

    /// Which parts of the state may be used.
    #[getter]
    fn valid<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (dict, valid) = (PyDict::new(py), &self.estimate.validity);
        dict.set_item("attitude", valid.attitude)?;
        dict.set_item("heading", valid.heading)?;
        dict.set_item("velocity", valid.velocity)?;
        dict.set_item("position", valid.position)?;
        dict.set_item("height", valid.height)?;
        Ok(dict)
    }

    /// Why it has not started; None once it runs.
    #[getter]
    fn unready(&self) -> Option<String> {
        self.estimate.unready.map(|why| why.to_string())
    }
}
