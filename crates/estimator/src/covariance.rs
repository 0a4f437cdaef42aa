//! Covariance of the error state in blocks, with its prediction and its update by one scalar.
//!
//! The errors are defined as truth minus nominal state:
//!
//! ```text
//! theta   rotation in the EARTH frame: R_true = (1 + [theta]x) R                       [rad]
//! v, p    velocity and position in the earth frame                                     [m/s, m]
//! g, a    biases of gyroscope and accelerometer in the body frame                      [rad/s, m/s2]
//! b       offset of the barometer                                                      [m]
//! ```
//!
//! This is Sola's global angular error (section 7.2), not the local one. The attitude then has no transition of its
//! own, and the third component *is* the heading error at any tilt, so an unknown heading stays in one state. A past
//! attitude has the same error as the present one. When the attitude is corrected, the error is rotated with it
//! ([`Covariance::turn`]), as a local error is by definition; the crate's documentation says why. Over an interval T
//! with the mean rotation R, C = R T, and S the velocity change by specific force,
//!
//! ```text
//! theta' = theta - C g        v' = v - S x theta - C a        p' = p + T v
//! ```
//!
//! where all of the right-hand side is at the beginning of the interval. Terms of second order in T are left out, as in
//! PX4's EKF2. The 16th state, the barometer's offset, is one more column. Without it, a filter that averages a
//! barometer would claim to know a height that it cannot know.

use crate::errors::{
    CovarianceBlock, ErrorVector, JacobianRow, PredictionInterval, ReplacedError, SlowErrors, VectorComponent,
    minus_cross, subtract_outer,
};
use crate::slow::{SlowCovariance, SlowErrorCovariances};
use afbc_control::math::{max, min, sqrt};
use nalgebra::Vector3;

/// Process noise: variances that a prediction adds per second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ProcessNoise {
    pub(crate) theta: f32,
    pub(crate) velocity: f32,
    pub(crate) gyro: f32,
    pub(crate) accel: f32,
    pub(crate) baro: f32,
}

/// Covariance matrix, stored as the upper triangle of blocks: `tv` is the covariance of theta and v. Diagonal blocks
/// are symmetric.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Covariance {
    pub(crate) tt: CovarianceBlock,
    pub(crate) tv: CovarianceBlock,
    pub(crate) tp: CovarianceBlock,
    pub(crate) tg: CovarianceBlock,
    pub(crate) ta: CovarianceBlock,
    pub(crate) vv: CovarianceBlock,
    pub(crate) vp: CovarianceBlock,
    pub(crate) vg: CovarianceBlock,
    pub(crate) va: CovarianceBlock,
    pub(crate) pp: CovarianceBlock,
    pub(crate) pg: CovarianceBlock,
    pub(crate) pa: CovarianceBlock,
    pub(crate) gg: CovarianceBlock,
    pub(crate) ga: CovarianceBlock,
    pub(crate) aa: CovarianceBlock,
    pub(crate) tb: Vector3<f32>,
    pub(crate) vb: Vector3<f32>,
    pub(crate) pb: Vector3<f32>,
    pub(crate) gb: Vector3<f32>,
    pub(crate) ab: Vector3<f32>,
    pub(crate) bb: f32,
    pub(crate) slow: SlowErrorCovariances,
}

/// Returns m (-[s]x)': the cross product of each row of `m`.
#[inline]
fn crossed_minus(m: &CovarianceBlock, s: &Vector3<f32>) -> CovarianceBlock {
    CovarianceBlock::new(
        m.m12 * s.z - m.m13 * s.y,
        m.m13 * s.x - m.m11 * s.z,
        m.m11 * s.y - m.m12 * s.x,
        m.m22 * s.z - m.m23 * s.y,
        m.m23 * s.x - m.m21 * s.z,
        m.m21 * s.y - m.m22 * s.x,
        m.m32 * s.z - m.m33 * s.y,
        m.m33 * s.x - m.m31 * s.z,
        m.m31 * s.y - m.m32 * s.x,
    )
}

