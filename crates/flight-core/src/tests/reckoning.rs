//! Compares dead reckoning, observer and descent without a position with the differential equations in their modules'
//! documentation, solved in closed form or in double precision.
#![allow(clippy::expect_used, reason = "a test that cannot go on should say why")]

use super::std::vec;
use crate::Stamped;
use crate::dead_reckoning::{DESCENT_THRUST, DeadReckoning, HOLD_RAD_S, INNOVATION_MAX_RAD_S, Reckoning, TRIM_S};
use crate::descent::{Descent, Drift, SINK_M_S};
use crate::motor::Response;
use crate::observer::{
    ATTITUDE_RAD_S, LATE_US, OUTLIER, OUTLIERS_MAX, POSITION_RAD_S, PUSH_MAX_M_S2, PoseObserver, SIGMAS_MAX, TRIM_SHARE,
};
use afbc_types::{Inputs, Parameters, Pose, PoseSigmas, State};
use nalgebra::{Rotation3, UnitQuaternion, Vector2, Vector3};
use proptest::prelude::*;

const DT_S: f32 = 1e-3;

/// Returns a vehicle that responds differently about each axis.
fn parameters() -> Parameters<f32> {
    Parameters { inertia_kg_m2: Vector3::new(0.004, 0.007, 0.012), arm_m: 0.2, ..Parameters::PAPER.to_f32() }
}

fn dead_reckoning() -> DeadReckoning {
    DeadReckoning::new(&parameters(), &Response::DEFAULT, DT_S)
}

fn weight_n() -> f32 {
    let Parameters { mass_kg, gravity_m_s2, .. } = parameters();
    mass_kg * gravity_m_s2
}

/// Returns l/Ix, l/Iy, (d/b)/Iz \[rad/s2 per N\].
fn authority() -> Vector3<f32> {
    let Parameters { inertia_kg_m2: i, arm_m: l, drag_factor_n_m_s2: d, thrust_factor_n_s2: b, .. } = parameters();
    Vector3::new(l / i.x, l / i.y, d / b / i.z)
}

fn hover() -> Inputs {
    Inputs { thrust_n: weight_n(), ..Inputs::default() }
}

fn pair(most: f32) -> impl Strategy<Value = Vector2<f32>> {
    (-most..most, -most..most).prop_map(|(x, y)| Vector2::new(x, y))
}

