//! Slow errors of sensors: considered, not estimated.
//!
//! A GNSS receiver's position error is noise plus an error d that stays from fix to fix and changes over minutes. A
//! magnetometer's heading error is noise plus the effect of the vehicle's iron, magnets and currents: two constants f,
//! the fields along body x and y in shares of the earth's horizontal field. A filter that takes d or f for noise
//! averages it, and soon states an accuracy that it does not have. Here d and f are consider states (Schmidt;
//! Jazwinski, *Stochastic Processes and Filtering Theory*, 1970, section 8.4): d is a first-order Gauss-Markov process
//! per coordinate, f is constant. Their variance D is given and stays; their estimate stays zero. The filter only keeps
//! the covariance X of its errors with them. A position fix then measures p + d + noise, and a field measures the
//! heading, the part of f across the field, and noise. The variance of an error never falls to that of an average.
//! Innovations only contain the noise and the change of the slow error; for the heading, that change comes from the
//! vehicle's turns.

use crate::errors::{CovarianceBlock, ErrorVector, JacobianRow, PredictionInterval, SlowErrors};
use nalgebra::{Matrix3x5, Vector3};

/// Covariances of a three-coordinate error with the slow errors.
pub(crate) type SlowCovariance = Matrix3x5<f32>;

/// Variances of the slow errors (x, y, z of d; x, y of f) and their covariances with the filter's errors, one column
/// each.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct SlowErrorCovariances {
    /// Variances of the slow errors, the diagonal of D. They are zero until a sensor has a slow error. Until then all
    /// covariances are zero too.
    pub(crate) variance: SlowErrors,
    pub(crate) theta: SlowCovariance,
    pub(crate) velocity: SlowCovariance,
    pub(crate) position: SlowCovariance,
    pub(crate) gyro: SlowCovariance,
    pub(crate) accel: SlowCovariance,
    pub(crate) baro: SlowErrors,
}

/// Multiplies each row by its factor.
fn scale(m: &mut SlowCovariance, by: &Vector3<f32>) {
    m.column_iter_mut().for_each(|mut column| column.component_mul_assign(by));
}

/// Returns -[s]x m.
#[inline]
fn minus_cross(s: &Vector3<f32>, m: &SlowCovariance) -> SlowCovariance {
    SlowCovariance::new(
        s.z * m.m21 - s.y * m.m31,
        s.z * m.m22 - s.y * m.m32,
        s.z * m.m23 - s.y * m.m33,
        s.z * m.m24 - s.y * m.m34,
        s.z * m.m25 - s.y * m.m35,
        s.x * m.m31 - s.z * m.m11,
        s.x * m.m32 - s.z * m.m12,
        s.x * m.m33 - s.z * m.m13,
        s.x * m.m34 - s.z * m.m14,
        s.x * m.m35 - s.z * m.m15,
        s.y * m.m11 - s.x * m.m21,
        s.y * m.m12 - s.x * m.m22,
        s.y * m.m13 - s.x * m.m23,
        s.y * m.m14 - s.x * m.m24,
        s.y * m.m15 - s.x * m.m25,
    )
}

impl SlowErrorCovariances {
    /// Returns true if there are no slow errors.
    #[inline]
    pub(crate) fn is_none(&self) -> bool {
        self.variance == SlowErrors::zeros()
    }

    /// Sets the variances of a new fix; d has kept `share` of its value since the last fix. If the new variance is
    /// smaller, part of the error is treated as a different one.
    pub(crate) fn follow(&mut self, variance: &Vector3<f32>, share: f32) {
        // A division only happens by a value above another variance, so never by zero.
        let kept =
            variance.zip_map(&self.gnss_variance(), |new, old| if new < old { share * (new / old) } else { share });
        for m in [&mut self.theta, &mut self.velocity, &mut self.position, &mut self.gyro, &mut self.accel] {
            for (mut column, kept) in m.column_iter_mut().zip(&kept) {
                column *= *kept;
            }
        }
        self.baro.iter_mut().zip(&kept).for_each(|(baro, kept)| *baro *= kept);
        self.variance.iter_mut().zip(variance).for_each(|(old, new)| *old = *new);
    }