/// Returns a b'.
#[inline]
fn by_transpose(a: &CovarianceBlock, b: &CovarianceBlock) -> CovarianceBlock {
    a * b.transpose()
}

/// Copies the upper triangle of a block to the lower one.
#[inline]
fn mirror(m: &mut CovarianceBlock) {
    m.m21 = m.m12;
    m.m31 = m.m13;
    m.m32 = m.m23;
}

/// Adds a variance to the diagonal.
#[inline]
fn add_diagonal(m: &mut CovarianceBlock, variance: f32) {
    m.m11 += variance;
    m.m22 += variance;
    m.m33 += variance;
}

/// Sets one row of the covariances with the slow errors.
fn set_row(columns: &mut SlowCovariance, at: VectorComponent, to: &SlowErrors) {
    for (mut column, to) in columns.column_iter_mut().zip(to) {
        if let Some(number) = column.iter_mut().nth(at as usize) {
            *number = *to;
        }
    }
}

/// Share of a variance that each prediction adds against rounding. Each operation may change an entry by its last bit.
/// Where two errors are almost equal, like those of height and barometer offset, their difference is only a few hundred
/// such bits. This growth alone raises a standard deviation by a tenth in an hour.
const ROUNDED: f32 = 1.0 / 16_777_216.0;

/// Number of blocks in the upper triangle.
pub(crate) const BLOCKS: u8 = 15;
/// Tolerance for rounding when the square of a correlation is compared with 1.
const POSSIBLE: f32 = 1.001;

/// Adds a variance and the share for rounding to the diagonal.
#[inline]
fn grown(m: &mut CovarianceBlock, variance: f32) {
    m.m11 += m.m11 * ROUNDED + variance;
    m.m22 += m.m22 * ROUNDED + variance;
    m.m33 += m.m33 * ROUNDED + variance;
}

/// Smallest and largest variance of one error.
struct VarianceBounds {
    least: f32,
    most: f32,
}

/// The variance is limited to (1e-5 rad)^2 and the variance of a completely unknown angle.
const THETA: VarianceBounds = VarianceBounds { least: 1e-10, most: 3.3 };
const VELOCITY: VarianceBounds = VarianceBounds { least: 1e-8, most: 1e4 };
const POSITION: VarianceBounds = VarianceBounds { least: 1e-9, most: 1e8 };
const GYRO: VarianceBounds = VarianceBounds { least: 1e-13, most: 0.25 };
const ACCEL: VarianceBounds = VarianceBounds { least: 1e-9, most: 25.0 };
const BARO: VarianceBounds = VarianceBounds { least: 1e-8, most: 1e8 };

/// Raises the variances of a block to at least `least`.
#[inline]
fn raised(block: &mut CovarianceBlock, least: f32) {
    block.m11 = max(block.m11, least);
    block.m22 = max(block.m22, least);
    block.m33 = max(block.m33, least);
}

/// Mirrors a diagonal block and raises its variances to the minimum. Returns true if one exceeds the maximum.
#[inline]
fn held(block: &mut CovarianceBlock, bounds: &VarianceBounds) -> bool {
    mirror(block);
    // The usual case takes comparisons alone.
    let usual = |variance: f32| variance > bounds.least && variance <= bounds.most;
    if usual(block.m11) && usual(block.m22) && usual(block.m33) {
        return false;
    }
    raised(block, bounds.least);
    block.m11 > bounds.most || block.m22 > bounds.most || block.m33 > bounds.most
}