fn triple(most: f32) -> impl Strategy<Value = Vector3<f32>> {
    (-most..most, -most..most, -most..most).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

fn any_state() -> impl Strategy<Value = State> {
    (triple(5.0), triple(3.0), triple(0.7), triple(2.0)).prop_map(
        |(position_m, velocity_m_s, attitude_rad, rates_rad_s)| State {
            position_m,
            velocity_m_s,
            attitude_rad,
            rates_rad_s,
        },
    )
}

// --- Blind flight. ---

#[test]
fn a_reckoning_begins_as_measured_and_trimmed_for_the_weight() {
    let mut state = State { rates_rad_s: Vector3::new(0.3, -0.4, 0.5), ..State::default() };
    state.attitude_rad = Vector3::new(0.1, -0.2, 1.0);
    let reckoning = dead_reckoning().start(&state);
    let (angle_rad, rate_rad_s) = (Vector2::new(0.1, -0.2), Vector2::new(0.3, -0.4));
    let acting_n = Vector2::zeros();
    assert_eq!(reckoning, Reckoning { held_rad: angle_rad, angle_rad, rate_rad_s, acting_n, trim: hover() });
}

proptest! {
    /// With constant inputs, roll and pitch follow the closed solution of their equation.
    #[test]
    fn dead_reckoning_solves_its_equation(
        start in any_state(), asked_n in pair(0.5), trim_n in pair(0.3), ticks in 1..300u32,
        lag in 0.005..0.2_f32,
    ) {
        let dead_reckoning = DeadReckoning::new(&parameters(), &Response { time_constant_s: lag }, DT_S);
        let mut reckoning = dead_reckoning.start(&start);
        (reckoning.trim.roll_n, reckoning.trim.pitch_n) = (trim_n.x, trim_n.y);
        let applied = Inputs { roll_n: asked_n.x, pitch_n: asked_n.y, yaw_n: 9.0, thrust_n: 7.0 };
        for _ in 0..ticks {
            dead_reckoning.advance(&mut reckoning, &applied);
        }
        let t = ticks as f32 * DT_S;
        let lost = 1.0 - (-t / lag).exp();
        let a = authority().xy();
        let rate = (asked_n - trim_n) * t - asked_n * (lag * lost);
        let angle = (asked_n - trim_n) * (0.5 * t * t) - asked_n * (lag * t - lag * lag * lost);
        let (rate, angle) = (a.component_mul(&rate), a.component_mul(&angle));
        // Tolerance for the error of 1 ms steps.
        let step = a.component_mul(&(asked_n.abs() + trim_n.abs())).amax() * DT_S + 1e-4;
        let rates = start.rates_rad_s.xy();
        prop_assert!((reckoning.rate_rad_s - rates - rate).amax() < step);
        let expected = start.attitude_rad.xy() + rates * t + angle;
        let allowed = 1.5 * step * t + 1e-4;
        prop_assert!((reckoning.angle_rad - expected).amax() < allowed, "{reckoning:?}, not {expected:?}");
        prop_assert_eq!(reckoning.held_rad, start.attitude_rad.xy());
        prop_assert!((reckoning.acting_n - asked_n * lost).amax() < 0.03);
    }

    /// A measurement replaces the reckoned state. The trim of each axis changes by the inputs that explain the
    /// difference, but not by a jump.
    #[test]
    fn a_measurement_corrects_the_trim_by_what_was_missed(
        start in any_state(), measured in any_state(), trim_n in pair(0.3), missed in pair(0.3),
    ) {
        let dead_reckoning = dead_reckoning();
        let mut reckoning = dead_reckoning.start(&start);
        (reckoning.trim.roll_n, reckoning.trim.pitch_n, reckoning.trim.yaw_n) = (trim_n.x, trim_n.y, 0.02);
        reckoning.rate_rad_s = measured.rates_rad_s.xy() - missed;
        dead_reckoning.measure(&mut reckoning, &measured);
        let angles = measured.attitude_rad.xy();
        prop_assert_eq!((reckoning.angle_rad, reckoning.held_rad), (angles, angles));
        prop_assert_eq!(reckoning.rate_rad_s, measured.rates_rad_s.xy());
        let counts = missed.map(|missed| missed.clamp(-INNOVATION_MAX_RAD_S, INNOVATION_MAX_RAD_S));
        let expected = trim_n - counts.component_div(&authority().xy()) / TRIM_S;
        let found = Vector2::new(reckoning.trim.roll_n, reckoning.trim.pitch_n);
        prop_assert!((found - expected).amax() < 1e-6, "{found:?}, not {expected:?}");
        prop_assert_eq!((reckoning.trim.yaw_n, reckoning.trim.thrust_n), (0.02, weight_n()));
    }

    /// Thrust and yaw of the trim converge to the inputs with a time constant of 1 s, within limits.
    #[test]
    fn thrust_and_yaw_of_the_trim_are_means(thrust in -1.0..4.0f32, yaw in -0.3..0.3f32, ticks in 1..3000u32) {
        let (dead_reckoning, weight_n) = (dead_reckoning(), weight_n());
        let mut reckoning = dead_reckoning.start(&State::default());
        let applied = Inputs { thrust_n: thrust * weight_n, yaw_n: yaw * weight_n, roll_n: 0.4, pitch_n: -0.4 };
        for _ in 0..ticks {
            dead_reckoning.trim(&mut reckoning, &applied);
        }
        let share = 1.0 - (-(ticks as f32) * DT_S / TRIM_S).exp();
        let thrust_n = weight_n * (1.0 + (thrust.clamp(0.0, 2.0) - 1.0) * share);
        let yaw_n = weight_n * yaw.clamp(-0.1, 0.1) * share;
        prop_assert!((reckoning.trim.thrust_n - thrust_n).abs() < 2e-3 * weight_n, "{reckoning:?}, not {thrust_n} N");
        prop_assert!((reckoning.trim.yaw_n - yaw_n).abs() < 2e-4 * weight_n, "{reckoning:?}, not {yaw_n} N");
        prop_assert_eq!((reckoning.trim.roll_n, reckoning.trim.pitch_n), (0.0, 0.0));
    }

    /// A vehicle with ideal rotors, flown by these inputs, reaches the held angles, or level, with the response of a
    /// critically damped system.
    #[test]
    fn a_blind_vehicle_is_held_critically_damped(
        start in any_state(), trim_n in pair(0.3), yaw_n in -0.1..0.1f32, held in pair(0.3), descends in any::<bool>(),
    ) {
        let dead_reckoning = dead_reckoning();
        let mut reckoning = dead_reckoning.start(&start);
        reckoning.trim = Inputs { thrust_n: 3.0, roll_n: trim_n.x, pitch_n: trim_n.y, yaw_n };
        reckoning.held_rad = held;
        let to = if descends { Vector2::zeros() } else { held };
        let (mut angle, mut rate) = (reckoning.angle_rad, reckoning.rate_rad_s);
        let (off, v, w) = (angle - to, rate, HOLD_RAD_S);
        for tick in 0..500 {
            (reckoning.angle_rad, reckoning.rate_rad_s) = (angle, rate);
            let inputs = if descends { dead_reckoning.descend(&reckoning) } else { dead_reckoning.coast(&reckoning) };
            prop_assert_eq!(inputs.yaw_n, yaw_n);
            prop_assert_eq!(inputs.thrust_n, if descends { 3.0 * DESCENT_THRUST } else { 3.0 });
            let excess_n = Vector2::new(inputs.roll_n, inputs.pitch_n) - trim_n;
            let change = authority().xy().component_mul(&excess_n);
            angle += (rate + change * (0.5 * DT_S)) * DT_S;
            rate += change * DT_S;
            let t = (tick + 1) as f32 * DT_S;
            let expected = to + (off + (v + off * w) * t) * (-w * t).exp();
            prop_assert!((angle - expected).amax() < 0.01, "{angle:?}, not {expected:?} at {t} s");
        }
    }

    /// Between two measurements, only roll, pitch and their rates are reckoned.
    #[test]
    fn between_measurements_roll_and_pitch_are_reckoned(state in any_state(), other in any_state()) {
        let between = dead_reckoning().start(&other).between(&state);
        let mix = |first: Vector3<f32>, second: Vector3<f32>| Vector3::new(second.x, second.y, first.z);
        let attitude_rad = mix(state.attitude_rad, other.attitude_rad);
        let rates_rad_s = mix(state.rates_rad_s, other.rates_rad_s);
        prop_assert_eq!(between, State { attitude_rad, rates_rad_s, ..state });
    }
}

// --- Descent without a position. ---

#[test]
fn a_descent_sinks_straight_down() {
    let mut state = State { position_m: Vector3::new(1.0, -2.0, 5.0), ..State::default() };
    (state.velocity_m_s, state.attitude_rad) = (Vector3::new(1.0, 2.0, 3.0), Vector3::new(0.1, 0.2, 0.3));
    let mut descent = Descent::new(&state);
    for _ in 0..2000 {
        descent.advance(DT_S);
    }
    let setpoint = descent.setpoint();
    assert!((setpoint.position_m - Vector3::new(1.0, -2.0, 5.0 - 2.0 * SINK_M_S)).amax() < 1e-3);
    assert_eq!(setpoint.velocity_m_s, Vector3::new(0.0, 0.0, -SINK_M_S));
    assert_eq!((setpoint.acceleration_m_s2, setpoint.yaw_rad, setpoint.yaw_rate_rad_s), (Vector3::zeros(), 0.3, 0.0));
}

proptest! {
    /// The shown velocity starts at the estimate's and fades with 2 s; the shown distance fades with an additional 1 s.
    /// A later change of the estimate counts less, a jump not at all. The rest of the state is unchanged.
    #[test]
    fn the_motion_of_a_vehicle_adrift_fades(
        state in any_state(), place_m in pair(50.0), change in 0.0..0.19f32, towards in -3.1..3.1f32,
        jumps in any::<bool>(),
        first in 1..3000u32, then in 1..3000u32,
    ) {
        let mut drift = Drift::new(place_m, &state);
        let direction = Vector2::new(towards.cos(), towards.sin());
        let size = if jumps { 0.21 + change } else { change };
        let mut reckoned = state;
        for _ in 0..first {
            reckoned = drift.advance(&state, DT_S);
        }
        let mut later = state;
        later.velocity_m_s.x += size * direction.x;
        later.velocity_m_s.y += size * direction.y;
        later.position_m += Vector3::new(7.0, 8.0, -0.5);
        let before = reckoned;
        for _ in 0..then {
            reckoned = drift.advance(&later, DT_S);
        }
        let (t1, t2) = (first as f32 * DT_S, then as f32 * DT_S);
        let fade = |t: f32| (-0.5 * t).exp();
        let way = |t: f32| 2.0 * (fade(t) - (-t).exp());
        let begin = state.velocity_m_s.xy();
        let changed = if jumps { Vector2::zeros() } else { direction * (size * fade(t1)) };
        let velocity = begin * fade(t1 + t2) + changed * fade(t2);
        prop_assert!((reckoned.velocity_m_s.xy() - velocity).amax() < 0.01, "{reckoned:?}, not {velocity:?}");
        let position = place_m + begin * way(t1 + t2) + changed * way(t2);
        prop_assert!((reckoned.position_m.xy() - position).amax() < 0.01, "{reckoned:?}, not {position:?}");
        prop_assert!((before.velocity_m_s.xy() - begin * fade(t1)).amax() < 0.01);
        let vertical =
            |state: &State| (state.position_m.z, state.velocity_m_s.z, state.attitude_rad, state.rates_rad_s);
        prop_assert_eq!(vertical(&reckoned), vertical(&later));
    }
}

/// Many small changes add up in any direction. A jump does not count, but changes after it do.
#[test]
fn a_jump_of_the_estimate_is_no_motion() {
    let reckoned = |steps: &[[f32; 2]]| {
        let mut state = State::default();
        let mut drift = Drift::new(Vector2::zeros(), &state);
        for [x, y] in steps {
            state.velocity_m_s += Vector3::new(*x, *y, 0.0);
            state = State { velocity_m_s: state.velocity_m_s, ..State::default() };
            let _ = drift.advance(&state, DT_S);
        }
        drift.advance(&state, DT_S).velocity_m_s
    };
    assert!((reckoned(&[[0.1, -0.1]; 5]) - Vector3::new(0.5, -0.5, 0.0)).amax() < 0.01);
    assert!((reckoned(&[[0.19, 0.0]]) - Vector3::new(0.19, 0.0, 0.0)).amax() < 0.001);
    for jump in [[0.21, 0.0], [0.0, -0.21], [0.15, 0.15], [3.0, 0.0]] {
        assert_eq!(reckoned(&[jump]), Vector3::zeros(), "{jump:?}");
        assert!((reckoned(&[jump, [0.05, 0.1]]) - Vector3::new(0.05, 0.1, 0.0)).amax() < 0.001, "{jump:?}");
    }
}

// --- The observer. ---

/// The vehicle in the observer's documentation, in double precision, with rotation matrices, in steps of 10 us.
struct Truth {
    position_m: Vector3<f64>,
    velocity_m_s: Vector3<f64>,
    attitude: Rotation3<f64>,
    rates_rad_s: Vector3<f64>,
    /// Lagged thrust T_a and inputs U_a about every axis \[N\].
    thrust_n: f64,
    acting_n: Vector3<f64>,
}

impl Truth {
    /// Flies for 1 ms.
    fn fly(&mut self, applied: &Inputs, trim: &Inputs) {
        let (weight_n, gravity, dt, lag) = (f64::from(weight_n()), f64::from(parameters().gravity_m_s2), 1e-5, 0.02);
        let least = f64::from(TRIM_SHARE.0) * weight_n;
        let trim_n = f64::from(trim.thrust_n).clamp(least, f64::from(TRIM_SHARE.1) * weight_n);
        let axes = |inputs: &Inputs| Vector3::new(inputs.roll_n, inputs.pitch_n, inputs.yaw_n).cast::<f64>();
        for _ in 0..100 {
            self.thrust_n += (f64::from(applied.thrust_n) - self.thrust_n) / lag * dt;
            self.acting_n += (axes(applied) - self.acting_n) / lag * dt;
            let moments = authority().cast::<f64>().component_mul(&(self.acting_n - axes(trim)));
            self.rates_rad_s += moments * (weight_n / trim_n * dt);
            self.attitude *= Rotation3::new(self.rates_rad_s * dt);
            let lift = self.attitude * Vector3::z() * (self.thrust_n / trim_n * gravity);
            self.velocity_m_s += (lift - Vector3::z() * gravity) * dt;
            self.position_m += self.velocity_m_s * dt;
        }
    }
}

/// Returns the angle between two attitudes \[rad\].
fn angle_between(state: &State, attitude: &UnitQuaternion<f32>) -> f32 {
    let turn = state.quaternion().conjugate() * attitude;
    2.0 * turn.imag().norm()
}

/// Returns the pose of a state.
fn pose_of(state: &State, at_us: u64) -> Stamped<Pose> {
    Stamped { value: Pose::of(state, PoseSigmas::UNKNOWN), at_us }
}

proptest! {
    /// Without poses, the observer predicts the documented vehicle's motion, for any inputs, trim and attitude. Rotors
    /// that need more than the weight to hover count as weaker, within the accepted range.
    #[test]
    fn the_prediction_solves_its_equations(
        start in any_state(),
        yaw_rad in -3.1..3.1f32,
        inputs in prop::collection::vec((0.5..1.6f32, triple(0.08)), 1..6),
        trim_share in 0.2..3.0f32,
        trim in triple(0.03),
    ) {
        let dead_reckoning = dead_reckoning();
        let start = State { attitude_rad: Vector3::new(start.attitude_rad.x, start.attitude_rad.y, yaw_rad), ..start };
        let weight_n = weight_n();
        let trim = Inputs { thrust_n: trim_share * weight_n, roll_n: trim.x, pitch_n: trim.y, yaw_n: trim.z };
        let first = Inputs { thrust_n: 1.1 * weight_n, yaw_n: 0.05, ..Inputs::default() };
        let mut reckoning = Reckoning { trim, ..dead_reckoning.start(&start) };
        let mut observer = PoseObserver::new(&start, &first, 0);
        let mut truth = Truth {
            position_m: start.position_m.cast(),
            velocity_m_s: start.velocity_m_s.cast(),
            attitude: start.quaternion().to_rotation_matrix().cast(),
            rates_rad_s: start.rates_rad_s.cast(),
            thrust_n: first.thrust_n.into(),
            acting_n: Vector3::new(0.0, 0.0, first.yaw_n.into()),
        };
        for (thrust, axes) in inputs {
            let [[roll_n, pitch_n, yaw_n]] = axes.data.0;
            let applied = Inputs { thrust_n: thrust * weight_n, roll_n, pitch_n, yaw_n: 3.0 * yaw_n };
            for _ in 0..40 {
                observer.advance(&dead_reckoning, &reckoning, &applied);
                dead_reckoning.advance(&mut reckoning, &applied);
                truth.fly(&applied, &trim);
            }
        }
        let state = observer.state().expect("plausible");
        let attitude = UnitQuaternion::from_rotation_matrix(&truth.attitude.cast::<f32>());
        // The tolerance covers 1 ms steps with a lag of 20 ms.
        let spun = (truth.rates_rad_s.cast::<f32>() - start.rates_rad_s).norm();
        let off = (state.rates_rad_s - truth.rates_rad_s.cast::<f32>()).norm();
        prop_assert!(off < 0.02 + 0.03 * spun, "{state:?}, not {:?}", truth.rates_rad_s);
        prop_assert!(angle_between(&state, &attitude) < 0.02, "{state:?}, not {attitude:?}");
        let off_m_s = (state.velocity_m_s - truth.velocity_m_s.cast::<f32>()).amax();
        let sped_m_s = (truth.velocity_m_s.cast::<f32>() - start.velocity_m_s).norm();
        prop_assert!(off_m_s < 0.02 + 0.02 * sped_m_s, "{state:?}, not {:?}", truth.velocity_m_s);
        let off_m = (state.position_m - truth.position_m.cast::<f32>()).amax();
        prop_assert!(off_m < 0.01 + 0.005 * sped_m_s, "{state:?}, not {:?}", truth.position_m);
    }

    /// A pose equal to the prediction for its own time changes nothing, however late it is.
    #[test]
    fn a_late_pose_is_compared_with_the_prediction_for_its_time(
        start in any_state(), thrust in 0.6..1.5f32, late_ms in 0..=u64::from(LATE_US / 1000), axes in triple(0.05),
    ) {
        let dead_reckoning = dead_reckoning();
        let trim = hover();
        let applied = Inputs { thrust_n: thrust * weight_n(), roll_n: axes.x, pitch_n: axes.y, yaw_n: axes.z };
        let mut reckoning = Reckoning { trim, acting_n: axes.xy(), ..dead_reckoning.start(&start) };
        // The rotors have reached their commands: accelerations are constant except for the rotation.
        let mut observer = PoseObserver::new(&start, &applied, 0);
        let mut was = vec![start];
        let now_ms = 60;
        for _ in 0..now_ms {
            observer.advance(&dead_reckoning, &reckoning, &applied);
            dead_reckoning.advance(&mut reckoning, &applied);
            was.push(observer.state().expect("plausible"));
        }
        let before = observer.state().expect("plausible");
        let then = was.iter().rev().nth(late_ms as usize).expect("recorded");
        observer.correct(&pose_of(then, (now_ms - late_ms) * 1000), now_ms * 1000);
        let after = observer.state().expect("plausible");
        // The prediction neglects that the acceleration turns with the vehicle within 50 ms; the tolerance covers this.
        prop_assert!((after.position_m - before.position_m).amax() < 2e-3, "{after:?}, not {before:?}");
        prop_assert!((after.velocity_m_s - before.velocity_m_s).amax() < 0.02, "{after:?}, not {before:?}");
        prop_assert!(angle_between(&before, &after.quaternion()) < 2e-3, "{after:?}, not {before:?}");
        prop_assert!((after.rates_rad_s - before.rates_rad_s).amax() < 0.05, "{after:?}, not {before:?}");
    }

    /// A pose corrects by the documented shares of the difference, for any time between two poses. A late pose also
    /// corrects the position by the change of velocity since.
    #[test]
    fn a_pose_corrects_by_the_shares_of_the_fading_memory(
        start in any_state(), off_m in triple(0.015), turn_rad in triple(0.015), flipped in any::<bool>(),
        since_us in 200..60_000u64, late_us in 0..=u64::from(LATE_US),
    ) {
        let dead_reckoning = dead_reckoning();
        let mut start = State { rates_rad_s: Vector3::zeros(), velocity_m_s: Vector3::zeros(), ..start };
        start.attitude_rad = Vector3::new(0.0, 0.0, start.attitude_rad.z);
        let mut observer = PoseObserver::new(&start, &hover(), 100_000);
        let at_us = 100_000 + since_us;
        let turn = UnitQuaternion::from_scaled_axis(turn_rad);
        let attitude = start.quaternion() * turn;
        let sign = if flipped { -1.0 } else { 1.0 };
        let attitude = [attitude.w * sign, attitude.i * sign, attitude.j * sign, attitude.k * sign];
        let pose = Pose { position_m: start.position_m + off_m, attitude, ..Pose::default() };
        observer.correct(&Stamped { value: pose, at_us }, at_us + late_us);
        let seen = observer.state().expect("plausible");
        let (t, late_s) = (since_us.max(1_000) as f32 * 1e-6, late_us as f32 * 1e-6);
        let beta = 1.0 / (1.0 + POSITION_RAD_S * t);
        let velocity = off_m * (1.5 * (1.0 - beta).powi(2) * (1.0 + beta) / t);
        let position = start.position_m + off_m * (1.0 - beta.powi(3)) + velocity * late_s;
        let allowed = 1e-5 + 1e-3 * velocity.amax();
        prop_assert!((seen.velocity_m_s - velocity).amax() < allowed, "{seen:?}, not {velocity:?}");
        prop_assert!((seen.position_m - position).amax() < 5e-6, "{seen:?}, not {position:?}");
        let beta = 1.0 / (1.0 + ATTITUDE_RAD_S * t);
        let rates = turn_rad * ((1.0 - beta).powi(2) / t);
        let turned = turn_rad * (1.0 - beta * beta) + rates * late_s;
        prop_assert!((seen.rates_rad_s - rates).amax() < 1e-4 + 2e-3 * rates.amax(), "{seen:?}, not {rates:?}");
        let expected = start.quaternion() * UnitQuaternion::from_scaled_axis(turned);
        prop_assert!(angle_between(&seen, &expected) < 2e-4, "{seen:?}, not {expected:?}");
        // d shows in the next step, together with the effect of the small tilt.
        let push = off_m * ((1.0 - 1.0 / (1.0 + POSITION_RAD_S * t)).powi(3) / (t * t));
        observer.advance(&dead_reckoning, &dead_reckoning.start(&start), &hover());
        let tilt = observer.state().expect("plausible").quaternion() * Vector3::z() - Vector3::z();
        let change = (observer.state().expect("plausible").velocity_m_s - seen.velocity_m_s) / DT_S;
        let expected = push + tilt * parameters().gravity_m_s2;
        prop_assert!((change - expected).amax() < 0.01, "{change:?}, not {expected:?}");
    }
}

/// An outlier along or about any axis counts as the largest accepted difference. The third in a row is followed. A good
/// pose in between resets the count.
#[test]
fn an_outlier_counts_little_until_it_repeats() {
    let (period_us, hold) = (10_000_u64, State::default());
    let most = OUTLIER.0 + OUTLIER.1 * period_us as f32 * 1e-6;
    let after = |offs: &[State]| {
        let mut observer = PoseObserver::new(&hold, &hover(), 0);
        for (index, off) in offs.iter().enumerate() {
            let now_us = (index as u64 + 1) * period_us;
            observer.correct(&pose_of(off, now_us), now_us);
        }
        observer.state().expect("plausible")
    };
    for axis in 0..6 {
        for sign in [1.0, -1.0] {
            let off = |size: f32| {
                let mut state = hold;
                let vector = if axis < 3 { &mut state.position_m } else { &mut state.attitude_rad };
                vector.iter_mut().nth(axis % 3).into_iter().for_each(|value| *value = sign * size);
                state
            };
            let far = off(20.0 * most);
            let (one, least) = (after(&[far]), after(&[off(most * 0.999)]));
            let moved = |seen: &State| (seen.position_m.amax(), seen.attitude_rad.amax(), seen.velocity_m_s.amax());
            let (far_m, far_rad, far_m_s) = moved(&one);
            let (least_m, least_rad, least_m_s) = moved(&least);
            let close = |a: f32, b: f32| (a - b).abs() < 2e-3 * b.abs() + 1e-5;
            assert!(close(far_m, least_m) && close(far_m_s, least_m_s), "axis {axis}: {one:?}, not {least:?}");
            // A large rotation is compared by its sine.
            assert!(close(far_rad, least_rad), "axis {axis}: {one:?}, not {least:?}");
            let twice = after(&[far; 2]);
            let where_it_is = |seen: &State| seen.position_m.amax().max(seen.attitude_rad.amax());
            assert!(where_it_is(&twice) < 3.0 * most, "axis {axis}: {twice:?}");
            let followed = after(&[far; OUTLIERS_MAX as usize]);
            let (reached, wanted) = (where_it_is(&followed), where_it_is(&far));
            // A large turn is set to first order only: hence the wide tolerance.
            assert!((reached - wanted).abs() < if axis < 3 { 1e-4 } else { 0.3 * wanted }, "axis {axis}: {followed:?}");
            let interrupted = after(&[far, far, hold, far, far]);
            assert!(where_it_is(&interrupted) < 6.0 * most, "axis {axis}: {interrupted:?}");
            // After the third outlier, the count restarts at the present pose.
            let back = after(&[far, far, far, hold, hold]);
            assert!(where_it_is(&back) > 10.0 * most, "axis {axis}: {back:?}");
        }
    }
}

/// The disturbance is limited along each axis.
#[test]
fn the_push_is_limited() {
    let (dead_reckoning, hold) = (dead_reckoning(), State::default());
    let mut observer = PoseObserver::new(&hold, &hover(), 0);
    for index in 1..200u64 {
        // Poses always ahead of the vehicle, but not by an outlier.
        let mut ahead = observer.state().expect("plausible");
        ahead.position_m += Vector3::new(0.04, -0.04, 0.04);
        observer.correct(&pose_of(&ahead, index * 10_000), index * 10_000);
    }
    let before = observer.state().expect("plausible").velocity_m_s;
    observer.advance(&dead_reckoning, &dead_reckoning.start(&hold), &hover());
    let change = (observer.state().expect("plausible").velocity_m_s - before) / DT_S;
    let limit = PUSH_MAX_M_S2;
    assert!((change - Vector3::new(limit, -limit, limit)).amax() < 0.05 * limit, "{change:?}");
}

#[test]
fn poses_that_are_late_unsure_old_or_repeated_are_not_used() {
    let sigmas = |position_m, attitude_rad| PoseSigmas { position_m, attitude_rad };
    let at = |sigmas: PoseSigmas| Stamped { value: Pose { sigmas, ..Pose::default() }, at_us: 1_000_000 };
    let now_us = 1_000_000 + u64::from(LATE_US);
    assert!(PoseObserver::takes(&at(PoseSigmas::UNKNOWN), now_us));
    assert!(!PoseObserver::takes(&at(PoseSigmas::UNKNOWN), now_us + 1), "late");
    assert!(!PoseObserver::takes(&at(PoseSigmas::UNKNOWN), 999_999), "from the future");
    let (most_m, most_rad) = SIGMAS_MAX;
    assert!(PoseObserver::takes(&at(sigmas(Some(most_m), Some(most_rad))), now_us));
    assert!(!PoseObserver::takes(&at(sigmas(Some(most_m * 1.01), Some(most_rad))), now_us), "position");
    assert!(!PoseObserver::takes(&at(sigmas(None, Some(most_rad * 1.01))), now_us), "attitude");

    let mut observer = PoseObserver::new(&State::default(), &hover(), 500_000);
    let moved = Pose { position_m: Vector3::new(0.01, 0.0, 0.0), ..Pose::default() };
    let pose = |at_us| Stamped { value: moved, at_us };
    assert!(observer.is_news(&pose(500_001)) && !observer.is_news(&pose(500_000)) && !observer.is_news(&pose(1)));
    observer.correct(&pose(510_000), 510_000);
    assert_eq!((observer.age_us(510_000), observer.age_us(540_000)), (0, 30_000));
    assert!(!observer.is_news(&pose(520_000)), "repeated");
    let other = Stamped { value: Pose::default(), at_us: 520_000 };
    assert!(observer.is_news(&other) && !observer.is_news(&Stamped { at_us: 510_000, ..other }));
}
