//! Third-order motion towards a goal that may itself move, with limits of speed, acceleration and jerk.
//!
//! The distance e to the goal determines the speed of approach f. The error x of the velocity determines the
//! acceleration g:
//!
//! ```text
//! f(e) = sqrt(c^2 + 2 B e) - c     c = 2 B^2/J'     a stop from f(e) takes the distance e, decelerating with at most B
//! g(x) = sqrt(d^2 + 2 J" x) - d    d = J"/k2        the same one derivative higher, with a jerk of at most J"
//! ```
//!
//! B, J' and J" are shares of the largest acceleration A and jerk J; the rest is a reserve for corrections. Near the
//! goal the motion is a linear system with the rates k1 = B/c, k2 = 4 k1 and k3 = 5 k2, and does not overshoot. PX4's
//! `computeMaxSpeedFromDistance` also takes the speed of approach from the stopping distance. ArduPilot's
//! `shape_pos_vel_accel` also cascades two such functions; here they act on vectors, so that a flight from rest is
//! straight.

use afbc_control::math::{max, min, sqrt};
use nalgebra::SVector;

/// B as a share of A.
const BRAKING: f32 = 0.7;
/// J' as a share of J.
const EASING: f32 = 0.9;
/// J" as a share of J.
const SETTLING: f32 = 0.55;
/// Largest k1 \[1/s\]: a time step of 1 ms must be short compared with 1/k3, the shortest of the three time constants.
const APPROACH_MAX_1_S: f32 = 12.0;
/// Share of a speed limit used as the aim, since the speed may overshoot slightly.
const AIM: f32 = 0.98;

/// Position and three derivatives. The position is kept in two parts, since far from the origin a step is smaller than
/// the resolution of one number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MotionState<const D: usize> {
    pub(crate) position: SVector<f32, D>,
    below: SVector<f32, D>,
    pub(crate) velocity: SVector<f32, D>,
    pub(crate) acceleration: SVector<f32, D>,
    pub(crate) jerk: SVector<f32, D>,
}

impl<const D: usize> MotionState<D> {
    /// Makes a motion without acceleration or jerk.
    pub(crate) fn new(position: SVector<f32, D>, velocity: SVector<f32, D>) -> Self {
        let zero = SVector::zeros();
        MotionState { position, below: zero, velocity, acceleration: zero, jerk: zero }
    }

    /// Makes a motion from position, velocity, acceleration and jerk.
    pub(crate) fn moving(
        position: SVector<f32, D>,
        velocity: SVector<f32, D>,
        acceleration: SVector<f32, D>,
        jerk: SVector<f32, D>,
    ) -> Self {
        MotionState { acceleration, jerk, ..MotionState::new(position, velocity) }
    }

    /// Returns the vector to `position`.
    pub(crate) fn to(&self, position: &SVector<f32, D>) -> SVector<f32, D> {
        (position - self.position) - self.below
    }

    /// Advances the motion by a step of constant `jerk`.
    pub(crate) fn advance(&mut self, jerk: SVector<f32, D>, dt_s: f32) {
        let MotionState { velocity, acceleration, .. } = *self;
        self.below += (velocity + (acceleration * 0.5 + jerk * (dt_s / 6.0)) * dt_s) * dt_s;
        let position = self.position + self.below;
        self.below -= position - self.position;
        self.position = position;
        self.velocity += (acceleration + jerk * (0.5 * dt_s)) * dt_s;
        self.acceleration += jerk * dt_s;
        self.jerk = jerk;
    }
}

/// Goal of a motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MotionGoal<const D: usize> {
    /// `None` if only velocity or acceleration is given.
    pub(crate) position: Option<SVector<f32, D>>,
    /// `None` if only the acceleration is given.
    pub(crate) velocity: Option<SVector<f32, D>>,
    pub(crate) acceleration: SVector<f32, D>,
    pub(crate) jerk: SVector<f32, D>,
}

