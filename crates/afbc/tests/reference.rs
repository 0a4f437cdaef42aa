//! Properties of the reference model.

use afbc::limits::PositionControlLimits;
use afbc::reference::{ReferenceFilter, ReferenceMemory, ReferenceModel};
use afbc_types::{Setpoint, State};
use nalgebra::Vector3;
use proptest::prelude::*;

const DT_S: f32 = 0.001;
const SPEED_M_S: f32 = 5.0;
const CLIMB_M_S: f32 = 3.0;

fn limits() -> PositionControlLimits {
    PositionControlLimits { speed_max_m_s: SPEED_M_S, climb_max_m_s: CLIMB_M_S, ..PositionControlLimits::NONE }
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

/// Draws a sine for every coordinate: amplitude, rate and phase.
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

/// Returns the state of a vehicle exactly on the setpoint.
fn on(setpoint: &Setpoint) -> State {
    let mut state = State { position_m: setpoint.position_m, velocity_m_s: setpoint.velocity_m_s, ..State::default() };
    (state.attitude_rad.z, state.rates_rad_s.z) = (setpoint.yaw_rad, setpoint.yaw_rate_rad_s);
    state
}

/// Draws a setpoint of small size with all derivatives.
fn setpoint_near() -> impl Strategy<Value = Setpoint> {
    let vector = |size: f32| prop::array::uniform3(-size..size).prop_map(Vector3::from);
    (vector(0.3), vector(0.5), vector(1.0), vector(100.0), prop::array::uniform3(-0.5_f32..0.5)).prop_map(
        |(
            position_m,
            velocity_m_s,
            acceleration_m_s2,
            jerk_m_s3,
            [yaw_rad, yaw_rate_rad_s, yaw_acceleration_rad_s2],
        )| {
            Setpoint {
                position_m,
                velocity_m_s,
                acceleration_m_s2,
                jerk_m_s3,
                yaw_rad,
                yaw_rate_rad_s,
                yaw_acceleration_rad_s2,
                ..Setpoint::default()
            }
        },
    )
}

/// One coordinate by the equations in the head of `reference.rs`: d with two derivatives.
#[derive(Clone, Copy, Debug)]
struct Documented {
    w: f64,
    a_max: f64,
    v_max: f64,
    d: [f64; 3],
}

impl Documented {
    fn advance(&mut self, dt_s: f64) {
        let [d, d_dot, d_ddot] = self.d;
        let approach = self.w / 3.0;
        // Beyond `far`, v_c^2/2 falls by half of a_max per metre.
        let far = 0.5 * self.a_max / approach.powi(2);
        let beyond = (d.abs() - far).max(0.0);
        let speed = ((approach * (d.abs() - beyond)).powi(2) + self.a_max * beyond).sqrt().min(self.v_max);
        let v_c = -speed.copysign(d);
        let a_c = (self.w * (v_c - d_dot)).clamp(-self.a_max, self.a_max);
        self.d = [
            d + dt_s * (d_dot + 0.5 * dt_s * d_ddot),
            d_dot + dt_s * d_ddot,
            d_ddot + dt_s * 3.0 * self.w * (a_c - d_ddot),
        ];
    }
}

/// Returns the largest differences of position, velocity, acceleration and yaw.
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

    /// The reference equals a smooth setpoint, wherever the vehicle is, even if the setpoint accelerates more than the
    /// model may.
    #[test]
    fn a_smooth_setpoint_is_tracked_as_it_is(model in any_model(), sines in sines(), away in -2.0_f32..2.0) {
        let reference = ReferenceFilter::new(&model, &limits(), DT_S).unwrap();
        let first = on_sines(&sines, 0.0);
        let mut memory = reference.start(&on(&first), &first);
        for step in 0..4000 {
            let setpoint = on_sines(&sines, f64::from(step) * f64::from(DT_S));
            let mut state = on(&setpoint);
            state.position_m.x += away;
            let tracked = reference.advance(&mut memory, &state, &setpoint);
            let [x, v, a, yaw] = apart(&tracked, &setpoint);
            prop_assert!(x < 1e-4 && v < 1e-4 && a < 2e-3 && yaw < 1e-4, "{x} {v} {a} {yaw} in step {step}");
        }
    }

    /// After a jump the reference starts from its old position, moves consistently with its derivatives within the
    /// limits, and arrives with less than a tenth of overshoot.
    #[test]
    fn a_jump_becomes_motion_within_the_limits(
        model in any_model(), by in [-20.0_f32..20.0, -20.0_f32..20.0, -20.0_f32..20.0], turn in -3.0_f32..3.0,
    ) {
        let reference = ReferenceFilter::new(&model, &limits(), DT_S).unwrap();
        let from = Setpoint::default();
        let by = Vector3::from(by);
        let to = Setpoint { position_m: by, yaw_rad: turn, ..from };
        let mut memory = reference.start(&on(&from), &from);
        let mut last = reference.advance(&mut memory, &on(&from), &from);
        for step in 0..40_000 {
            // The vehicle is on the reference.
            let next = reference.advance(&mut memory, &on(&last), &to);
            let mean_m_s = last.velocity_m_s + last.acceleration_m_s2 * (0.5 * DT_S);
            let moved = next.position_m - last.position_m - mean_m_s * DT_S;
            prop_assert!(moved.amax() < 1e-5, "jumped by {moved} in step {step}");
            let gained = next.velocity_m_s - last.velocity_m_s - last.acceleration_m_s2 * DT_S;
            prop_assert!(gained.amax() < 1e-4, "accelerated by {gained} in step {step}");
            let pushed = next.acceleration_m_s2 - last.acceleration_m_s2 - last.jerk_m_s3 * DT_S;
            prop_assert!(pushed.amax() < 1e-4, "jerked by {pushed} in step {step}");
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

    /// The reference starts at the vehicle from any state. Then it moves consistently with its derivatives, and follows
    /// only the part of each jump, in position and velocity, that brings it nearer to the vehicle.
    #[test]
    fn of_a_jump_it_follows_what_brings_it_nearer_to_the_vehicle(
        model in any_model(), near in prop::collection::vec((setpoint_near(), setpoint_near()), 2..30),
    ) {
        let reference = ReferenceFilter::new(&model, &limits(), DT_S).unwrap();
        let list = |s: &Setpoint| [s.position_m.x, s.position_m.y, s.position_m.z, s.yaw_rad].map(f64::from);
        let speeds = |s: &Setpoint| {
            let v = &s.velocity_m_s;
            [v.x, v.y, v.z, s.yaw_rate_rad_s].map(f64::from)
        };
        let pushes = |s: &Setpoint| {
            let a = &s.acceleration_m_s2;
            [a.x, a.y, a.z, s.yaw_acceleration_rad_s2].map(f64::from)
        };
        let jerks = |s: &Setpoint| [s.jerk_m_s3.x, s.jerk_m_s3.y, s.jerk_m_s3.z, 0.0].map(f64::from);
        let dt = f64::from(DT_S);
        let mut memory = reference.start(&on(&near[0].1), &near[0].0);
        let mut last: Option<(Setpoint, Setpoint)> = None;
        for (setpoint, vehicle) in &near {
            let tracked = reference.advance(&mut memory, &on(vehicle), setpoint);
            for i in 0..4 {
                let (x, v) = (list(&tracked)[i], speeds(&tracked)[i]);
                let (at, speed) = (list(vehicle)[i], speeds(vehicle)[i]);
                let Some((setpoint_then, then)) = &last else {
                    prop_assert!((x - at).abs() < 1e-6 && (v - speed).abs() < 1e-6, "starts at {x} with {v}");
                    continue;
                };
                let on_x = |s: &Setpoint| list(s)[i] + dt * (speeds(s)[i] + 0.5 * dt * pushes(s)[i]);
                let on_v = |s: &Setpoint, j: f64| speeds(s)[i] + dt * (pushes(s)[i] + 0.5 * dt * j);
                let nearest = |goes_on: f64, jump: f64, vehicle: f64| {
                    vehicle.clamp(goes_on.min(goes_on + jump), goes_on.max(goes_on + jump))
                };
                let wanted = nearest(on_x(then), list(setpoint)[i] - on_x(setpoint_then), at);
                prop_assert!((x - wanted).abs() < 1e-5, "{i}: at {x} instead of {wanted}");
                let jump = speeds(setpoint)[i] - on_v(setpoint_then, jerks(setpoint_then)[i]);
                // The setpoint's next velocity includes the setpoint's jerk; the offset's velocity does not include the
                // offset's.
                let own = 0.5 * dt * dt * jerks(setpoint_then)[i];
                let wanted = nearest(on_v(then, 0.0) + own, jump, speed);
                prop_assert!((v - wanted).abs() < 1e-5, "{i}: {v} m/s instead of {wanted}");
            }
            last = Some((*setpoint, tracked));
        }
    }

    /// With an accelerating setpoint, the reference accelerates no more than the larger of the model's limit and the
    /// setpoint.
    #[test]
    fn it_accelerates_no_more_than_it_may_or_the_setpoint_does(
        model in any_model(), sines in sines(), by in -20.0_f32..20.0,
    ) {
        let reference = ReferenceFilter::new(&model, &PositionControlLimits::NONE, DT_S).unwrap();
        let first = on_sines(&sines, 0.0);
        let mut memory = reference.start(&on(&first), &first);
        let mut last = first;
        for step in 0..6000 {
            let mut setpoint = on_sines(&sines, f64::from(step) * f64::from(DT_S));
            if step > 500 {
                setpoint.position_m += Vector3::new(by, -by, by);
            }
            last = reference.advance(&mut memory, &on(&last), &setpoint);
            for (own, all) in setpoint.acceleration_m_s2.iter().zip(last.acceleration_m_s2.iter()) {
                let most = own.abs().max(model.reference_acceleration_m_s2) * 1.0001;
                prop_assert!(all.abs() <= most, "{all} m/s2 with {own} m/s2 of the setpoint in step {step}");
            }
        }
    }

    /// A jump far beyond the limits follows the documented equations, integrated in `f64` with a tenth of the step.
    #[test]
    fn a_large_jump_takes_the_documented_course(
        model in any_model(), by in prop_oneof![0.1_f32..1.0, 1.0_f32..60.0], turn in 0.1_f32..3.0, back: bool,
    ) {
        let reference = ReferenceFilter::new(&model, &limits(), DT_S).unwrap();
        let sign = if back { -1.0 } else { 1.0 };
        let from = Setpoint::default();
        let to = Setpoint { position_m: Vector3::repeat(sign * by), yaw_rad: sign * turn, ..from };
        let mut memory = reference.start(&on(&from), &from);
        let mut last = reference.advance(&mut memory, &on(&from), &from);
        let (a, yaw_a) = (model.reference_acceleration_m_s2, model.reference_turn_rad_s2);
        let coordinate = |w: f32, a: f32, v: f32, d: f32| Documented {
            w: f64::from(w),
            a_max: f64::from(a),
            v_max: f64::from(v),
            d: [-f64::from(sign * d), 0.0, 0.0],
        };
        let mut exact = [
            coordinate(model.reference_xy_rad_s, a, SPEED_M_S, by),
            coordinate(model.reference_z_rad_s, a, CLIMB_M_S, by),
            coordinate(model.reference_yaw_rad_s, yaw_a, model.reference_yaw_rate_rad_s, turn),
        ];
        for step in 0..8000 {
            last = reference.advance(&mut memory, &on(&last), &to);
            let got = [
                (last.position_m.x - to.position_m.x, last.velocity_m_s.x),
                (last.position_m.z - to.position_m.z, last.velocity_m_s.z),
                (last.yaw_rad - to.yaw_rad, last.yaw_rate_rad_s),
            ];
            for ((d, v), exact) in got.into_iter().zip(&mut exact) {
                let [exact_d, exact_v, _] = exact.d;
                // The discrete model is late by half a step, which is a distance at the present speed and acceleration.
                let (off_d, off_v) = ((f64::from(d) - exact_d).abs(), (f64::from(v) - exact_v).abs());
                let size = exact.v_max.min(f64::from(by.max(turn)) * exact.w);
                prop_assert!(off_d < 4e-3 * size && off_v < 0.02 * size, "{d} {v} for {exact:?} in step {step}");
                for _ in 0..10 {
                    exact.advance(1e-4);
                }
            }
        }
    }

    /// During an interruption setpoint and vehicle move on, and so does the reference. If the vehicle stood still, the
    /// reference is at the vehicle.
    #[test]
    fn after_an_interruption_the_reference_is_near_the_vehicle(
        model in any_model(), sines in sines(), begin in 0.0..3.0, length in 0.1..0.6, stands in any::<bool>(),
    ) {
        let reference = ReferenceFilter::new(&model, &limits(), DT_S).unwrap();
        let first = on_sines(&sines, begin);
        let mut memory = reference.start(&on(&first), &first);
        let _ = reference.advance(&mut memory, &on(&first), &first);
        let after = on_sines(&sines, begin + length);
        let vehicle = on(if stands { &first } else { &after });
        let tracked = reference.advance(&mut memory, &vehicle, &after);
        let away = (tracked.position_m - vehicle.position_m).amax();
        // The expected position is a step ahead: 4.5 mm at the greatest speed.
        prop_assert!(away < 5e-3, "{away} m from the vehicle, {} m from the setpoint", apart(&tracked, &after)[0]);
    }

    /// The reference is finite for plausible setpoints and states.
    #[test]
    fn no_plausible_input_makes_it_infinite(
        model in any_model(),
        positions in proptest::collection::vec(-1e5_f32..1e5, 40),
        speeds in proptest::collection::vec(-1e3_f32..1e3, 40),
    ) {
        let reference = ReferenceFilter::new(&model, &limits(), DT_S).unwrap();
        let mut memory: Option<ReferenceMemory> = None;
        for (&x, &v) in positions.iter().zip(&speeds) {
            let mut setpoint = Setpoint::default();
            (setpoint.position_m, setpoint.velocity_m_s) = (Vector3::repeat(x), Vector3::repeat(v));
            (setpoint.acceleration_m_s2, setpoint.yaw_rad) = (Vector3::repeat(-v), 1e-2 * x);
            let (position_m, velocity_m_s) = (Vector3::repeat(v), Vector3::repeat(-v));
            let mut state = State { position_m, velocity_m_s, ..State::default() };
            state.attitude_rad.z = -v;
            let memory = memory.get_or_insert_with(|| reference.start(&state, &setpoint));
            let tracked = reference.advance(memory, &state, &setpoint);
            let sum = tracked.position_m.sum() + tracked.velocity_m_s.sum() + tracked.acceleration_m_s2.sum()
                + tracked.jerk_m_s3.sum() + tracked.yaw_rad + tracked.yaw_rate_rad_s + tracked.yaw_acceleration_rad_s2;
            prop_assert!(sum.is_finite(), "{tracked:?}");
        }
    }
}

/// Within the limits the model is (s + w)^3: the exact response to a step of the setpoint.
#[test]
fn a_small_jump_decays_as_the_model_says() {
    let w = 6.0_f64;
    let model = ReferenceModel { reference_xy_rad_s: w as f32, ..ReferenceModel::DEFAULT };
    let reference = ReferenceFilter::new(&model, &PositionControlLimits::NONE, DT_S).unwrap();
    let (from, mut to) = (Setpoint::default(), Setpoint::default());
    to.position_m.x = 0.5;
    let mut memory = reference.start(&on(&from), &from);
    let mut tracked = reference.advance(&mut memory, &on(&from), &from);
    for step in 0..2000 {
        tracked = reference.advance(&mut memory, &on(&tracked), &to);
        let t = w * f64::from(step) * f64::from(DT_S);
        let exact = 0.5 * (1.0 - (1.0 + t + 0.5 * t * t) * (-t).exp());
        assert!((f64::from(tracked.position_m.x) - exact).abs() < 3e-3, "{} instead of {exact}", tracked.position_m.x);
    }
    assert_eq!((tracked.position_m.y, tracked.yaw_rad), (0.0, 0.0));
}

/// A single bandwidth is enough for a model.
#[test]
fn each_bandwidth_makes_a_model() {
    let none = ReferenceModel::DEFAULT;
    for model in [
        ReferenceModel { reference_xy_rad_s: 1.0, ..none },
        ReferenceModel { reference_z_rad_s: 1.0, ..none },
        ReferenceModel { reference_yaw_rad_s: 1.0, ..none },
    ] {
        assert!(ReferenceFilter::new(&model, &PositionControlLimits::NONE, DT_S).is_some(), "{model:?}");
    }
}

/// Without bandwidths there is no model; a coordinate without a bandwidth is tracked exactly.
#[test]
fn no_bandwidth_is_no_model() {
    assert!(ReferenceFilter::new(&ReferenceModel::DEFAULT, &PositionControlLimits::NONE, DT_S).is_none());
    let only_yaw = ReferenceModel { reference_yaw_rad_s: 5.0, ..ReferenceModel::DEFAULT };
    let reference = ReferenceFilter::new(&only_yaw, &PositionControlLimits::NONE, DT_S).unwrap();
    let mut memory = reference.start(&State::default(), &Setpoint::default());
    let far = Setpoint { position_m: Vector3::new(1.0, -2.0, 3.0), yaw_rad: 1.0, ..Setpoint::default() };
    let tracked = reference.advance(&mut memory, &State::default(), &far);
    assert_eq!(tracked.position_m, far.position_m);
    assert!(tracked.yaw_rad.abs() < 1e-6, "{}", tracked.yaw_rad);
}
