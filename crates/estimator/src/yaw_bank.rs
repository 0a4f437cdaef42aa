//! Heading from a GNSS receiver's velocity without a compass: a bank of filters with different initial headings.
//!
//! The IMU gives the horizontal velocity change dV in the estimate's frame, which is wrong by the heading error delta:
//! dv = R(delta) dV. A receiver measures v, so an accelerating vehicle shows delta. This is not linear, and a single
//! filter may converge to the wrong side; five filters, a fifth of a turn apart, do not. Each has the state v and
//! delta, and a weight from its innovations (a Gaussian sum, like PX4's EKF-GSF, whose filters also each have their own
//! attitude). The bank runs once per fix beside the main filter and never uses a compass, so it can tell when the
//! compass is wrong.

use crate::rotation::atan2;
use afbc_control::math::{cos, exp, max, sin, sqrt, wrap_angle};
use core::f32::consts::TAU;
use nalgebra::Vector2;

/// Number of filters.
const FILTERS: usize = 5;
/// Acceleration error of the IMU by biases and tilt errors. Its square is the growth of the velocity variance per
/// second \[m/s2\].
const MISSED_M_S2: f32 = 0.5;
/// Drift of the heading error by the gyroscope's bias and scale, per root of a second \[rad\].
const DRIFT_RAD: f32 = 0.01;
/// Smallest standard deviation assumed for a receiver's velocity \[m/s\].
const LEAST_M_S: f32 = 0.3;
/// Longest time between two fixes from which a velocity change is used \[s\].
const APART_S: f32 = 1.0;
/// Smallest weight: a filter that was wrong before a heading reset may be right later.
const LEAST_WEIGHT: f32 = 1e-4;

/// One filter of the bank.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct YawHypothesis {
    velocity: Vector2<f32>,
    /// True heading minus the estimate's heading \[rad\].
    delta: f32,
    /// Covariance: velocity xx, xy, yy in `vv`, velocity with delta in `vd`, delta in `dd`.
    vv: (f32, f32, f32),
    vd: Vector2<f32>,
    dd: f32,
    weight: f32,
}

/// Bank of yaw filters.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct YawBank {
    guesses: [YawHypothesis; FILTERS],
    /// Sum of the IMU's velocity changes at the last fix, and the fix's time \[us\].
    last: Option<(Vector2<f32>, u64)>,
    /// Corrections of the estimate's heading since the last fix \[rad\].
    turned: f32,
    begun: bool,
}

impl YawBank {
    /// Fuses a velocity fix with the variance of each coordinate. `pushed` is the sum of the IMU's velocity changes up
    /// to the fix's time `at_us`, in the estimate's frame.
    pub(crate) fn fuse(&mut self, pushed: &Vector2<f32>, at_us: u64, velocity: &Vector2<f32>, variance: f32) {
        let variance = max(variance, LEAST_M_S * LEAST_M_S);
        if !self.begun {
            self.begun = true;
            for (k, guess) in self.guesses.iter_mut().enumerate() {
                let delta = wrap_angle(TAU / FILTERS as f32 * k as f32);
                // The standard deviation is half the distance to the next filter.
                let dd = (0.5 * TAU / FILTERS as f32) * (0.5 * TAU / FILTERS as f32);
                *guess = YawHypothesis { delta, dd, weight: 1.0 / FILTERS as f32, ..YawHypothesis::default() };
            }
        }
        let turned = core::mem::take(&mut self.turned);
        for guess in &mut self.guesses {
            guess.delta = wrap_angle(guess.delta - turned);
        }
        let last = self.last.replace((*pushed, at_us));
        let since = last.map(|(before, before_us)| (pushed - before, at_us.saturating_sub(before_us) as f32 * 1e-6));
        match since.filter(|(_, time_s)| *time_s > 0.0 && *time_s < APART_S) {
            Some((change, time_s)) => {
                let mut sum = 0.0;
                for guess in &mut self.guesses {
                    guess.predict(&change, time_s);
                    guess.weight = max(guess.weight * guess.correct(velocity, variance), 1e-30);
                    sum += guess.weight;
                }
                for guess in &mut self.guesses {
                    guess.weight = max(guess.weight / sum, LEAST_WEIGHT);
                }
            }
            // The velocity change since the last fix is unknown, so each filter starts from this velocity.
            None => {
                for guess in &mut self.guesses {
                    (guess.velocity, guess.vv, guess.vd) = (*velocity, (variance, 0.0, variance), Vector2::zeros());
                }
            }
        }
    }

    /// Records a heading correction of the estimate by `by`.
    #[inline]
    pub(crate) fn turn(&mut self, by: f32) {
        self.turned = wrap_angle(self.turned + by);
    }

    /// Records a heading reset. The velocity changes since the last fix are in the old frame and are not used.
    pub(crate) fn turn_at_once(&mut self, by: f32) {
        self.turn(by);
        self.last = None;
    }

    /// Returns the heading error over all filters and its variance, `None` before the first fix.
    pub(crate) fn error(&self) -> Option<(f32, f32)> {
        if !self.begun {
            return None;
        }
        let sum =
            |of: &dyn Fn(&YawHypothesis) -> f32| self.guesses.iter().map(|guess| guess.weight * of(guess)).sum::<f32>();
        let mean = atan2(sum(&|guess| sin(guess.delta)), sum(&|guess| cos(guess.delta)));
        let spread = |guess: &YawHypothesis| {
            let off = wrap_angle(guess.delta - mean);
            guess.dd + off * off
        };
        // At least one weight is at least a fifth, so the sum is above zero.
        Some((wrap_angle(mean - self.turned), sum(&spread) / max(sum(&|_| 1.0), LEAST_WEIGHT)))
    }
}

