//! Heading by a GNSS receiver's velocity, without a compass: a bank of filters, each with a guess of its own.
//!
//! The inertial sensor knows how the velocity has changed, but for the heading's error delta: dv = R(delta) dV with its
//! own horizontal dV. A receiver measures v, so a vehicle that accelerates shows delta. That is not linear, and one
//! filter may settle on the wrong side; five, a fifth of a turn apart, do not. Each has the state v, delta and the
//! weight that its innovations give it (a Gaussian sum; PX4's EKF-GSF, which has an attitude of its own for each
//! instead). It runs at the rate of the fixes, beside the filter, and never takes anything from a compass: so it can
//! tell when the compass is wrong.

use crate::rotation::atan2;
use afbc_control::math::{cos, exp, max, sin, sqrt, wrap_angle};
use core::f32::consts::TAU;
use nalgebra::Vector2;

/// Number of filters.
const FILTERS: usize = 5;
/// Acceleration that the inertial sensor misses by its biases and the tilt's errors: what the velocity's variance grows
/// by in a second is its square \[m/s2\].
const MISSED_M_S2: f32 = 0.5;
/// Drift of the heading's error, the gyroscope's bias and scale: per root of a second \[rad\].
const DRIFT_RAD: f32 = 0.01;
/// Smallest standard deviation that a receiver's velocity counts with \[m/s\].
const LEAST_M_S: f32 = 0.3;
/// Longest time between two fixes that show a change of velocity \[s\].
const APART_S: f32 = 1.0;
/// Smallest weight: a guess that was wrong before the heading was set may be right later.
const LEAST_WEIGHT: f32 = 1e-4;

/// One filter.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Guess {
    velocity: Vector2<f32>,
    /// Heading less the estimate's \[rad\].
    delta: f32,
    /// Covariance of the velocity, xx, xy, yy; its covariances with delta; delta's variance.
    vv: (f32, f32, f32),
    vd: Vector2<f32>,
    dd: f32,
    weight: f32,
}

/// The bank.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct YawBank {
    guesses: [Guess; FILTERS],
    /// Sum of the inertial sensor's changes of velocity at the last fix, and its time \[us\].
    last: Option<(Vector2<f32>, u64)>,
    /// Turn of the estimate's heading since then \[rad\].
    turned: f32,
    begun: bool,
}

impl YawBank {
    /// Takes a fix of the velocity, with the variance of each coordinate. `pushed` is the sum of the changes of
    /// velocity that the inertial sensor has seen up to the fix's time `at_us`, in the estimate's frame.
    pub(crate) fn fuse(&mut self, pushed: &Vector2<f32>, at_us: u64, velocity: &Vector2<f32>, variance: f32) {
        let variance = max(variance, LEAST_M_S * LEAST_M_S);
        if !self.begun {
            self.begun = true;
            for (k, guess) in self.guesses.iter_mut().enumerate() {
                let delta = wrap_angle(TAU / FILTERS as f32 * k as f32);
                // Half of the way to the next.
                let dd = (0.5 * TAU / FILTERS as f32) * (0.5 * TAU / FILTERS as f32);
                *guess = Guess { delta, dd, weight: 1.0 / FILTERS as f32, ..Guess::default() };
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
            // Nothing is known of the way since the last one.
            None => {
                for guess in &mut self.guesses {
                    (guess.velocity, guess.vv, guess.vd) = (*velocity, (variance, 0.0, variance), Vector2::zeros());
                }
            }
        }
    }

    /// Follows a turn of the estimate's heading by `by`.
    #[inline]
    pub(crate) fn turn(&mut self, by: f32) {
        self.turned = wrap_angle(self.turned + by);
    }

    /// Follows a heading that was set anew: what was pushed since the last fix was so in another frame.
    pub(crate) fn turn_at_once(&mut self, by: f32) {
        self.turn(by);
        self.last = None;
    }

    /// Returns the heading's error by all filters, and its variance; none before the first fix.
    pub(crate) fn error(&self) -> Option<(f32, f32)> {
        if !self.begun {
            return None;
        }
        let sum = |of: &dyn Fn(&Guess) -> f32| self.guesses.iter().map(|guess| guess.weight * of(guess)).sum::<f32>();
        let mean = atan2(sum(&|guess| sin(guess.delta)), sum(&|guess| cos(guess.delta)));
        let spread = |guess: &Guess| {
            let off = wrap_angle(guess.delta - mean);
            guess.dd + off * off
        };
        // At least one weight is not below a fifth.
        Some((wrap_angle(mean - self.turned), sum(&spread) / max(sum(&|_| 1.0), LEAST_WEIGHT)))
    }
}

impl Guess {
    /// v' = v + R(delta) dV.
    fn predict(&mut self, change: &Vector2<f32>, time_s: f32) {
        let (sine, cosine) = (sin(self.delta), cos(self.delta));
        let turned = Vector2::new(cosine * change.x - sine * change.y, sine * change.x + cosine * change.y);
        self.velocity += turned;
        // What delta makes of it.
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

    /// Corrects by a velocity, and returns how likely it was.
    fn correct(&mut self, velocity: &Vector2<f32>, variance: f32) -> f32 {
        let (xx, xy, yy) = self.vv;
        let (sxx, syy) = (xx + variance, yy + variance);
        // At least the square of the measurement's variance.
        let determinant = max(sxx * syy - xy * xy, variance * variance);
        let inverse = 1.0 / determinant;
        // S^-1 x.
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

    /// Flies a path whose acceleration changes, with this error of the heading, and returns what the bank says of it.
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
        /// Any error of the heading is found by any path that accelerates, whatever the receiver's noise and a bias;
        /// and the bank says how well it knows.
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

        /// One that does not accelerate shows none.
        #[test]
        fn a_hover_shows_nothing(off in -PI..PI, noise in prop::collection::vec(-0.2..0.2_f32, 98)) {
            let (_, variance) = found(off, &[0.0; 60], &noise, 0.0);
            prop_assert!(variance > 0.5, "{variance}");
        }

        /// No number that a receiver or a sensor may say makes it one that is none.
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