/// Limits that may change from tick to tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MotionBounds {
    /// Largest speed of approach, in positive and in negative direction; for a vector of two coordinates, the first
    /// counts.
    pub(crate) approach: (f32, f32),
    /// Largest speed, in positive and in negative direction.
    pub(crate) speed: (f32, f32),
    /// Largest acceleration and jerk, including the goal's.
    pub(crate) acceleration: f32,
    pub(crate) jerk: f32,
}

/// Constants of the motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MotionShaper {
    acceleration: f32,
    jerk: f32,
    /// B, c, J", d, 1/k2 and k3 of the module's documentation.
    braking: f32,
    c: f32,
    settling: f32,
    d: f32,
    inverse_k2: f32,
    k3: f32,
}

impl MotionShaper {
    /// Makes the constants for this largest acceleration and jerk, both positive.
    pub(crate) fn new(acceleration: f32, jerk: f32) -> Self {
        let braking = BRAKING * acceleration;
        let k1 = min(EASING * jerk / (2.0 * braking), APPROACH_MAX_1_S);
        let k2 = 4.0 * k1;
        let settling = SETTLING * jerk;
        MotionShaper {
            acceleration,
            jerk,
            braking,
            // Equals 2 B^2/J', unless k1 is at its limit: then larger.
            c: braking / k1,
            settling,
            d: settling / k2,
            inverse_k2: 1.0 / k2,
            k3: 5.0 * k2,
        }
    }

    /// Returns the deceleration of a stop from this speed: g(speed), at most A.
    pub(crate) fn braking(&self, speed: f32) -> f32 {
        min(sqrt(self.d * self.d + 2.0 * self.settling * speed) - self.d, self.acceleration)
    }

    /// Returns the distance of a stop from this speed for a vehicle that already decelerates by `braking`. The
    /// deceleration first builds up with J to A, and decreases along g near the end.
    pub(crate) fn stop(&self, speed: f32, braking: f32) -> f32 {
        let MotionShaper { acceleration, jerk, settling, d, .. } = *self;
        let missing = max(acceleration - braking, 0.0);
        let builds_up_s = missing * missing / (2.0 * acceleration * jerk);
        // This is the speed at which g reaches A. Below it, the distance is the integral of x/g(x).
        let gentle = min((acceleration + 2.0 * d) * acceleration / (2.0 * settling), speed);
        let root = sqrt(d * d + 2.0 * settling * gentle);
        let end = (root * root * root - d * d * d) / (6.0 * settling * settling) + d * gentle / (2.0 * settling);
        speed * builds_up_s + (speed * speed - gentle * gentle) / (2.0 * acceleration) + end
    }

    /// Advances `motion` by one step towards `goal`.
    pub(crate) fn advance<const D: usize>(
        &self,
        motion: &mut MotionState<D>,
        goal: &MotionGoal<D>,
        reach: &MotionBounds,
        dt_s: f32,
    ) {
        let (wanted, change) = self.wanted(motion, goal, reach);
        let x = wanted - motion.velocity;
        // g(x)/x and the derivative g'.
        let root = sqrt(self.d * self.d + 2.0 * self.settling * sqrt(x.norm_squared()));
        let (gain, slope) = (2.0 * self.settling / (self.d + root), self.settling / root);
        let given = if goal.velocity.is_some() { goal.acceleration } else { SVector::zeros() };
        let own = change + x * gain;
        let (own, rise) = if own.norm_squared() <= self.acceleration * self.acceleration {
            (own, (change - (motion.acceleration - given)) * slope)
        } else {
            // At its limit, the acceleration is constant.
            (capped(own, self.acceleration), SVector::zeros())
        };
        let wanted = capped(given + own, reach.acceleration);
        let jerk = match self.guarded(wanted, motion, reach) {
            // Near the speed limit, the goal's jerk is dropped.
            Some((wanted, rise)) => rise + (wanted - motion.acceleration) * self.k3,
            None => goal.jerk + capped(rise + (wanted - motion.acceleration) * self.k3, self.jerk),
        };
        let jerk = capped(jerk, reach.jerk);
        let next = capped(motion.acceleration + jerk * dt_s, reach.acceleration);
        // If a lowered limit is below the present acceleration, the acceleration decreases with the largest jerk.
        let jerk = capped((next - motion.acceleration) / dt_s, reach.jerk);
        motion.advance(jerk, dt_s);
    }