impl YawHypothesis {
    /// Predicts v' = v + R(delta) dV.
    fn predict(&mut self, change: &Vector2<f32>, time_s: f32) {
        let (sine, cosine) = (sin(self.delta), cos(self.delta));
        let turned = Vector2::new(cosine * change.x - sine * change.y, sine * change.x + cosine * change.y);
        self.velocity += turned;
        // Derivative of the velocity change by delta.
        let slope = Vector2::new(-turned.y, turned.x);
        let (xx, xy, yy) = self.vv;
        let (c, d) = (self.vd, self.dd);
        let missed = MISSED_M_S2 * MISSED_M_S2 * time_s;
        self.vv = (
            xx + 2.0 * c.x * slope.x + d * slope.x * slope.x + missed,
            xy + c.x * slope.y + c.y * slope.x + d * slope.x * slope.y,
            yy + 2.0 * c.y * slope.y + d * slope.y * slope.y + missed,
        );
        self.vd += slope * d;
        self.dd += DRIFT_RAD * DRIFT_RAD * time_s;
    }

    /// Corrects by a velocity and returns its likelihood.
    fn correct(&mut self, velocity: &Vector2<f32>, variance: f32) -> f32 {
        let (xx, xy, yy) = self.vv;
        let (sxx, syy) = (xx + variance, yy + variance);
        // At least the square of the measurement's variance, so the division is safe.
        let determinant = max(sxx * syy - xy * xy, variance * variance);
        let inverse = 1.0 / determinant;
        // Product of the inverse innovation covariance S^-1 with a vector.
        let solve = |x: f32, y: f32| Vector2::new((syy * x - xy * y) * inverse, (sxx * y - xy * x) * inverse);
        let innovation = velocity - self.velocity;
        let weighted = solve(innovation.x, innovation.y);
        let distance = innovation.dot(&weighted);
        let (kx, ky) = (solve(xx, xy), solve(xy, yy));
        let kd = solve(self.vd.x, self.vd.y);
        self.velocity += Vector2::new(kx.dot(&innovation), ky.dot(&innovation));
        self.delta = wrap_angle(self.delta + kd.dot(&innovation));
        let vd = self.vd;
        self.vv = (
            max(xx - (kx.x * xx + kx.y * xy), 1e-6),
            xy - (kx.x * xy + kx.y * yy),
            max(yy - (ky.x * xy + ky.y * yy), 1e-6),
        );
        self.vd -= Vector2::new(kx.dot(&vd), ky.dot(&vd));
        self.dd = max(self.dd - kd.dot(&vd), 1e-6);
        exp(-0.5 * distance) * sqrt(inverse)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]
mod tests {
    extern crate std;
    use super::YawBank;
    use core::f32::consts::PI;
    use nalgebra::Vector2;
    use proptest::prelude::*;

    /// Flies accelerations with a heading error of `off`, and returns the bank's heading error and variance.
    fn found(off: f32, accelerations: &[f32], noise: &[f32], bias: f32) -> (f32, f32) {
        let mut bank = YawBank::default();
        let (mut v, mut pushed) = (Vector2::zeros(), Vector2::zeros());
        let turn =
            |by: f32, v: Vector2<f32>| Vector2::new(by.cos() * v.x - by.sin() * v.y, by.sin() * v.x + by.cos() * v.y);
        let mut noise = noise.iter().cycle();
        for (k, pair) in accelerations.chunks_exact(2).enumerate() {
            for i in 0..5 {
                let change = Vector2::new(pair[0], pair[1]) * 0.2;
                v += change;
                pushed += turn(-off, change) + Vector2::new(bias, 0.0) * 0.2;
                let by = Vector2::new(*noise.next().unwrap(), *noise.next().unwrap());
                bank.fuse(&pushed, (5 * k + i) as u64 * 200_000, &(v + by), 0.01);
            }
        }
        bank.error().unwrap()
    }

    proptest! {
        /// The bank finds any heading error from any accelerated path, despite receiver noise and an acceleration bias,
        /// and its error fits its variance.
        #[test]
        fn any_heading_is_found(
            off in -PI..PI, accelerations in prop::collection::vec(-2.0..2.0_f32, 60),
            noise in prop::collection::vec(-0.2..0.2_f32, 98), bias in -0.3..0.3_f32,
        ) {
            let (mean, variance) = found(off, &accelerations, &noise, bias);
            let error = afbc_control::math::wrap_angle(mean - off).abs();
            prop_assert!(variance < 0.1, "{variance}");
            prop_assert!(error < 3.5 * variance.sqrt() + 0.05, "{error}, {variance}");
            prop_assert!(error < 0.4, "{error}");
        }

        /// Without acceleration the heading stays unknown.
        #[test]
        fn a_hover_shows_nothing(off in -PI..PI, noise in prop::collection::vec(-0.2..0.2_f32, 98)) {
            let (_, variance) = found(off, &[0.0; 60], &noise, 0.0);
            prop_assert!(variance > 0.5, "{variance}");
        }

        /// The output stays finite for any input of receiver and IMU.
        #[test]
        fn it_stays_finite(
            steps in prop::collection::vec((-1e4..1e4_f32, -150.0..150.0_f32, 0_u64..3_000_000, 1e-6..1e8_f32), 1..80),
            by in -10.0..10.0_f32,
        ) {
            let (mut bank, mut at_us) = (YawBank::default(), 0);
            for (pushed, velocity, later_us, variance) in steps {
                at_us += later_us;
                bank.fuse(&Vector2::new(pushed, -pushed), at_us, &Vector2::new(velocity, 1.0), variance);
                bank.turn(by);
                let (mean, variance) = bank.error().unwrap();
                prop_assert!(mean.is_finite() && variance.is_finite() && variance > 0.0, "{bank:?}");
            }
        }
    }
}
