//! Throttle curve: converts rotor speed to throttle.

use afbc_control::math::{max, min, sqrt};
use afbc_types::{Declared, OutOfRange, RotorSpeeds, parameters};

/// Smallest throttle that turns a motor. 0 stops it, 1 to 47 are commands.
pub const THROTTLE_MIN: u16 = 48;
/// Full throttle.
pub const THROTTLE_MAX: u16 = 2047;

parameters! {
    /// Thrust curve of a motor with its controller and propeller. At throttle u in 0..1, the share of the largest
    /// thrust is
    ///
    /// ```text
    /// F / F_max = (omega / omega_max)^2 = k u^2 + (1 - k) u
    /// ```
    ///
    /// with k like PX4's `THR_MDL_FAC`: for k = 1 the speed is proportional to the throttle, for k = 0 the thrust is.
    /// By default full throttle gives 1000 rad/s; the paper's vehicle hovers at 200. Measure the curve of a real
    /// vehicle. Not in the paper.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct Curve {
        /// omega_max: speed at full throttle.
        #[parameter(SPEED_MAX, "rad/s", 1.0..=32_768.0)]
        pub speed_max_rad_s: f32 = 1000.0,
        /// k: 1 if the speed is proportional to the throttle, 0 if the thrust is proportional, or a value in between.
        #[parameter(LINEARITY, "1", 0.0..=1.0)]
        pub linearity: f32 = 1.0,
        /// Smallest throttle of an armed motor, which keeps it turning.
        #[parameter(IDLE, "1", 0.0..=0.3)]
        pub idle: f32 = 0.05,
    }
}

parameters! {
    /// Response of the rotors to their commands: d omega/dt = (omega_commanded - omega)/tau. Flight without
    /// measurements ([`crate::dead_reckoning`]) and on poses alone ([`crate::observer`]) predicts with it. Laws have
    /// their own parameters for it. Not in the paper.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct Response {
        /// tau: time constant of the rotors. The default is that of the paper's vehicle.
        #[parameter(LAG, "s", 0.001..=1.0)]
        pub time_constant_s: f32 = 0.02,
    }
}

impl Response {
    /// Returns the share of the difference to their command that rotors make up in a step of `dt_s`.
    pub(crate) fn share(&self, dt_s: f32) -> f32 {
        min(dt_s / self.time_constant_s, 1.0)
    }
}

/// A motor with a valid curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motor {
    curve: Curve,
    /// Idle throttle of the curve, in steps.
    idle: u32,
    inverse_speed_max: f32,
}

/// Number of throttle steps from the smallest to the largest.
const SPAN: u16 = THROTTLE_MAX - THROTTLE_MIN;

/// Converts a throttle in 0..1 to steps above [`THROTTLE_MIN`], rounded. Returns 0 for smaller values and NaN. Uses 32
/// bits, to which the processor's own conversion saturates.
fn steps(u: f32) -> u32 {
    (u * f32::from(SPAN) + 0.5) as u32
}

impl Motor {
    /// Makes a motor with this curve.
    ///
    /// # Errors
    /// The first value out of range.
    pub fn new(curve: Curve) -> Result<Self, OutOfRange> {
        curve.validate()?;
        Ok(Motor { curve, idle: steps(curve.idle), inverse_speed_max: 1.0 / curve.speed_max_rad_s })
    }

    /// Returns the throttles of all motors: 0 if disarmed, 48 to 2047 if armed.
    pub fn throttles<const N: usize>(&self, armed: bool, speeds: &RotorSpeeds<N>) -> [u16; N] {
        let speeds: [f32; N] = speeds.0.into();
        if armed { speeds.map(|speed| self.throttle(speed)) } else { [0; N] }
    }

    /// Returns the throttle \[48 to 2047\] of an armed motor for `speed_rad_s`. It never decreases with the speed.
    /// Anything but a positive number gives idle, a speed above the largest gives full throttle.
    pub fn throttle(&self, speed_rad_s: f32) -> u16 {
        let ratio = speed_rad_s * self.inverse_speed_max;
        // With k = 1, the speed is proportional to the throttle.
        let u = if self.curve.linearity == 1.0 { ratio } else { self.inverse_curve(max(ratio, 0.0)) };
        steps(u).max(self.idle).min(SPAN.into()) as u16 + THROTTLE_MIN
    }

    /// Returns u in 0..1 with k u^2 + (1 - k) u = `ratio`^2, by the form of the quadratic formula that is also valid
    /// for k = 0. Returns 0 for NaN.
    fn inverse_curve(&self, ratio: f32) -> f32 {
        let share = ratio * ratio;
        let k = self.curve.linearity;
        let linear = 1.0 - k;
        let denominator = linear + sqrt(linear * linear + 4.0 * k * share);
        // The denominator is zero for a rotor at rest with k = 1.
        if denominator > 0.0 { 2.0 * share / denominator } else { 0.0 }
    }
}