impl Covariance {
    /// Predicts over `interval`: P = F P F' + Q, as three substitutions in blocks.
    #[inline]
    pub(crate) fn predict(&mut self, interval: &PredictionInterval, growth: &ProcessNoise) {
        let PredictionInterval { time_s, turn, thrust } = interval;
        let (t, c, s) = (*time_s, turn, thrust);
        // Blocks are replaced in the order from position to rotation. So each block is computed from values at the
        // beginning of the interval.
        self.slow.predict(interval);

        // p' = p + T v.
        self.pp += (self.vp + self.vp.transpose()) * t + self.vv * (t * t);
        self.tp += self.tv * t;
        self.vp += self.vv * t;
        self.pg += self.vg * t;
        self.pa += self.va * t;
        self.pb += self.vb * t;

        // v' = v - S x theta - C a.
        let vv = self.vv + minus_cross(s, &self.tv) - by_transpose(c, &self.va);
        self.tv += crossed_minus(&self.tt, s) - by_transpose(&self.ta, c);
        self.va += minus_cross(s, &self.ta) - c * self.aa;
        // Uses the new tv and va: vv is multiplied from the right as well.
        self.vv = vv + crossed_minus(&self.tv.transpose(), s) - by_transpose(&self.va, c);
        self.vp += minus_cross(s, &self.tp) - by_transpose(c, &self.pa);
        self.vg += minus_cross(s, &self.tg) - by_transpose(c, &self.ga);
        self.vb += self.tb.cross(s) - c * self.ab;

        // theta' = theta - C g.
        let tt = self.tt - by_transpose(c, &self.tg);
        self.tg -= c * self.gg;
        self.tt = tt - by_transpose(&self.tg, c);
        self.tv -= by_transpose(c, &self.vg);
        self.tp -= by_transpose(c, &self.pg);
        self.ta -= c * self.ga;
        self.tb -= c * self.gb;

        self.grow(t, growth);
        self.hold();
    }

    /// Rotates the angular error along with a rotation r of the nominal attitude: theta = r theta.
    #[inline]
    pub(crate) fn turn(&mut self, r: &CovarianceBlock) {
        self.tt = by_transpose(&(r * self.tt), r);
        self.tv = r * self.tv;
        self.tp = r * self.tp;
        self.tg = r * self.tg;
        self.ta = r * self.ta;
        self.tb = r * self.tb;
        self.slow.turn(r);
        mirror(&mut self.tt);
    }

    /// Adds the process noise of `time_s` and the share for rounding.
    #[inline]
    fn grow(&mut self, time_s: f32, growth: &ProcessNoise) {
        add_diagonal(&mut self.tt, growth.theta * time_s);
        grown(&mut self.vv, growth.velocity * time_s);
        grown(&mut self.pp, 0.0);
        add_diagonal(&mut self.gg, growth.gyro * time_s);
        add_diagonal(&mut self.aa, growth.accel * time_s);
        self.bb += self.bb * ROUNDED + growth.baro * time_s;
    }

    /// Adds variances to attitude and velocity.
    pub(crate) fn inflate_variances(&mut self, (theta, velocity): (f32, f32)) {
        add_diagonal(&mut self.tt, theta);
        add_diagonal(&mut self.vv, velocity);
    }

    /// Returns true if every covariance in one block is within the limit that the variances set (a correlation of at
    /// most 1). A matrix that is no valid covariance is found within [`BLOCKS`] calls, one block per call. NaN returns
    /// false.
    pub(crate) fn is_possible(&self, number: u8) -> bool {
        let c = self;
        let (block, rows, columns) = match number {
            0 => (&c.tt, &c.tt, &c.tt),
            1 => (&c.tv, &c.tt, &c.vv),
            2 => (&c.tp, &c.tt, &c.pp),
            3 => (&c.tg, &c.tt, &c.gg),
            4 => (&c.ta, &c.tt, &c.aa),
            5 => (&c.vv, &c.vv, &c.vv),
            6 => (&c.vp, &c.vv, &c.pp),
            7 => (&c.vg, &c.vv, &c.gg),
            8 => (&c.va, &c.vv, &c.aa),
            9 => (&c.pp, &c.pp, &c.pp),
            10 => (&c.pg, &c.pp, &c.gg),
            11 => (&c.pa, &c.pp, &c.aa),
            12 => (&c.gg, &c.gg, &c.gg),
            13 => (&c.ga, &c.gg, &c.aa),
            _ => (&c.aa, &c.aa, &c.aa),
        };
        let (rows, columns) = (rows.diagonal(), columns.diagonal() * POSSIBLE);
        let allowed = rows * columns.transpose();
        block.iter().zip(&allowed).all(|(entry, allowed)| entry * entry <= *allowed)
    }

