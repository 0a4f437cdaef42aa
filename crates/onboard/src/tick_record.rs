//! A control tick, written down once: what it took, what it gave, and what it decided on the way. Telemetry, logs,
//! reports and hosts look at it and derive none of it anew.

use crate::readings::{AIDS_MAX, Readings};
use afbc::monitor::Norm;
use afbc_control::Trace;
use afbc_estimator::{Aids, Estimate, ImuSample, Measurement};
use afbc_flight_core::{EndReason, Mode, Reasons, RequestAnswer, TickHealth};
use afbc_guidance::{BatteryReading, Guided, Sticks};
use afbc_types::{Axis, Pose, ROTORS_MAX, RotorSpeeds, Stamped, State};
use core::array;
use nalgebra::Vector3;

/// What a tick gave.
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
    /// The vehicle's own estimate of its state, or that of the pose observer after the inertial sensor has failed
    /// ([`TickHealth::observed`](afbc_flight_core::TickHealth::observed)); none without an inertial sensor.
    pub estimate: Option<State>,
    /// Health of the flight core.
    pub health: TickHealth,
    /// Ticks since power-up in which a rotor was commanded a force outside its limits.
    pub saturated_ticks: u32,
    /// Norms of the estimates of one subsystem, all reported in turn; none before the first flight.
    pub norms: Option<(Axis, Norm)>,
    /// True in the air while the accelerometer is [shaken](crate::vibration) more than is acceptable.
    pub shaken: bool,
    /// Answer to a request.
    pub answer: Option<RequestAnswer>,
    /// Why the flight ended, if it did in this tick.
    pub ended: Option<EndReason>,
    /// What spoke against arming in this tick, by which a request to arm was or would have been answered.
    pub against: Reasons,
    /// What the guidance decided.
    pub guided: Guided,
}

impl<const N: usize> Report<N> {
    /// Returns the report extended with zeros to the largest number of rotors.
    #[must_use]
    pub fn padded(&self) -> Report<ROTORS_MAX> {
        let Report { time_us, mode, motors, throttles, estimate, health, saturated_ticks, norms, answer, .. } = *self;
        let throttles = array::from_fn(|i| throttles.get(i).copied().unwrap_or_default());
        let motors = motors.padded();
        let (ended, against, guided, shaken) = (self.ended, self.against, self.guided, self.shaken);
        Report {
            time_us,
            mode,
            motors,
            throttles,
            estimate,
            health,
            saturated_ticks,
            norms,
            shaken,
            answer,
            ended,
            against,
            guided,
        }
    }
}

/// What a tick takes, beside what messages bring.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TickInputs {
    /// Number of the tick since power-up.
    pub number: u32,
    /// When it begins, since power-up \[us\].
    pub time_us: u64,
    /// True if the clock is not trusted.
    pub clock_failed: bool,
    /// What the sensors have read.
    pub readings: Readings,
    /// The battery, if it is measured.
    pub battery: Option<BatteryReading>,
    /// Number of the configuration that is flown from this tick on, if it is another.
    pub adopted: Option<u16>,
    /// Rotor speed at which the notch stands from this tick on, if it has moved \[rad/s\].
    pub notch_rad_s: Option<f32>,
}

/// What logs have of the time before a tick, which changes it ([`Flight::before`](crate::Flight::before)).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TickBefore {
    /// A tracker's pose that messages had brought: the tick hands it over.
    pub(crate) pose: Option<Stamped<Pose>>,
    /// Where a vehicle at rest stood, which is where usable fixes are taken to be \[m\].
    pub(crate) stands_m: Option<Vector3<f32>>,
    /// True if the inertial sensor worked.
    pub(crate) works: bool,
}

/// What logs have of a tick beside its report ([`Flight::details`](crate::Flight::details)), made only if one is
/// written.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TickDetails {
    /// What it took.
    pub inputs: TickInputs,
    /// A tracker's pose that messages had brought.
    pub pose: Option<Stamped<Pose>>,
    /// The pilot's sticks.
    pub sticks: Option<Stamped<Sticks>>,
    /// The inertial sensor's sample, calibrated and at the centre of mass.
    pub sample: Option<ImuSample>,
    /// The aids among the readings, corrected and in the local frame; none of a fix before a usable one.
    pub local: [Option<Measurement>; AIDS_MAX],
    /// True if the estimator was offered these and the pose; false without an inertial sensor that works.
    pub offers: bool,
    /// True if the motors could not carry the vehicle.
    pub on_ground: bool,
    /// The law's internal signals: only inputs while blind, zeros while disarmed.
    pub trace: Trace,
    /// The estimate with its uncertainty and validity; none without an inertial sensor.
    pub estimate: Option<Estimate>,
    /// What the estimator makes of each kind of measurement.
    pub aids: Aids,
    /// The local frame's origin in the frame of the GNSS receiver, from the first usable fix on \[m\].
    pub origin_m: Option<Vector3<f32>>,
    /// The newest state that the flight core believes.
    pub state: Option<State>,
}

/// A tick. In two parts, for of most ticks nobody wants the details.
#[derive(Clone, Copy, Debug)]
pub struct TickRecord<'a, const N: usize = 4> {
    /// What it gave.
    pub report: &'a Report<N>,
    /// What it took and decided.
    pub details: &'a TickDetails,
}
