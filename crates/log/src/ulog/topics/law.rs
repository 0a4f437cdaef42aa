//! Topic of the law's internal signals, in this project's frames (earth north-west-up, body forward-left-up).

use crate::ulog::layout::message;
use crate::ulog::moment::Moment;
use afbc_control::Errors;
use afbc_types::{Axis, PerAxis};

/// Number of subsystems.
const AXES: usize = Axis::ALL.len();

message! {
    /// Errors of each subsystem, in the order roll, pitch, yaw, z, x, y, the law's demands, and norms of its estimates,
    /// of which one subsystem's are new in each message. `norms` are those that have been reported last: |Theta_hat|^2
    /// and delta_hat.
    "afbc_law" LawSignals of moment, norms: &PerAxis<[f32; 2]> {
        e1: [f32; AXES] = "rad, m" => errors(moment, |errors| errors.e1),
        e1_dot: [f32; AXES] = "rad/s, m/s" => errors(moment, |errors| errors.e1_dot),
        e2: [f32; AXES] = "rad/s, m/s; 0 for laws without e2" => errors(moment, |errors| errors.e2),
        inputs: [f32; 4] = "U1 to U4, N" => {
            let inputs = &moment.details.trace.inputs;
            [inputs.roll_n, inputs.pitch_n, inputs.yaw_n, inputs.thrust_n]
        },
        virtual_m_s2: [f32; 2] = "u5, u6, m/s2" => moment.details.trace.virtual_m_s2,
        desired_rad: [f32; 2] = "roll and pitch before the command filter, rad" => moment.details.trace.desired_rad,
        theta_norm_squared: [f32; AXES] = "N2, m2/s4" => Axis::ALL.map(|axis| norms[axis][0]),
        delta: [f32; AXES] = "N, m/s2" => Axis::ALL.map(|axis| norms[axis][1]),
        core_mode: u8 = "0 disarmed, 1 flying, 2 coasting, 3 descending" => moment.report.mode as u8,
        saturated: bool = "" => moment.report.health.control.saturated,
        fallback: bool = "" => moment.report.health.control.fallback.is_some(),
        observed: bool = "" => moment.report.health.observed,
    }
}

/// Returns one of the errors of each subsystem.
fn errors(moment: &Moment<'_>, part: fn(&Errors) -> f32) -> [f32; AXES] {
    Axis::ALL.map(|axis| part(&moment.details.trace.errors[axis]))
}
