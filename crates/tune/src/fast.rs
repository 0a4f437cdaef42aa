//! Fast flights, near the limits of a vehicle: lemniscates and circles.

use crate::builder::{FlightBuilder, TrainingFlight};
use crate::scale::VehicleScale;
use afbc_scenario::Scenario;
use afbc_scenario::contender::Contender;
use afbc_scenario::trajectory::{Sine, Trajectory};
use core::f64::consts::TAU;
use libm::sqrt;
use nalgebra::Vector3;
use std::borrow::Cow;
use std::error::Error;

/// Names of fast flights begin with one of these.
const NAMES: [&str; 2] = ["lemniscate", "circle"];
/// Tilt limit of each law in fast flights \[rad\], as in the suite `field`.
const TILT_MAX_RAD: f32 = 1.2;
/// Largest acceleration on Gerono's lemniscate, divided by its half length and by the square of its rate.
const LEMNISCATE: f64 = 2.125;
/// Largest rate of a fast path \[rad/s\], multiplied by the vehicle's time scale. The paper's lemniscate has 1.3.
const RATE_RAD_S: f64 = 2.5;

/// Returns the contender for `scenario`, with a raised tilt limit if it is a fast flight.
pub(crate) fn free<'a>(scenario: &Scenario, contender: &'a Contender) -> Cow<'a, Contender> {
    if NAMES.iter().any(|name| scenario.name.starts_with(name)) {
        Cow::Owned(contender.clone().free_to_tilt(TILT_MAX_RAD))
    } else {
        Cow::Borrowed(contender)
    }
}

/// Returns a lemniscate at 60 % and a circle at 50 % of the largest horizontal acceleration.
pub(crate) fn training(builder: &FlightBuilder<'_>) -> Result<[Scenario; 2], Box<dyn Error>> {
    Ok([lemniscate(builder, "lemniscate", 3.0, 0.6)?, circle(builder, "circle", 2.0, 0.5)?])
}

/// Returns a lemniscate and a circle of other sizes and speeds.
pub(crate) fn held_out(builder: &FlightBuilder<'_>) -> Result<[Scenario; 2], Box<dyn Error>> {
    Ok([lemniscate(builder, "lemniscate-short", 2.0, 0.5)?, circle(builder, "circle-wide", 3.0, 0.6)?])
}

/// Returns a lemniscate at the fraction `share` of the largest horizontal acceleration. Its half length is `half_m` on
/// the paper's vehicle.
pub(crate) fn lemniscate(
    builder: &FlightBuilder<'_>,
    name: &'static str,
    half_m: f64,
    share: f64,
) -> Result<Scenario, Box<dyn Error>> {
    let VehicleScale { length, time, .. } = builder.scale;
    let half_m = half_m * length;
    let rate = sqrt(share * builder.scale.horizontal_m_s2() / (LEMNISCATE * half_m)).min(RATE_RAD_S / time);
    let sine = |amplitude_m, rate| Sine { amplitude_m, period_s: TAU / rate, phase_rad: 0.0 };
    let trajectory = Trajectory::Lissajous {
        centre_m: Vector3::new(0.0, 0.0, 3.0),
        sines: [sine(half_m, rate), sine(0.5 * half_m, 2.0 * rate), sine(0.0, rate)],
        yaw_rad: 0.0,
    };
    // Errors count from 5 s on. The flight lasts at least one period longer.
    let duration_s = libm::ceil((5.0 + TAU / rate).max(12.0));
    builder.scenario(TrainingFlight { trajectory, ..TrainingFlight::new(name, duration_s) })
}

/// Returns a circle at the fraction `share` of the largest horizontal acceleration, with a banked start. Its radius is
/// `radius_m` on the paper's vehicle.
pub(crate) fn circle(
    builder: &FlightBuilder<'_>,
    name: &'static str,
    radius_m: f64,
    share: f64,
) -> Result<Scenario, Box<dyn Error>> {
    let VehicleScale { length, time, .. } = builder.scale;
    let radius_m = radius_m * length;
    let rate = sqrt(share * builder.scale.horizontal_m_s2() / radius_m).min(RATE_RAD_S / time);
    let trajectory =
        Trajectory::Circle { centre_m: Vector3::new(0.0, 0.0, 3.0), radius_m, period_s: TAU / rate, yaw_rad: 0.0 };
    let mut scenario = builder.scenario(TrainingFlight { trajectory, ..TrainingFlight::new(name, 12.0) })?;
    // The circle begins at +x of its centre, and the thrust must lean towards the centre.
    scenario.initial.attitude_rad.y = -builder.scale.tilt_rad(radius_m * rate * rate);
    Ok(scenario)
}
