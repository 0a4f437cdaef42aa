//! Compares the fallback law with its equations in `f64`, and checks its stability proof.
#![allow(clippy::unwrap_used, missing_docs)] // a law that cannot be built must stop the test

use afbc::integral::{Gains, IntegralBackstepping, IntegralMemory};
use afbc::law::{StepContext, SubsystemTracking};
use afbc::model::RollPitch;
use afbc::{Backstepping, Profile, SubsystemLaw, adaptive, backstepping};
use afbc_types::{Axis, Parameters, PerAxis, State};
use nalgebra::Vector3;
use proptest::prelude::*;

/// Rounding error of one `f32` operation, relative.
const U: f64 = 1.0 / (1 << 24) as f64;
const DT_S: f32 = 0.001;

fn tracking() -> impl Strategy<Value = SubsystemTracking> {
    prop::array::uniform4(-3.0_f32..3.0).prop_map(|[x2, e1, x1d_dot, x1d_ddot]| SubsystemTracking {
        x2,
        e1,
        x1d_dot,
        x1d_ddot,
        ..SubsystemTracking::default()
    })
}

fn gains() -> impl Strategy<Value = Gains> {
    (0.1_f32..5.0, 0.0_f32..10.0, 0.0_f32..20.0, 0.1_f32..50.0, 0.0_f32..10.0).prop_map(
        |(alpha1, alpha2, stiffness, integral, integral_max)| Gains {
            backstepping: backstepping::Gains { alpha1, alpha2, stiffness },
            integral,
            integral_max,
        },
    )
}

/// Runs one step of the subsystem x, with f = 0 and g = 1. Returns u of this law, u of the baseline for the same errors
/// (to which the integral is added), and e_2.
fn step(
    gains: Gains,
    tracking: &SubsystemTracking,
    unallocated: f32,
    adapt: bool,
    integral: &mut IntegralMemory,
) -> [f32; 3] {
    let vehicle = Parameters::PAPER.to_f32();
    let law = IntegralBackstepping::new(&vehicle, PerAxis::from_fn(|_| gains)).unwrap();
    let fixed = Backstepping::new(&vehicle, PerAxis::from_fn(|_| gains.backstepping)).unwrap();
    let context = StepContext {
        state: &State::default(),
        roll_pitch: RollPitch::new(&State::default()),
        rotor_residual_rad_s: 0.0,
        dt_s: DT_S,
        adapt,
        adapt_z: !adapt,
        unallocated: &PerAxis { x: unallocated, ..PerAxis::default() },
        observed_m_s2: Vector3::zeros(),
        softness: 1.0,
        known: None,
    };
    let (u, errors) = law.input(Axis::X, tracking, &context, integral);
    let (alone, same) = fixed.input(Axis::X, tracking, &context, &mut ());
    assert_eq!(errors, same);
    [u, alone, errors.e2]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 5_000, failure_persistence: None, ..ProptestConfig::default() })]

    /// u = u*_eq + alpha_2 e_2 + i. Then i grows by kappa e_2 dt, but not without a new state, not towards a reached
    /// limit, and only within +-i_max.
    #[test]
    fn a_step_adds_the_integral_and_then_moves_it(
        gains in gains(), tracking in tracking(), value in -12.0_f32..12.0, adapt: bool,
        unallocated in prop_oneof![Just(0.0_f32), -1.0_f32..1.0],
    ) {
        let mut integral = IntegralMemory { value, ..IntegralMemory::default() };
        let [u, alone, e2] = step(gains, &tracking, unallocated, adapt, &mut integral);
        let i = value.clamp(-gains.integral_max, gains.integral_max);
        prop_assert_eq!(u, alone + i);
        let pressed = f64::from(e2) * f64::from(unallocated) > 0.0;
        let moved = if adapt && !pressed { f64::from(gains.integral) * f64::from(e2) * f64::from(DT_S) } else { 0.0 };
        let allowed = U * f64::from(i).abs() + 4.0 * U * moved.abs();
        prop_assert!((f64::from(integral.value) - f64::from(i) - moved).abs() <= allowed, "{integral:?}");
        prop_assert_eq!((integral.resume, integral.hover_thrust_n), (None, None));
    }

    /// The law continues with the input to resume, once and as far as its bound allows.
    #[test]
    fn it_takes_over_with_the_last_input(gains in gains(), tracking in tracking(), last in -20.0_f32..20.0) {
        let mut integral = IntegralMemory { value: 3.0, resume: Some(last), hover_thrust_n: None };
        let [u, alone, _] = step(gains, &tracking, 0.0, false, &mut integral);
        let most = gains.integral_max;
        let wanted = last.clamp(alone - most, alone + most);
        prop_assert!((u - wanted).abs() <= 4.0 * U as f32 * (wanted.abs() + alone.abs()), "{u} instead of {wanted}");
        prop_assert_eq!(integral.resume, None);
        let [again, ..] = step(gains, &tracking, 0.0, false, &mut integral);
        prop_assert_eq!(again, u);
    }

    /// V = (c e_1^2 + e_2^2 + (i* - i)^2/kappa)/2 with i* = -d never grows under a constant disturbance d: V' = -c
    /// alpha_1 e_1^2 - alpha_2 e_2^2.
    #[test]
    fn lyapunov(gains in gains(), tracking in tracking(), value in -5.0_f32..5.0, d in -5.0_f64..5.0) {
        let gains = Gains { integral_max: 10.0, ..gains };
        let mut integral = IntegralMemory { value, ..IntegralMemory::default() };
        let [u, _, e2] = step(gains, &tracking, 0.0, true, &mut integral);
        let backstepping::Gains { alpha1, alpha2, stiffness } = gains.backstepping;
        let [a1, a2, c, kappa, e1, e2] =
            [alpha1, alpha2, stiffness, gains.integral, tracking.e1, e2].map(f64::from);
        let e1_dot = f64::from(tracking.x1d_dot) - f64::from(tracking.x2);
        let e2_dot = f64::from(tracking.x1d_ddot) - (f64::from(u) + d) + a1 * e1_dot;
        let i_dot = (f64::from(integral.value) - f64::from(value)) / f64::from(DT_S);
        let missing = -d - f64::from(value);
        let slope = c * e1 * e1_dot + e2 * e2_dot - missing * i_dot / kappa;
        let wanted = -c * a1 * e1 * e1 - a2 * e2 * e2;
        // i changes by a small part of itself per step, so its rounding error is divided by dt and kappa.
        let allowed = 1e-4 * (1.0 + wanted.abs() + a1 * a1 * e1.abs() * e2.abs()) + 10.0 * 1.2e-6 / 1e-3 / kappa;
        prop_assert!((slope - wanted).abs() <= allowed, "{slope} instead of {wanted}");
    }
}