    /// Returns an acceleration that keeps the speed within its limit, and its derivative; `None` if `wanted` does that
    /// already.
    fn guarded<const D: usize>(
        &self,
        wanted: SVector<f32, D>,
        motion: &MotionState<D>,
        reach: &MotionBounds,
    ) -> Option<(SVector<f32, D>, SVector<f32, D>)> {
        let size_squared = wanted.norm_squared();
        if size_squared <= 0.0 {
            return None;
        }
        // Distance of the velocity from the limit, along the acceleration.
        let size = sqrt(size_squared);
        let along = motion.velocity.dot(&wanted) / size;
        let most = AIM * side(&wanted, reach.speed);
        let across_squared = motion.velocity.norm_squared() - along * along;
        let room = max(sqrt(max(most * most - across_squared, 0.0)) - along, 0.0);
        // This is the function g with the largest jerk.
        let settling = SETTLING * reach.jerk;
        let d = settling * self.inverse_k2;
        let root = sqrt(d * d + 2.0 * settling * room);
        let most = root - d;
        (size > most).then(|| (wanted * (most / size), motion.acceleration * (-settling / root)))
    }

    /// Returns the wanted velocity, and its derivative without the goal's acceleration.
    fn wanted<const D: usize>(
        &self,
        motion: &MotionState<D>,
        goal: &MotionGoal<D>,
        reach: &MotionBounds,
    ) -> (SVector<f32, D>, SVector<f32, D>) {
        let zero = SVector::zeros();
        let Some(velocity) = goal.velocity else {
            // The velocity for which g gives this acceleration, up to the limit.
            let size = sqrt(goal.acceleration.norm_squared());
            let ahead = motion.velocity + goal.acceleration * ((2.0 * self.d + size) / (2.0 * self.settling));
            return (capped(ahead, AIM * side(&ahead, reach.approach)), zero);
        };
        let Some(position) = goal.position else {
            return (capped(velocity, AIM * side(&velocity, reach.approach)), zero);
        };
        let e = motion.to(&position);
        let distance_squared = e.norm_squared();
        let root = sqrt(self.c * self.c + 2.0 * self.braking * sqrt(distance_squared));
        // f(e)/e and the derivative f'.
        let (share, slope) = (2.0 * self.braking / (root + self.c), self.braking / root);
        let approach = e * share;
        let most = AIM * side(&e, reach.approach);
        let (approach, change) = if share * share * distance_squared <= most * most {
            let closing = motion.velocity - velocity;
            let along = if distance_squared > 0.0 { e * (e.dot(&closing) / distance_squared) } else { zero };
            (approach, along * (share - slope) - closing * share)
        } else {
            (capped(approach, most), zero)
        };
        let wanted = velocity + approach;
        (capped(wanted, AIM * side(&wanted, reach.speed)), change)
    }
}

/// Returns the limit for the vector's direction: the first for positive, the second for negative coordinates.
fn side<const D: usize>(vector: &SVector<f32, D>, (up, down): (f32, f32)) -> f32 {
    if vector.iter().all(|coordinate| *coordinate < 0.0) && D == 1 { down } else { up }
}

/// Returns the vector, shortened to the length `most` if longer.
pub(crate) fn capped<const D: usize>(vector: SVector<f32, D>, most: f32) -> SVector<f32, D> {
    let squared = vector.norm_squared();
    if squared <= most * most { vector } else { vector * (most / sqrt(max(squared, f32::MIN_POSITIVE))) }
}

#[cfg(test)]
mod tests;