    /// Deletes all covariances and doubles the variances, since they come from an invalid matrix.
    #[cold]
    #[inline(never)]
    pub(crate) fn decorrelate(&mut self) {
        let of = |block: &CovarianceBlock| CovarianceBlock::from_diagonal(&(block.diagonal() * 2.0));
        *self = Covariance {
            tt: of(&self.tt),
            vv: of(&self.vv),
            pp: of(&self.pp),
            gg: of(&self.gg),
            aa: of(&self.aa),
            bb: 2.0 * self.bb,
            slow: SlowErrorCovariances { variance: self.slow.variance, ..SlowErrorCovariances::default() },
            ..Covariance::default()
        };
        self.hold();
    }

    /// Returns true if every variance is finite.
    pub(crate) fn is_sound(&self) -> bool {
        [&self.tt, &self.vv, &self.pp, &self.gg, &self.aa].into_iter().all(|block| block.trace().is_finite())
            && self.bb.is_finite()
    }

    /// Raises every variance to its minimum.
    #[inline]
    fn raise(&mut self) {
        raised(&mut self.tt, THETA.least);
        raised(&mut self.vv, VELOCITY.least);
        raised(&mut self.pp, POSITION.least);
        raised(&mut self.gg, GYRO.least);
        raised(&mut self.aa, ACCEL.least);
        self.bb = max(self.bb, BARO.least);
    }

    /// Limits every variance to its bounds and keeps the diagonal blocks symmetric. Both ways, raising a variance and
    /// scaling an error down with all its covariances, keep the matrix positive.
    #[inline]
    pub(crate) fn hold(&mut self) {
        let theta = held(&mut self.tt, &THETA);
        let velocity = held(&mut self.vv, &VELOCITY);
        let position = held(&mut self.pp, &POSITION);
        let gyro = held(&mut self.gg, &GYRO);
        let accel = held(&mut self.aa, &ACCEL);
        self.bb = max(self.bb, BARO.least);
        if theta || velocity || position || gyro || accel || self.bb > BARO.most {
            self.limit();
        }
    }

    /// Scales down every error whose variance is too large.
    #[cold]
    #[inline(never)]
    fn limit(&mut self) {
        let factor = |variance: f32, bounds: &VarianceBounds| {
            // Slightly below the bound, so that rounding cannot end above it.
            if variance > bounds.most { sqrt(bounds.most / variance) * 0.9999 } else { 1.0 }
        };
        let of = |m: &CovarianceBlock, bounds: VarianceBounds| {
            Vector3::new(factor(m.m11, &bounds), factor(m.m22, &bounds), factor(m.m33, &bounds))
        };
        let (t, v, p) = (of(&self.tt, THETA), of(&self.vv, VELOCITY), of(&self.pp, POSITION));
        let (g, a, b) = (of(&self.gg, GYRO), of(&self.aa, ACCEL), factor(self.bb, &BARO));
        // Zeros for `slow`: `scale` leaves the variances of slow errors, which are fixed, as they are.
        self.scale(&ErrorVector {
            theta: t,
            velocity: v,
            position: p,
            gyro: g,
            accel: a,
            baro: b,
            slow: SlowErrors::zeros(),
        });
    }

    /// Multiplies each error by its factor, which scales the error's row and column.
    fn scale(&mut self, by: &ErrorVector) {
        let ErrorVector { theta: t, velocity: v, position: p, gyro: g, accel: a, baro: b, .. } = by;
        let scale =
            |m: &mut CovarianceBlock, x: &Vector3<f32>, y: &Vector3<f32>| m.component_mul_assign(&(x * y.transpose()));
        for (block, y) in
            [(&mut self.tt, t), (&mut self.tv, v), (&mut self.tp, p), (&mut self.tg, g), (&mut self.ta, a)]
        {
            scale(block, t, y);
        }
        for (block, y) in [(&mut self.vv, v), (&mut self.vp, p), (&mut self.vg, g), (&mut self.va, a)] {
            scale(block, v, y);
        }
        for (block, y) in [(&mut self.pp, p), (&mut self.pg, g), (&mut self.pa, a)] {
            scale(block, p, y);
        }
        scale(&mut self.gg, g, g);
        scale(&mut self.ga, g, a);
        scale(&mut self.aa, a, a);
        for (column, x) in
            [(&mut self.tb, t), (&mut self.vb, v), (&mut self.pb, p), (&mut self.gb, g), (&mut self.ab, a)]
        {
            column.component_mul_assign(&(x * *b));
        }
        self.bb *= b * b;
        self.slow.scale(by);
    }

