//! Topics of the body rates and their setpoint.

use crate::ulog::layout::message;
use crate::ulog::moment::{Moment, flip};
use afbc_control::Errors;
use nalgebra::Vector3;

message! {
    /// Body rates, filtered and without bias.
    "vehicle_angular_velocity" VehicleAngularVelocity {
        timestamp_sample: u64 = "us",
        xyz: [f32; 3] = "rad/s",
    }
}

impl VehicleAngularVelocity {
    pub(crate) fn of(moment: &Moment<'_>) -> Option<Self> {
        Some(VehicleAngularVelocity {
            timestamp: moment.now_us(),
            timestamp_sample: moment.state_us(),
            xyz: flip(moment.state()?.rates_rad_s),
        })
    }
}

message! {
    /// Body rates that the law demands: the virtual control of backstepping, or the reference's rates if the law has no
    /// virtual control.
    "vehicle_rates_setpoint" VehicleRatesSetpoint {
        roll: f32 = "rad/s",
        pitch: f32 = "rad/s",
        yaw: f32 = "rad/s",
        thrust_body: [f32; 3] = "share of the largest thrust",
    }
}

impl VehicleRatesSetpoint {
    /// Returns none while disarmed or without a state.
    pub(crate) fn of(moment: &Moment<'_>) -> Option<Self> {
        let state = moment.state().filter(|_| moment.report.mode.armed())?;
        let trace = &moment.details.trace;
        // e2 is 0 for a law without a virtual control.
        let error = |Errors { e1_dot, e2, .. }: Errors| if e2 == 0.0 { e1_dot } else { e2 };
        let errors = &trace.errors;
        let off = Vector3::new(error(errors.roll), error(errors.pitch), error(errors.yaw));
        let [roll, pitch, yaw] = flip(state.rates_rad_s + off);
        Some(VehicleRatesSetpoint {
            timestamp: moment.now_us(),
            roll,
            pitch,
            yaw,
            thrust_body: [0.0, 0.0, -trace.inputs.thrust_n / moment.known.thrust_max_n],
        })
    }
}
