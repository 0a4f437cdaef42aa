//! Properties of the reference model.
#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    missing_docs,
    reason = "what cannot be built must stop the test"
)]

use afbc::limits::Limits;
use afbc::reference::{Detours, Reference, ReferenceModel};
use afbc_types::{Setpoint, State};
use nalgebra::Vector3;
use proptest::prelude::*;

const DT_S: f32 = 0.001;
const SPEED_M_S: f32 = 5.0;
const CLIMB_M_S: f32 = 3.0;

fn limits() -> Limits {
    Limits { speed_max_m_s: SPEED_M_S, climb_max_m_s: CLIMB_M_S, ..Limits::NONE }
}

fn any_model() -> impl Strategy<Value = ReferenceModel> {
    (2.0_f32..15.0, 2.0_f32..15.0, 2.0_f32..15.0, 3.0_f32..15.0, 5.0_f32..30.0, 1.0_f32..5.0).prop_map(
        |(reference_xy_rad_s, reference_z_rad_s, reference_yaw_rad_s, acceleration, turn, rate)| ReferenceModel {
            reference_xy_rad_s,
            reference_z_rad_s,
            reference_yaw_rad_s,
            reference_acceleration_m_s2: acceleration,
            reference_turn_rad_s2: turn,
            reference_yaw_rate_rad_s: rate,
        },
    )
}

/// A sine along every coordinate: amplitude, rate and phase.
fn sines() -> impl Strategy<Value = [(f32, f32, f32); 4]> {
    let sine = || (0.1_f32..1.5, 0.2_f32..3.0, 0.0_f32..6.3);
    [sine(), sine(), sine(), sine()]
}

fn on_sines(sines: &[(f32, f32, f32); 4], t: f64) -> Setpoint {
    let derivative = |&(amplitude, rate, phase): &(f32, f32, f32), order: i32| {
        let (amplitude, rate, phase) = (f64::from(amplitude), f64::from(rate), f64::from(phase));
        let shift = f64::from(order) * core::f64::consts::FRAC_PI_2;
        (amplitude * rate.powi(order) * (rate * t + phase + shift).sin()) as f32
    };
    let [x, y, z, yaw] = sines;
    let vector = |order| Vector3::new(derivative(x, order), derivative(y, order), derivative(z, order));
    Setpoint {
        position_m: vector(0),
        velocity_m_s: vector(1),
        acceleration_m_s2: vector(2),
        jerk_m_s3: vector(3),
        snap_m_s4: vector(4),
        yaw_rad: derivative(yaw, 0),
        yaw_rate_rad_s: derivative(yaw, 1),
        yaw_acceleration_rad_s2: derivative(yaw, 2),
    }
}

/// A vehicle exactly on the setpoint.
fn on(setpoint: &Setpoint) -> State {
    let mut state = State { position_m: setpoint.position_m, velocity_m_s: setpoint.velocity_m_s, ..State::default() };
    (state.attitude_rad.z, state.rates_rad_s.z) = (setpoint.yaw_rad, setpoint.yaw_rate_rad_s);
    state
}

