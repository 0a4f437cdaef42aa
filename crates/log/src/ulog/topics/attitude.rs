//! Topics of the attitude and its setpoint.

use crate::ulog::layout::message;
use crate::ulog::moment::{Moment, flip_turn};
use afbc_control::Trace;
use afbc_types::State;
use nalgebra::Vector3;

message! {
    /// Attitude.
    "vehicle_attitude" VehicleAttitude {
        timestamp_sample: u64 = "us",
        q: [f32; 4] = "w, x, y, z from body to earth",
        quat_reset_counter: u8 = "number of jumps of the heading",
    }
}

impl VehicleAttitude {
    pub(crate) fn of(moment: &Moment<'_>) -> Option<Self> {
        let resets = moment.details.estimate.map_or(0, |estimate| estimate.resets.heading);
        Some(VehicleAttitude {
            timestamp: moment.now_us(),
            timestamp_sample: moment.state_us(),
            q: moment.attitude()?,
            // PX4's counters have 8 bits and wrap; readers look for a change.
            quat_reset_counter: resets as u8,
        })
    }
}

message! {
    /// Attitude that the law demands.
    "vehicle_attitude_setpoint" VehicleAttitudeSetpoint {
        roll_body: f32 = "rad",
        pitch_body: f32 = "rad",
        yaw_body: f32 = "rad",
        yaw_sp_move_rate: f32 = "rad/s",
        q_d: [f32; 4] = "w, x, y, z from body to earth",
        thrust_body: [f32; 3] = "share of the largest thrust",
    }
}

impl VehicleAttitudeSetpoint {
    /// Returns none while disarmed or without a setpoint.
    pub(crate) fn of(moment: &Moment<'_>) -> Option<Self> {
        let setpoint = moment.report.guided.setpoint.filter(|_| moment.report.mode.armed())?;
        let Trace { inputs, filtered: [roll, pitch], .. } = moment.details.trace;
        let attitude_rad = Vector3::new(roll.angle, pitch.angle, setpoint.yaw_rad);
        let q = State { attitude_rad, ..State::default() }.quaternion().coords;
        Some(VehicleAttitudeSetpoint {
            timestamp: moment.now_us(),
            roll_body: roll.angle,
            pitch_body: -pitch.angle,
            yaw_body: -setpoint.yaw_rad,
            yaw_sp_move_rate: -setpoint.yaw_rate_rad_s,
            q_d: flip_turn([q.w, q.x, q.y, q.z]),
            thrust_body: [0.0, 0.0, -inputs.thrust_n / moment.known.thrust_max_n],
        })
    }
}
