//! Which of two inertial sensors that disagree is right, by what else is measured.

use afbc_estimator::Inertial;
use nalgebra::{Matrix3, Vector3};

/// Distance of the lanes from which on another sensor decides: of a magnetic field its share, and of a velocity
/// \[m/s\], to which twice its standard deviation along the axis is added. A vehicle's own field and the lanes' common
/// errors stay below half of these.
const FIELD: f32 = 0.12;
const SPEED_M_S: f32 = 0.5;
/// Measurements in a row of each that must say the same.
const FIELDS: i8 = 15;
const SPEEDS: i8 = 2;
/// What counts as much as what in the estimate: a turn \[rad\], and a velocity \[m/s\]. The distance from which on the
/// estimate tells, and the share of the way that it must have gone: by its fixes alone it wanders by a unit.
const TURN_RAD: f32 = 0.05;
const SPEED_LIKE_M_S: f32 = 0.5;
const FAR: f32 = 3.0;
const GOES: f32 = 0.5;
/// Time after which lanes begin anew \[s\].
const OLD_S: f32 = 6.0;
/// What a fix finds of the past: so many entries, so far apart \[us\].
// Together 0.4 s, more than the 0.25 s by which a measurement may be late.
const PAST: usize = 16;
const APART_US: u64 = 25_000;

/// What else is measured in a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OtherSensors {
    /// Velocity of a GNSS receiver, its standard deviations \[m/s\] and age \[us\].
    pub velocity: Option<([Vector3<f32>; 2], u32)>,
    /// Corrected magnetic field in the body's axes \[uT\].
    pub field: Option<Vector3<f32>>,
}

/// Two lanes from one estimate: what the vehicle does by the sensor that flies, and by the other, both without aids
/// from the beginning on.
///
/// ```text
/// d theta/dt = R (w_other - w)                                    the other lane, seen from the one that flies
/// d v/dt = R (f_other - f) + theta x R f
/// d gamma/dt = corrections + R (b_0 - b)                          the estimate, seen from there
/// d u/dt = corrections + R (a_0 - a) + gamma x R f
/// ```
///
/// with the attitude R, rates w and specific force f of the estimate, and its biases b and a, b_0 and a_0 at the
/// beginning. Three measurements show how far the vehicle is on the way from the lane that flies, 0, to the other one,
/// 1, once the lanes are far enough apart:
///
/// * the earth's magnetic field, which stays where it was before the beginning;
/// * a GNSS receiver's velocity;
/// * the estimate, which its aids pull to where the vehicle is, a tracker above all. It says nothing by staying: a
///   filter trusts its gyroscope, and refuses what contradicts it at first.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ImuLanes {
    last: Inertial,
    begin_biases: [Vector3<f32>; 2],
    /// Of the other lane, and of the estimate: turn \[rad\] and velocity \[m/s\] in the earth frame.
    other: [Vector3<f32>; 2],
    estimate: [Vector3<f32>; 2],
    /// The magnetic field before the beginning, in the earth frame \[uT\].
    field: Option<Vector3<f32>>,
    /// Measurements in a row that speak for the other lane, or, below zero, against it: of the field, and of velocity.
    votes: [i8; 2],
    begin_us: u64,
    /// Times, and velocities by the lane that flies, and from there to the other one.
    past: [(u64, [Vector3<f32>; 2]); PAST],
}

impl ImuLanes {
    /// Begins at an estimate.
    pub(crate) fn new(now: &Inertial, field: Option<Vector3<f32>>) -> Self {
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

    /// Goes on to the next estimate, while the other sensor measures so much more in the body's axes \[rad/s, m/s2\].
    pub(crate) fn advance(
        &mut self,
        now: &Inertial,
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

    fn remember(&mut self, now: &Inertial) {
        let ([_, other], [_, estimate]) = (self.other, self.estimate);
        let newest_us = self.past.iter().map(|(at_us, _)| *at_us).max();
        if newest_us.is_none_or(|newest_us| now.at_us >= newest_us + APART_US)
            && let Some(oldest) = self.past.iter_mut().min_by_key(|(at_us, _)| *at_us)
        {
            *oldest = (now.at_us, [now.velocity - estimate, other]);
        }
    }

    /// Takes the field in the earth frame, by the attitude of the estimate.
    fn hear_field(&mut self, field: &Vector3<f32>) {
        let ([turn, _], [estimate, _], Some(before)) = (self.other, self.estimate, self.field) else { return };
        // By the attitudes of either lane.
        let flying = field - estimate.cross(field);
        let apart = turn.cross(&before);
        if apart.norm_squared() > FIELD * FIELD * before.norm_squared() {
            let [votes, _] = &mut self.votes;
            vote(votes, (before - flying).dot(&apart) / apart.norm_squared());
        }
    }

    /// Takes a velocity with its standard deviations that was true at `at_us`.
    fn hear_velocity(&mut self, [velocity, sigmas]: &[Vector3<f32>; 2], at_us: u64) {
        let nearest = self.past.iter().min_by_key(|(past_us, _)| past_us.abs_diff(at_us));
        // What was true before the beginning says nothing: both lanes begin there.
        let Some((_, [flying, apart])) = nearest.filter(|_| at_us > self.begin_us) else { return };
        let weights = sigmas.map(|sigma| 1.0 / (SPEED_M_S + 2.0 * sigma));
        let (apart, measured) = (apart.component_mul(&weights), (velocity - flying).component_mul(&weights));
        if apart.norm_squared() > 1.0 {
            let [_, votes] = &mut self.votes;
            vote(votes, measured.dot(&apart) / apart.norm_squared());
        }
    }

    /// True if the vehicle is in the other lane, false if it is in the one that flies.
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

    /// True if nothing has told for so long that it is to begin anew.
    pub(crate) fn is_old(&self) -> bool {
        self.last.at_us.saturating_sub(self.begin_us) as f32 * 1e-6 > OLD_S
    }

    /// From the estimate to the other lane, in the earth frame: turn \[rad\] and velocity \[m/s\].
    pub(crate) fn hidden(&self) -> [Vector3<f32>; 2] {
        let ([turn, speed], [of_turn, of_speed]) = (self.other, self.estimate);
        [turn - of_turn, speed - of_speed]
    }

    /// By how much the biases of gyroscope \[rad/s\] and accelerometer \[m/s2\] have moved since the beginning.
    pub(crate) fn moved(&self, now: &Inertial) -> [Vector3<f32>; 2] {
        let [gyro, accel] = self.begin_biases;
        [now.gyro_bias - gyro, now.accel_bias - accel]
    }
}

/// Counts a measurement that finds the vehicle on this share of the way to the other lane.
fn vote(votes: &mut i8, share: f32) {
    // Only votes in a row count: one for the other side takes the place of all before it.
    *votes = if share > 0.5 { votes.saturating_add(1).max(1) } else { votes.saturating_sub(1).min(-1) };
}

/// Returns the vector of a small rotation.
fn axial(rotation: &Matrix3<f32>) -> Vector3<f32> {
    let skew = rotation - rotation.transpose();
    Vector3::new(skew.m32, skew.m13, skew.m21) * 0.5
}
