//! Error vectors, measurement rows, and the block algebra of their covariances.

use nalgebra::{Matrix3, Vector3, Vector5};

/// Covariance of two errors with three coordinates each.
pub(crate) type CovarianceBlock = Matrix3<f32>;

/// One number per slow error: a GNSS receiver's position error along x, y, z, and a magnetometer's heading error by
/// fields along body x, y.
pub(crate) type SlowErrors = Vector5<f32>;

/// One coordinate of a vector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum VectorComponent {
    X,
    Y,
    Z,
}

impl VectorComponent {
    pub(crate) const ALL: [VectorComponent; 3] = [VectorComponent::X, VectorComponent::Y, VectorComponent::Z];

    /// Returns this coordinate of a vector.
    #[inline]
    pub(crate) fn of(self, vector: &Vector3<f32>) -> f32 {
        match self {
            VectorComponent::X => vector.x,
            VectorComponent::Y => vector.y,
            VectorComponent::Z => vector.z,
        }
    }

    /// Returns the unit vector along this coordinate.
    #[inline]
    pub(crate) fn unit(self) -> Vector3<f32> {
        match self {
            VectorComponent::X => Vector3::new(1.0, 0.0, 0.0),
            VectorComponent::Y => Vector3::new(0.0, 1.0, 0.0),
            VectorComponent::Z => Vector3::new(0.0, 0.0, 1.0),
        }
    }

    /// Returns this column of a block.
    #[inline]
    pub(crate) fn column(self, m: &CovarianceBlock) -> Vector3<f32> {
        match self {
            VectorComponent::X => Vector3::new(m.m11, m.m21, m.m31),
            VectorComponent::Y => Vector3::new(m.m12, m.m22, m.m32),
            VectorComponent::Z => Vector3::new(m.m13, m.m23, m.m33),
        }
    }

    /// Returns this row of a block.
    #[inline]
    pub(crate) fn row(self, m: &CovarianceBlock) -> Vector3<f32> {
        match self {
            VectorComponent::X => Vector3::new(m.m11, m.m12, m.m13),
            VectorComponent::Y => Vector3::new(m.m21, m.m22, m.m23),
            VectorComponent::Z => Vector3::new(m.m31, m.m32, m.m33),
        }
    }

    /// Sets this row of a block.
    pub(crate) fn set_row(self, m: &mut CovarianceBlock, to: &Vector3<f32>) {
        match self {
            VectorComponent::X => (m.m11, m.m12, m.m13) = (to.x, to.y, to.z),
            VectorComponent::Y => (m.m21, m.m22, m.m23) = (to.x, to.y, to.z),
            VectorComponent::Z => (m.m31, m.m32, m.m33) = (to.x, to.y, to.z),
        }
    }

    /// Sets this column of a block.
    pub(crate) fn set_column(self, m: &mut CovarianceBlock, to: &Vector3<f32>) {
        match self {
            VectorComponent::X => (m.m11, m.m21, m.m31) = (to.x, to.y, to.z),
            VectorComponent::Y => (m.m12, m.m22, m.m32) = (to.x, to.y, to.z),
            VectorComponent::Z => (m.m13, m.m23, m.m33) = (to.x, to.y, to.z),
        }
    }

    /// Sets this coordinate of a vector.
    pub(crate) fn set(self, vector: &mut Vector3<f32>, to: f32) {
        match self {
            VectorComponent::X => vector.x = to,
            VectorComponent::Y => vector.y = to,
            VectorComponent::Z => vector.z = to,
        }
    }
}

/// Error that a measurement can replace.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ReplacedError {
    /// Third coordinate of the rotation error.
    Heading,
    Velocity(VectorComponent),
    Position(VectorComponent),
    /// Barometer offset.
    Offset,
}

