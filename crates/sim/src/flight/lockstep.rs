//! The simulation loop.

use super::loss::LossDetector;
use super::pilot::FlightSoftware;
use super::sample::Sample;
use super::world::World;
use core::ops::ControlFlow;

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
pub struct FlightEnd {
    /// When and why the vehicle was lost, if it was.
    pub lost: Option<Lost>,
    /// True if the observer ended the flight.
    pub interrupted: bool,
}

/// Flies for `duration_s`, until the vehicle is lost, or until `observe` or the pilot ends the flight. Passes every
/// step from t = 0 on to `observe`.
///
/// # Errors
/// Returns the pilot's error.
// This function is always inlined, so that each flight has a single loop that includes its pilot's step.
#[inline(always)]
pub fn lockstep<P: FlightSoftware>(
    world: &mut World,
    pilot: &mut P,
    duration_s: f64,
    mut observe: impl FnMut(&Sample) -> ControlFlow<()>,
) -> Result<FlightEnd, P::Error> {
    let steps = (duration_s / world.dt_s()).round() as u64;
    let mut watch = LossDetector::new(world.faulty_from_s());
    for step in 0..=steps {
        let sample = pilot.step(world)?;
        // The step is observed before the loss is judged, so that a log includes the step in which the vehicle was
        // lost.
        let interrupted = observe(&sample).is_break();
        let reason = watch.lost(&sample, pilot.descends()).or_else(|| pilot.gave_up());
        let lost = reason.map(|reason| Lost { time_s: sample.time_s, reason });
        if interrupted || lost.is_some() {
            return Ok(FlightEnd { lost, interrupted });
        }
        if step < steps {
            world.advance(&sample.action.speeds);
        }
    }
    Ok(FlightEnd::default())
}
