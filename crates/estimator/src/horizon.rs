//! Innovations and Jacobians of late measurements: maps the error of a past state to the present error in closed form.
//!
//! Between the time of a measurement and the present, tau later, the error follows the filter's own equations
//! ([`crate::covariance`]). Solved backwards, with C = tau R (the mean rotation), S the velocity change by specific
//! force and D the position change that S has yet to cause,
//!
//! ```text
//! theta_past = theta + C g
//! v_past     = v + S x theta + C a                                S = v - v_past + g tau e_z
//! p_past     = p - tau v - D x theta                             D = tau v - (p - p_past) + g tau^2/2 e_z
//! ```
//!
//! So a late measurement corrects the present as if it had been fused in time and all later samples had been replayed,
//! apart from the IMU's noise in between. The effects of the gyroscope bias on v and p are left out (5e-5 m/s for 1e-3
//! rad/s and 100 ms), and that of the accelerometer bias on p (1e-4 m for 0.02 m/s2 and 100 ms).

use crate::errors::{JacobianRow, NO_ROW, SlowErrors, VectorComponent};
use crate::history::{PastState, motion_between};
use crate::rotation::{atan2, difference, matrix};
use afbc_control::math::{max, sqrt, wrap_angle};
use nalgebra::{Matrix3, Quaternion, Vector3};

/// Measured quantity with its measured value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ObservedQuantity {
    Position(Vector3<f32>),
    Velocity(Vector3<f32>),
    Attitude(Quaternion<f32>),
    /// Barometer height, which includes the barometer's offset.
    Height(f32),
    /// Magnetic field in the body frame; only the direction of its horizontal part is fused.
    Field(Vector3<f32>),
    Heading(f32),
}

/// Expected values of barometer and magnetometer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ExpectedReadings {
    /// Barometer offset \[m\].
    pub(crate) height_offset: f32,
    /// Magnetic field in the earth frame, of any strength.
    pub(crate) field: Vector3<f32>,
}

/// A past state as seen from the present.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FusionHorizon {
    past: PastState,
    /// Rotation of the past state.
    rotation: Matrix3<f32>,
    tau_s: f32,
    /// Matrix C.
    turn: Matrix3<f32>,
    /// Velocity change S.
    thrust: Vector3<f32>,
    /// Distance D.
    distance: Vector3<f32>,
}

impl FusionHorizon {
    /// Compares `present`, at the covariance's time, with `past`.
    pub(crate) fn new(present: &PastState, past: &PastState, gravity: f32) -> Self {
        let (tau_s, thrust, distance) = motion_between(present, past, gravity);
        let rotation = matrix(&past.attitude);
        let turn = (rotation + matrix(&present.attitude)) * (0.5 * tau_s);
        FusionHorizon { past: *past, rotation, tau_s, turn, thrust, distance }
    }

    /// Returns this horizon after a turn about the vertical.
    pub(crate) fn turned(&self, turn: &Quaternion<f32>) -> Self {
        let r = matrix(turn);
        FusionHorizon { rotation: r * self.rotation, turn: r * self.turn, ..*self }
    }

    /// Returns the past state.
    pub(crate) fn past(&self) -> &PastState {
        &self.past
    }

    /// Returns the age of the past state \[s\].
    pub(crate) fn tau_s(&self) -> f32 {
        self.tau_s
    }

    /// Returns a body frame field in the earth frame.
    pub(crate) fn field(&self, field: &Vector3<f32>) -> Vector3<f32> {
        self.rotation * field
    }

    /// Returns the yaw of the past state.
    pub(crate) fn heading(&self) -> f32 {
        atan2(self.rotation.m21, self.rotation.m11)
    }

    /// Returns the innovation of `target` at `coordinate` (ignored for single scalars) and its Jacobian, `None` if the
    /// heading is undefined because the nose or the field is almost vertical.
    pub(crate) fn row(
        &self,
        target: &ObservedQuantity,
        coordinate: VectorComponent,
        expected: &ExpectedReadings,
    ) -> Option<(f32, JacobianRow)> {
        let at = coordinate;
        let unit = at.unit();
        let none = JacobianRow { coordinate, ..NO_ROW };
        // `angle` makes the row of an angle, whose innovation is the product of the rotation error with `theta`.
        let angle = |innovation: f32, theta: Vector3<f32>| {
            (innovation, JacobianRow { theta, gyro: Some(self.turn.tr_mul(&theta)), ..none })
        };
        match target {
            ObservedQuantity::Position(position) => {
                Some((at.of(&(position - self.past.position)), self.position_row(at, none)))
            }
            ObservedQuantity::Velocity(velocity) => {
                let row = JacobianRow {
                    theta: unit.cross(&self.thrust),
                    velocity: 1.0,
                    accel: Some(self.turn.tr_mul(&unit)),
                    ..none
                };
                Some((at.of(&(velocity - self.past.velocity)), row))
            }
            ObservedQuantity::Attitude(attitude) => {
                Some(angle(at.of(&difference(attitude, &self.past.attitude)), unit))
            }
            ObservedQuantity::Height(height) => {
                let at = VectorComponent::Z;
                let row = JacobianRow { baro: 1.0, ..self.position_row(at, JacobianRow { coordinate: at, ..none }) };
                Some((height - self.past.position.z - expected.height_offset, row))
            }
            ObservedQuantity::Field(field) => {
                let field = self.field(field);
                // The Jacobian uses the expected field: the noise of the measured field would look like a tilt.
                let theta = upright(&expected.field)?;
                let north = atan2(expected.field.y, expected.field.x);
                let (innovation, row) = angle(wrap_angle(north - atan2(field.y, field.x)), theta);
                Some((innovation, JacobianRow { slow: Some(magnetic(&self.rotation, &expected.field)), ..row }))
            }
            ObservedQuantity::Heading(heading) => {
                let nose = Vector3::new(self.rotation.m11, self.rotation.m21, self.rotation.m31);
                let theta = upright(&nose)?;
                Some(angle(wrap_angle(heading - self.heading()), theta))
            }
        }
    }

    fn position_row(&self, at: VectorComponent, none: JacobianRow) -> JacobianRow {
        let unit = at.unit();
        JacobianRow { theta: self.distance.cross(&unit), velocity: -self.tau_s, position: 1.0, ..none }
    }
}

/// Returns the derivative of the direction of `north` by fields along body x and y, in shares of the earth's horizontal
/// field.
pub(crate) fn magnetic(rotation: &Matrix3<f32>, north: &Vector3<f32>) -> SlowErrors {
    let across = Vector3::new(north.y, -north.x, 0.0) * (1.0 / sqrt(max(north.x * north.x + north.y * north.y, 1e-12)));
    let body = rotation.tr_mul(&across);
    SlowErrors::new(0.0, 0.0, 0.0, body.x, body.y)
}

/// Returns the derivative of the direction of a vector's horizontal part by a rotation of the earth frame, `None`
/// within 10 degrees of vertical.
fn upright(vector: &Vector3<f32>) -> Option<Vector3<f32>> {
    let horizontal = vector.x * vector.x + vector.y * vector.y;
    if horizontal < 0.03 * vector.norm_squared() {
        return None;
    }
    let slope = -vector.z / horizontal;
    Some(Vector3::new(slope * vector.x, slope * vector.y, 1.0))
}