/// The integral law is as fast as AFBC with one rule and the same bound. It uses AFBC's hover thrust, or else the
/// weight.
#[test]
fn it_stands_in_for_afbc() {
    let gains = Profile::Flight.gains();
    let vehicle = Parameters::PAPER.to_f32();
    for axis in Axis::ALL {
        let (own, of) = (Gains::from(&gains[axis]), gains[axis]);
        assert_eq!(own.backstepping, of.backstepping);
        assert_eq!((own.integral, own.integral_max), (of.gamma, of.safeguards.theta_max));
    }
    let law = IntegralBackstepping::new(&vehicle, gains.map(|gains| gains.into())).unwrap();
    let with =
        |hover_thrust_n| law.hover_thrust_n(&IntegralMemory { hover_thrust_n, ..IntegralMemory::default() }, 4.7, 0.0);
    assert_eq!((with(None), with(Some(6.1))), (4.7, 6.1));
}

#[test]
fn a_gain_out_of_range_is_refused_by_name() {
    let vehicle = Parameters::PAPER.to_f32();
    type Set = fn(&mut Gains, f32);
    let cases: [(&str, f32, Set); 3] = [
        (adaptive::Gains::GAMMA.range.name, 1e4, |gains, value| gains.integral = value),
        ("theta_max", 1e6, |gains, value| gains.integral_max = value),
        ("alpha1", 100.0, |gains, value| gains.backstepping.alpha1 = value),
    ];
    for axis in Axis::ALL {
        for (name, max, set) in cases {
            let with = |value| {
                let mut gains: PerAxis<Gains> = Profile::Flight.gains().map(|gains| gains.into());
                set(&mut gains[axis], value);
                IntegralBackstepping::new(&vehicle, gains).map(drop).map_err(|error| error.range.name)
            };
            assert_eq!(with(max), Ok(()), "{name} of {}", axis.name());
            for bad in [-1.0, max.next_up(), f32::NAN] {
                assert_eq!(with(bad), Err(name), "{name} of {}", axis.name());
            }
        }
    }
}
