//! True motion of the vehicle.

use afbc_types::State;
use nalgebra::Vector3;

/// True motion in `f64`, with the quantities and frames of [`afbc_types::State`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Motion {
    /// xi, earth frame \[m\].
    pub position_m: Vector3<f64>,
    /// d xi/dt, earth frame \[m/s\].
    pub velocity_m_s: Vector3<f64>,
    /// eta = \[roll, pitch, yaw\] \[rad\].
    pub attitude_rad: Vector3<f64>,
    /// Omega = \[p, q, r\], body frame \[rad/s\]; d eta/dt in the simplified model.
    pub rates_rad_s: Vector3<f64>,
}

impl Motion {
    /// Returns the measurement of a perfect sensor.
    #[inline]
    pub fn measure(&self) -> State {
        State {
            position_m: self.position_m.cast(),
            velocity_m_s: self.velocity_m_s.cast(),
            attitude_rad: self.attitude_rad.cast(),
            rates_rad_s: self.rates_rad_s.cast(),
        }
    }
}
