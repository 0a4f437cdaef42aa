//! What changes while the vehicle flies.

use crate::page::plan::{FenceArea, MissionPoint};
use serde::Serialize;

/// The vehicle at one time.
#[derive(Clone, Debug, Serialize)]
pub struct PageFrame {
    /// Always `frame`.
    pub kind: &'static str,
    /// Time since power-up \[s\].
    pub time_s: f64,
    /// How many times real time it runs; 0: as fast as possible, none: in lockstep.
    pub speed: Option<f64>,
    /// True if time stands still.
    pub paused: bool,
    /// True if the motors may turn.
    pub armed: bool,
    /// True if it is armed and in the air.
    pub airborne: bool,
    /// Mode of the flight core.
    pub core: &'static str,
    /// Flight mode.
    pub mode: &'static str,
    /// True if a failsafe has taken over.
    pub failsafe: bool,
    /// The law that flies.
    pub law: &'static str,
    /// Why a fallback law flies instead, if one does.
    pub fallback: Option<&'static str>,
    /// True motion.
    pub truth: MotionView,
    /// What it follows; none without a state.
    pub reference: Option<ReferenceView>,
    /// What it estimates; none before the first sample.
    pub estimate: Option<EstimateView>,
    /// The rotors, in the order of their numbers.
    pub rotors: Vec<RotorView>,
    /// Velocity of the air, earth frame \[m/s\].
    pub wind_m_s: [f32; 3],
    /// The battery, if there is one.
    pub battery: Option<BatteryView>,
    /// Mass of what it carries \[kg\].
    pub payload_kg: f32,
    /// Errors and estimates of the law.
    pub adaptation: Adaptation,
    /// Where a return lands, earth frame \[m\].
    pub home_m: Option<[f32; 3]>,
    /// The mission.
    pub mission: Vec<MissionPoint>,
    /// Number of the item that is flown, or to be flown.
    pub item: u16,
    /// The geofence.
    pub fence: Vec<FenceArea>,
    /// What it suffers, in words.
    pub faults: Vec<String>,
    /// What was said of late, oldest first.
    pub texts: Vec<PageText>,
    /// Changes of the parameters since power-up.
    pub parameter_changes: u32,
}

/// A motion.
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

/// What the vehicle follows.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ReferenceView {
    /// Position, earth frame \[m\].
    pub position_m: [f32; 3],
    /// Velocity, earth frame \[m/s\].
    pub velocity_m_s: [f32; 3],
    /// Heading \[rad\].
    pub yaw_rad: f32,
}

/// What the vehicle estimates.
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
    /// Standard deviations of the rotation about the earth's axes \[rad\].
    pub attitude_sigma_rad: [f32; 3],
    /// True if a law may fly on it.
    pub valid: bool,
}

/// A rotor.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct RotorView {
    /// True speed \[rad/s\].
    pub speed_rad_s: f32,
    /// Commanded speed \[rad/s\].
    pub commanded_rad_s: f32,
    /// True thrust \[N\].
    pub thrust_n: f32,
    /// Share of its thrust that it has left.
    pub share: f32,
}

/// The battery.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct BatteryView {
    /// Voltage \[V\].
    pub voltage_v: f32,
    /// Current \[A\].
    pub current_a: f32,
    /// Charge, 0 to 1.
    pub charge: f32,
}

/// Errors and estimates of the law.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Adaptation {
    /// Per subsystem: roll, pitch, yaw, z, x, y.
    pub axes: Vec<AxisAdaptation>,
    /// Sum of V over the subsystems; none for laws outside the cascade.
    pub lyapunov: Option<f32>,
}

/// Errors and estimates of one subsystem.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct AxisAdaptation {
    /// Name.
    pub name: &'static str,
    /// e_1 \[m or rad\].
    pub e1: f32,
    /// |Theta_hat|, in the unit of the subsystem's input; none for laws without it.
    pub theta_norm: Option<f32>,
    /// delta_hat, likewise.
    pub delta: Option<f32>,
    /// The computable terms of V (14), (27); none for laws outside the cascade.
    pub lyapunov: Option<f32>,
}

/// Something that was said.
#[derive(Clone, Debug, Serialize)]
pub struct PageText {
    /// Number, counted up: what was seen before is not new.
    pub number: u32,
    /// When \[s\].
    pub time_s: f64,
    /// How grave it is, by MAVLink's number: 0 an emergency, 7 for debugging.
    pub severity: u8,
    /// What.
    pub text: String,
}
