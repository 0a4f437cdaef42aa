//! The law's internal signals, in this project's frames (earth north-west-up, body forward-left-up).

use crate::ulog::layout::message;
use crate::ulog::moment::Moment;
use afbc_control::Errors;
use afbc_types::{Axis, PerAxis};

/// Subsystems.
const AXES: usize = Axis::ALL.len();

message! {
    /// Errors of each subsystem, in the order roll, pitch, yaw, z, x, y, the law's demands, and norms of its estimates,
    /// of which one subsystem's are new in each message.
    "afbc_law" LawSignals {
        e1: [f32; AXES] = "rad, m",
        e1_dot: [f32; AXES] = "rad/s, m/s",
        e2: [f32; AXES] = "rad/s, m/s; 0 for laws without it",
        inputs: [f32; 4] = "U1 to U4, N",
        virtual_m_s2: [f32; 2] = "u5, u6, m/s2",
        desired_rad: [f32; 2] = "roll and pitch before the command filter, rad",
        theta_norm_squared: [f32; AXES] = "N2, m2/s4",
        delta: [f32; AXES] = "N, m/s2",
        core_mode: u8 = "0 disarmed, 1 flying, 2 coasting, 3 descending",
        saturated: bool = "",
        fallback: bool = "",
        observed: bool = "",
    }
}

impl LawSignals {
    /// `norms` are those that have been reported last: |Theta_hat|^2 and delta_hat.
    pub(crate) fn of(moment: &Moment<'_>, norms: &PerAxis<[f32; 2]>) -> Self {
        let (trace, report) = (&moment.details.trace, moment.report);
        let of = |part: fn(&Errors) -> f32| Axis::ALL.map(|axis| part(&trace.errors[axis]));
        let inputs = &trace.inputs;
        let norm = |part: fn(&[f32; 2]) -> f32| Axis::ALL.map(|axis| part(&norms[axis]));
        LawSignals {
            timestamp: moment.now_us(),
            e1: of(|errors| errors.e1),
            e1_dot: of(|errors| errors.e1_dot),
            e2: of(|errors| errors.e2),
            inputs: [inputs.roll_n, inputs.pitch_n, inputs.yaw_n, inputs.thrust_n],
            virtual_m_s2: trace.virtual_m_s2,
            desired_rad: trace.desired_rad,
            theta_norm_squared: norm(|[theta, _]| *theta),
            delta: norm(|[_, delta]| *delta),
            core_mode: report.mode as u8,
            saturated: report.health.control.saturated,
            fallback: report.health.control.fallback.is_some(),
            observed: report.health.observed,
        }
    }
}
