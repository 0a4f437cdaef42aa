//! Shared test helpers: random inputs and settings, and the checks of every step.

use afbc::adaptive::Gains;
use afbc::disturbance::DisturbanceObserver;
use afbc::fuzzy::Membership;
use afbc::reference::ReferenceModel;
use afbc::{PositionControlLimits, Profile, Safeguards, Settings, backstepping};
use afbc_control::{Action, FlightController, Smoothing, Trace, Validated};
use afbc_types::{Axis, Declaration, Declared, Inputs, Parameters, PerAxis, Setpoint, State};
use nalgebra::Vector3;
use proptest::prelude::*;
use std::cell::Cell;

/// Rounding error of one `f32` operation, relative.
pub(crate) const U: f64 = 1.0 / (1 << 24) as f64;

/// Draws a value as from a sensor or link: mostly of realistic size, often arbitrary.
pub(crate) fn value() -> impl Strategy<Value = f32> {
    let edges = [
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::MAX,
        f32::MIN,
        f32::MIN_POSITIVE,
        1e5,
        -1e5,
        1e3,
        -1e3,
        0.0,
        -0.0,
    ];
    prop_oneof![
        30 => -3.0_f32..3.0,
        4 => -1e3_f32..=1e3,
        1 => prop::sample::select(edges.to_vec()),
        1 => prop::num::f32::ANY,
    ]
}

/// Draws a value that is always plausible.
pub(crate) fn plausible() -> impl Strategy<Value = f32> {
    prop_oneof![4 => -3.0_f32..3.0, 1 => -1e3_f32..=1e3]
}

pub(crate) fn vector(value: BoxedStrategy<f32>) -> impl Strategy<Value = Vector3<f32>> {
    (value.clone(), value.clone(), value).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

pub(crate) fn state<S: Strategy<Value = f32> + 'static>(value: fn() -> S) -> impl Strategy<Value = State> {
    (vector(value().boxed()), vector(value().boxed()), vector(value().boxed()), vector(value().boxed())).prop_map(
        |(position_m, velocity_m_s, attitude_rad, rates_rad_s)| State {
            position_m,
            velocity_m_s,
            attitude_rad,
            rates_rad_s,
        },
    )
}

pub(crate) fn setpoint<S: Strategy<Value = f32> + 'static>(value: fn() -> S) -> impl Strategy<Value = Setpoint> {
    (vector(value().boxed()), vector(value().boxed()), vector(value().boxed()), vector(value().boxed())).prop_map(
        |(position_m, velocity_m_s, acceleration_m_s2, yaw)| Setpoint {
            position_m,
            velocity_m_s,
            acceleration_m_s2,
            yaw_rad: yaw.x,
            yaw_rate_rad_s: yaw.y,
            yaw_acceleration_rad_s2: yaw.z,
            ..Setpoint::default()
        },
    )
}

/// Draws a value within a parameter's range, often one of its bounds.
pub(crate) fn within(declaration: Declaration) -> impl Strategy<Value = f32> {
    let (min, max) = (declaration.range.min as f32, declaration.range.max as f32);
    prop_oneof![4 => min..=max, 1 => Just(min), 1 => Just(max)]
}

/// Draws a value within a parameter's range, uniform in the logarithm from a millionth of the maximum upwards, often a
/// bound.
pub(crate) fn spread(declaration: Declaration) -> impl Strategy<Value = f32> {
    let range = declaration.range;
    let (min, max) = (range.min.max(1e-6 * range.max), range.max);
    prop_oneof![
        4 => (min.ln()..=max.ln()).prop_map(move |x| x.exp().clamp(min, max) as f32),
        1 => Just(range.min as f32),
        1 => Just(range.max as f32),
    ]
}

