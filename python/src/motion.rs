//! The classes `State` and `Setpoint`.

use crate::argument::CallArg;
use afbc_types::{Setpoint, State};
use nalgebra::Vector3;
use numpy::{PyArray1, ToPyArray};
use pyo3::prelude::*;

type NumpyArray<'py> = Bound<'py, PyArray1<f64>>;
type Vector3Argument<'py> = CallArg<'py, [f64; 3]>;
const ZERO: [f64; 3] = [0.0; 3];

/// Returns the three numbers as an array of doubles, which hold singles exactly.
pub(crate) fn array<'py>(py: Python<'py>, vector: &Vector3<f32>) -> NumpyArray<'py> {
    [vector.x, vector.y, vector.z].map(f64::from).to_pyarray(py)
}

/// Returns the three numbers in single precision, which the controllers use.
pub(crate) fn vector(numbers: [f64; 3]) -> Vector3<f32> {
    Vector3::from(numbers.map(|number| number as f32))
}

/// Measured motion of the vehicle: position and velocity in the earth frame (z up), Euler angles roll, pitch, yaw
/// (z-y-x), and body rates (x forward, y left, z up).
#[pyclass(name = "State", module = "afbc", frozen, from_py_object)]
#[derive(Clone, Copy)]
pub(crate) struct PyState(pub(crate) State);

#[pymethods]
impl PyState {
    #[new]
    #[pyo3(signature = (
        position_m=CallArg::Default(ZERO), velocity_m_s=CallArg::Default(ZERO), attitude_rad=CallArg::Default(ZERO),
        rates_rad_s=CallArg::Default(ZERO)
    ))]
    fn new(
        position_m: Vector3Argument<'_>,
        velocity_m_s: Vector3Argument<'_>,
        attitude_rad: Vector3Argument<'_>,
        rates_rad_s: Vector3Argument<'_>,
    ) -> PyResult<Self> {
        Ok(PyState(State {
            position_m: vector(position_m.named("position_m")?),
            velocity_m_s: vector(velocity_m_s.named("velocity_m_s")?),
            attitude_rad: vector(attitude_rad.named("attitude_rad")?),
            rates_rad_s: vector(rates_rad_s.named("rates_rad_s")?),
        }))
    }

    fn __reduce__<'py>(
        &self,
        py: Python<'py>,
    ) -> (Bound<'py, PyAny>, (NumpyArray<'py>, NumpyArray<'py>, NumpyArray<'py>, NumpyArray<'py>)) {
        let State { position_m, velocity_m_s, attitude_rad, rates_rad_s } = &self.0;
        let [x, v, eta, omega] = [position_m, velocity_m_s, attitude_rad, rates_rad_s].map(|part| array(py, part));
        (py.get_type::<PyState>().into_any(), (x, v, eta, omega))
    }

    #[getter]
    fn position_m<'py>(&self, py: Python<'py>) -> NumpyArray<'py> {
        array(py, &self.0.position_m)
    }

    #[getter]
    fn velocity_m_s<'py>(&self, py: Python<'py>) -> NumpyArray<'py> {
        array(py, &self.0.velocity_m_s)
    }

    #[getter]
    fn attitude_rad<'py>(&self, py: Python<'py>) -> NumpyArray<'py> {
        array(py, &self.0.attitude_rad)
    }

    #[getter]
    fn rates_rad_s<'py>(&self, py: Python<'py>) -> NumpyArray<'py> {
        array(py, &self.0.rates_rad_s)
    }

    /// All twelve numbers in this order, as an optimiser or a neural network needs them.
    #[getter]
    fn vector<'py>(&self, py: Python<'py>) -> NumpyArray<'py> {
        numbers(&self.0).to_pyarray(py)
    }

    fn __repr__(&self) -> String {
        let State { position_m: x, velocity_m_s: v, attitude_rad: eta, rates_rad_s: omega } = &self.0;
        let list = |v: &Vector3<f32>| format!("[{}, {}, {}]", v.x, v.y, v.z);
        format!(
            "State(position_m={}, velocity_m_s={}, attitude_rad={}, rates_rad_s={})",
            list(x),
            list(v),
            list(eta),
            list(omega)
        )
    }
}

/// Returns the twelve numbers of a state.
pub(crate) fn numbers(state: &State) -> [f64; 12] {
    let parts = [&state.position_m, &state.velocity_m_s, &state.attitude_rad, &state.rates_rad_s];
    let mut numbers = parts.into_iter().flat_map(|part| part.iter().map(|number| f64::from(*number)));
    core::array::from_fn(|_| numbers.next().unwrap_or_default())
}

