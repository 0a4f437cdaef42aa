//! Any controller inside the flight core: what a board does around its law, without the board and its link.

use super::pilot::Pilot;
use super::sample::Sample;
use super::world::World;
use afbc_control::{Action, FlightController};
use afbc_flight_core::rate::{PERIOD_US, WINDOW_US};
use afbc_flight_core::{ArmingLimits, Asked, Inbox, Request, Stamped, Vehicle, VehicleMemory};
use afbc_types::{OutOfRange, Parameters, Setpoint, State};
use core::convert::Infallible;

/// Ticks before the first step: the flight core arms once it has measured its rate.
const TICKS_HELD: u64 = WINDOW_US as u64 / PERIOD_US + 1;

/// A controller that the flight core flies: without a state it coasts blind, then descends.
pub struct Aboard<C: FlightController> {
    vehicle: Vehicle<C>,
    memory: VehicleMemory<C::Memory>,
    inbox: Inbox,
    /// Time since power-up \[us\].
    now_us: u64,
}

impl<C: FlightController> Aboard<C> {
    /// `controller`, which was made for this vehicle, in a flight core that arms wherever it may.
    ///
    /// # Errors
    /// If the time step is not the flight core's, 1 ms.
    pub fn new(vehicle: Parameters, controller: C) -> Result<Self, OutOfRange> {
        let vehicle = Vehicle::new(vehicle, ArmingLimits::NONE, controller)?;
        Ok(Aboard { vehicle, memory: VehicleMemory::default(), inbox: Inbox::default(), now_us: 0 })
    }

    /// One tick, after what it is told.
    fn tick(&mut self, state: Option<State>, setpoint: Setpoint) -> Action {
        self.now_us += PERIOD_US;
        let at_us = self.now_us;
        if let Some(value) = state {
            self.inbox.put_state(Stamped { value, at_us });
        }
        self.inbox.put_setpoint(Stamped { value: setpoint, at_us });
        let inbox = self.inbox.take();
        let outcome = self.vehicle.tick(&mut self.memory, at_us, &inbox);
        let mut action = Action::new(outcome.motors, outcome.forces, false);
        action.health = outcome.health.control;
        action
    }

    /// Powers up and arms a vehicle that is held in this `state`.
    fn arm(&mut self, state: State, setpoint: Setpoint) {
        for _ in 0..TICKS_HELD {
            let _ = self.tick(Some(state), setpoint);
        }
        self.inbox.request(Asked { request: Request::Arm, ticket: 0 });
        let _ = self.tick(Some(state), setpoint);
    }
}

impl<C: FlightController> Pilot for Aboard<C> {
    type Error = Infallible;

    /// One tick. Before the first, as soon as there is a state, the vehicle is held where it is until it has armed.
    fn step(&mut self, world: &mut World) -> Result<Sample, Infallible> {
        let view = world.look();
        let (state, setpoint) = (view.state.filter(State::is_plausible), view.reference.setpoint());
        if let Some(state) = state.filter(|_| self.now_us == 0) {
            self.arm(state, setpoint);
        }
        let mut action = if self.now_us > 0 { self.tick(state, setpoint) } else { Action::default() };
        action.health.state_rejected = state.is_none();
        action.health.setpoint_rejected = !setpoint.is_plausible();
        let estimates = self.memory.control().map(C::learnt).unwrap_or_default();
        Ok(view.sample(action, self.memory.trace::<C>(), estimates))
    }
}
