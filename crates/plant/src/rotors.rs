//! Rotors with lag, delay, limits and faults, supplied by a battery.

use crate::battery::{BatteryModel, BatteryState, Sag, SimulatedBattery};
use crate::delay::{DelayLine, whole_steps};
use crate::frame;
use crate::frame::{PerRotor, RotorLayout};
use afbc_types::{Choice, Declared, OutOfRange, Parameters, ROTORS_MAX, Range, parameters};
use alloc::vec::Vec;
use libm::exp;

parameters! {
    /// Dynamics between commanded rotor speeds and thrust. The default is ideal: commanded speeds are reached at once.
    ///
    /// The order is that of the hardware: a command is delayed, scaled by the battery's voltage, limited, and followed
    /// with a lag.
    #[derive(Clone, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct Rotors {
        /// Time constant of d omega/dt = (commanded - omega)/tau; 0 for no lag.
        #[parameter(LAG, "s", 0.0..=1.0)]
        pub time_constant_s: f64 = 0.0,
        /// Delay from command to the speed controllers, rounded to whole steps.
        #[parameter(DELAY, "s", 0.0..=0.5)]
        pub delay_s: f64 = 0.0,
        /// Smallest speed, at which rotors idle; must not exceed the largest speed.
        #[parameter(MIN, "rad/s", 0.0..=10_000.0)]
        pub min_rad_s: f64 = 0.0,
        /// Largest speed.
        #[parameter(MAX, "rad/s", 1.0..=10_000.0)]
        pub max_rad_s: f64 = 10_000.0,
        /// Rotor speeds before the first command arrives: hover speed, or the smallest speed.
        #[choice(START)]
        pub start: RotorStart = RotorStart::Hover,
        /// Faults that reduce a rotor's thrust.
        pub faults: Vec<RotorFault> = Vec::new(),
        /// Battery that supplies the rotors; without one, the voltage is constant.
        pub battery: Option<BatteryModel> = None,
    }
    together(rotors) {
        Range { max: rotors.max_rad_s, ..Rotors::MIN.range }.check(rotors.min_rad_s)?;
        rotors.faults.iter().try_for_each(RotorFault::validate)?;
        rotors.battery.map_or(Ok(()), |battery| battery.validate())
    }
}

/// Actual and commanded rotor speeds before the first command arrives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum RotorStart {
    /// Hover speed, for a flight that begins in the air without a transient.
    Hover,
    /// Smallest speed, for a flight that begins on the ground.
    Idle,
}

impl Choice for RotorStart {
    const ALL: &'static [Self] = &[RotorStart::Hover, RotorStart::Idle];
    const WORDS: &'static [&'static str] = &["hover", "idle"];
}

/// Worn or broken rotor, whose thrust and drag moment are multiplied by `efficiency`. With an efficiency of 0 the rotor
/// is dead: its motor does not drive it, and it slows down with the rotors' time constant.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct RotorFault {
    /// Number of the rotor, from 1, in the order of the frame.
    pub rotor: u8,
    /// Remaining share of the thrust: 1 is intact, 0 is dead. Faults of one rotor multiply.
    pub efficiency: f64,
    /// Onset \[s\].
    pub start_s: f64,
}

/// Accepted ranges of a fault.
#[expect(missing_docs, reason = "named after the field that each bounds")]
pub mod limits {
    use afbc_types::Range;
    pub const ROTOR: Range = Range::new("rotor", 1.0, afbc_types::ROTORS_MAX as f64);
    pub const EFFICIENCY: Range = Range::new("efficiency", 0.0, 1.0);
    pub const START: Range = Range::new("start_s", 0.0, f64::INFINITY);
}

impl RotorFault {
    /// # Errors
    /// Returns the first number that is out of range, by name.
    fn validate(&self) -> Result<(), OutOfRange> {
        limits::ROTOR.check(self.rotor)?;
        limits::EFFICIENCY.check(self.efficiency)?;
        limits::START.check(self.start_s)
    }
}

