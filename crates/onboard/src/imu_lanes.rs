//! Decides which of two disagreeing inertial sensors is right, by other measurements.

use afbc_estimator::InertialState;
use nalgebra::{Matrix3, Vector3};

/// Distance between the lanes from which another sensor can decide. For the magnetic field it is a share of the field.
/// For a velocity it is in m/s, plus twice the standard deviation along the axis. The vehicle's own field and errors
/// common to both lanes stay below half of these distances.
const FIELD: f32 = 0.12;
const SPEED_M_S: f32 = 0.5;
/// Number of consecutive field and velocity measurements that must agree.
const FIELDS: i8 = 15;
const SPEEDS: i8 = 2;
/// Difference in attitude that counts as one unit of the distance between the lanes \[rad\].
const TURN_RAD: f32 = 0.05;
/// Difference in velocity that counts as one unit of the distance between the lanes \[m/s\].
const SPEED_LIKE_M_S: f32 = 0.5;
/// Distance between the lanes from which the estimate can decide. Fixes alone make the estimate wander by one unit.
const FAR: f32 = 3.0;
/// Share of the distance between the lanes that the estimate must have moved to decide.
const GOES: f32 = 0.5;
/// Time after which the lanes start again \[s\].
const OLD_S: f32 = 6.0;
/// Stored past velocities, to which a late fix is compared: their number and spacing \[us\].
// The stored velocities cover 0.4 s. The largest delay of a measurement is 0.25 s.
const PAST: usize = 16;
const APART_US: u64 = 25_000;

/// Measurements of other sensors in a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OtherSensors {
    /// Velocity of a GNSS receiver, its standard deviations \[m/s\] and age \[us\].
    pub velocity: Option<([Vector3<f32>; 2], u32)>,
    /// Corrected magnetic field in the body frame \[uT\].
    pub field: Option<Vector3<f32>>,
}

/// Two lanes that start from one estimate: the motion by the sensor that flies (is in use), and the motion by the other
/// sensor. Both run without aiding.
///
/// ```text
/// d theta/dt = R (w_other - w)                                    the other lane, seen from the one that flies
/// d v/dt = R (f_other - f) + theta x R f
/// d gamma/dt = corrections + R (b_0 - b)                          the estimate, seen from there
/// d u/dt = corrections + R (a_0 - a) + gamma x R f
/// ```
///
/// where R, w and f are the estimate's attitude, rates and specific force, b and a its biases, and b_0 and a_0 the
/// biases at the start. Once the lanes are far enough apart, three measurements show where the vehicle is between the
/// lane that flies (0) and the other lane (1):
///
/// * the earth's magnetic field, which keeps its direction from before the start;
/// * a GNSS receiver's velocity;
/// * the estimate, which aiding pulls towards the true motion, most of all a tracker. An estimate that does not move
///   proves nothing: the filter trusts its gyroscope, and at first rejects contradictions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ImuLanes {
    last: InertialState,
    begin_biases: [Vector3<f32>; 2],
    /// Turn \[rad\] and velocity \[m/s\] in the earth frame, relative to the lane that flies: of the other lane, and of
    /// the estimate.
    other: [Vector3<f32>; 2],
    estimate: [Vector3<f32>; 2],
    /// Magnetic field in the earth frame before the start \[uT\].
    field: Option<Vector3<f32>>,
    /// Consecutive votes of field and velocity: positive for the other lane, negative against it.
    votes: [i8; 2],
    begin_us: u64,
    /// Times, with the velocity of the lane that flies and the other lane's velocity relative to it.
    past: [(u64, [Vector3<f32>; 2]); PAST],
}

impl ImuLanes {
    /// Starts the lanes at an estimate.
    pub(crate) fn new(now: &InertialState, field: Option<Vector3<f32>>) -> Self {
        let zero = [Vector3::zeros(); 2];
        ImuLanes {
            last: *now,
            begin_biases: [now.gyro_bias, now.accel_bias],
            other: zero,
            estimate: zero,
            field,
            votes: [0; 2],
            begin_us: now.at_us,
            past: [(0, zero); PAST],
        }
    }

    /// Advances to the next estimate. The other sensor's excess over the one that flies is in the body frame \[rad/s,
    /// m/s2\].
    pub(crate) fn advance(
        &mut self,
        now: &InertialState,
        [rates_apart, force_apart]: [Vector3<f32>; 2],
        others: &OtherSensors,
    ) {
        let last = core::mem::replace(&mut self.last, *now);
        let dt_s = now.at_us.saturating_sub(last.at_us).min(100_000) as f32 * 1e-6;
        let rates = (last.rates + now.rates) * 0.5;
        let force = (last.rotation * last.force + now.rotation * now.force) * 0.5;
        let [turn, speed] = &mut self.other;
        *speed += (turn.cross(&force) + now.rotation * force_apart) * dt_s;
        *turn += now.rotation * rates_apart * dt_s;

        let turned = axial(&(last.rotation.transpose() * now.rotation));
        let acceleration = force - Vector3::new(0.0, 0.0, now.gravity);
        let [of_rates, of_force] = self.moved(now);
        let [turn, speed] = &mut self.estimate;
        *speed += now.velocity - last.velocity + (turn.cross(&force) - acceleration - now.rotation * of_force) * dt_s;
        *turn += now.rotation * (turned - (rates + of_rates) * dt_s);

        self.remember(now);
        if let Some(field) = &others.field {
            self.hear_field(&(now.rotation * field));
        }
        if let Some((velocity, age_us)) = &others.velocity {
            self.hear_velocity(velocity, now.at_us.saturating_sub(u64::from(*age_us)));
        }
    }