pub(crate) fn limits() -> impl Strategy<Value = PositionControlLimits> {
    let any = (
        spread(PositionControlLimits::TILT),
        spread(PositionControlLimits::RATE),
        spread(PositionControlLimits::ACCEL),
        spread(PositionControlLimits::SPEED),
        spread(PositionControlLimits::CLIMB),
    )
        .prop_map(|(tilt_max_rad, tilt_rate_max_rad_s, acceleration_max_m_s2, speed_max_m_s, climb_max_m_s)| {
            PositionControlLimits {
                tilt_max_rad,
                tilt_rate_max_rad_s,
                acceleration_max_m_s2,
                speed_max_m_s,
                climb_max_m_s,
            }
        });
    prop_oneof![1 => Just(PositionControlLimits::NONE), 1 => Just(Profile::Flight.settings().limits), 4 => any]
}

pub(crate) fn safeguards() -> impl Strategy<Value = Safeguards> {
    let any = (spread(Safeguards::SIGMA), spread(Safeguards::THETAMAX), spread(Safeguards::DELTAMAX))
        .prop_map(|(sigma, theta_max, delta_max)| Safeguards { sigma, theta_max, delta_max });
    prop_oneof![1 => Just(Safeguards::NONE), 4 => any]
}

pub(crate) fn settings() -> impl Strategy<Value = Settings> {
    use afbc_control::Settings as Common;
    let common = (within(Common::DT), within(Common::FORCE_MAX), within(Common::RAISE_MAX));
    let numbers = (common, within(Settings::FILTER), within(Settings::FORWARD), limits());
    let model = (
        within(ReferenceModel::REF_XY),
        within(ReferenceModel::REF_Z),
        within(ReferenceModel::REF_YAW),
        within(ReferenceModel::REF_ACC),
        within(ReferenceModel::REF_TURN),
        within(ReferenceModel::REF_YAWRATE),
    )
        .prop_map(|(reference_xy_rad_s, reference_z_rad_s, reference_yaw_rad_s, acceleration, turn, yaw_rate)| {
            ReferenceModel {
                reference_xy_rad_s,
                reference_z_rad_s,
                reference_yaw_rad_s,
                reference_acceleration_m_s2: acceleration,
                reference_turn_rad_s2: turn,
                reference_yaw_rate_rad_s: yaw_rate,
            }
        });
    let smoothing = (
        within(Smoothing::SMOOTH_TILT),
        within(Smoothing::SMOOTH_YAW),
        within(Smoothing::SMOOTH_LIFT),
        within(Smoothing::LEAD),
    )
        .prop_map(|(smooth_tilt_rad_s, smooth_yaw_rad_s, smooth_lift_rad_s, lead_s)| Smoothing {
            smooth_tilt_rad_s,
            smooth_yaw_rad_s,
            smooth_lift_rad_s,
            lead_s,
        });
    let observer = (
        within(DisturbanceObserver::DIST_XY),
        within(DisturbanceObserver::DIST_TILT),
        within(DisturbanceObserver::DIST_LAG),
        within(DisturbanceObserver::MEM_RATE),
    )
        .prop_map(|(disturbance_rad_s, rad_s, disturbance_lag_s, memory_1_s)| DisturbanceObserver {
            disturbance_rad_s,
            disturbance_tilt_rad_s: rad_s,
            disturbance_yaw_rad_s: rad_s,
            disturbance_lag_s,
            memory_1_s,
            ..DisturbanceObserver::DEFAULT
        });
    let added = (
        prop_oneof![Just(DisturbanceObserver::DEFAULT), observer],
        prop_oneof![Just(ReferenceModel::DEFAULT), model],
        prop_oneof![Just(Smoothing::DEFAULT), smoothing],
    );
    let any = (numbers, any::<[bool; 6]>(), added).prop_map(|(numbers, switches, added)| {
        let (disturbance, reference, smoothing) = added;
        let ((dt_s, rotor_force_max_n, raised_thrust_max), command_filter_rad_s, forward_rad_s, limits) = numbers;
        let [tilt_by_thrust, anti_windup, freeze_on_ground, bumpless, feed_forward, by_rotation] = switches;
        Settings {
            common: Common { dt_s, rotor_force_max_n, raised_thrust_max, ..Common::DEFAULT },
            command_filter_rad_s,
            forward_rad_s,
            limits,
            tilt_by_thrust,
            anti_windup,
            freeze_on_ground,
            bumpless,
            feed_forward,
            by_rotation,
            disturbance,
            reference,
            smoothing,
        }
    });
    prop_oneof![Just(Profile::Paper.settings()), Just(Profile::Flight.settings()), any]
}