    /// Forgets some errors: those with a zero in `keep` lose their variance and all their covariances.
    pub(crate) fn forget(&mut self, keep: &ErrorVector) {
        self.scale(keep);
    }

    /// Replaces one error after the state was reset to a measurement, so that the innovation is zero. `row` is the
    /// measurement's Jacobian without its 1 for the replaced error. The new error is -(row x) minus the noise, which
    /// has the variance `variance`. It keeps exactly the covariances that follow from the other errors.
    pub(crate) fn replace(&mut self, which: ReplacedError, row: &JacobianRow, variance: f32) {
        let y = self.times(row);
        let variance = max(row.dot(&y), 0.0) + variance;
        let ErrorVector { theta: t, velocity: v, position: p, gyro: g, accel: a, baro: b, slow } = y.scaled(-1.0);
        match which {
            ReplacedError::Heading => {
                let at = VectorComponent::Z;
                let t = Vector3::new(t.x, t.y, variance);
                at.set_row(&mut self.tt, &t);
                at.set_column(&mut self.tt, &t);
                at.set_row(&mut self.tv, &v);
                at.set_row(&mut self.tp, &p);
                at.set_row(&mut self.tg, &g);
                at.set_row(&mut self.ta, &a);
                self.tb.z = b;
                set_row(&mut self.slow.theta, at, &slow);
            }
            ReplacedError::Velocity(at) => {
                let mut v = v;
                at.set(&mut v, variance);
                at.set_column(&mut self.tv, &t);
                at.set_row(&mut self.vv, &v);
                at.set_column(&mut self.vv, &v);
                at.set_row(&mut self.vp, &p);
                at.set_row(&mut self.vg, &g);
                at.set_row(&mut self.va, &a);
                at.set(&mut self.vb, b);
                set_row(&mut self.slow.velocity, at, &slow);
            }
            ReplacedError::Position(at) => {
                let mut p = p;
                at.set(&mut p, variance);
                at.set_column(&mut self.tp, &t);
                at.set_column(&mut self.vp, &v);
                at.set_row(&mut self.pp, &p);
                at.set_column(&mut self.pp, &p);
                at.set_row(&mut self.pg, &g);
                at.set_row(&mut self.pa, &a);
                at.set(&mut self.pb, b);
                set_row(&mut self.slow.position, at, &slow);
            }
            ReplacedError::Offset => {
                (self.tb, self.vb, self.pb, self.gb, self.ab, self.bb) = (t, v, p, g, a, variance);
                self.slow.baro = slow;
            }
        }
        self.hold();
    }

