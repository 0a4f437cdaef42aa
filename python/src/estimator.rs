//! The class `Estimator`: the state estimator, step by step.

use crate::argument::{CallArg, all_finite, finite};
use crate::error::error;
use crate::motion::{PyState, array, vector};
use afbc_estimator::{Estimate, Estimator, ImuSample, Measurement, Memory, Settings, Stamped};
use nalgebra::Vector3;
use numpy::{PyArray1, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Latest accepted time [s], so that times fit the clock.
const LATEST_S: f64 = 1e9;

/// Estimates position, velocity, attitude and biases from an inertial sensor and other measurements, with the estimator
/// that flies on board. Each measurement is fused at its own time, up to 0.3 s late.
#[pyclass(name = "Estimator", module = "afbc")]
pub(crate) struct PyEstimator {
    estimator: Estimator,
    memory: Memory,
    estimate: Estimate,
    /// Time of the last step \[us\].
    now_us: u64,
}

/// A number as an argument.
type NumberArgument<'py> = CallArg<'py, f64>;
/// Three numbers as an argument.
type Vector3Argument<'py> = CallArg<'py, [f64; 3]>;

/// Returns the time of the argument called `name` on the estimator's clock \[us\].
fn us(time_s: &NumberArgument<'_>, name: &str) -> PyResult<u64> {
    let time_s = time_s.named(name)?;
    if (0.0..=LATEST_S).contains(&time_s) {
        return Ok((time_s * 1e6).round() as u64);
    }
    Err(error(format!("{name}: {time_s} given; times lie within 0 to {LATEST_S:e} s")))
}

/// Returns the number of the argument called `name` if it is finite.
fn number(given: &NumberArgument<'_>, name: &str) -> PyResult<f32> {
    Ok(finite(name, given.named(name)?)? as f32)
}

/// Returns the standard deviation of the argument called `name` if it is positive.
fn sigma(given: &NumberArgument<'_>, name: &str) -> PyResult<f32> {
    match number(given, name)? {
        value if value > 0.0 => Ok(value),
        value => Err(error(format!("{name}: {value} given; a positive number is needed"))),
    }
}

/// Returns the numbers of the argument called `name` if they are finite.
fn three(given: &Vector3Argument<'_>, name: &str) -> PyResult<Vector3<f32>> {
    Ok(vector(all_finite(name, given.named(name)?)?))
}

impl PyEstimator {
    fn offer(&mut self, at_s: &NumberArgument<'_>, value: Measurement) -> PyResult<()> {
        if !value.is_plausible() {
            return Err(error(format!(
                "{value:?}: the value is not plausible; check units, and that the attitude has length 1"
            )));
        }
        self.memory.offer(&Stamped { value, at_us: us(at_s, "at_s")? });
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
        Ok(PyEstimator { estimator, memory, estimate, now_us: 0 })
    }

    /// Adds a tracker's pose, valid at `at_s`: position [m], attitude as a quaternion w, x, y, z from body to earth,
    /// and standard deviations [m, rad].
    #[pyo3(
        signature = (
            at_s, position_m, attitude, position_sigma_m=CallArg::Default(0.001),
            attitude_sigma_rad=CallArg::Default(0.01)
        ),
        text_signature = "($self, at_s, position_m, attitude, position_sigma_m=0.001, attitude_sigma_rad=0.01)"
    )]
    fn pose(
        &mut self,
        at_s: NumberArgument<'_>,
        position_m: Vector3Argument<'_>,
        attitude: CallArg<'_, [f64; 4]>,
        position_sigma_m: NumberArgument<'_>,
        attitude_sigma_rad: NumberArgument<'_>,
    ) -> PyResult<()> {
        let attitude = all_finite("attitude", attitude.named("attitude")?)?;
        let pose = Measurement::Pose {
            position_m: three(&position_m, "position_m")?,
            attitude: attitude.map(|part| part as f32),
            position_sigma_m: sigma(&position_sigma_m, "position_sigma_m")?,
            attitude_sigma_rad: sigma(&attitude_sigma_rad, "attitude_sigma_rad")?,
        };
        self.offer(&at_s, pose)
    }

    /// Adds a fix of a GNSS receiver in local coordinates, valid at `at_s`: position [m], velocity [m/s], standard
    /// deviations.
    #[pyo3(
        signature = (
            at_s, position_m, velocity_m_s, horizontal_sigma_m=CallArg::Default(1.5),
            vertical_sigma_m=CallArg::Default(3.0), speed_sigma_m_s=CallArg::Default(0.2),
            climb_sigma_m_s=CallArg::Default(0.3)
        ),
        text_signature = "($self, at_s, position_m, velocity_m_s, horizontal_sigma_m=1.5, vertical_sigma_m=3.0, \
                          speed_sigma_m_s=0.2, climb_sigma_m_s=0.3)"
    )]
    #[expect(clippy::too_many_arguments, reason = "each by its name")]
    fn gnss(
        &mut self,
        at_s: NumberArgument<'_>,
        position_m: Vector3Argument<'_>,
        velocity_m_s: Vector3Argument<'_>,
        horizontal_sigma_m: NumberArgument<'_>,
        vertical_sigma_m: NumberArgument<'_>,
        speed_sigma_m_s: NumberArgument<'_>,
        climb_sigma_m_s: NumberArgument<'_>,
    ) -> PyResult<()> {
        let fix = Measurement::Gnss {
            position_m: three(&position_m, "position_m")?,
            velocity_m_s: three(&velocity_m_s, "velocity_m_s")?,
            horizontal_sigma_m: sigma(&horizontal_sigma_m, "horizontal_sigma_m")?,
            vertical_sigma_m: sigma(&vertical_sigma_m, "vertical_sigma_m")?,
            speed_sigma_m_s: sigma(&speed_sigma_m_s, "speed_sigma_m_s")?,
            climb_sigma_m_s: sigma(&climb_sigma_m_s, "climb_sigma_m_s")?,
        };
        self.offer(&at_s, fix)
    }

    /// Adds a barometer's height [m] above any fixed reference.
    #[pyo3(
        signature = (at_s, height_m, sigma_m=CallArg::Default(0.1)),
        text_signature = "($self, at_s, height_m, sigma_m=0.1)"
    )]
    fn height(
        &mut self,
        at_s: NumberArgument<'_>,
        height_m: NumberArgument<'_>,
        sigma_m: NumberArgument<'_>,
    ) -> PyResult<()> {
        let (height_m, sigma_m) = (number(&height_m, "height_m")?, sigma(&sigma_m, "sigma_m")?);
        self.offer(&at_s, Measurement::Height { height_m, sigma_m })
    }

    /// Adds a magnetometer's field in the body frame, in any unit, as long as the unit stays the same.
    #[pyo3(signature = (at_s, field, sigma))]
    fn magnetic_field(
        &mut self,
        at_s: NumberArgument<'_>,
        field: Vector3Argument<'_>,
        sigma: NumberArgument<'_>,
    ) -> PyResult<()> {
        let (field, sigma) = (three(&field, "field")?, self::sigma(&sigma, "sigma")?);
        self.offer(&at_s, Measurement::MagneticField { field, sigma })
    }

    /// Adds a heading [rad].
    #[pyo3(
        signature = (at_s, heading_rad, sigma_rad=CallArg::Default(0.05)),
        text_signature = "($self, at_s, heading_rad, sigma_rad=0.05)"
    )]
    fn heading(
        &mut self,
        at_s: NumberArgument<'_>,
        heading_rad: NumberArgument<'_>,
        sigma_rad: NumberArgument<'_>,
    ) -> PyResult<()> {
        let (heading_rad, sigma_rad) = (number(&heading_rad, "heading_rad")?, sigma(&sigma_rad, "sigma_rad")?);
        self.offer(&at_s, Measurement::Heading { heading_rad, sigma_rad })
    }

    /// Sets whether the vehicle stands on the ground. While it rests there, its velocity is held at zero.
    fn set_on_ground(&mut self, on_ground: bool) {
        self.memory.set_on_ground(on_ground);
    }

    /// Performs a step at `now_s`, with a sample of the inertial sensor if there is one: rates [rad/s] and specific
    /// force [m/s2] in the body frame, valid at `now_s`. Returns the state.
    #[pyo3(signature = (now_s, rates_rad_s=None, specific_force_m_s2=None))]
    fn step(
        &mut self,
        now_s: NumberArgument<'_>,
        rates_rad_s: Option<Vector3Argument<'_>>,
        specific_force_m_s2: Option<Vector3Argument<'_>>,
    ) -> PyResult<PyState> {
        let now_us = us(&now_s, "now_s")?;
        if now_us < self.now_us {
            let [now_s, last_s] = [now_us, self.now_us].map(|us| us as f64 * 1e-6);
            return Err(error(format!("now_s: {now_s} given after {last_s}; time does not run backwards")));
        }
        let rates = rates_rad_s.map(|rates| three(&rates, "rates_rad_s")).transpose()?;
        let force = specific_force_m_s2.map(|force| three(&force, "specific_force_m_s2")).transpose()?;
        let sample = match (rates, force) {
            (Some(rates_rad_s), Some(specific_force_m_s2)) => {
                Some(ImuSample { at_us: now_us, rates_rad_s, specific_force_m_s2 })
            }
            (None, None) => None,
            _ => return Err(error("rates_rad_s, specific_force_m_s2: a sample needs both; give both, or none")),
        };
        self.now_us = now_us;
        self.estimate = self.estimator.step(&mut self.memory, now_us, sample.as_ref());
        Ok(PyState(self.estimate.state))
    }

    /// State of the last step.
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

    /// Standard deviations of the errors. Those of the attitude are about the axes of the earth frame.
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

    /// Parts of the state that may be used.
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

    /// Reason why the estimator has not started; None once it runs.
    #[getter]
    fn unready(&self) -> Option<String> {
        self.estimate.unready.map(|why| why.to_string())
    }
}
