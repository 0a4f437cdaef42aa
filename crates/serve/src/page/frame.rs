//! The state of the vehicle that a web page shows, sent some thirty times a second.

use crate::page::plan::{FenceArea, MissionPoint};
use serde::Serialize;

/// State of the vehicle at one time.
#[derive(Clone, Debug, Serialize)]
pub struct PageFrame {
    /// Type of the message: always `frame`.
    pub kind: &'static str,
    /// Time since power-up \[s\].
    pub time_s: f64,
    /// Multiple of real time; 0: as fast as possible, `None`: in lockstep.
    pub speed: Option<f64>,
    /// True while the simulation is paused.
    pub paused: bool,
    /// True if the motors may turn.
    pub armed: bool,
    /// True if the vehicle is armed and in the air.
    pub airborne: bool,
    /// Mode of the flight core.
    pub core: &'static str,
    /// Flight mode.
    pub mode: &'static str,
    /// True if a failsafe has taken over.
    pub failsafe: bool,
    /// Name of the law that flies.
    pub law: &'static str,
    /// Reason why a fallback law flies instead, if one does.
    pub fallback: Option<&'static str>,
    /// True motion of the vehicle.
    pub truth: MotionView,
    /// Setpoint that the vehicle follows; `None` without a state estimate.
    pub reference: Option<ReferenceView>,
    /// State that the vehicle estimates; `None` before the first sample.
    pub estimate: Option<EstimateView>,
    /// State of each rotor, in the order of their numbers.
    pub rotors: Vec<RotorView>,
    /// Wind velocity, earth frame \[m/s\].
    pub wind_m_s: [f32; 3],
    /// State of the battery, if there is one.
    pub battery: Option<BatteryView>,
    /// Mass of the payload \[kg\].
    pub payload_kg: f32,
    /// Errors and adaptive estimates of the law.
    pub adaptation: Adaptation,
    /// Home, where a return lands, earth frame \[m\].
    pub home_m: Option<[f32; 3]>,
    /// Places of the mission.
    pub mission: Vec<MissionPoint>,
    /// Number of the mission item that is flown, or is to be flown next.
    pub item: u16,
    /// Areas of the geofence.
    pub fence: Vec<FenceArea>,
    /// Faults that act on the vehicle now, in words.
    pub faults: Vec<String>,
    /// Recent status texts, oldest first.
    pub texts: Vec<PageText>,
    /// Number of parameter changes since power-up.
    pub parameter_changes: u32,
}

/// A true motion.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct MotionView {
    /// Position, earth frame \[m\].
    pub position_m: [f32; 3],
    /// Velocity, earth frame \[m/s\].
    pub velocity_m_s: [f32; 3],
    /// Attitude as a unit quaternion from body to earth: w, x, y, z.
    pub attitude: [f32; 4],
    /// Roll, pitch, yaw \[rad\].
    pub attitude_rad: [f32; 3],
    /// Rates, body frame \[rad/s\].
    pub rates_rad_s: [f32; 3],
}

/// Setpoint that the vehicle follows.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ReferenceView {
    /// Position, earth frame \[m\].
    pub position_m: [f32; 3],
    /// Velocity, earth frame \[m/s\].
    pub velocity_m_s: [f32; 3],
    /// Heading \[rad\].
    pub yaw_rad: f32,
}

/// State that the vehicle estimates.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct EstimateView {
    /// Position, earth frame \[m\].
    pub position_m: [f32; 3],
    /// Velocity, earth frame \[m/s\].
    pub velocity_m_s: [f32; 3],
    /// Roll, pitch, yaw \[rad\].
    pub attitude_rad: [f32; 3],
    /// Standard deviations of the position \[m\].
    pub position_sigma_m: [f32; 3],
    /// Standard deviations of the velocity \[m/s\].
    pub velocity_sigma_m_s: [f32; 3],
    /// Standard deviations of the attitude, as rotations about the earth's axes \[rad\].
    pub attitude_sigma_rad: [f32; 3],
    /// True if the estimate is good enough for a law to fly on.
    pub valid: bool,
}

/// State of a rotor.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct RotorView {
    /// True speed \[rad/s\].
    pub speed_rad_s: f32,
    /// Commanded speed \[rad/s\].
    pub commanded_rad_s: f32,
    /// True thrust \[N\].
    pub thrust_n: f32,
    /// Remaining share of the rotor's thrust, 0 to 1.
    pub share: f32,
}

/// State of the battery.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct BatteryView {
    /// Voltage \[V\].
    pub voltage_v: f32,
    /// Current \[A\].
    pub current_a: f32,
    /// Charge, 0 to 1.
    pub charge: f32,
}

/// Errors and adaptive estimates of the law.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Adaptation {
    /// Values of each subsystem: roll, pitch, yaw, z, x, y.
    pub axes: Vec<AxisAdaptation>,
    /// Lyapunov function: sum of V over the subsystems; `None` for laws outside the cascade.
    pub lyapunov: Option<f32>,
}

/// Errors and adaptive estimates of one subsystem.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct AxisAdaptation {
    /// Name of the subsystem.
    pub name: &'static str,
    /// Tracking error e_1 \[m or rad\].
    pub e1: f32,
    /// Norm |Theta_hat|, in the unit of the subsystem's input; `None` for laws without it.
    pub theta_norm: Option<f32>,
    /// Estimate delta_hat, in the unit of the subsystem's input; `None` for laws without it.
    pub delta: Option<f32>,
    /// The computable terms of V, equations (14) and (27); `None` for laws outside the cascade.
    pub lyapunov: Option<f32>,
}

/// A status text.
#[derive(Clone, Debug, Serialize)]
pub struct PageText {
    /// Running number, by which a page recognizes texts that it has already shown.
    pub number: u32,
    /// Time of the text \[s\].
    pub time_s: f64,
    /// MAVLink severity, from 0 (emergency) to 7 (debug).
    pub severity: u8,
    /// The text.
    pub text: String,
}