impl Rotors {
    /// Returns each rotor's share of its thrust at time `t` \[s\], and the time of the next change.
    fn efficiency(&self, frame: &RotorLayout, t: f64) -> (PerRotor, f64) {
        let (mut efficiency, mut until_s) = (frame.repeat(1.0), f64::INFINITY);
        // `check` refuses a rotor 0, so the subtraction does not underflow.
        for fault in &self.faults {
            if fault.start_s > t + TIME_SLACK_S {
                until_s = until_s.min(fault.start_s - TIME_SLACK_S);
            } else if let Some(rotor) = efficiency.get_mut(usize::from(fault.rotor) - 1) {
                *rotor *= fault.efficiency;
            }
        }
        (efficiency, until_s)
    }
}

/// Tolerance when comparing times, far below any step \[s\].
const TIME_SLACK_S: f64 = 1e-9;

/// Rotor speeds over one step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RotorSpeedStep {
    /// Speeds in the middle of the step \[rad/s\].
    pub(crate) speeds_rad_s: PerRotor,
    /// Squares of the speeds times each rotor's efficiency \[rad2/s2\].
    pub(crate) squares: PerRotor,
}

/// Returns 1 for each rotor that its motor drives. Rotors that the vehicle does not have have an efficiency of 0.
fn driven(efficiency: &PerRotor) -> PerRotor {
    efficiency.map(|share| if share > 0.0 { 1.0 } else { 0.0 })
}

/// Checks rotor faults for a vehicle with this frame.
fn check(faults: &[RotorFault], frame: &RotorLayout) -> Result<(), OutOfRange> {
    faults.iter().try_for_each(|fault| {
        fault.validate()?;
        Range { max: frame.count() as f64, ..limits::ROTOR }.check(fault.rotor)
    })
}

/// Rotors in simulation.
#[derive(Clone, Debug)]
pub(crate) struct SimulatedRotors {
    rotors: Rotors,
    commands: DelayLine<PerRotor>,
    /// exp(-dt / 2 tau): remaining share of a speed's distance to its target after half a step.
    half_step: f64,
    /// Present speeds \[rad/s\].
    pub(crate) speeds_rad_s: PerRotor,
    efficiency: PerRotor,
    efficiency_until_s: f64,
    /// 1 for each rotor that its motor drives.
    driven: PerRotor,
    battery: Option<SimulatedBattery>,
}

impl SimulatedRotors {
    /// Creates rotors for a vehicle with these parameters, with the initial speeds of [`RotorStart`].
    ///
    /// # Errors
    /// Returns the first parameter that is out of range.
    pub(crate) fn new(
        rotors: Rotors,
        vehicle: &Parameters<f64>,
        frame: &RotorLayout,
        step_s: f64,
    ) -> Result<Self, OutOfRange> {
        rotors.validate()?;
        check(&rotors.faults, frame)?;
        let start_rad_s = match rotors.start {
            RotorStart::Hover => {
                frame.masked(&frame.hover_rad_s(vehicle).map(|w| w.max(rotors.min_rad_s).min(rotors.max_rad_s)))
            }
            RotorStart::Idle => frame.repeat(rotors.min_rad_s),
        };
        let (efficiency, efficiency_until_s) = rotors.efficiency(frame, 0.0);
        Ok(SimulatedRotors {
            // Commands are `f32`, so the commands before the first one are rounded to `f32` too.
            commands: DelayLine::new(whole_steps(rotors.delay_s, step_s), start_rad_s.map(|w| f64::from(w as f32))),
            // At tau = 0 this is exp(-infinity) = 0: no lag.
            half_step: exp(-0.5 * step_s / rotors.time_constant_s),
            speeds_rad_s: start_rad_s,
            efficiency,
            efficiency_until_s,
            driven: driven(&efficiency),
            battery: rotors.battery.map(|battery| SimulatedBattery::new(battery, step_s)),
            rotors,
        })
    }

