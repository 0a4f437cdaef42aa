//! Columns that every flight log has.

use crate::flight::{EstimateErrors, Sample};

/// A column's name, which ends in the unit, and the function that reads its value from a sample.
pub type SampleColumn = (&'static str, fn(&Sample) -> f64);

/// Columns of time, true motion and reference.
pub const MOTION: [SampleColumn; 25] = [
    ("time_s", |s| s.time_s),
    ("x_m", |s| s.motion.position_m.x),
    ("y_m", |s| s.motion.position_m.y),
    ("z_m", |s| s.motion.position_m.z),
    ("vx_m_s", |s| s.motion.velocity_m_s.x),
    ("vy_m_s", |s| s.motion.velocity_m_s.y),
    ("vz_m_s", |s| s.motion.velocity_m_s.z),
    ("phi_rad", |s| s.motion.attitude_rad.x),
    ("theta_rad", |s| s.motion.attitude_rad.y),
    ("psi_rad", |s| s.motion.attitude_rad.z),
    ("p_rad_s", |s| s.motion.rates_rad_s.x),
    ("q_rad_s", |s| s.motion.rates_rad_s.y),
    ("r_rad_s", |s| s.motion.rates_rad_s.z),
    ("x_d_m", |s| s.reference.position_m.x),
    ("y_d_m", |s| s.reference.position_m.y),
    ("z_d_m", |s| s.reference.position_m.z),
    ("vx_d_m_s", |s| s.reference.velocity_m_s.x),
    ("vy_d_m_s", |s| s.reference.velocity_m_s.y),
    ("vz_d_m_s", |s| s.reference.velocity_m_s.z),
    ("ax_d_m_s2", |s| s.reference.acceleration_m_s2.x),
    ("ay_d_m_s2", |s| s.reference.acceleration_m_s2.y),
    ("az_d_m_s2", |s| s.reference.acceleration_m_s2.z),
    ("psi_d_rad", |s| s.reference.yaw_rad),
    ("psi_d_rate_rad_s", |s| s.reference.yaw_rate_rad_s),
    ("psi_d_acceleration_rad_s2", |s| s.reference.yaw_acceleration_rad_s2),
];

/// A column's name and the function that reads its value from the vehicle's own estimate.
pub type EstimateColumn = (&'static str, fn(&EstimateErrors) -> f32);

/// Columns of the estimate's errors, truth minus estimate, and of their standard deviations. `rx`, `ry` and `rz` are
/// rotations about the axes of the earth frame.
pub const ESTIMATE: [EstimateColumn; 19] = [
    ("x_estimate_error_m", |e| e.position_error_m.x),
    ("x_estimate_sigma_m", |e| e.position_sigma_m.x),
    ("y_estimate_error_m", |e| e.position_error_m.y),
    ("y_estimate_sigma_m", |e| e.position_sigma_m.y),
    ("z_estimate_error_m", |e| e.position_error_m.z),
    ("z_estimate_sigma_m", |e| e.position_sigma_m.z),
    ("vx_estimate_error_m_s", |e| e.velocity_error_m_s.x),
    ("vx_estimate_sigma_m_s", |e| e.velocity_sigma_m_s.x),
    ("vy_estimate_error_m_s", |e| e.velocity_error_m_s.y),
    ("vy_estimate_sigma_m_s", |e| e.velocity_sigma_m_s.y),
    ("vz_estimate_error_m_s", |e| e.velocity_error_m_s.z),
    ("vz_estimate_sigma_m_s", |e| e.velocity_sigma_m_s.z),
    ("rx_estimate_error_rad", |e| e.attitude_error_rad.x),
    ("rx_estimate_sigma_rad", |e| e.attitude_sigma_rad.x),
    ("ry_estimate_error_rad", |e| e.attitude_error_rad.y),
    ("ry_estimate_sigma_rad", |e| e.attitude_sigma_rad.y),
    ("rz_estimate_error_rad", |e| e.attitude_error_rad.z),
    ("rz_estimate_sigma_rad", |e| e.attitude_sigma_rad.z),
    ("estimate_nees", |e| e.nees),
];
