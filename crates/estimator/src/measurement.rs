//! Input of the estimator: IMU samples and measurements, with their plausibility limits.

use nalgebra::Vector3;

/// Sample of the IMU in the body frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ImuSample {
    /// Time of the measurement, on the clock of `now_us` \[us\].
    pub at_us: u64,
    /// Angular rates \[rad/s\].
    pub rates_rad_s: Vector3<f32>,
    /// Specific force, which is acceleration minus gravity: +9.81 along body z when level and at rest \[m/s2\].
    pub specific_force_m_s2: Vector3<f32>,
}

/// Measurement of an aiding sensor, in the earth and body frames of [`afbc_types`].
///
/// Standard deviations are positive. Those below 0.1 mm, 0.1 mrad or 1 mm/s are raised to that.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Measurement {
    /// Pose from a tracker.
    Pose {
        /// Position in the earth frame \[m\].
        position_m: Vector3<f32>,
        /// Quaternion w, x, y, z from body to earth, of either sign, with a squared norm within 0.9 to 1.1.
        attitude: [f32; 4],
        /// Standard deviation of each coordinate of the position \[m\].
        position_sigma_m: f32,
        /// Standard deviation of the attitude about each axis \[rad\].
        attitude_sigma_rad: f32,
    },
    /// Position from a tracker, without attitude.
    Position {
        /// Position in the earth frame \[m\].
        position_m: Vector3<f32>,
        /// Standard deviation of each coordinate \[m\].
        sigma_m: f32,
    },
    /// Fix of a GNSS receiver in local coordinates ([`GeodeticOrigin::local`](crate::GeodeticOrigin::local)).
    Gnss {
        /// Position in the earth frame \[m\].
        position_m: Vector3<f32>,
        /// Velocity in the earth frame \[m/s\].
        velocity_m_s: Vector3<f32>,
        /// Standard deviation of x and of y \[m\].
        horizontal_sigma_m: f32,
        /// Standard deviation of z \[m\].
        vertical_sigma_m: f32,
        /// Standard deviation of the velocity's x and y \[m/s\].
        speed_sigma_m_s: f32,
        /// Standard deviation of the velocity's z \[m/s\].
        climb_sigma_m_s: f32,
    },
    /// Barometer height above any fixed reference; the estimator finds its offset.
    Height {
        /// Height, upwards \[m\].
        height_m: f32,
        /// Standard deviation of the noise, without the offset's slow drift \[m\].
        sigma_m: f32,
    },
    /// Field of a magnetometer in the body frame, in any fixed unit.
    MagneticField {
        /// Field.
        field: Vector3<f32>,
        /// Standard deviation of each coordinate, in the same unit.
        sigma: f32,
    },
    /// Heading (yaw angle) from any source.
    Heading {
        /// Yaw \[rad\].
        heading_rad: f32,
        /// Standard deviation \[rad\].
        sigma_rad: f32,
    },
}

/// Largest coordinate of a position \[m\].
const POSITION_MAX_M: f32 = 5e4;
/// Largest coordinate of a velocity \[m/s\].
const VELOCITY_MAX_M_S: f32 = 150.0;
/// Largest heading, which may be unwrapped \[rad\].
const HEADING_MAX_RAD: f32 = 1e3;
/// Largest coordinate and smallest norm of a field, in any usual unit from tesla to nanotesla.
const FIELD_MAX: f32 = 1e7;
const FIELD_MIN: f32 = 1e-7;
/// Largest standard deviation of any quantity.
const SIGMA_MAX: f32 = 1e4;
/// Allowed deviation of a quaternion's squared norm from 1.
const NORM_SQUARED_ERROR_MAX: f32 = 0.1;
/// Largest rates \[rad/s\] and specific force \[m/s2\] of a sample.
const RATE_MAX_RAD_S: f32 = 200.0;
const FORCE_MAX_M_S2: f32 = 2000.0;

/// Returns true if every coordinate is finite and at most `max` in absolute value.
fn within(vector: &Vector3<f32>, max: f32) -> bool {
    // Nearly every vector passes by its length, in a third of the instructions. NaN returns false.
    vector.norm_squared() <= max * max || (vector.x.abs() <= max && vector.y.abs() <= max && vector.z.abs() <= max)
}

/// Returns true for a usable standard deviation.
fn is_sigma(sigma: f32) -> bool {
    sigma > 0.0 && sigma <= SIGMA_MAX
}

impl ImuSample {
    /// Returns true if every value is finite and at most 200 rad/s or 2000 m/s2 in absolute value.
    #[must_use]
    pub fn is_plausible(&self) -> bool {
        within(&self.rates_rad_s, RATE_MAX_RAD_S) && within(&self.specific_force_m_s2, FORCE_MAX_M_S2)
    }
}

impl Measurement {
    /// Largest number of values in one measurement.
    pub const NUMBERS: usize = 10;

