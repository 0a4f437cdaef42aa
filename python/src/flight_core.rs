//! The class `FlightCore`: the flight core around a control law, tick by tick.

use crate::argument::{CallArg, NamedGains, optional};
use crate::controller::{LawChoice, PyAction, SetpointArgument, made};
use crate::error::error;
use crate::plant::StateArgument;
use crate::vehicle::{VehicleArgument, flown};
use afbc_control::{Action, FlightController, Mixer};
use afbc_flight_core::{FlightCore, FlightCoreMemory, Inbox, Mode, Request, RequestAnswer, Stamped, Ticketed};
use afbc_scenario::AnyController;
use afbc_types::{ROTORS_MAX, with_rotors};
use core::fmt::Debug;
use pyo3::prelude::*;
use std::sync::{Mutex, PoisonError};

/// Time between ticks [us].
const TICK_US: u64 = 1000;

const REQUESTS: [(&str, Request); 4] =
    [("arm", Request::Arm), ("disarm", Request::Disarm), ("kill", Request::Kill), ("engage", Request::Engage)];

/// Result of a tick, padded to the largest number of rotors.
struct TickResult {
    action: Action<ROTORS_MAX>,
    mode: Mode,
    answer: Option<RequestAnswer>,
    against: Vec<String>,
    ended: Option<String>,
}

/// A flight core for any number of rotors, which is fixed when it is made.
trait DynFlightCore: Send + Sync {
    fn tick(&mut self, now_us: u64, inbox: &Inbox) -> TickResult;
    fn airborne(&self) -> bool;
    fn rested(&self) -> bool;
}

struct SizedFlightCore<const N: usize> {
    /// The mutex makes the core `Sync`: a user's own law cannot be shared between threads.
    core: Mutex<FlightCore<AnyController<N>, N>>,
    mixer: Mixer<N>,
    memory: FlightCoreMemory<<AnyController<N> as FlightController<N>>::Memory>,
}

impl<const N: usize> DynFlightCore for SizedFlightCore<N> {
    fn tick(&mut self, now_us: u64, inbox: &Inbox) -> TickResult {
        let core = self.core.get_mut().unwrap_or_else(PoisonError::into_inner);
        let outcome = core.tick(&mut self.memory, now_us, inbox);
        let inputs = self.mixer.inputs(&outcome.forces);
        let mut action = Action::new(outcome.motors, outcome.forces, inputs, false);
        action.health = outcome.health.control;
        TickResult {
            action: action.padded(),
            mode: outcome.mode,
            answer: outcome.answer,
            against: outcome.against.iter().map(|reason| words(&reason)).collect(),
            ended: outcome.ended.map(|reason| words(&reason)),
        }
    }

    fn airborne(&self) -> bool {
        self.memory.airborne()
    }

    fn rested(&self) -> bool {
        self.memory.rested()
    }
}

/// Returns a name of the source code as words: "state stale" for `StateStale`.
pub(crate) fn words(name: &impl Debug) -> String {
    let mut words = String::new();
    for letter in format!("{name:?}").chars() {
        if letter.is_uppercase() && !words.is_empty() {
            words.push(' ');
        }
        words.extend(letter.to_lowercase());
    }
    words
}

/// The firmware's flight core around a control law, tick by tick at 1 kHz. It arms, flies, coasts or descends without
/// states, and disarms.
#[pyclass(name = "FlightCore", module = "afbc")]
pub(crate) struct PyFlightCore {
    core: Box<dyn DynFlightCore>,
    rotors: usize,
    inbox: Inbox,
    now_us: u64,
    ticked: Option<TickResult>,
}

