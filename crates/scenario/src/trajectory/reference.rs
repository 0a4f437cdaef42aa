//! The reference at one time.

use afbc_types::Setpoint;
use nalgebra::Vector3;

/// The reference at one time, earth frame, with the quantities of [`Setpoint`] in `f64`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reference {
    /// Position \[m\].
    pub position_m: Vector3<f64>,
    /// Velocity \[m/s\].
    pub velocity_m_s: Vector3<f64>,
    /// Acceleration \[m/s2\].
    pub acceleration_m_s2: Vector3<f64>,
    /// Jerk \[m/s3\].
    pub jerk_m_s3: Vector3<f64>,
    /// Snap \[m/s4\].
    pub snap_m_s4: Vector3<f64>,
    /// Yaw psi_d \[rad\].
    pub yaw_rad: f64,
    /// Yaw rate \[rad/s\].
    pub yaw_rate_rad_s: f64,
    /// Yaw acceleration \[rad/s2\].
    pub yaw_acceleration_rad_s2: f64,
}

impl Reference {
    /// Returns a reference at rest.
    #[inline]
    pub fn rest(position_m: Vector3<f64>, yaw_rad: f64) -> Self {
        Reference { position_m, yaw_rad, ..Reference::default() }
    }

    /// Returns the controller's setpoint.
    #[inline]
    pub fn setpoint(&self) -> Setpoint {
        Setpoint {
            position_m: self.position_m.cast(),
            velocity_m_s: self.velocity_m_s.cast(),
            acceleration_m_s2: self.acceleration_m_s2.cast(),
            jerk_m_s3: self.jerk_m_s3.cast(),
            snap_m_s4: self.snap_m_s4.cast(),
            yaw_rad: self.yaw_rad as f32,
            yaw_rate_rad_s: self.yaw_rate_rad_s as f32,
            yaw_acceleration_rad_s2: self.yaw_acceleration_rad_s2 as f32,
        }
    }
}
