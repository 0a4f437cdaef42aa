//! The slow error of a GNSS receiver: considered, not estimated.
//!
//! A receiver's position is off by noise and by an error d that stays from fix to fix and changes within minutes. A
//! filter that takes d for noise averages it, and is soon sure of a position that it does not know. Here d is a
//! consider state (Schmidt; Jazwinski, *Stochastic Processes and Filtering Theory*, 1970, section 8.4): a first-order
//! Gauss-Markov process per coordinate, whose variance D is the receiver's and stays, and whose estimate is zero. What
//! is kept is the covariance X of the filter's errors with d. A fix then measures p + d + noise with what is known of
//! both; the position's variance never falls to that of an average, and its innovations have the noise alone.

use crate::errors::{Block, Errors, Interval, Row, minus_cross, subtract_outer};
use nalgebra::Vector3;

/// Variances of the slow error and its covariances with the errors; each column belongs to a coordinate of d.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Slow {
    /// Diagonal of D; zero as long as no receiver has such an error, and then all else is zero too.
    pub(crate) variance: Vector3<f32>,
    pub(crate) theta: Block,
    pub(crate) velocity: Block,
    pub(crate) position: Block,
    pub(crate) gyro: Block,
    pub(crate) accel: Block,
    pub(crate) baro: Vector3<f32>,
}

const ONES: Vector3<f32> = Vector3::new(1.0, 1.0, 1.0);

/// Multiplies rows by `x` and columns by `y`.
fn scale(m: &mut Block, x: &Vector3<f32>, y: &Vector3<f32>) {
    m.component_mul_assign(&(x * y.transpose()));
}

impl Slow {
    /// True if there is none.
    #[inline]
    pub(crate) fn is_none(&self) -> bool {
        self.variance == Vector3::zeros()
    }

    /// Takes the variances of a new fix, since the last of which d has kept `share` of itself. A smaller variance than
    /// before is that of an error which is partly another one.
    pub(crate) fn follow(&mut self, variance: &Vector3<f32>, share: f32) {
        let kept = variance.zip_map(&self.variance, |new, old| if new < old { share * (new / old) } else { share });
        for block in [&mut self.theta, &mut self.velocity, &mut self.position, &mut self.gyro, &mut self.accel] {
            scale(block, &ONES, &kept);
        }
        self.baro.component_mul_assign(&kept);
        self.variance = *variance;
    }

    /// X = F X, as the covariance's own prediction.
    #[inline]
    pub(crate) fn predict(&mut self, interval: &Interval) {
        if self.is_none() {
            return;
        }
        let Interval { time_s, turn, thrust } = interval;
        self.position += self.velocity * *time_s;
        self.velocity += minus_cross(thrust, &self.theta) - turn * self.accel;
        self.theta -= turn * self.gyro;
    }

    /// Turns the angular error.
    #[inline]
    pub(crate) fn turn(&mut self, r: &Block) {
        if !self.is_none() {
            self.theta = r * self.theta;
        }
    }

    /// Multiplies each error.
    pub(crate) fn scale(&mut self, by: &Errors) {
        scale(&mut self.theta, &by.theta, &ONES);
        scale(&mut self.velocity, &by.velocity, &ONES);
        scale(&mut self.position, &by.position, &ONES);
        scale(&mut self.gyro, &by.gyro, &ONES);
        scale(&mut self.accel, &by.accel, &ONES);
        self.baro *= by.baro;
    }

    /// Completes `y` = P h by X h of d and, if the row measures d, by the errors' covariances with it.
    #[inline]
    pub(crate) fn complete(&self, row: &Row, y: &mut Errors) {
        if self.is_none() {
            return;
        }
        let at = row.coordinate;
        y.slow = self.theta.tr_mul(&row.theta);
        if row.velocity != 0.0 {
            y.slow += at.row(&self.velocity) * row.velocity;
        }
        if row.position != 0.0 {
            y.slow += at.row(&self.position) * row.position;
        }
        if let Some(h) = &row.gyro {
            y.slow += self.gyro.tr_mul(h);
        }
        if let Some(h) = &row.accel {
            y.slow += self.accel.tr_mul(h);
        }
        if row.baro != 0.0 {
            y.slow += self.baro * row.baro;
        }
        if row.slow {
            y.theta += at.column(&self.theta);
            y.velocity += at.column(&self.velocity);
            y.position += at.column(&self.position);
            y.gyro += at.column(&self.gyro);
            y.accel += at.column(&self.accel);
            y.baro += at.of(&self.baro);
            y.slow += at.unit() * at.of(&self.variance);
        }
    }

    /// Subtracts k y' of d: a gain that leaves d as it is.
    #[inline]
    pub(crate) fn subtract(&mut self, k: &Errors, y: &Errors) {
        if self.is_none() {
            return;
        }
        subtract_outer(&mut self.theta, &k.theta, &y.slow);
        subtract_outer(&mut self.velocity, &k.velocity, &y.slow);
        subtract_outer(&mut self.position, &k.position, &y.slow);
        subtract_outer(&mut self.gyro, &k.gyro, &y.slow);
        subtract_outer(&mut self.accel, &k.accel, &y.slow);
        self.baro -= y.slow * k.baro;
    }

    /// Variance that d adds to a position of `tau_s` ago, its covariance with it included.
    pub(crate) fn of_position(&self, tau_s: f32) -> Vector3<f32> {
        self.variance + (self.position.diagonal() - self.velocity.diagonal() * tau_s) * 2.0
    }
}
