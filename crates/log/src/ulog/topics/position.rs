//! Topics of local position and velocity, and their setpoint.

use crate::ulog::layout::message;
use crate::ulog::moment::{Moment, flip};
use afbc_types::Setpoint;

message! {
    /// Position and velocity.
    "vehicle_local_position" VehicleLocalPosition {
        timestamp_sample: u64 = "us",
        ref_timestamp: u64 = "us",
        ref_lat: f64 = "degrees",
        ref_lon: f64 = "degrees",
        x: f32 = "m",
        y: f32 = "m",
        z: f32 = "m",
        vx: f32 = "m/s",
        vy: f32 = "m/s",
        vz: f32 = "m/s",
        heading: f32 = "rad",
        ref_alt: f32 = "m",
        eph: f32 = "m",
        epv: f32 = "m",
        evh: f32 = "m/s",
        evv: f32 = "m/s",
        xy_valid: bool = "",
        z_valid: bool = "",
        v_xy_valid: bool = "",
        v_z_valid: bool = "",
        xy_reset_counter: u8 = "",
        z_reset_counter: u8 = "",
        vxy_reset_counter: u8 = "",
        vz_reset_counter: u8 = "",
        heading_reset_counter: u8 = "",
        heading_good_for_control: bool = "",
        xy_global: bool = "",
        z_global: bool = "",
        dead_reckoning: bool = "",
    }
}

impl VehicleLocalPosition {
    pub(crate) fn of(moment: &Moment<'_>) -> Option<Self> {
        let state = moment.state()?;
        let estimate = moment.details.estimate.unwrap_or_default();
        let (resets, sigmas) = (estimate.resets, estimate.sigmas);
        let validity = match &moment.details.estimate {
            Some(estimate) => estimate.validity,
            // A state from the link comes without validity flags and counts as valid.
            None => {
                afbc_estimator::Validity { attitude: true, heading: true, velocity: true, position: true, height: true }
            }
        };
        let reference = moment.reference();
        let [ref_lat, ref_lon, ref_alt] = reference.unwrap_or([f64::NAN; 3]);
        let [[x, y, z], [vx, vy, vz]] = [state.position_m, state.velocity_m_s].map(flip);
        let larger = |v: nalgebra::Vector3<f32>| v.x.max(v.y);
        Some(VehicleLocalPosition {
            timestamp: moment.now_us(),
            timestamp_sample: moment.state_us(),
            ref_timestamp: 0,
            ref_lat,
            ref_lon,
            x,
            y,
            z,
            vx,
            vy,
            vz,
            heading: -state.attitude_rad.z,
            ref_alt: ref_alt as f32,
            eph: larger(sigmas.position_m),
            epv: sigmas.position_m.z,
            evh: larger(sigmas.velocity_m_s),
            evv: sigmas.velocity_m_s.z,
            xy_valid: validity.position,
            z_valid: validity.height,
            v_xy_valid: validity.velocity,
            v_z_valid: validity.velocity || validity.height,
            // Counters wrap, like PX4's; readers look for a change.
            xy_reset_counter: resets.position as u8,
            z_reset_counter: resets.height as u8,
            vxy_reset_counter: resets.velocity as u8,
            vz_reset_counter: resets.velocity as u8,
            heading_reset_counter: resets.heading as u8,
            heading_good_for_control: validity.heading,
            xy_global: reference.is_some(),
            z_global: reference.is_some(),
            dead_reckoning: moment.report.health.observed,
        })
    }
}

message! {
    /// Position that the guidance demands.
    "vehicle_local_position_setpoint" VehicleLocalPositionSetpoint {
        x: f32 = "m",
        y: f32 = "m",
        z: f32 = "m",
        vx: f32 = "m/s",
        vy: f32 = "m/s",
        vz: f32 = "m/s",
        acceleration: [f32; 3] = "m/s2",
        yaw: f32 = "rad",
        yawspeed: f32 = "rad/s",
    }
}

impl VehicleLocalPositionSetpoint {
    pub(crate) fn of(moment: &Moment<'_>) -> Option<Self> {
        let Setpoint { position_m, velocity_m_s, acceleration_m_s2, yaw_rad, yaw_rate_rad_s, .. } =
            moment.report.guided.setpoint?;
        let [[x, y, z], [vx, vy, vz], acceleration] = [position_m, velocity_m_s, acceleration_m_s2].map(flip);
        Some(VehicleLocalPositionSetpoint {
            timestamp: moment.now_us(),
            x,
            y,
            z,
            vx,
            vy,
            vz,
            acceleration,
            yaw: -yaw_rad,
            yawspeed: -yaw_rate_rad_s,
        })
    }
}
