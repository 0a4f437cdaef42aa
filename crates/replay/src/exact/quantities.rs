//! The quantities that are compared between a flight and its replay under changed settings.

use afbc_control::Trace;
use afbc_onboard::Report;
use afbc_types::ROTORS_MAX;

/// A quantity that every tick has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReplayQuantity {
    /// Name of the quantity's column.
    pub name: &'static str,
    /// Title for people.
    pub title: &'static str,
    /// Unit of the quantity.
    pub unit: &'static str,
    /// True for a heading: its difference is taken the shorter way round.
    pub wraps: bool,
    /// Number of the rotor, counted from 0; none if the quantity belongs to no rotor.
    pub rotor: Option<usize>,
}

const fn plain(name: &'static str, title: &'static str, unit: &'static str) -> ReplayQuantity {
    ReplayQuantity { name, title, unit, wraps: false, rotor: None }
}

const fn heading(name: &'static str, title: &'static str) -> ReplayQuantity {
    ReplayQuantity { name, title, unit: "rad", wraps: true, rotor: None }
}

const fn of_rotor(name: &'static str, title: &'static str, unit: &'static str, rotor: usize) -> ReplayQuantity {
    ReplayQuantity { name, title, unit, wraps: false, rotor: Some(rotor) }
}

const MOTIONS: usize = 19;
const COUNT: usize = 2 * ROTORS_MAX + MOTIONS;

/// Values of all quantities; a missing value is NaN.
pub(super) type QuantityValues = [f32; COUNT];

/// All quantities: motor commands, the law's demands, its setpoints and the estimate.
pub const QUANTITIES: [ReplayQuantity; COUNT] = [
    of_rotor("omega1_rad_s", "rotor 1", "rad/s", 0),
    of_rotor("omega2_rad_s", "rotor 2", "rad/s", 1),
    of_rotor("omega3_rad_s", "rotor 3", "rad/s", 2),
    of_rotor("omega4_rad_s", "rotor 4", "rad/s", 3),
    of_rotor("omega5_rad_s", "rotor 5", "rad/s", 4),
    of_rotor("omega6_rad_s", "rotor 6", "rad/s", 5),
    of_rotor("omega7_rad_s", "rotor 7", "rad/s", 6),
    of_rotor("omega8_rad_s", "rotor 8", "rad/s", 7),
    of_rotor("throttle1", "throttle 1", "of 2047", 0),
    of_rotor("throttle2", "throttle 2", "of 2047", 1),
    of_rotor("throttle3", "throttle 3", "of 2047", 2),
    of_rotor("throttle4", "throttle 4", "of 2047", 3),
    of_rotor("throttle5", "throttle 5", "of 2047", 4),
    of_rotor("throttle6", "throttle 6", "of 2047", 5),
    of_rotor("throttle7", "throttle 7", "of 2047", 6),
    of_rotor("throttle8", "throttle 8", "of 2047", 7),
    plain("u4_n", "thrust U4", "N"),
    plain("u1_n", "roll U1", "N"),
    plain("u2_n", "pitch U2", "N"),
    plain("u3_n", "yaw U3", "N"),
    plain("roll_setpoint_rad", "roll setpoint", "rad"),
    plain("pitch_setpoint_rad", "pitch setpoint", "rad"),
    heading("yaw_setpoint_rad", "yaw setpoint"),
    plain("x_setpoint_m", "x setpoint", "m"),
    plain("y_setpoint_m", "y setpoint", "m"),
    plain("z_setpoint_m", "z setpoint", "m"),
    plain("x_m", "x", "m"),
    plain("y_m", "y", "m"),
    plain("z_m", "z", "m"),
    plain("vx_m_s", "velocity x", "m/s"),
    plain("vy_m_s", "velocity y", "m/s"),
    plain("vz_m_s", "velocity z", "m/s"),
    plain("roll_rad", "roll", "rad"),
    plain("pitch_rad", "pitch", "rad"),
    heading("yaw_rad", "yaw"),
];

/// Returns the values of all quantities at a tick.
pub(super) fn values(report: &Report, trace: &Trace) -> QuantityValues {
    const NONE: [f32; 3] = [f32::NAN; 3];
    let (inputs, [roll, pitch]) = (&trace.inputs, trace.desired_rad);
    let setpoint = report.guided.setpoint;
    let place = setpoint.map_or(NONE, |setpoint| setpoint.position_m.into());
    let yaw = setpoint.map_or(f32::NAN, |setpoint| setpoint.yaw_rad);
    let state = report.estimate.as_ref();
    let estimate =
        state.map_or([NONE; 3], |state| [state.position_m, state.velocity_m_s, state.attitude_rad].map(Into::into));
    let motors = report.motors.0.iter().copied().chain(report.throttles.map(f32::from));
    let law = [inputs.thrust_n, inputs.roll_n, inputs.pitch_n, inputs.yaw_n, roll, pitch, yaw];
    let mut values = [f32::NAN; COUNT];
    let all = motors.chain(law).chain(place).chain(estimate.into_iter().flatten());
    values.iter_mut().zip(all).for_each(|(to, from)| *to = from);
    values
}