/// Numbers of a setpoint, in the order of its constructor.
type SetpointNumbers<'py> =
    (NumpyArray<'py>, NumpyArray<'py>, NumpyArray<'py>, NumpyArray<'py>, NumpyArray<'py>, f32, f32, f32);

/// Desired motion in the earth frame: position with four derivatives, heading with two.
#[pyclass(name = "Setpoint", module = "afbc", frozen, from_py_object)]
#[derive(Clone, Copy)]
pub(crate) struct PySetpoint(pub(crate) Setpoint);

#[pymethods]
impl PySetpoint {
    #[new]
    #[pyo3(
        signature = (
            position_m=CallArg::Default(ZERO), velocity_m_s=CallArg::Default(ZERO),
            acceleration_m_s2=CallArg::Default(ZERO), jerk_m_s3=CallArg::Default(ZERO),
            snap_m_s4=CallArg::Default(ZERO), yaw_rad=CallArg::Default(0.0),
            yaw_rate_rad_s=CallArg::Default(0.0), yaw_acceleration_rad_s2=CallArg::Default(0.0)
        ),
        text_signature = "(position_m=..., velocity_m_s=..., acceleration_m_s2=..., jerk_m_s3=..., snap_m_s4=..., \
                          yaw_rad=0.0, yaw_rate_rad_s=0.0, yaw_acceleration_rad_s2=0.0)"
    )]
    #[expect(clippy::too_many_arguments, reason = "each by its name")]
    fn new(
        position_m: Vector3Argument<'_>,
        velocity_m_s: Vector3Argument<'_>,
        acceleration_m_s2: Vector3Argument<'_>,
        jerk_m_s3: Vector3Argument<'_>,
        snap_m_s4: Vector3Argument<'_>,
        yaw_rad: CallArg<'_, f64>,
        yaw_rate_rad_s: CallArg<'_, f64>,
        yaw_acceleration_rad_s2: CallArg<'_, f64>,
    ) -> PyResult<Self> {
        Ok(PySetpoint(Setpoint {
            position_m: vector(position_m.named("position_m")?),
            velocity_m_s: vector(velocity_m_s.named("velocity_m_s")?),
            acceleration_m_s2: vector(acceleration_m_s2.named("acceleration_m_s2")?),
            jerk_m_s3: vector(jerk_m_s3.named("jerk_m_s3")?),
            snap_m_s4: vector(snap_m_s4.named("snap_m_s4")?),
            yaw_rad: yaw_rad.named("yaw_rad")? as f32,
            yaw_rate_rad_s: yaw_rate_rad_s.named("yaw_rate_rad_s")? as f32,
            yaw_acceleration_rad_s2: yaw_acceleration_rad_s2.named("yaw_acceleration_rad_s2")? as f32,
        }))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> (Bound<'py, PyAny>, SetpointNumbers<'py>) {
        let Setpoint { position_m, velocity_m_s, acceleration_m_s2, jerk_m_s3, snap_m_s4, .. } = &self.0;
        let Setpoint { yaw_rad, yaw_rate_rad_s, yaw_acceleration_rad_s2, .. } = self.0;
        let [x, v, a, j, s] =
            [position_m, velocity_m_s, acceleration_m_s2, jerk_m_s3, snap_m_s4].map(|part| array(py, part));
        let numbers = (x, v, a, j, s, yaw_rad, yaw_rate_rad_s, yaw_acceleration_rad_s2);
        (py.get_type::<PySetpoint>().into_any(), numbers)
    }

    #[getter]
    fn position_m<'py>(&self, py: Python<'py>) -> NumpyArray<'py> {
        array(py, &self.0.position_m)
    }

    #[getter]
    fn velocity_m_s<'py>(&self, py: Python<'py>) -> NumpyArray<'py> {
        array(py, &self.0.velocity_m_s)
    }

    #[getter]
    fn acceleration_m_s2<'py>(&self, py: Python<'py>) -> NumpyArray<'py> {
        array(py, &self.0.acceleration_m_s2)
    }

    #[getter]
    fn jerk_m_s3<'py>(&self, py: Python<'py>) -> NumpyArray<'py> {
        array(py, &self.0.jerk_m_s3)
    }

    #[getter]
    fn snap_m_s4<'py>(&self, py: Python<'py>) -> NumpyArray<'py> {
        array(py, &self.0.snap_m_s4)
    }

    #[getter]
    fn yaw_rad(&self) -> f32 {
        self.0.yaw_rad
    }

    #[getter]
    fn yaw_rate_rad_s(&self) -> f32 {
        self.0.yaw_rate_rad_s
    }

    #[getter]
    fn yaw_acceleration_rad_s2(&self) -> f32 {
        self.0.yaw_acceleration_rad_s2
    }
}