/// Row of a Jacobian: the derivative of one scalar measurement by the errors. Only one coordinate of velocity and
/// position enters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct JacobianRow {
    pub(crate) coordinate: VectorComponent,
    pub(crate) theta: Vector3<f32>,
    pub(crate) velocity: f32,
    pub(crate) position: f32,
    /// Derivative by the gyroscope bias, `None` if zero.
    pub(crate) gyro: Option<Vector3<f32>>,
    /// Derivative by the accelerometer bias, `None` if zero.
    pub(crate) accel: Option<Vector3<f32>>,
    /// Derivative by the barometer offset.
    pub(crate) baro: f32,
    /// Derivative by the slow errors, `None` if zero.
    pub(crate) slow: Option<SlowErrors>,
}

/// Row with all derivatives zero.
pub(crate) const NO_ROW: JacobianRow = JacobianRow {
    coordinate: VectorComponent::Z,
    theta: Vector3::new(0.0, 0.0, 0.0),
    velocity: 0.0,
    position: 0.0,
    gyro: None,
    accel: None,
    baro: 0.0,
    slow: None,
};

/// One number per error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ErrorVector {
    pub(crate) theta: Vector3<f32>,
    pub(crate) velocity: Vector3<f32>,
    pub(crate) position: Vector3<f32>,
    pub(crate) gyro: Vector3<f32>,
    pub(crate) accel: Vector3<f32>,
    pub(crate) baro: f32,
    /// Numbers of the slow errors. Slow errors are considered in the covariance, but no gain corrects them.
    pub(crate) slow: SlowErrors,
}

impl ErrorVector {
    /// Returns all numbers multiplied by `factor`.
    pub(crate) fn scaled(&self, factor: f32) -> Self {
        ErrorVector {
            theta: self.theta * factor,
            velocity: self.velocity * factor,
            position: self.position * factor,
            gyro: self.gyro * factor,
            accel: self.accel * factor,
            baro: self.baro * factor,
            slow: self.slow * factor,
        }
    }
}

impl JacobianRow {
    /// Returns the scalar product with `errors`.
    #[inline]
    pub(crate) fn dot(&self, errors: &ErrorVector) -> f32 {
        self.theta.dot(&errors.theta)
            + self.velocity * self.coordinate.of(&errors.velocity)
            + self.position * self.coordinate.of(&errors.position)
            + self.gyro.map_or(0.0, |gyro| gyro.dot(&errors.gyro))
            + self.accel.map_or(0.0, |accel| accel.dot(&errors.accel))
            + self.baro * errors.baro
            + self.slow.map_or(0.0, |slow| slow.dot(&errors.slow))
    }
}

/// Motion of the nominal state over one prediction interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PredictionInterval {
    /// Length T \[s\].
    pub(crate) time_s: f32,
    /// C = R T with the mean rotation R.
    pub(crate) turn: CovarianceBlock,
    /// S: velocity change by specific force \[m/s\].
    pub(crate) thrust: Vector3<f32>,
}

/// Returns -[s]x m.
#[inline]
pub(crate) fn minus_cross(s: &Vector3<f32>, m: &CovarianceBlock) -> CovarianceBlock {
    CovarianceBlock::new(
        s.z * m.m21 - s.y * m.m31,
        s.z * m.m22 - s.y * m.m32,
        s.z * m.m23 - s.y * m.m33,
        s.x * m.m31 - s.z * m.m11,
        s.x * m.m32 - s.z * m.m12,
        s.x * m.m33 - s.z * m.m13,
        s.y * m.m11 - s.x * m.m21,
        s.y * m.m12 - s.x * m.m22,
        s.y * m.m13 - s.x * m.m23,
    )
}

/// m -= x y'.
#[inline]
pub(crate) fn subtract_outer(m: &mut CovarianceBlock, x: &Vector3<f32>, y: &Vector3<f32>) {
    m.m11 -= x.x * y.x;
    m.m21 -= x.y * y.x;
    m.m31 -= x.z * y.x;
    m.m12 -= x.x * y.y;
    m.m22 -= x.y * y.y;
    m.m32 -= x.z * y.y;
    m.m13 -= x.x * y.z;
    m.m23 -= x.y * y.z;
    m.m33 -= x.z * y.z;
}
