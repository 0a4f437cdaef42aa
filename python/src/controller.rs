//! The class `Controller`: a control law, step by step.

use crate::argument::{CallArg, NamedGains, optional};
use crate::error::error;
use crate::motion::{PySetpoint, PyState};
use crate::plant::StateArgument;
use crate::vehicle::{self, VehicleArgument};
use afbc::{AdaptiveEstimate, Profile};
use afbc_control::{Action, FlightController, Trace, Validated};
use afbc_scenario::contender::{Contender, ControllerKind};
use afbc_scenario::{AnyController, AnyControllerMemory};
use afbc_types::{
    Axis, Declaration, Declared, DeclaredValue, DeclaredValueMut, Inputs, PLUS, Parameters, PerAxis, ROTORS_MAX, Rotor,
    with_rotors,
};
use afbc_vehicles::Vehicle;
use core::convert::Infallible;
use numpy::{PyArray1, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::{Mutex, PoisonError};

/// Result of a controller's step.
#[pyclass(name = "Action", module = "afbc", frozen)]
pub(crate) struct PyAction {
    action: Action<ROTORS_MAX>,
    rotors: usize,
}

impl PyAction {
    /// Makes an action for this number of rotors.
    pub(crate) fn new(action: Action<ROTORS_MAX>, rotors: usize) -> Self {
        PyAction { action, rotors }
    }
}

#[pymethods]
impl PyAction {
    /// Rotor speeds [rad/s], shape (rotors,).
    #[getter]
    fn speeds_rad_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.action.speeds.0.iter().take(self.rotors).map(|speed| f64::from(*speed)))
    }

    /// Rotor forces [N], shape (rotors,).
    #[getter]
    fn forces_n<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.action.forces.0.iter().take(self.rotors).map(|force| f64::from(*force)))
    }

    /// Inputs U1, U2, U3, U4 that the forces produce [N], shape (4,).
    #[getter]
    fn inputs_n<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        inputs(py, &self.action.given)
    }

    /// True if a rotor force was limited.
    #[getter]
    fn saturated(&self) -> bool {
        self.action.health.saturated
    }

    /// True if the state was missing or implausible, so that the last one was used.
    #[getter]
    fn state_rejected(&self) -> bool {
        self.action.health.state_rejected
    }

    /// True if the setpoint was implausible.
    #[getter]
    fn setpoint_rejected(&self) -> bool {
        self.action.health.setpoint_rejected
    }

    /// Reason why a fallback law flies; None if none does.
    #[getter]
    fn fallback(&self) -> Option<&'static str> {
        self.action.health.fallback
    }
}

fn inputs<'py>(py: Python<'py>, u: &Inputs) -> Bound<'py, PyArray1<f64>> {
    [u.roll_n, u.pitch_n, u.yaw_n, u.thrust_n].map(f64::from).to_pyarray(py)
}

/// Argument that must be a setpoint.
pub(crate) type SetpointArgument<'py> = CallArg<'py, Bound<'py, PySetpoint>>;

/// A controller for any number of rotors, which is fixed when it is made.
trait DynController: Send + Sync {
    fn step(&mut self, state: Option<&PyState>, setpoint: &PySetpoint) -> Action<ROTORS_MAX>;
    fn reset(&mut self);
    fn trace(&self) -> Trace;
    fn estimates(&self) -> Option<PerAxis<AdaptiveEstimate>>;
}

struct SizedController<const N: usize> {
    /// The mutex makes the controller `Sync`: a user's own law cannot be shared between threads.
    controller: Mutex<AnyController<N>>,
    memory: Validated<AnyControllerMemory<N>>,
}

impl<const N: usize> DynController for SizedController<N> {
    fn step(&mut self, state: Option<&PyState>, setpoint: &PySetpoint) -> Action<ROTORS_MAX> {
        let controller = self.controller.get_mut().unwrap_or_else(PoisonError::into_inner);
        controller.step(&mut self.memory, state.map(|state| &state.0), &setpoint.0).padded()
    }

    fn reset(&mut self) {
        self.memory = Validated::default();
    }

    fn trace(&self) -> Trace {
        AnyController::<N>::trace(&self.memory.control)
    }

    fn estimates(&self) -> Option<PerAxis<AdaptiveEstimate>> {
        self.memory.control.estimates()
    }
}

/// A control law on a vehicle, step by step. It is the same code that flies on a board.
#[pyclass(name = "Controller", module = "afbc")]
pub(crate) struct PyController {
    contender: Contender,
    rotors: usize,
    law: Box<dyn DynController>,
}

#[pymethods]
impl PyController {
    /// Makes the law `law` for this vehicle, or for the paper's. The profile "flight" takes the gains of the vehicle's
    /// file, "paper" those of the paper. `gains` sets single gains by name, such as "x.alpha1" or "kp".
    #[new]
    #[pyo3(signature = (law="afbc", vehicle=None, *, profile="flight", monitored=false, gains=None))]
    fn new(
        law: &str,
        vehicle: Option<CallArg<'_, VehicleArgument<'_>>>,
        profile: &str,
        monitored: bool,
        gains: Option<CallArg<'_, NamedGains>>,
    ) -> PyResult<Self> {
        let vehicle = vehicle::given(vehicle.as_ref())?;
        let NamedGains(gains) = optional(gains.as_ref(), "gains")?.unwrap_or_default();
        let named = LawChoice { law, profile, monitored, gains };
        let (contender, parameters, rotors) = made(&named, vehicle.as_ref())?;
        let law: Box<dyn DynController> = with_rotors!(rotors.len(), N => {
            let controller = contender.controller::<N>(&parameters, &rotors).map_err(error)?;
            Ok::<Box<dyn DynController>, PyErr>(Box::new(SizedController {
                controller: Mutex::new(controller),
                memory: Validated::default(),
            }))
        })?;
        Ok(PyController { contender, rotors: rotors.len(), law })
    }