    /// Returns P h.
    #[inline]
    pub(crate) fn times(&self, row: &JacobianRow) -> ErrorVector {
        let at = row.coordinate;
        let mut y = ErrorVector {
            theta: self.tt * row.theta,
            velocity: self.tv.tr_mul(&row.theta),
            position: self.tp.tr_mul(&row.theta),
            gyro: self.tg.tr_mul(&row.theta),
            accel: self.ta.tr_mul(&row.theta),
            baro: self.tb.dot(&row.theta),
            slow: SlowErrors::zeros(),
        };
        // Most parts of a row are zero and a scalar must be fused within a control tick, so zero parts are skipped.
        if row.velocity != 0.0 {
            let h = row.velocity;
            y.theta += at.column(&self.tv) * h;
            y.velocity += at.column(&self.vv) * h;
            y.position += at.row(&self.vp) * h;
            y.gyro += at.row(&self.vg) * h;
            y.accel += at.row(&self.va) * h;
            y.baro += at.of(&self.vb) * h;
        }
        if row.position != 0.0 {
            let h = row.position;
            y.theta += at.column(&self.tp) * h;
            y.velocity += at.column(&self.vp) * h;
            y.position += at.column(&self.pp) * h;
            y.gyro += at.row(&self.pg) * h;
            y.accel += at.row(&self.pa) * h;
            y.baro += at.of(&self.pb) * h;
        }
        if let Some(h) = &row.gyro {
            y.theta += self.tg * h;
            y.velocity += self.vg * h;
            y.position += self.pg * h;
            y.gyro += self.gg * h;
            y.accel += self.ga.tr_mul(h);
            y.baro += self.gb.dot(h);
        }
        if let Some(h) = &row.accel {
            y.theta += self.ta * h;
            y.velocity += self.va * h;
            y.position += self.pa * h;
            y.gyro += self.ga * h;
            y.accel += self.aa * h;
            y.baro += self.ab.dot(h);
        }
        if row.baro != 0.0 {
            let h = row.baro;
            y.theta += self.tb * h;
            y.velocity += self.vb * h;
            y.position += self.pb * h;
            y.gyro += self.gb * h;
            y.accel += self.ab * h;
            y.baro += self.bb * h;
        }
        self.slow.complete(row, &mut y);
        y
    }

    /// Returns the sum of the variances of the row's position and velocity, without their covariance.
    #[inline]
    pub(crate) fn motion_variance(&self, row: &JacobianRow) -> f32 {
        let of = |m: &CovarianceBlock| row.coordinate.of(&m.diagonal());
        row.position * row.position * of(&self.pp) + row.velocity * row.velocity * of(&self.vv)
    }

    /// Subtracts k w'.
    #[inline]
    fn subtract(&mut self, k: &ErrorVector, w: &ErrorVector) {
        subtract_outer(&mut self.tt, &k.theta, &w.theta);
        subtract_outer(&mut self.tv, &k.theta, &w.velocity);
        subtract_outer(&mut self.tp, &k.theta, &w.position);
        subtract_outer(&mut self.tg, &k.theta, &w.gyro);
        subtract_outer(&mut self.ta, &k.theta, &w.accel);
        subtract_outer(&mut self.vv, &k.velocity, &w.velocity);
        subtract_outer(&mut self.vp, &k.velocity, &w.position);
        subtract_outer(&mut self.vg, &k.velocity, &w.gyro);
        subtract_outer(&mut self.va, &k.velocity, &w.accel);
        subtract_outer(&mut self.pp, &k.position, &w.position);
        subtract_outer(&mut self.pg, &k.position, &w.gyro);
        subtract_outer(&mut self.pa, &k.position, &w.accel);
        subtract_outer(&mut self.gg, &k.gyro, &w.gyro);
        subtract_outer(&mut self.ga, &k.gyro, &w.accel);
        subtract_outer(&mut self.aa, &k.accel, &w.accel);
        self.tb -= k.theta * w.baro;
        self.vb -= k.velocity * w.baro;
        self.pb -= k.position * w.baro;
        self.gb -= k.gyro * w.baro;
        self.ab -= k.accel * w.baro;
        self.bb -= k.baro * w.baro;
    }

    /// Fuses a scalar with the optimal gain K = y/s, where y = P h and s is the innovation variance. The result P - y
    /// y'/s is symmetric to the last bit.
    #[inline]
    pub(crate) fn fuse(&mut self, y: &ErrorVector, s: f32) {
        let w = y.scaled(1.0 / sqrt(s));
        self.subtract(&w, &w);
        self.slow.subtract(&w, &w);
        // An update only lowers variances, so the upper bounds hold.
        self.raise();
    }

