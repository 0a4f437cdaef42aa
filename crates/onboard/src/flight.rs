//! The vehicle with its flight core and motors.

use afbc::monitor::{Bounds, Norm};
use afbc::{Guarded, Profile, guarded};
use afbc_flight_core::motor::Curve;
use afbc_flight_core::{Answer, ArmingLimits, End, Health, Inbox, Mode, Motor, Vehicle, VehicleMemory};
use afbc_types::{Axis, OutOfRange, Parameters, RotorSpeeds};

/// The paper's vehicle under AFBC in the profile `flight`.
#[derive(Clone, Debug)]
pub struct Flight {
    vehicle: Vehicle<Guarded>,
    memory: VehicleMemory<guarded::Memory>,
    motor: Motor,
    saturated_ticks: u32,
}

/// Result of a control tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report {
    /// Start of the tick, since power-up \[us\].
    pub time_us: u64,
    /// Flight mode.
    pub mode: Mode,
    /// Rotor speeds for the motors: zero if disarmed.
    pub motors: RotorSpeeds,
    /// Throttles for the motors: 0 if disarmed, otherwise 48 to 2047.
    pub throttles: [u16; 4],
    /// Health of the flight core.
    pub health: Health,
    /// Ticks since power-up in which a rotor was commanded a force outside its limits.
    pub saturated_ticks: u32,
    /// Norms of the estimates of one subsystem, all reported in turn; none before the first flight.
    pub learnt: Option<(Axis, Norm)>,
    /// Answer to a request.
    pub answer: Option<Answer>,
    /// Why the flight ended, if it did in this tick.
    pub ended: Option<End>,
}

impl Flight {
    /// Creates the vehicle, disarmed.
    ///
    /// # Errors
    /// The first parameter out of range.
    pub fn new() -> Result<Self, OutOfRange> {
        let (parameters, settings) = (Parameters::PAPER.to_f32(), Profile::Flight.settings());
        let gains = Profile::Flight.gains_for(&parameters);
        let bounds = Bounds::new(&gains, &parameters);
        let controller = Guarded::new(parameters, settings, gains, bounds)?;
        Ok(Flight {
            vehicle: Vehicle::new(parameters, ArmingLimits::default(), controller)?,
            memory: VehicleMemory::default(),
            motor: Motor::new(Curve::DEFAULT)?,
            saturated_ticks: 0,
        })
    }

    /// Records that the clock has failed and another has taken over: the vehicle is not armed again.
    pub fn distrust_clock(&mut self) {
        self.memory.distrust_clock();
    }

    /// Runs one control tick, to be called every millisecond; `now_us` is the time since power-up. Cannot fail.
    pub fn tick(&mut self, now_us: u64, inbox: &Inbox) -> Report {
        let outcome = self.vehicle.tick(&mut self.memory, now_us, inbox);
        if outcome.health.control.saturated {
            self.saturated_ticks = self.saturated_ticks.saturating_add(1);
        }
        Report {
            time_us: now_us,
            mode: outcome.mode,
            motors: outcome.motors,
            throttles: self.motor.throttles(outcome.mode.armed(), &outcome.motors),
            health: outcome.health,
            saturated_ticks: self.saturated_ticks,
            learnt: self.memory.control().map(|control| control.figures().latest()),
            answer: outcome.answer,
            ended: outcome.ended,
        }
    }
}
