//! Collects the log's own estimate.

use crate::aids::sparse;
use crate::order::rising;
use crate::recording::{LoggedState, SampleSource, Sensor};
use nalgebra::Vector3;

/// Shortest time between two kept states of the same kind \[us\].
const SPARSE_US: u64 = 9_000;
/// Largest plausible coordinate of a position \[m\] and of a velocity \[m/s\].
const POSITION_MAX_M: f32 = 1e5;
const VELOCITY_MAX_M_S: f32 = 1e3;

/// Returns a state with velocity and position; none if neither is usable.
pub(crate) fn motion(
    at_us: u64,
    velocity: Option<Vector3<f32>>,
    position: Option<Vector3<f32>>,
) -> Option<LoggedState> {
    // NaN makes this false.
    let within = |v: &Vector3<f32>, most: f32| v.iter().all(|part| part.abs() <= most);
    let velocity_m_s = velocity.filter(|velocity| within(velocity, VELOCITY_MAX_M_S));
    let position_m = position.filter(|position| within(position, POSITION_MAX_M));
    let some = velocity_m_s.is_some() || position_m.is_some();
    some.then_some(LoggedState { at_us, attitude: None, velocity_m_s, position_m })
}

/// Brings states into the order of time and thins them out; `raw` is their number in the log.
pub(crate) fn collect(
    states: Vec<LoggedState>,
    raw: usize,
    sensor: Sensor,
    topic: &str,
) -> (Vec<LoggedState>, SampleSource) {
    let states = sparse(rising(states, |state| state.at_us).0, SPARSE_US, |state| state.at_us);
    let (used, topic) = (states.len(), topic.to_owned());
    (states, SampleSource { sensor, topic, used, skipped: raw - used })
}

/// Merges attitudes and motions; two states of the same time become one.
pub(crate) fn merged(attitudes: Vec<LoggedState>, motions: Vec<LoggedState>) -> Vec<LoggedState> {
    let mut states: Vec<_> = attitudes.into_iter().chain(motions).collect();
    states.sort_by_key(|state| state.at_us);
    states.dedup_by(|later, first| {
        let same = later.at_us == first.at_us;
        if same {
            first.attitude = first.attitude.or(later.attitude);
            first.velocity_m_s = first.velocity_m_s.or(later.velocity_m_s);
            first.position_m = first.position_m.or(later.position_m);
        }
        same
    });
    states
}
