//! Topics of the law's demanded thrust and torque, before the rotors' limits.

use crate::ulog::layout::message;
use crate::ulog::moment::{Moment, flip};
use nalgebra::Vector3;

message! {
    /// Thrust.
    "vehicle_thrust_setpoint" ThrustDemand {
        timestamp_sample: u64 = "us",
        xyz: [f32; 3] = "share of the largest thrust",
    }
}

impl ThrustDemand {
    /// Returns none while disarmed.
    pub(crate) fn of(moment: &Moment<'_>) -> Option<Self> {
        moment.report.mode.armed().then(|| ThrustDemand {
            timestamp: moment.now_us(),
            timestamp_sample: moment.state_us(),
            xyz: [0.0, 0.0, -moment.details.trace.inputs.thrust_n / moment.known.thrust_max_n],
        })
    }
}

message! {
    /// Moments, as the forces that make them.
    "vehicle_torque_setpoint" TorqueDemand {
        timestamp_sample: u64 = "us",
        xyz: [f32; 3] = "U1, U2, U3 as shares of the largest thrust",
    }
}

impl TorqueDemand {
    /// Returns none while disarmed.
    pub(crate) fn of(moment: &Moment<'_>) -> Option<Self> {
        let inputs = &moment.details.trace.inputs;
        let forces_n = Vector3::new(inputs.roll_n, inputs.pitch_n, inputs.yaw_n);
        moment.report.mode.armed().then(|| TorqueDemand {
            timestamp: moment.now_us(),
            timestamp_sample: moment.state_us(),
            xyz: flip(forces_n / moment.known.thrust_max_n),
        })
    }
}