    /// Returns the variances of d, the slow position error of a GNSS receiver.
    pub(crate) fn gnss_variance(&self) -> Vector3<f32> {
        self.variance.fixed_rows::<3>(0).into_owned()
    }

    /// Sets the variance of the vehicle's own magnetic field f, the same for both coordinates.
    pub(crate) fn set_field_variance(&mut self, variance: f32) {
        (self.variance.w, self.variance.a) = (variance, variance);
    }

    /// Sets the heading error after a start by a field that measures f with `row`: the error is entirely caused by f,
    /// and no other error depends on f.
    pub(crate) fn point(&mut self, row: &SlowErrors) {
        let by = -row.component_mul(&self.variance);
        self.theta.row_mut(2).copy_from(&by.transpose());
    }

    /// Returns the variance that the slow errors alone add to a measurement with this row.
    pub(crate) fn of_row(&self, row: &SlowErrors) -> f32 {
        row.component_mul(&self.variance).dot(row)
    }

    /// Predicts X = F X, like the covariance itself.
    #[inline]
    pub(crate) fn predict(&mut self, interval: &PredictionInterval) {
        // With a tracker alone everything is zero, so such a vehicle skips the products.
        if self.is_none() {
            return;
        }
        let PredictionInterval { time_s, turn, thrust } = interval;
        self.position += self.velocity * *time_s;
        self.velocity += minus_cross(thrust, &self.theta) - turn * self.accel;
        self.theta -= turn * self.gyro;
    }

    /// Rotates the angular error by r.
    #[inline]
    pub(crate) fn turn(&mut self, r: &CovarianceBlock) {
        if !self.is_none() {
            self.theta = r * self.theta;
        }
    }

    /// Multiplies each error by its factor.
    pub(crate) fn scale(&mut self, by: &ErrorVector) {
        scale(&mut self.theta, &by.theta);
        scale(&mut self.velocity, &by.velocity);
        scale(&mut self.position, &by.position);
        scale(&mut self.gyro, &by.gyro);
        scale(&mut self.accel, &by.accel);
        self.baro *= by.baro;
    }

    /// Completes `y` = P h: adds X' h for the slow errors and, if the row measures slow errors, their covariances with
    /// the other errors.
    #[inline]
    pub(crate) fn complete(&self, row: &JacobianRow, y: &mut ErrorVector) {
        if self.is_none() {
            return;
        }
        let at = row.coordinate.unit();
        y.slow = self.theta.tr_mul(&row.theta);
        if row.velocity != 0.0 {
            y.slow += self.velocity.tr_mul(&at) * row.velocity;
        }
        if row.position != 0.0 {
            y.slow += self.position.tr_mul(&at) * row.position;
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
        if let Some(h) = &row.slow {
            y.theta += self.theta * h;
            y.velocity += self.velocity * h;
            y.position += self.position * h;
            y.gyro += self.gyro * h;
            y.accel += self.accel * h;
            y.baro += self.baro.dot(h);
            y.slow += self.variance.component_mul(h);
        }
    }

    /// Subtracts k y' from the covariances with the slow errors, which have no gain themselves.
    #[inline]
    pub(crate) fn subtract(&mut self, k: &ErrorVector, y: &ErrorVector) {
        if self.is_none() {
            return;
        }
        let outer = |m: &mut SlowCovariance, x: &Vector3<f32>| {
            for (mut column, y) in m.column_iter_mut().zip(&y.slow) {
                column -= x * *y;
            }
        };
        outer(&mut self.theta, &k.theta);
        outer(&mut self.velocity, &k.velocity);
        outer(&mut self.position, &k.position);
        outer(&mut self.gyro, &k.gyro);
        outer(&mut self.accel, &k.accel);
        self.baro -= y.slow * k.baro;
    }

    /// Returns the variance that d adds to a position of `tau_s` ago, including its covariance with that position.
    pub(crate) fn of_position(&self, tau_s: f32) -> Vector3<f32> {
        let along = |m: &SlowCovariance| Vector3::new(m.m11, m.m22, m.m33);
        self.gnss_variance() + (along(&self.position) - along(&self.velocity) * tau_s) * 2.0
    }
}