    /// Name of the law.
    #[getter]
    fn law(&self) -> &'static str {
        self.contender.kind().name()
    }

    /// Time between steps [s].
    #[getter]
    fn dt_s(&self) -> f64 {
        self.contender.step_s()
    }

    /// Gains by name.
    #[getter]
    fn gains<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        gains(&self.contender).into_iter().try_for_each(|(name, value)| dict.set_item(name, value))?;
        Ok(dict)
    }

    /// Performs a step. Without a state, the last one is used and the law does not adapt.
    fn step(&mut self, state: Option<StateArgument<'_>>, setpoint: SetpointArgument<'_>) -> PyResult<PyAction> {
        let (state, setpoint) = (optional(state.as_ref(), "state")?, setpoint.named("setpoint")?);
        let action = self.law.step(state.as_ref().map(Bound::get), setpoint.get());
        match crate::law::take_error() {
            Some(error) => Err(error),
            None => Ok(PyAction { action, rotors: self.rotors }),
        }
    }

    /// Resets the law to its state before the first step.
    fn reset(&mut self) {
        self.law.reset();
    }

    /// Internal signals of the last step by name: demanded inputs and angles, errors and, for AFBC, estimates.
    #[getter]
    fn trace<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (trace, dict) = (self.law.trace(), PyDict::new(py));
        dict.set_item("inputs_n", inputs(py, &trace.inputs))?;
        dict.set_item("virtual_m_s2", trace.virtual_m_s2.map(f64::from).to_pyarray(py))?;
        dict.set_item("desired_rad", trace.desired_rad.map(f64::from).to_pyarray(py))?;
        let estimates = self.law.estimates();
        for axis in Axis::ALL {
            let errors = &trace.errors[axis];
            dict.set_item(format!("{}.e1", axis.name()), errors.e1)?;
            dict.set_item(format!("{}.e1_dot", axis.name()), errors.e1_dot)?;
            dict.set_item(format!("{}.e2", axis.name()), errors.e2)?;
            if let Some(estimates) = &estimates {
                dict.set_item(format!("{}.delta_hat", axis.name()), estimates[axis].delta)?;
                let theta: Vec<f64> = estimates[axis].theta.iter().map(|theta| f64::from(*theta)).collect();
                dict.set_item(format!("{}.theta_hat", axis.name()), theta.to_pyarray(py))?;
            }
        }
        Ok(dict)
    }
}

/// Choice of a law and its gains.
pub(crate) struct LawChoice<'a> {
    pub(crate) law: &'a str,
    pub(crate) profile: &'a str,
    pub(crate) monitored: bool,
    pub(crate) gains: Vec<(String, f64)>,
}

/// Returns the law, and parameters and rotors of its vehicle. Without a vehicle, these are the paper's.
pub(crate) fn made(
    named: &LawChoice<'_>,
    vehicle: Option<&Vehicle>,
) -> PyResult<(Contender, Parameters<f64>, Vec<Rotor<f64>>)> {
    let LawChoice { law, profile, monitored, gains } = named;
    let kind = ControllerKind::named(law)
        .ok_or_else(|| error(format!("{law}: no such law; {}", ControllerKind::cure(law))))?;
    let profile = Profile::ALL.into_iter().find(|known| known.name() == *profile).ok_or_else(|| {
        let known = Profile::ALL.map(Profile::name).join(", ");
        error(format!("{profile}: no such profile; the profiles are {known}"))
    })?;
    let mut contender = Contender::of(kind, profile);
    let (mut parameters, mut rotors) = (Parameters::PAPER, PLUS.map(|rotor| rotor.to_f64()).to_vec());
    if let Some(vehicle) = vehicle {
        contender = contender.on(vehicle, profile).map_err(error)?;
        (parameters, rotors) = (vehicle.parameters, vehicle.rotors.clone());
    }
    for (name, value) in gains {
        set(&mut contender, name, *value)?;
    }
    if *monitored {
        contender = contender.monitored();
    }
    contender.check(&parameters, &rotors).map_err(error)?;
    Ok((contender, parameters, rotors))
}

/// Returns the gains of a contender by name.
pub(crate) fn gains(contender: &Contender) -> Vec<(String, f64)> {
    let mut gains = Vec::new();
    let Ok(()) = contender.law.visit(&mut |declaration: &Declaration, value: DeclaredValue<'_>| {
        gains.extend(value.numbers().map(|number| (full(declaration), number)));
        Ok::<(), Infallible>(())
    });
    gains
}

/// Returns the name of a gain: its key in files, after its axis if it has one.
fn full(declaration: &Declaration) -> String {
    match declaration.group {
        "" => declaration.range.name.into(),
        group => format!("{group}.{}", declaration.range.name),
    }
}

/// Sets a gain by name.
fn set(contender: &mut Contender, name: &str, value: f64) -> PyResult<()> {
    let (mut found, mut known) = (false, Vec::new());
    let Ok(()) = contender.law.visit_mut(&mut |declaration: &Declaration, of: DeclaredValueMut<'_>| {
        if let DeclaredValueMut::Single([gain]) = of {
            if full(declaration) == name {
                *gain = value as f32;
                found = true;
            }
            known.push(full(declaration));
        }
        Ok::<(), Infallible>(())
    });
    match found {
        true => contender.law.validate().map_err(error),
        false => Err(error(format!("{name}: no such gain; the gains are {}", known.join(", ")))),
    }
}
