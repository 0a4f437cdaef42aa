//! The vehicle's own estimate, and what of it the flight core is told.

use crate::readings::{Aged, Readings};
use afbc_estimator::{Easing, Estimate, Estimator, Measurement, Memory, Settings, Timed};
use afbc_flight_core::{Inbox, Refusal, Stamped};
use afbc_types::{OutOfRange, State};

/// Standard deviations of a tracker's pose that does not say how good it is: a motion-capture system's \[m, rad\].
const TRACKER: (f32, f32) = (0.003, 0.01);

/// Estimator and memory of a vehicle. Until its first sample of an inertial sensor, the vehicle flies on the states
/// that come over the link; from then on those are measurements like others.
#[derive(Clone, Debug)]
pub struct Navigation {
    estimator: Estimator,
    memory: Memory,
    easing: Easing,
    /// True if there has been a sample.
    senses: bool,
    /// Time of the tracker's last state that was taken as a measurement \[us\].
    tracked_us: Option<u64>,
}

impl Navigation {
    /// Creates it with nothing read.
    ///
    /// # Errors
    /// The first setting out of range.
    pub fn new(settings: Settings) -> Result<Self, OutOfRange> {
        Ok(Navigation {
            estimator: Estimator::new(settings)?,
            memory: Memory::default(),
            easing: Easing::default(),
            senses: false,
            tracked_us: None,
        })
    }

    /// Takes the readings of a tick at `now_us`, tells `inbox` what the vehicle knows, and returns the estimated state;
    /// none before the first sample.
    #[inline(always)]
    pub fn tick(&mut self, now_us: u64, readings: &Readings, inbox: &mut Inbox) -> Option<State> {
        let sample = readings.sample(now_us);
        self.senses |= sample.is_some();
        if !self.senses {
            return None;
        }
        for aid in readings.aids.iter().flatten() {
            self.memory.offer(&Aged::timed(*aid, now_us));
        }
        if let Some(state) = inbox.state().filter(|state| self.tracked_us.is_none_or(|last| state.at_us > last)) {
            self.tracked_us = Some(state.at_us);
            self.memory.offer(&Timed { value: pose(&state.value), at_us: state.at_us });
        }
        let estimate = self.estimator.step(&mut self.memory, now_us, sample.as_ref());
        tell(&estimate, self.easing.step(&estimate), now_us, inbox);
        Some(estimate.state)
    }
}

/// Tells `inbox` the eased `state` of an `estimate` as far as it is valid. What the link says of the state stands only
/// while the estimate has no attitude: after the inertial sensor has failed.
#[inline(always)]
pub fn tell(estimate: &Estimate, state: State, now_us: u64, inbox: &mut Inbox) {
    let stamped = Stamped { value: state, at_us: now_us };
    let validity = &estimate.validity;
    let missing = match (validity.attitude, validity.heading, validity.velocity && validity.position) {
        (true, true, true) => None,
        (false, ..) => Some(Refusal::AttitudeUnknown),
        (_, false, _) => Some(Refusal::HeadingUnknown),
        _ => Some(Refusal::PositionUnknown),
    };
    match missing {
        None => inbox.locate(stamped),
        Some(missing) => inbox.put_adrift(Some(stamped).filter(|_| validity.attitude), missing),
    }
}

/// Returns a tracker's state as a measurement: its pose.
fn pose(state: &State) -> Measurement {
    let (position_sigma_m, attitude_sigma_rad) = TRACKER;
    let q = state.quaternion().coords;
    Measurement::Pose {
        position_m: state.position_m,
        attitude: [q.w, q.x, q.y, q.z],
        position_sigma_m,
        attitude_sigma_rad,
    }
}
