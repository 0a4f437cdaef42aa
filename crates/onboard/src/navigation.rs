//! The vehicle's own estimate, and what of it the flight core is told.

use crate::readings::{Aged, Readings};
use afbc_estimator::{Easing, Estimate, Estimator, Measurement, Memory, Settings, Timed};
use afbc_flight_core::{Inbox, Refusal, Stamped};
use afbc_types::{OutOfRange, Pose, State};

/// Standard deviations of a tracker's pose that does not say how good it is: a motion-capture system's \[m, rad\].
const TRACKER: (f32, f32) = (0.003, 0.01);

/// Estimator and memory of a vehicle. Until its first sample of an inertial sensor, the vehicle flies on the states
/// that come over the link; from then on their poses, and poses that come alone, are measurements like others.
#[derive(Clone, Debug)]
pub struct Navigation {
    estimator: Estimator,
    memory: Memory,
    easing: Easing,
    /// True if there has been a sample.
    senses: bool,
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
        if let Some(Stamped { value, at_us }) = inbox.pose() {
            self.memory.offer(&Timed { value: measurement(value), at_us: *at_us });
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

fn measurement(pose: &Pose) -> Measurement {
    let (position_sigma_m, attitude_sigma_rad) = TRACKER;
    Measurement::Pose {
        position_m: pose.position_m,
        attitude: pose.attitude,
        position_sigma_m: pose.sigmas.position_m.unwrap_or(position_sigma_m),
        attitude_sigma_rad: pose.sigmas.attitude_rad.unwrap_or(attitude_sigma_rad),
    }
}