/// Largest differences of position, velocity, acceleration and yaw.
fn apart(a: &Setpoint, b: &Setpoint) -> [f32; 4] {
    [
        (a.position_m - b.position_m).amax(),
        (a.velocity_m_s - b.velocity_m_s).amax(),
        (a.acceleration_m_s2 - b.acceleration_m_s2).amax(),
        (a.yaw_rad - b.yaw_rad).abs(),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// A smooth setpoint is the reference, wherever the vehicle is, also one that accelerates more than the model may.
    #[test]
    fn a_smooth_setpoint_is_tracked_as_it_is(model in any_model(), sines in sines(), away in -2.0_f32..2.0) {
        let reference = Reference::new(&model, &limits(), DT_S).unwrap();
        let first = on_sines(&sines, 0.0);
        let mut detours = reference.start(&on(&first), &first);
        for step in 0..4000 {
            let setpoint = on_sines(&sines, f64::from(step) * f64::from(DT_S));
            let mut state = on(&setpoint);
            state.position_m.x += away;
            let tracked = reference.advance(&mut detours, &state, &setpoint);
            let [x, v, a, yaw] = apart(&tracked, &setpoint);
            prop_assert!(x < 1e-4 && v < 1e-4 && a < 2e-3 && yaw < 1e-4, "{x} {v} {a} {yaw} in step {step}");
        }
    }

    /// After a jump the reference leaves from where it was, moves as its derivatives say within the limits, and arrives
    /// without running past the setpoint by more than a tenth.
    #[test]
    fn a_jump_becomes_motion_within_the_limits(
        model in any_model(), by in [-20.0_f32..20.0, -20.0_f32..20.0, -20.0_f32..20.0], turn in -3.0_f32..3.0,
    ) {
        let reference = Reference::new(&model, &limits(), DT_S).unwrap();
        let from = Setpoint::default();
        let by = Vector3::from(by);
        let to = Setpoint { position_m: by, yaw_rad: turn, ..from };
        let mut detours = reference.start(&on(&from), &from);
        let mut last = reference.advance(&mut detours, &on(&from), &from);
        for step in 0..40_000 {
            // The vehicle is on the reference.
            let next = reference.advance(&mut detours, &on(&last), &to);
            let mean_m_s = last.velocity_m_s + last.acceleration_m_s2 * (0.5 * DT_S);
            let moved = next.position_m - last.position_m - mean_m_s * DT_S;
            prop_assert!(moved.amax() < 1e-5, "jumped by {moved} in step {step}");
            let gained = next.velocity_m_s - last.velocity_m_s - last.acceleration_m_s2 * DT_S;
            prop_assert!(gained.amax() < 1e-4, "accelerated by {gained} in step {step}");
            prop_assert!(next.acceleration_m_s2.amax() <= 1.0001 * model.reference_acceleration_m_s2);
            let [across, up] = [next.velocity_m_s.xy().amax(), next.velocity_m_s.z.abs()];
            prop_assert!(across <= 1.2 * SPEED_M_S && up <= 1.2 * CLIMB_M_S, "{across} and {up} m/s");
            prop_assert!(next.yaw_rate_rad_s.abs() <= 1.2 * model.reference_yaw_rate_rad_s);
            for axis in 0..3 {
                let (at, all) = (next.position_m.as_slice()[axis], by.as_slice()[axis]);
                prop_assert!(at * all.signum() <= 1.1 * all.abs() + 1e-3, "{at} of {all} in step {step}");
            }
            last = next;
        }
        let [x, v, a, yaw] = apart(&last, &to);
        prop_assert!(x < 1e-2 && v < 1e-2 && a < 1e-1 && yaw < 1e-2, "still away by {x} {v} {a} {yaw}");
    }

    /// Setpoint and vehicle go on while no step is made: so does the reference. A vehicle that stood still meanwhile is
    /// met where it is.
    #[test]
    fn after_an_interruption_the_reference_is_near_the_vehicle(
        model in any_model(), sines in sines(), begin in 0.0..3.0, length in 0.1..0.6, stands in any::<bool>(),
    ) {
        let reference = Reference::new(&model, &limits(), DT_S).unwrap();
        let first = on_sines(&sines, begin);
        let mut detours = reference.start(&on(&first), &first);
        let _ = reference.advance(&mut detours, &on(&first), &first);
        let after = on_sines(&sines, begin + length);
        let vehicle = on(if stands { &first } else { &after });
        let tracked = reference.advance(&mut detours, &vehicle, &after);
        let away = (tracked.position_m - vehicle.position_m).amax();
        // It is expected a step ahead: 4.5 mm at the greatest speed.
        prop_assert!(away < 5e-3, "{away} m from the vehicle, {} m from the setpoint", apart(&tracked, &after)[0]);
    }

    /// Every reference for plausible setpoints and states is finite.
    #[test]
    fn no_plausible_input_makes_it_infinite(
        model in any_model(),
        positions in proptest::collection::vec(-1e5_f32..1e5, 40),
        speeds in proptest::collection::vec(-1e3_f32..1e3, 40),
    ) {
        let reference = Reference::new(&model, &limits(), DT_S).unwrap();
        let mut detours: Option<Detours> = None;
        for (&x, &v) in positions.iter().zip(&speeds) {
            let mut setpoint = Setpoint::default();
            (setpoint.position_m, setpoint.velocity_m_s) = (Vector3::repeat(x), Vector3::repeat(v));
            (setpoint.acceleration_m_s2, setpoint.yaw_rad) = (Vector3::repeat(-v), 1e-2 * x);
            let (position_m, velocity_m_s) = (Vector3::repeat(v), Vector3::repeat(-v));
            let mut state = State { position_m, velocity_m_s, ..State::default() };
            state.attitude_rad.z = -v;
            let detours = detours.get_or_insert_with(|| reference.start(&state, &setpoint));
            let tracked = reference.advance(detours, &state, &setpoint);
            let sum = tracked.position_m.sum() + tracked.velocity_m_s.sum() + tracked.acceleration_m_s2.sum()
                + tracked.jerk_m_s3.sum() + tracked.yaw_rad + tracked.yaw_rate_rad_s + tracked.yaw_acceleration_rad_s2;
            prop_assert!(sum.is_finite(), "{tracked:?}");
        }
    }
}

/// The model follows (s + w)^3 within the limits: the exact response to a step of the setpoint.
#[test]
fn a_small_jump_decays_as_the_model_says() {
    let w = 6.0_f64;
    let model = ReferenceModel { reference_xy_rad_s: w as f32, ..ReferenceModel::DEFAULT };
    let reference = Reference::new(&model, &Limits::NONE, DT_S).unwrap();
    let (from, mut to) = (Setpoint::default(), Setpoint::default());
    to.position_m.x = 0.5;
    let mut detours = reference.start(&on(&from), &from);
    let mut tracked = reference.advance(&mut detours, &on(&from), &from);
    for step in 0..2000 {
        tracked = reference.advance(&mut detours, &on(&tracked), &to);
        let t = w * f64::from(step) * f64::from(DT_S);
        let exact = 0.5 * (1.0 - (1.0 + t + 0.5 * t * t) * (-t).exp());
        assert!((f64::from(tracked.position_m.x) - exact).abs() < 3e-3, "{} instead of {exact}", tracked.position_m.x);
    }
    assert_eq!((tracked.position_m.y, tracked.yaw_rad), (0.0, 0.0));
}

/// Without bandwidths there is no model; a coordinate without one is tracked to the bit.
#[test]
fn no_bandwidth_is_no_model() {
    assert!(Reference::new(&ReferenceModel::DEFAULT, &Limits::NONE, DT_S).is_none());
    let only_yaw = ReferenceModel { reference_yaw_rad_s: 5.0, ..ReferenceModel::DEFAULT };
    let reference = Reference::new(&only_yaw, &Limits::NONE, DT_S).unwrap();
    let mut detours = reference.start(&State::default(), &Setpoint::default());
    let far = Setpoint { position_m: Vector3::new(1.0, -2.0, 3.0), yaw_rad: 1.0, ..Setpoint::default() };
    let tracked = reference.advance(&mut detours, &State::default(), &far);
    assert_eq!(tracked.position_m, far.position_m);
    assert!(tracked.yaw_rad.abs() < 1e-6, "{}", tracked.yaw_rad);
}