    /// Fuses a scalar with any gain `k`: P - k y' - y k' + k s k' = P - k w' - w k' with w = y - k s/2. This is
    /// Joseph's form, which stays positive for any gain.
    pub(crate) fn fuse_with(&mut self, k: &ErrorVector, y: &ErrorVector, s: f32) {
        let half = k.scaled(0.5 * s);
        let w = ErrorVector {
            theta: y.theta - half.theta,
            velocity: y.velocity - half.velocity,
            position: y.position - half.position,
            gyro: y.gyro - half.gyro,
            accel: y.accel - half.accel,
            baro: y.baro - half.baro,
            slow: y.slow,
        };
        self.subtract(k, &w);
        self.subtract(&w, k);
        // The slow errors are subtracted only once, because they have no gain.
        self.slow.subtract(k, y);
        // The two products are subtracted one after the other, and rounding makes the halves of a block differ.
        for block in [&mut self.tt, &mut self.vv, &mut self.pp, &mut self.gg, &mut self.aa] {
            mirror(block);
        }
        self.raise();
    }

    /// Returns the variances.
    #[inline]
    pub(crate) fn variances(&self) -> ErrorVector {
        ErrorVector {
            theta: self.tt.diagonal(),
            velocity: self.vv.diagonal(),
            position: self.pp.diagonal(),
            gyro: self.gg.diagonal(),
            accel: self.aa.diagonal(),
            baro: self.bb,
            slow: self.slow.variance,
        }
    }

    /// Returns the rows and columns of theta, v and p.
    pub(crate) fn of_motion(&self) -> [[f32; 9]; 9] {
        let (vt, pt, pv) = (self.tv.transpose(), self.tp.transpose(), self.vp.transpose());
        let blocks = [[&self.tt, &self.tv, &self.tp], [&vt, &self.vv, &self.vp], [&pt, &pv, &self.pp]];
        let mut rows = [[0.0; 9]; 9];
        for (three, [a, b, c]) in rows.chunks_exact_mut(3).zip(blocks) {
            for (to, at) in three.iter_mut().zip(VectorComponent::ALL) {
                let [a, b, c] = [at.row(a), at.row(b), at.row(c)];
                *to = [a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z];
            }
        }
        rows
    }

    /// Returns the matrix as rows, in the order theta, v, p, g, a, b.
    pub(crate) fn rows(&self) -> [[f32; 16]; 16] {
        let c = self;
        let blocks = [
            [c.tt, c.tv, c.tp, c.tg, c.ta],
            [c.tv.transpose(), c.vv, c.vp, c.vg, c.va],
            [c.tp.transpose(), c.vp.transpose(), c.pp, c.pg, c.pa],
            [c.tg.transpose(), c.vg.transpose(), c.pg.transpose(), c.gg, c.ga],
            [c.ta.transpose(), c.va.transpose(), c.pa.transpose(), c.ga.transpose(), c.aa],
        ];
        let border = [c.tb, c.vb, c.pb, c.gb, c.ab];
        let mut rows = [[0.0; 16]; 16];
        let (body, last) = rows.split_at_mut(15);
        for ((three, blocks), column) in body.chunks_exact_mut(3).zip(&blocks).zip(&border) {
            for (row, at) in three.iter_mut().zip(VectorComponent::ALL) {
                let numbers = blocks.iter().flat_map(|block| {
                    let row = at.row(block);
                    [row.x, row.y, row.z]
                });
                let numbers = numbers.chain([at.of(column)]);
                row.iter_mut().zip(numbers).for_each(|(to, from)| *to = from);
            }
        }
        let numbers = border.iter().flat_map(|column| [column.x, column.y, column.z]).chain([c.bb]);
        last.iter_mut().flatten().zip(numbers).for_each(|(to, from)| *to = from);
        rows
    }
}

/// Returns the largest of three variances as a standard deviation.
pub(crate) fn largest_sigma(variances: &Vector3<f32>) -> f32 {
    sqrt(max(max(variances.x, variances.y), variances.z))
}

/// Limits a variance to the variance of a completely unknown angle.
pub(crate) fn angle_variance(variance: f32) -> f32 {
    min(variance, THETA.most)
}
