//! The vehicle with its flight core and motors.

use crate::configuration::Configuration;
use crate::navigation::Navigation;
use crate::readings::Readings;
use afbc::monitor::{Bounds, Norm};
use afbc::{Guarded, guarded};
use afbc_flight_core::{Answer, ArmingLimits, End, Health, Inbox, Mode, Motor, Vehicle, VehicleMemory};
use afbc_types::{Axis, OutOfRange, ROTORS_MAX, RotorSpeeds, State};
use core::array;

/// A vehicle under AFBC with its monitor.
#[derive(Clone, Debug)]
pub struct Flight<const N: usize = 4> {
    vehicle: Vehicle<Guarded<N>, N>,
    memory: VehicleMemory<guarded::Memory<N>>,
    navigation: Navigation,
    motor: Motor,
    saturated_ticks: u32,
}

/// Result of a control tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report<const N: usize = 4> {
    /// Start of the tick, since power-up \[us\].
    pub time_us: u64,
    /// Flight mode.
    pub mode: Mode,
    /// Rotor speeds for the motors: zero if disarmed.
    pub motors: RotorSpeeds<N>,
    /// Throttles for the motors: 0 if disarmed, otherwise 48 to 2047.
    pub throttles: [u16; N],
    /// The vehicle's own estimate of its state, or what is observed of it in place of that
    /// ([`Health::observed`]); none without an inertial sensor.
    pub estimate: Option<State>,
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

impl<const N: usize> Report<N> {
    /// Returns the report extended with zeros to the largest number of rotors.
    #[must_use]
    pub fn padded(&self) -> Report<ROTORS_MAX> {
        let Report { time_us, mode, motors, throttles, estimate, health, saturated_ticks, learnt, answer, ended } =
            *self;
        let throttles = array::from_fn(|i| throttles.get(i).copied().unwrap_or_default());
        let motors = motors.padded();
        Report { time_us, mode, motors, throttles, estimate, health, saturated_ticks, learnt, answer, ended }
    }
}

impl<const N: usize> Flight<N> {
    /// Creates the vehicle, disarmed.
    ///
    /// # Errors
    /// The first parameter, setting or gain out of range, or the first that leaves the vehicle without a margin to
    /// hover.
    pub fn new(configuration: &Configuration<N>) -> Result<Self, OutOfRange> {
        let Configuration { airframe, settings, gains, curve, estimation } = configuration;
        let bounds = Bounds::new(gains, &airframe.parameters, settings);
        let controller = Guarded::new(*airframe, *settings, *gains, bounds)?;
        Ok(Flight {
            vehicle: Vehicle::new(airframe.parameters, ArmingLimits::default(), controller)?,
            memory: VehicleMemory::default(),
            navigation: Navigation::new(*estimation)?,
            motor: Motor::new(*curve)?,
            saturated_ticks: 0,
        })
    }

    /// Records that the clock has failed and another has taken over: the vehicle is not armed again.
    pub fn distrust_clock(&mut self) {
        self.memory.distrust_clock();
    }

    /// Runs one control tick, to be called every millisecond, with what the link brought and the vehicle's own sensors
    /// read; `now_us` is the time since power-up. Cannot fail.
    // Always: copying the report out of a call costs a hundred instructions.
    #[inline(always)]
    pub fn tick(&mut self, now_us: u64, inbox: &mut Inbox, readings: &Readings) -> Report<N> {
        let estimate = self.navigation.tick(now_us, readings, inbox);
        let outcome = self.vehicle.tick(&mut self.memory, now_us, inbox);
        if outcome.health.control.saturated {
            self.saturated_ticks = self.saturated_ticks.saturating_add(1);
        }
        let observed = if outcome.health.observed { self.memory.state().copied() } else { None };
        Report {
            time_us: now_us,
            mode: outcome.mode,
            motors: outcome.motors,
            throttles: self.motor.throttles(outcome.mode.armed(), &outcome.motors),
            estimate: observed.or(estimate),
            health: outcome.health,
            saturated_ticks: self.saturated_ticks,
            learnt: self.memory.control().map(|control| control.figures().latest()),
            answer: outcome.answer,
            ended: outcome.ended,
        }
    }
}
