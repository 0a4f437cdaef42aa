//! Record of a control tick: its inputs, its outputs and its decisions. Telemetry, logs, reports and hosts read them
//! here and never compute them again.

use crate::readings::{AIDS_MAX, Readings};
use afbc::monitor::EstimateNorms;
use afbc_control::Trace;
use afbc_estimator::{AidRecords, AidSet, Estimate, ImuSample, Measurement};
use afbc_flight_core::{EndReason, Mode, Reasons, RequestAnswer, TickHealth};
use afbc_guidance::{BatteryReading, GuidanceOutputs, Sticks};
use afbc_types::{Axis, Pose, ROTORS_MAX, RotorSpeeds, Stamped, State};
use nalgebra::Vector3;

/// Outputs of a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report {
    /// Start of the tick, since power-up \[us\].
    pub time_us: u64,
    /// Flight core's mode.
    pub mode: Mode,
    /// Number of rotors.
    pub rotors: u8,
    /// Commanded rotor speeds \[rad/s\]; zero while disarmed, and for rotors that the vehicle does not have.
    pub motors: RotorSpeeds<ROTORS_MAX>,
    /// DSHOT throttles of the motors: 0 while disarmed, otherwise 48 to 2047; 0 where there is no motor.
    pub throttles: [u16; ROTORS_MAX],
    /// Estimated state, or the pose observer's state after the inertial sensor has failed
    /// ([`TickHealth::observed`](afbc_flight_core::TickHealth::observed)); none without an inertial sensor.
    pub estimate: Option<State>,
    /// Health of the flight core.
    pub health: TickHealth,
    /// Number of ticks since power-up in which a rotor's commanded force was beyond its limits.
    pub saturated_ticks: u32,
    /// Norms of one subsystem's estimates, a different subsystem in each tick; none before the first flight.
    pub norms: Option<(Axis, EstimateNorms)>,
    /// True in the air while [vibration](crate::vibration) of the accelerometer is too high.
    pub shaken: bool,
    /// Aiding sensors that contradict the estimate ([`Memory::ignored`](afbc_estimator::Memory::ignored)).
    pub ignored: AidSet,
    /// Answer to a request.
    pub answer: Option<RequestAnswer>,
    /// Reason for the flight's end, if it ended in this tick.
    pub ended: Option<EndReason>,
    /// Reasons against arming in this tick; the answer to a request to arm uses them.
    pub against: Reasons,
    /// The guidance's decisions.
    pub guided: GuidanceOutputs,
}

/// Inputs of a tick, apart from messages.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TickInputs {
    /// Number of the tick since power-up.
    pub number: u32,
    /// Start of the tick, since power-up \[us\].
    pub time_us: u64,
    /// True if the clock is not trusted.
    pub clock_failed: bool,
    /// Readings of the sensors.
    pub readings: Readings,
    /// Reading of the battery, if it is measured.
    pub battery: Option<BatteryReading>,
    /// Number of the configuration flown from this tick on, if it has changed.
    pub adopted: Option<u16>,
    /// Rotor speed of the notch filter from this tick on, if the notch has moved \[rad/s\].
    pub notch_rad_s: Option<f32>,
}

/// State before a tick, which the tick changes and logs need ([`Flight::before`](crate::Flight::before)).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TickBefore {
    /// A tracker's pose from messages, which the tick removes.
    pub(crate) pose: Option<Stamped<Pose>>,
    /// Position of a vehicle at rest, to which usable fixes are set \[m\].
    pub(crate) stands_m: Option<Vector3<f32>>,
    /// True if the inertial sensor worked.
    pub(crate) works: bool,
}

/// Details of a tick that only logs need ([`Flight::details`](crate::Flight::details)). They are computed only if a log
/// is written.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TickDetails {
    /// Inputs of the tick.
    pub inputs: TickInputs,
    /// A tracker's pose from messages.
    pub pose: Option<Stamped<Pose>>,
    /// The pilot's sticks.
    pub sticks: Option<Stamped<Sticks>>,
    /// Inertial sample, calibrated and at the centre of mass.
    pub sample: Option<ImuSample>,
    /// Aiding measurements, corrected and in the local frame, without fixes before the first usable one.
    pub local: [Option<Measurement>; AIDS_MAX],
    /// True if the estimator was offered `local` and `pose`; false if no inertial sensor works.
    pub offers: bool,
    /// True if the motors could not carry the vehicle.
    pub on_ground: bool,
    /// The law's internal signals: only inputs while blind, zeros while disarmed.
    pub trace: Trace,
    /// Estimate with its uncertainty and validity; none without an inertial sensor.
    pub estimate: Option<Estimate>,
    /// The estimator's statistics for each kind of measurement.
    pub aids: AidRecords,
    /// Local frame's origin in the GNSS receiver's frame, from the first usable fix on \[m\].
    pub origin_m: Option<Vector3<f32>>,
    /// Newest state that the flight core trusts.
    pub state: Option<State>,
}

/// Record of a tick. It has two parts, because the details of most ticks are not needed.
#[derive(Clone, Copy, Debug)]
pub struct TickRecord<'a> {
    /// Outputs of the tick.
    pub report: &'a Report,
    /// Inputs and decisions of the tick.
    pub details: &'a TickDetails,
}
