//! Any controller inside the flight core: what a board does around its law, without the board and its link.

use afbc_control::{Action, Estimate, FlightController, Mixer, Trace};
use afbc_flight_core::rate::{PERIOD_US, WINDOW_US};
use afbc_flight_core::{ArmingLimits, Asked, Inbox, Request, Stamped, Vehicle};
use afbc_types::{OutOfRange, Parameters, PerAxis, Range, Setpoint, State};

/// Accepted roll and pitch of a vehicle that is to be armed \[rad\].
pub const ARMING_TILT: Range = Range::new("attitude_rad", -TILT_MAX, TILT_MAX);
const TILT_MAX: f64 = ArmingLimits::TILT_MAX.range.max;
/// Ticks before the first step: the flight core arms once it has measured its rate.
const TICKS_HELD: u64 = WINDOW_US as u64 / PERIOD_US + 1;

/// A controller that the flight core flies: without a state it rides blind, then descends.
#[derive(Clone, Copy, Debug)]
pub struct Aboard<C> {
    vehicle: Vehicle<C>,
    mixer: Mixer,
    dt_s: f32,
}

/// What the flight core remembers, and its clock.
#[derive(Clone, Copy, Debug, Default)]
pub struct Memory<M> {
    vehicle: afbc_flight_core::Memory<M>,
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
        let (mixer, dt_s) = (*controller.mixer(), controller.dt_s());
        Ok(Aboard { vehicle: Vehicle::new(vehicle, ArmingLimits::NONE, controller)?, mixer, dt_s })
    }

    fn tick(&self, memory: &mut Memory<C::Memory>) -> Action {
        memory.now_us += PERIOD_US;
        let inbox = memory.inbox.take();
        let outcome = self.vehicle.tick(&mut memory.vehicle, memory.now_us, &inbox);
        Action { speeds: outcome.motors, forces: outcome.forces, health: outcome.health.control }
    }
}

impl<C: FlightController> FlightController for Aboard<C> {
    type Memory = Memory<C::Memory>;

    fn dt_s(&self) -> f32 {
        self.dt_s
    }

    fn mixer(&self) -> &Mixer {
        &self.mixer
    }

    /// One tick. Before the first, the vehicle is held where it is until it has armed.
    fn decide(&self, memory: &mut Self::Memory, state: &State, setpoint: &Setpoint, fresh: bool) -> Action {
        let post = |memory: &mut Self::Memory| {
            let at_us = memory.now_us + PERIOD_US;
            if fresh {
                memory.inbox.measure(Stamped { value: *state, at_us });
            }
            memory.inbox.aim(Stamped { value: *setpoint, at_us });
        };
        if memory.now_us == 0 {
            for _ in 0..TICKS_HELD {
                post(memory);
                self.tick(memory);
            }
            post(memory);
            memory.inbox.ask(Asked { request: Request::Arm, ticket: 0 });
            self.tick(memory);
        }
        post(memory);
        self.tick(memory)
    }

    fn trace(memory: &Self::Memory) -> Trace {
        memory.vehicle.trace::<C>()
    }

    fn learnt(memory: &Self::Memory) -> PerAxis<Estimate> {
        memory.vehicle.control().map(C::learnt).unwrap_or_default()
    }
}
