//! The simulation loop.

use super::pilot::Pilot;
use super::sample::Sample;
use super::world::World;
use core::f64::consts::FRAC_PI_2;
use core::ops::ControlFlow;

/// Distance from the reference beyond which a vehicle counts as lost \[m\].
pub const LOST_DISTANCE_M: f64 = 50.0;

/// Time and reason of the loss of a vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lost {
    /// Time \[s\].
    pub time_s: f64,
    /// Reason in words.
    pub reason: &'static str,
}

/// End of a flight.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct End {
    /// When and why the vehicle was lost, if it was.
    pub lost: Option<Lost>,
    /// True if the observer ended the flight.
    pub interrupted: bool,
}

/// Flies for `duration_s`, until the vehicle is lost or `observe` ends the flight, and passes it every step from t = 0
/// on.
///
/// # Errors
/// The pilot's error.
// Always inlined: a flight has one loop, which includes its pilot's step.
#[inline(always)]
pub fn lockstep<P: Pilot>(
    world: &mut World,
    pilot: &mut P,
    duration_s: f64,
    mut observe: impl FnMut(&Sample) -> ControlFlow<()>,
) -> Result<End, P::Error> {
    let steps = (duration_s / world.dt_s()).round() as u64;
    for step in 0..=steps {
        let sample = pilot.step(world)?;
        let interrupted = observe(&sample).is_break();
        let lost = lost(&sample).or_else(|| pilot.gave_up()).map(|reason| Lost { time_s: sample.time_s, reason });
        if interrupted || lost.is_some() {
            return Ok(End { lost, interrupted });
        }
        if step < steps {
            world.advance(&sample.action.speeds);
        }
    }
    Ok(End::default())
}

/// Returns why the vehicle counts as lost, if it does. Assumption A3 excludes a tilt of 90 degrees; a vehicle that has
/// landed on its feet is not lost.
fn lost(sample: &Sample) -> Option<&'static str> {
    let eta = &sample.motion.attitude_rad;
    let distance_m = (sample.motion.position_m - sample.reference.position_m).norm();
    let (upright, near) = (eta.x.abs() < FRAC_PI_2 && eta.y.abs() < FRAC_PI_2, distance_m < LOST_DISTANCE_M);
    // A NaN is neither upright nor near.
    match (upright, near) {
        (true, true) => None,
        (false, _) => Some("tilted beyond 90 degrees"),
        (_, false) => Some("more than 50 m from the reference"),
    }
}
