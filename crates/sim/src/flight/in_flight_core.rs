//! Flies a controller inside the flight core, as on board, but without board and link.

use super::pilot::FlightSoftware;
use super::sample::{Sample, estimates};
use super::world::{World, WorldView};
use afbc_control::{Action, FlightController, Mixer};
use afbc_flight_core::motor::Response;
use afbc_flight_core::rate::{PERIOD_US, WINDOW_US};
use afbc_flight_core::{ArmingLimits, FlightCore, FlightCoreMemory, Inbox, Mode, Request, Stamped, Ticketed};
use afbc_onboard::Aged;
use afbc_types::{OutOfRange, Parameters, Setpoint, State};
use core::convert::Infallible;

/// Ticks before the first step: the flight core arms only after it has measured its tick rate.
const TICKS_HELD: u64 = WINDOW_US as u64 / PERIOD_US + 1;

/// A controller inside the flight core. Without states the flight core flies by dead reckoning, then descends.
pub struct InFlightCore<C: FlightController<N>, const N: usize> {
    vehicle: FlightCore<C, N>,
    mixer: Mixer<N>,
    memory: FlightCoreMemory<C::Memory>,
    inbox: Inbox,
    /// Time since power-up \[us\].
    now_us: u64,
}

impl<C: FlightController<N>, const N: usize> InFlightCore<C, N> {
    /// Puts `controller` into a flight core without arming limits. The controller must be built for this vehicle;
    /// `rotors` is its rotors' response.
    ///
    /// # Errors
    /// Returns an error if the controller's time step is not the flight core's 1 ms.
    pub fn new(vehicle: Parameters, rotors: &Response, controller: C) -> Result<Self, OutOfRange> {
        let mixer = *controller.mixer();
        let vehicle = FlightCore::with_rotors(vehicle, rotors, ArmingLimits::NONE, controller)?;
        Ok(InFlightCore { vehicle, mixer, memory: FlightCoreMemory::default(), inbox: Inbox::default(), now_us: 0 })
    }

    /// Runs one tick with the inputs that `view` shows.
    fn tick(&mut self, view: &WorldView, setpoint: Setpoint) -> Action<N> {
        self.now_us += PERIOD_US;
        let at_us = self.now_us;
        let stamped = |value| Stamped { value, at_us };
        if let Some(Aged { value, age_us }) = view.pose {
            self.inbox.put_pose(Stamped { value, at_us: at_us.saturating_sub(age_us.into()) });
        }
        // Only new states are passed on. A state that is held between samples would count as fresh, and the flight core
        // extrapolates by itself.
        match (view.state.filter(|state| view.new && state.is_plausible()), view.missing) {
            (Some(state), _) => self.inbox.locate(stamped(state)),
            (None, Some(missing)) => self.inbox.put_position_lost(view.position_lost.map(stamped), missing),
            (None, None) => {}
        }
        self.inbox.put_setpoint(Stamped { value: setpoint, at_us });
        let inbox = self.inbox.take();
        let outcome = self.vehicle.tick(&mut self.memory, at_us, &inbox);
        let given = self.mixer.inputs(&outcome.forces);
        let mut action = Action::new(outcome.motors, outcome.forces, given, false);
        action.health = outcome.health.control;
        action
    }

    /// Powers up and arms a vehicle that is held in the state of `view`.
    fn arm(&mut self, view: &WorldView, setpoint: Setpoint) {
        for _ in 0..TICKS_HELD {
            let _ = self.tick(view, setpoint);
        }
        self.inbox.request(Ticketed { value: Request::Arm, ticket: 0 });
        let _ = self.tick(view, setpoint);
    }
}

impl<C: FlightController<N>, const N: usize> FlightSoftware for InFlightCore<C, N> {
    type Error = Infallible;

    /// Runs one tick. At the first state, the vehicle is held until the flight core has armed.
    fn step(&mut self, world: &mut World) -> Result<Sample, Infallible> {
        let view = world.look();
        let (is_held, setpoint) = (self.now_us == 0, view.reference.setpoint());
        let state = view.state.filter(State::is_plausible);
        if is_held && state.is_some() {
            // The vehicle is held, so its state stays true in every tick of arming.
            self.arm(&WorldView { new: true, pose: None, ..view }, setpoint);
        }
        let mut action = if self.now_us > 0 { self.tick(&view, setpoint) } else { Action::default() };
        action.health.state_rejected = state.is_none();
        action.health.setpoint_rejected = !setpoint.is_plausible();
        let estimates = self.memory.control().and_then(|control| estimates::<N>(control));
        let sample = view.sample(action, self.memory.trace::<C, N>(), estimates);
        Ok(Sample { mode: Some(self.memory.mode()), ..sample })
    }

    fn descends(&self) -> bool {
        self.memory.mode() == Mode::Descending
    }
}