/// Draws gains for one subsystem.
pub(crate) fn gains_of_one() -> impl Strategy<Value = Gains> {
    let membership = (1e-3_f32..100.0, 0.1_f32..=6.0);
    let backstepping =
        (within(backstepping::Gains::ALPHA1), within(backstepping::Gains::ALPHA2), within(backstepping::Gains::STIFF));
    (backstepping, within(Gains::GAMMA), within(Gains::ETA), within(Gains::EPSILON), membership, safeguards())
        .prop_map(|((alpha1, alpha2, stiffness), gamma, eta, epsilon, (width, spread), safeguards)| Gains {
            backstepping: afbc::backstepping::Gains { alpha1, alpha2, stiffness },
            gamma,
            eta,
            epsilon,
            membership: Membership { centre: (width * spread).max(1e-3), width },
            safeguards,
        })
        .prop_filter("accepted", |gains| gains.validate().is_ok())
}

/// Draws gains for all six subsystems, or those of a profile.
pub(crate) fn gains() -> impl Strategy<Value = PerAxis<Gains>> {
    prop_oneof![
        Just(Profile::Paper.gains()),
        Just(Profile::Flight.gains()),
        gains_of_one().prop_map(|gains| PerAxis::from_fn(|_| gains)),
    ]
}

/// Action and trace of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Stepped {
    pub(crate) action: Action,
    pub(crate) trace: Trace,
}

impl Stepped {
    /// Returns each subsystem's input: U1..U4 \[N\], u5, u6 \[m/s2\].
    pub(crate) fn per_axis(&self) -> PerAxis<f32> {
        let Inputs { roll_n, pitch_n, yaw_n, thrust_n } = self.trace.inputs;
        let [x, y] = self.trace.virtual_m_s2;
        PerAxis { roll: roll_n, pitch: pitch_n, yaw: yaw_n, z: thrust_n, x, y }
    }
}

/// Returns the state with a velocity whose last bit changes from one call to the next, since a law takes a velocity
/// that repeats itself to the bit for an old one.
pub(crate) fn measured(state: &State) -> State {
    thread_local!(static LAST_BIT: Cell<u32> = const { Cell::new(0) });
    let last_bit = LAST_BIT.replace(1 - LAST_BIT.get());
    State { velocity_m_s: state.velocity_m_s.map(|v| f32::from_bits(v.to_bits() & !1 | last_bit)), ..*state }
}

/// Runs one step with a measurement.
pub(crate) fn step<C: FlightController>(
    controller: &C,
    memory: &mut Validated<C::Memory>,
    state: &State,
    setpoint: &Setpoint,
) -> Stepped {
    let action = controller.step(memory, Some(state), setpoint);
    Stepped { action, trace: C::trace(&memory.control) }
}

/// Checks every step: speeds and forces are finite and within the rotors' limits.
pub(crate) fn check_step(step: &Stepped, settings: &Settings) -> Result<(), TestCaseError> {
    let (limit, Stepped { action, trace }) = (settings.common.rotor_force_max_n, step);
    let fastest = (f64::from(limit) / Parameters::PAPER.thrust_factor_n_s2).sqrt() * (1.0 + 2e-7);
    prop_assert!(action.forces.0.iter().all(|f| (0.0..=limit).contains(f)), "{step:?}");
    prop_assert!(action.speeds.0.iter().all(|w| (0.0..=fastest).contains(&f64::from(*w))), "{step:?}");
    let u = &trace.inputs;
    let numbers = [u.roll_n, u.pitch_n, u.yaw_n, u.thrust_n]
        .into_iter()
        .chain(trace.virtual_m_s2)
        .chain(trace.desired_rad)
        .chain(trace.filtered.iter().flat_map(|f| [f.angle, f.rate]))
        .chain(Axis::ALL.iter().flat_map(|axis| {
            let errors = &trace.errors[*axis];
            [errors.e1, errors.e1_dot, errors.e2]
        }));
    for number in numbers {
        prop_assert!(number.is_finite(), "{step:?}");
    }
    Ok(())
}
