//! Control laws that users write in Python.

use crate::argument::{Argument, CallArg, optional, wrong};
use crate::error::error;
use crate::motion::{PySetpoint, PyState};
use afbc_scenario::contender::ControllerKind;
use afbc_scenario::{OwnController, OwnGain, OwnLaw, OwnVehicle};
use afbc_types::{Inputs, Setpoint, State};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

/// Exception that a law raised, kept until the call that flies raises it again.
static RAISED: Mutex<Option<PyErr>> = Mutex::new(None);
/// Names that live as long as the program.
static NAMES: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());

pub(crate) fn forget_error() {
    take_error();
}

pub(crate) fn has_error() -> bool {
    RAISED.lock().unwrap_or_else(PoisonError::into_inner).is_some()
}

pub(crate) fn take_error() -> Option<PyErr> {
    RAISED.lock().unwrap_or_else(PoisonError::into_inner).take()
}

fn raise(error: PyErr) {
    // Keeps the first exception, since later ones may follow from it.
    RAISED.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
}

/// Returns the same text with the lifetime of the program.
fn kept(name: &str) -> &'static str {
    let mut names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = names.get(name) {
        return known;
    }
    let name: &'static str = Box::leak(name.to_owned().into_boxed_str());
    names.insert(name);
    name
}

/// Data of the vehicle that a law flies.
#[pyclass(name = "OwnVehicle", module = "afbc", frozen)]
pub(crate) struct PyOwnVehicle {
    vehicle: OwnVehicle,
    gains: Vec<&'static str>,
}

#[pymethods]
impl PyOwnVehicle {
    #[getter]
    fn mass_kg(&self) -> f32 {
        self.vehicle.parameters.mass_kg
    }

    #[getter]
    fn gravity_m_s2(&self) -> f32 {
        self.vehicle.parameters.gravity_m_s2
    }

    /// Distance from the centre of mass to a rotor shaft [m].
    #[getter]
    fn arm_m(&self) -> f32 {
        self.vehicle.parameters.arm_m
    }

    /// Force of a rotor divided by the square of its speed [N s2].
    #[getter]
    fn thrust_factor_n_s2(&self) -> f32 {
        self.vehicle.parameters.thrust_factor_n_s2
    }

    /// Drag moment of a rotor divided by the square of its speed [N m s2].
    #[getter]
    fn drag_factor_n_m_s2(&self) -> f32 {
        self.vehicle.parameters.drag_factor_n_m_s2
    }

    /// Inertia about the body axes [kg m2], shape (3,).
    #[getter]
    fn inertia_kg_m2<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        crate::motion::array(py, &self.vehicle.parameters.inertia_kg_m2).into_any()
    }

    /// Angular acceleration about each body axis per newton of U1, U2, U3 [rad/s2 per N], shape (3,).
    #[getter]
    fn effectiveness<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        crate::motion::array(py, &self.vehicle.parameters.effectiveness()).into_any()
    }

    /// Number of rotors.
    #[getter]
    fn rotors(&self) -> usize {
        self.vehicle.rotors
    }

    /// Largest force of one rotor [N].
    #[getter]
    fn rotor_force_max_n(&self) -> f32 {
        self.vehicle.rotor_force_max_n
    }

    /// Time between steps [s].
    #[getter]
    fn dt_s(&self) -> f32 {
        self.vehicle.dt_s
    }

    /// The law's gains by name.
    #[getter]
    fn gains<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        self.gains.iter().zip(self.vehicle.gains).try_for_each(|(name, value)| dict.set_item(name, value))?;
        Ok(dict)
    }
}

/// Default, smallest and largest value of a gain.
type GainRange = (f64, f64, f64);

/// A control law written in Python.
struct PythonLaw(Option<Py<PyAny>>);

impl PythonLaw {
    fn inputs(&self, state: &State, setpoint: &Setpoint, fresh: bool) -> PyResult<Inputs> {
        let Some(law) = &self.0 else { return Ok(Inputs::default()) };
        Python::attach(|py| {
            let given = law.bind(py).call_method1("step", (PyState(*state), PySetpoint(*setpoint), fresh))?;
            let given = <[f64; 4]>::of("U1, U2, U3, U4 [N] of step", &given)?;
            let [roll_n, pitch_n, yaw_n, thrust_n] = given.map(|input| input as f32);
            if given.iter().any(|input| !input.is_finite()) {
                return Err(error(format!("step returned {given:?}: U1, U2, U3, U4 must be finite")));
            }
            Ok(Inputs { roll_n, pitch_n, yaw_n, thrust_n })
        })
    }
}

impl OwnController for PythonLaw {
    fn step(&mut self, state: &State, setpoint: &Setpoint, fresh: bool) -> Inputs {
        self.inputs(state, setpoint, fresh).unwrap_or_else(|error| {
            raise(error);
            // The law is not called again: the vehicle falls, and the flight ends soon.
            self.0 = None;
            Inputs::default()
        })
    }
}

/// Registers a law of your own, which then flies wherever a built-in one does: in `fly`, `compare`, `campaign`, `tune`
/// and scenario files.
///
/// `make(vehicle)` is called at the start of each flight with an `OwnVehicle`. It returns an object whose `step(state,
/// setpoint, fresh)` returns the demanded U1, U2, U3, U4 [N] every millisecond. `gains` maps names to default, smallest
/// and largest values; `tune` searches them. A law of the same name is replaced.
#[pyfunction]
#[pyo3(signature = (name, make, *, title=None, gains=None))]
pub(crate) fn register(
    name: CallArg<'_, String>,
    make: Bound<'_, PyAny>,
    title: Option<CallArg<'_, String>>,
    gains: Option<Vec<(String, GainRange)>>,
) -> PyResult<()> {
    let name = name.named("name")?;
    if !make.is_callable() {
        return Err(wrong("make", "a class, or another callable that takes an afbc.OwnVehicle, is", &make));
    }
    let make = make.unbind();
    let title = optional(title.as_ref(), "title")?.unwrap_or_else(|| name.clone());
    let gains = gains.unwrap_or_default();
    let names: Vec<&'static str> = gains.iter().map(|(name, _)| kept(name)).collect();
    let own = names.iter().zip(&gains);
    let gains: Vec<OwnGain> =
        own.map(|(name, (_, (value, min, max)))| OwnGain::new(name, "1", *value as f32, [*min, *max])).collect();
    let law = OwnLaw::new(kept(&name), move |vehicle| {
        let vehicle = PyOwnVehicle { vehicle: *vehicle, gains: names.clone() };
        PythonLaw(Python::attach(|py| make.call1(py, (vehicle,))).map_err(raise).ok())
    });
    law.title(kept(&title)).gains(gains).register().map(drop).map_err(error)
}

/// Returns the names of the laws: the built-in ones, then the registered ones.
#[pyfunction]
pub(crate) fn laws() -> Vec<&'static str> {
    ControllerKind::all().into_iter().map(ControllerKind::name).collect()
}