    /// Advances the rotors by one step from `t` \[s\] with a constant command.
    ///
    /// The lag is discretised exactly. The load over the step is that of the speeds at its middle, which is accurate to
    /// second order. A command of NaN counts as the smallest speed.
    #[inline]
    pub(crate) fn advance(
        &mut self,
        frame: &RotorLayout,
        command_rad_s: &PerRotor,
        t: f64,
        drag_factor_n_m_s2: f64,
    ) -> RotorSpeedStep {
        if t >= self.efficiency_until_s {
            (self.efficiency, self.efficiency_until_s) = self.rotors.efficiency(frame, t);
            self.driven = driven(&self.efficiency);
        }
        let (mut scale, mut ceiling) = (1.0, self.rotors.max_rad_s);
        if let Some(battery) = &self.battery {
            let share = battery.voltage_share();
            ceiling *= share;
            if battery.effect() == Sag::Speed {
                scale = share;
            }
        }
        // `max` first, so that it replaces NaN.
        let floor = self.rotors.min_rad_s;
        let command = self.commands.pass(*command_rad_s);
        // `min` last, so that an empty battery stops even idling rotors.
        let target = |w: f64| (w * scale).max(floor).min(ceiling);
        let drive = if frame.count() == frame::FEW {
            self.follow::<{ frame::FEW }>(&command, target)
        } else {
            self.follow::<ROTORS_MAX>(&command, target)
        };
        if let Some(battery) = &mut self.battery {
            // Drag moment times speed. The energy that accelerates the rotors is returned when they slow down.
            battery.supply(drag_factor_n_m_s2 * frame::power(&drive.squares, &drive.speeds_rad_s));
        }
        drive
    }

    /// Advances the speeds of the first `N` rotors toward `target` of their commands. There are no other rotors.
    #[inline]
    fn follow<const N: usize>(&mut self, command: &PerRotor, target: impl Fn(f64) -> f64) -> RotorSpeedStep {
        let mut drive = RotorSpeedStep { speeds_rad_s: PerRotor::zeros(), squares: PerRotor::zeros() };
        let driven_commands = command.as_slice().iter().zip(self.driven.as_slice());
        let speeds = self.speeds_rad_s.as_mut_slice().iter_mut().zip(self.efficiency.as_slice());
        let driven = drive.speeds_rad_s.as_mut_slice().iter_mut().zip(drive.squares.as_mut_slice());
        let rotors = driven_commands.zip(speeds).zip(driven).take(N);
        for (((command, driven), (speed, efficiency)), (middle, square)) in rotors {
            let target = driven * target(*command);
            *middle = target + (*speed - target) * self.half_step;
            *speed = target + (*middle - target) * self.half_step;
            *square = *middle * *middle * efficiency;
        }
        drive
    }

    /// Returns the squares of the present speeds times each rotor's efficiency \[rad2/s2\].
    pub(crate) fn squares(&self) -> PerRotor {
        self.speeds_rad_s.component_mul(&self.speeds_rad_s).component_mul(&self.efficiency)
    }

    /// Changes the faults.
    ///
    /// # Errors
    /// Returns the first number that is out of range, and changes nothing then.
    pub(crate) fn set_faults(&mut self, frame: &RotorLayout, faults: Vec<RotorFault>) -> Result<(), OutOfRange> {
        check(&faults, frame)?;
        self.rotors.faults = faults;
        // Makes the next step evaluate the faults again, at any time.
        self.efficiency_until_s = f64::NEG_INFINITY;
        Ok(())
    }

    /// Sets the battery's charge. Returns false without a battery.
    ///
    /// # Errors
    /// Returns an error if the share is out of range.
    pub(crate) fn set_charge(&mut self, share: f64) -> Result<bool, OutOfRange> {
        self.battery.as_mut().map_or(Ok(false), |battery| battery.charge(share).map(|()| true))
    }

    pub(crate) fn charge(&self) -> Option<BatteryState> {
        self.battery.as_ref().map(|battery| battery.now)
    }
}