    fn remember(&mut self, now: &InertialState) {
        let ([_, other], [_, estimate]) = (self.other, self.estimate);
        let newest_us = self.past.iter().map(|(at_us, _)| *at_us).max();
        if newest_us.is_none_or(|newest_us| now.at_us >= newest_us + APART_US)
            && let Some(oldest) = self.past.iter_mut().min_by_key(|(at_us, _)| *at_us)
        {
            *oldest = (now.at_us, [now.velocity - estimate, other]);
        }
    }

    /// Takes the field in the earth frame, as rotated by the estimate's attitude.
    fn hear_field(&mut self, field: &Vector3<f32>) {
        let ([turn, _], [estimate, _], Some(before)) = (self.other, self.estimate, self.field) else { return };
        // Rotates the field by the flying lane's attitude. `apart` is how far the other lane would turn it.
        let flying = field - estimate.cross(field);
        let apart = turn.cross(&before);
        if apart.norm_squared() > FIELD * FIELD * before.norm_squared() {
            let [votes, _] = &mut self.votes;
            vote(votes, (before - flying).dot(&apart) / apart.norm_squared());
        }
    }

    /// Takes a velocity with its standard deviations, valid at `at_us`.
    fn hear_velocity(&mut self, [velocity, sigmas]: &[Vector3<f32>; 2], at_us: u64) {
        let nearest = self.past.iter().min_by_key(|(past_us, _)| past_us.abs_diff(at_us));
        // A velocity from before the start proves nothing, as both lanes begin there.
        let Some((_, [flying, apart])) = nearest.filter(|_| at_us > self.begin_us) else { return };
        let weights = sigmas.map(|sigma| 1.0 / (SPEED_M_S + 2.0 * sigma));
        let (apart, measured) = (apart.component_mul(&weights), (velocity - flying).component_mul(&weights));
        if apart.norm_squared() > 1.0 {
            let [_, votes] = &mut self.votes;
            vote(votes, measured.dot(&apart) / apart.norm_squared());
        }
    }

    /// Returns true if the other lane is right, false if the lane that flies is right, and none as long as this is
    /// undecided.
    pub(crate) fn other_is_right(&self) -> Option<bool> {
        let units = [1.0 / TURN_RAD, 1.0 / SPEED_LIKE_M_S];
        let product = |one: &[Vector3<f32>; 2], other: &[Vector3<f32>; 2]| -> f32 {
            one.iter().zip(other).zip(units).map(|((one, other), unit)| one.dot(other) * unit * unit).sum()
        };
        let distance_squared = product(&self.other, &self.other);
        let goes = product(&self.other, &self.estimate) > GOES * distance_squared;
        let [fields, speeds] = self.votes;
        if fields >= FIELDS || speeds >= SPEEDS || goes && distance_squared > FAR * FAR {
            Some(true)
        } else if fields <= -FIELDS || speeds <= -SPEEDS {
            Some(false)
        } else {
            None
        }
    }

    /// Returns true if the lanes are so old, without a decision, that they must start again.
    pub(crate) fn is_old(&self) -> bool {
        self.last.at_us.saturating_sub(self.begin_us) as f32 * 1e-6 > OLD_S
    }

    /// Returns the way from the estimate to the other lane in the earth frame: turn \[rad\] and velocity \[m/s\].
    pub(crate) fn hidden(&self) -> [Vector3<f32>; 2] {
        let ([turn, speed], [of_turn, of_speed]) = (self.other, self.estimate);
        [turn - of_turn, speed - of_speed]
    }

    /// Returns the change of gyroscope \[rad/s\] and accelerometer \[m/s2\] biases since the start.
    pub(crate) fn moved(&self, now: &InertialState) -> [Vector3<f32>; 2] {
        let [gyro, accel] = self.begin_biases;
        [now.gyro_bias - gyro, now.accel_bias - accel]
    }
}

/// Counts a vote. `share` is the vehicle's measured place between the lane that flies (0) and the other (1).
fn vote(votes: &mut i8, share: f32) {
    // Only consecutive votes count: a vote for the other side resets the count.
    *votes = if share > 0.5 { votes.saturating_add(1).max(1) } else { votes.saturating_sub(1).min(-1) };
}

/// Returns the vector of a small rotation.
fn axial(rotation: &Matrix3<f32>) -> Vector3<f32> {
    let skew = rotation - rotation.transpose();
    Vector3::new(skew.m32, skew.m13, skew.m21) * 0.5
}