#[pymethods]
impl PyFlightCore {
    /// Makes a flight core around the law `law` for this vehicle, or for the paper's, with the arming limits and gains
    /// of the vehicle's file. `gains` sets single gains by name, as for `Controller`.
    #[new]
    #[pyo3(signature = (law="afbc", vehicle=None, *, monitored=true, gains=None))]
    fn new(
        law: &str,
        vehicle: Option<CallArg<'_, VehicleArgument<'_>>>,
        monitored: bool,
        gains: Option<CallArg<'_, NamedGains>>,
    ) -> PyResult<Self> {
        let vehicle = flown(vehicle.as_ref())?;
        let NamedGains(gains) = optional(gains.as_ref(), "gains")?.unwrap_or_default();
        let named = LawChoice { law, profile: "flight", monitored, gains };
        let (contender, parameters, rotors) = made(&named, Some(&vehicle))?;
        let nominal = parameters.to_f32();
        let core: Box<dyn DynFlightCore> = with_rotors!(rotors.len(), N => {
            let controller = contender.controller::<N>(&parameters, &rotors).map_err(error)?;
            let mixer = *controller.mixer();
            let core = FlightCore::with_rotors(nominal, &vehicle.response(), vehicle.arming, controller);
            Ok::<Box<dyn DynFlightCore>, PyErr>(Box::new(SizedFlightCore {
                core: Mutex::new(core.map_err(error)?),
                mixer,
                memory: FlightCoreMemory::default(),
            }))
        })?;
        Ok(PyFlightCore { core, rotors: rotors.len(), inbox: Inbox::EMPTY, now_us: 0, ticked: None })
    }

    /// Requests "arm", "disarm", "kill" or "engage", which takes back a law that the monitor has replaced. The next
    /// step answers.
    fn request(&mut self, request: CallArg<'_, String>) -> PyResult<()> {
        let request = request.named("request")?;
        let known = REQUESTS.iter().find(|(name, _)| *name == request);
        let (_, value) = known.ok_or_else(|| {
            let names = REQUESTS.map(|(name, _)| name).join(", ");
            error(format!("{request}: no such request; the requests are {names}"))
        })?;
        self.inbox.request(Ticketed { value: *value, ticket: 0 });
        Ok(())
    }

    /// Performs a tick of 1 ms, with a fresh state from the vehicle's own estimate and a setpoint, if given. With
    /// `idle_on_ground`, the motors of an armed vehicle on the ground idle.
    #[pyo3(signature = (state=None, setpoint=None, *, idle_on_ground=false))]
    fn step(
        &mut self,
        state: Option<StateArgument<'_>>,
        setpoint: Option<SetpointArgument<'_>>,
        idle_on_ground: bool,
    ) -> PyResult<PyAction> {
        let state = optional(state.as_ref(), "state")?;
        let setpoint = optional(setpoint.as_ref(), "setpoint")?;
        self.now_us += TICK_US;
        let at_us = self.now_us;
        if let Some(state) = state.as_ref().map(Bound::get).filter(|state| state.0.is_plausible()) {
            self.inbox.locate(Stamped { value: state.0, at_us });
        }
        if let Some(setpoint) = setpoint {
            self.inbox.put_setpoint(Stamped { value: setpoint.get().0, at_us });
        }
        self.inbox.set_idle_on_ground(idle_on_ground);
        let ticked = self.core.tick(at_us, &self.inbox.take());
        let action = PyAction::new(ticked.action, self.rotors);
        self.ticked = Some(ticked);
        match crate::law::take_error() {
            Some(error) => Err(error),
            None => Ok(action),
        }
    }

    /// Time since power-up [s].
    #[getter]
    fn time_s(&self) -> f64 {
        self.now_us as f64 * 1e-6
    }

    /// Mode: "disarmed", "flying", "coasting" (without fresh states) or "descending".
    #[getter]
    fn mode(&self) -> String {
        words(&self.ticked.as_ref().map_or(Mode::Disarmed, |ticked| ticked.mode))
    }

    /// Answer of the last step to a request: "arm: granted" or the reason for the refusal; None without a request.
    #[getter]
    fn answer(&self) -> Option<String> {
        let answer = self.ticked.as_ref()?.answer.as_ref()?;
        let result = answer.result.map_or_else(|refusal| words(&refusal), |()| "granted".into());
        Some(format!("{}: {result}", words(&answer.request)))
    }

    /// Reasons against arming.
    #[getter]
    fn against(&self) -> Vec<String> {
        self.ticked.as_ref().map_or(Vec::new(), |ticked| ticked.against.clone())
    }

    /// Reason why the flight ended in the last step; None if it did not.
    #[getter]
    fn ended(&self) -> Option<String> {
        self.ticked.as_ref()?.ended.clone()
    }

    /// True if the vehicle's motion shows that it is in the air.
    #[getter]
    fn airborne(&self) -> bool {
        self.core.airborne()
    }

    /// True if the vehicle has been at rest for as long as arming requires.
    #[getter]
    fn rested(&self) -> bool {
        self.core.rested()
    }
}