    /// Returns the kind (1 pose, 2 position, 3 GNSS, 4 height, 5 magnetic field, 6 heading) and the values in the order
    /// of the fields, padded with zeros. For logs and links.
    pub fn numbers(&self) -> (u8, [f32; Self::NUMBERS]) {
        let (kind, [first, second], [g, h, i, j]): (u8, [Vector3<f32>; 2], [f32; 4]) = match *self {
            Measurement::Pose { position_m, attitude: [w, x, y, z], position_sigma_m, attitude_sigma_rad } => {
                (1, [position_m, Vector3::new(w, x, y)], [z, position_sigma_m, attitude_sigma_rad, 0.0])
            }
            Measurement::Position { position_m, sigma_m } => {
                (2, [position_m, Vector3::new(sigma_m, 0.0, 0.0)], [0.0; 4])
            }
            Measurement::Gnss {
                position_m,
                velocity_m_s,
                horizontal_sigma_m,
                vertical_sigma_m,
                speed_sigma_m_s,
                climb_sigma_m_s,
            } => (
                3,
                [position_m, velocity_m_s],
                [horizontal_sigma_m, vertical_sigma_m, speed_sigma_m_s, climb_sigma_m_s],
            ),
            Measurement::Height { height_m, sigma_m } => {
                (4, [Vector3::new(height_m, sigma_m, 0.0), Vector3::zeros()], [0.0; 4])
            }
            Measurement::MagneticField { field, sigma } => (5, [field, Vector3::new(sigma, 0.0, 0.0)], [0.0; 4]),
            Measurement::Heading { heading_rad, sigma_rad } => {
                (6, [Vector3::new(heading_rad, sigma_rad, 0.0), Vector3::zeros()], [0.0; 4])
            }
        };
        (kind, [first.x, first.y, first.z, second.x, second.y, second.z, g, h, i, j])
    }

    /// Returns the measurement of this kind and these [numbers](Self::numbers), `None` for an unknown kind.
    pub fn of_numbers(kind: u8, [a, b, c, d, e, f, g, h, i, j]: [f32; Self::NUMBERS]) -> Option<Self> {
        let first = Vector3::new(a, b, c);
        Some(match kind {
            1 => Measurement::Pose {
                position_m: first,
                attitude: [d, e, f, g],
                position_sigma_m: h,
                attitude_sigma_rad: i,
            },
            2 => Measurement::Position { position_m: first, sigma_m: d },
            3 => Measurement::Gnss {
                position_m: first,
                velocity_m_s: Vector3::new(d, e, f),
                horizontal_sigma_m: g,
                vertical_sigma_m: h,
                speed_sigma_m_s: i,
                climb_sigma_m_s: j,
            },
            4 => Measurement::Height { height_m: a, sigma_m: b },
            5 => Measurement::MagneticField { field: first, sigma: d },
            6 => Measurement::Heading { heading_rad: a, sigma_rad: b },
            _ => return None,
        })
    }

    /// Returns true if every value is finite and plausible: positions up to 50 km and velocities up to 150 m/s per
    /// coordinate, unit quaternions, fields above zero, standard deviations above 0 and up to 1e4.
    #[must_use]
    pub fn is_plausible(&self) -> bool {
        match self {
            Measurement::Pose { position_m, attitude: [w, x, y, z], position_sigma_m, attitude_sigma_rad } => {
                within(position_m, POSITION_MAX_M)
                    && (w * w + x * x + y * y + z * z - 1.0).abs() <= NORM_SQUARED_ERROR_MAX
                    && is_sigma(*position_sigma_m)
                    && is_sigma(*attitude_sigma_rad)
            }
            Measurement::Position { position_m, sigma_m } => within(position_m, POSITION_MAX_M) && is_sigma(*sigma_m),
            Measurement::Gnss {
                position_m,
                velocity_m_s,
                horizontal_sigma_m,
                vertical_sigma_m,
                speed_sigma_m_s,
                climb_sigma_m_s,
            } => {
                within(position_m, POSITION_MAX_M)
                    && within(velocity_m_s, VELOCITY_MAX_M_S)
                    && is_sigma(*horizontal_sigma_m)
                    && is_sigma(*vertical_sigma_m)
                    && is_sigma(*speed_sigma_m_s)
                    && is_sigma(*climb_sigma_m_s)
            }
            Measurement::Height { height_m, sigma_m } => height_m.abs() <= POSITION_MAX_M && is_sigma(*sigma_m),
            Measurement::MagneticField { field, sigma } => {
                let largest = afbc_control::math::abs_max(field);
                within(field, FIELD_MAX) && largest >= FIELD_MIN && *sigma > 0.0 && *sigma <= FIELD_MAX
            }
            Measurement::Heading { heading_rad, sigma_rad } => {
                heading_rad.abs() <= HEADING_MAX_RAD && is_sigma(*sigma_rad)
            }
        }
    }
}
