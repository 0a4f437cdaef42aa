//! Any controller inside the flight core: what a board does around its law, without the board and its link.

use afbc::{Command, FlightController, Settings, adaptive};
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
pub struct Aboard<C>(Vehicle<C>);

/// What the flight core remembers, and its clock.
#[derive(Clone, Copy, Debug, Default)]
pub struct Memory<M> {
    vehicle: afbc_flight_core::Memory<M>,
    inbox: Inbox,
    /// Time since power-up \[us\].
    now_us: u64,
}

impl<C: FlightController> Aboard<C> {
    /// `controller`, which was made for this vehicle and these settings, in a flight core that arms wherever it may.
    ///
    /// # Errors
    /// If the time step is not the flight core's, 1 ms.
    pub fn new(vehicle: Parameters, settings: Settings, controller: C) -> Result<Self, OutOfRange> {
        Vehicle::new(vehicle, settings, ArmingLimits::NONE, controller).map(Aboard)
    }

    fn tick(&self, memory: &mut Memory<C::Memory>) -> Command {
        memory.now_us += PERIOD_US;
        let inbox = memory.inbox.take();
        self.0.traced_tick(&mut memory.vehicle, memory.now_us, &inbox).1
    }
}

impl<C: FlightController> FlightController for Aboard<C> {
    type Memory = Memory<C::Memory>;

    /// One tick. Before the first, the vehicle is held where it is until it has armed.
    fn decide(&self, memory: &mut Self::Memory, state: &State, setpoint: &Setpoint, fresh: bool) -> Command {
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

    fn learnt(memory: &Self::Memory) -> PerAxis<adaptive::Estimate> {
        memory.vehicle.control().map(C::learnt).unwrap_or_default()
    }
}
