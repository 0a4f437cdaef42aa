//! The half that decides.

use afbc::adaptive::Estimate;
use afbc::{Adaptive, Profile};
use airframe::{Axis, OutOfRange, Parameters, PerAxis, RotorSpeeds};
use vehicle::motor::Curve;
use vehicle::{ArmingLimits, Health, Inbox, Memory, Mode, Motor, Refusal, Request, Vehicle};

/// Motor, controller and propeller: 1000 rad/s at full throttle, of which the paper's vehicle needs 200 to hover. Ours;
/// to be measured for the vehicle at hand.
const MOTOR: Curve = Curve { speed_max_rad_s: 1000.0, linearity: 1.0, idle: 0.05 };

/// The vehicle of the paper, under its law.
#[derive(Clone, Debug)]
pub struct Flight {
    vehicle: Vehicle<Adaptive>,
    memory: Memory<Estimate>,
    motor: Motor,
    estimates: PerAxis<Norm>,
    /// Whose norm is worked out in the next tick.
    axis: Axis,
    saturated_ticks: u32,
}

/// How much one subsystem has learnt.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Norm {
    /// |Theta_hat|^2
    pub theta_squared: f32,
    /// delta_hat
    pub delta: f32,
}

/// What a control tick decided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report {
    /// When the tick began, since power-up \[us\].
    pub time_us: u64,
    /// What the vehicle is doing.
    pub mode: Mode,
    /// What the rotors are told: zero if disarmed.
    pub motors: RotorSpeeds,
    /// The same as throttle: 0 if disarmed, otherwise 48 to 2047.
    pub throttles: [u16; 4],
    /// How well it goes.
    pub health: Health,
    /// Ticks since power-up in which a rotor was asked for a force outside its limits.
    pub saturated_ticks: u32,
    /// Each subsystem's as of one of the last six ticks.
    pub estimates: PerAxis<Norm>,
    /// The answer to a request.
    pub answer: Option<Result<Request, Refusal>>,
}

impl Flight {
    /// The vehicle, disarmed.
    ///
    /// # Errors
    /// The first parameter out of range.
    pub fn new() -> Result<Self, OutOfRange> {
        let profile = Profile::Paper;
        let law = Adaptive::new(profile.gains())?;
        let airframe = Parameters::PAPER.to_f32();
        Ok(Flight {
            vehicle: Vehicle::new(airframe, profile.settings(), ArmingLimits::default(), law)?,
            memory: Memory::default(),
            motor: Motor::new(MOTOR)?,
            estimates: PerAxis::default(),
            axis: Axis::Roll,
            saturated_ticks: 0,
        })
    }

    /// One control tick, to be called every millisecond; `now_us` is the time since power-up. Cannot fail.
    pub fn tick(&mut self, now_us: u64, inbox: &Inbox) -> Report {
        let outcome = self.vehicle.tick(&mut self.memory, now_us, inbox);
        if outcome.health.control.saturated {
            self.saturated_ticks = self.saturated_ticks.saturating_add(1);
        }
        self.look_at_one_estimate();
        Report {
            time_us: now_us,
            mode: outcome.mode,
            motors: outcome.motors,
            throttles: self.motor.throttles(outcome.mode.armed(), &outcome.motors),
            health: outcome.health,
            saturated_ticks: self.saturated_ticks,
            estimates: self.estimates,
            answer: outcome.answer,
        }
    }

    /// One subsystem in each tick: nobody needs them sooner, and so no tick pays for all six.
    fn look_at_one_estimate(&mut self) {
        let Some(control) = self.memory.control() else { return };
        let Estimate { theta, delta } = control.estimates.get(self.axis);
        *self.estimates.get_mut(self.axis) = Norm { theta_squared: theta.norm_squared(), delta: *delta };
        self.axis = match self.axis {
            Axis::Roll => Axis::Pitch,
            Axis::Pitch => Axis::Yaw,
            Axis::Yaw => Axis::Z,
            Axis::Z => Axis::X,
            Axis::X => Axis::Y,
            Axis::Y => Axis::Roll,
        };
    }
}
