//! Compares the disturbance observer with its closed solution, and checks which effects it must not see as a
//! disturbance.

use crate::common::measured;
use afbc::Settings;
use afbc::disturbance::{
    ACCELERATION_MAX_M_S2, DisturbanceObserver, ForceObserver, ForceObserverMemory, ObserverConditions, UNSEEN_S,
};
use afbc_control::Settings as Common;
use afbc_control::drag::KnownDrag;
use afbc_types::{Parameters, State};
use nalgebra::Vector3;
use proptest::prelude::*;

const DT_S: f32 = 0.001;
/// Largest difference of the velocity that is no jump \[m/s\].
const JUMP_M_S: f32 = ACCELERATION_MAX_M_S2 * UNSEEN_S;

fn observer(disturbance_rad_s: f32) -> ForceObserver {
    let settings = DisturbanceObserver { disturbance_rad_s, ..DisturbanceObserver::DEFAULT };
    ForceObserver::new(&settings, &Common::DEFAULT, &Parameters::PAPER.to_f32()).unwrap().unwrap()
}

fn conditions(fresh: bool, touches_ground: bool) -> ObserverConditions {
    ObserverConditions { fresh, touches_ground }
}

fn weight_n() -> f32 {
    Parameters::PAPER.to_f32().weight_n()
}

/// A flying vehicle with this attitude, whose thrust would hold it in hover.
struct Body {
    state: State,
    memory: Option<ForceObserverMemory>,
    /// Learnt hover thrust, which is also the commanded thrust \[N\].
    hover_n: f32,
}

impl Body {
    fn new(attitude_rad: Vector3<f32>, hover_n: f32) -> Self {
        Body { state: State { attitude_rad, ..State::default() }, memory: None, hover_n }
    }

    /// Returns R e_z from the attitude by the textbook formula.
    fn up(&self) -> Vector3<f32> {
        let [phi, theta, psi] = self.state.attitude_rad.map(f64::from).into();
        let (sin_phi, cos_phi, sin_theta, cos_theta) = (phi.sin(), phi.cos(), theta.sin(), theta.cos());
        let x = psi.cos() * sin_theta * cos_phi + psi.sin() * sin_phi;
        let y = psi.sin() * sin_theta * cos_phi - psi.cos() * sin_phi;
        Vector3::new(x, y, cos_theta * cos_phi).cast()
    }

    /// Flies one step with the hover thrust and this disturbance, and returns the observer's output.
    fn step(&mut self, observer: &ForceObserver, f_m_s2: [f32; 2]) -> Vector3<f32> {
        let up = self.up();
        let seen = observer.advance(&mut self.memory, &self.state, &up, self.hover_n, conditions(true, false));
        observer.record_thrust(&mut self.memory, self.hover_n);
        let up = up * 9.81;
        self.state.velocity_m_s += Vector3::new(up.x + f_m_s2[0], up.y + f_m_s2[1], 0.0) * DT_S;
        seen
    }
}

/// For a constant f, f_hat is f behind two poles at w.
#[test]
fn a_constant_disturbance_is_found_as_two_poles_say() {
    for w in [5.0, 28.7, 60.0] {
        // Small enough that v - v_hat is no jump: at most f/(e w).
        let (observer, f) = (observer(w), [0.1 * w, -0.03 * w]);
        let mut body = Body::new(Vector3::zeros(), weight_n());
        for step in 0..2000_u16 {
            let seen = body.step(&observer, f);
            let wt = w * f32::from(step) * DT_S;
            let expected = 1.0 - (1.0 + wt) * (-wt).exp();
            for (seen, f) in seen.iter().zip(f) {
                assert!((seen - f * expected).abs() < 0.04 * f.abs(), "{w} rad/s, step {step}: {seen}");
            }
        }
    }
}

/// Neither tilt nor weak rotors look like a disturbance: the acceleration by tilt is known at any heading, and the
/// weakness is in the learnt hover thrust.
#[test]
fn what_the_rotors_do_is_no_disturbance() {
    let observer = observer(28.7);
    for (phi, theta, psi) in [(0.3, 0.0, 0.0), (0.0, -0.4, 1.0), (0.2, 0.3, -2.5), (-0.5, 0.1, 3.0)] {
        for hover in [1.0, 1.67] {
            let mut body = Body::new(Vector3::new(phi, theta, psi), hover * weight_n());
            // The thrust estimate starts at the weight.
            for _ in 0..600 {
                body.step(&observer, [0.0; 2]);
            }
            for _ in 0..300 {
                let seen = body.step(&observer, [0.0; 2]);
                assert!(seen.iter().all(|f| f.abs() < 0.02), "{phi} {theta} {psi}, {hover}: {seen:?}");
            }
        }
    }
}

/// A jump of the state, as after an outage, changes nothing.
#[test]
fn a_jump_is_no_disturbance() {
    let observer = observer(28.7);
    let mut body = Body::new(Vector3::zeros(), weight_n());
    for _ in 0..1000 {
        body.step(&observer, [1.0, 0.0]);
    }
    let before = body.step(&observer, [1.0, 0.0]);
    body.state.velocity_m_s += Vector3::new(-5.0 * JUMP_M_S, 2.0 * JUMP_M_S, 0.0);
    for _ in 0..100 {
        let seen = body.step(&observer, [1.0, 0.0]);
        let off = (seen - before).abs().max();
        assert!(off < 0.02, "{seen:?}, {before:?} before");
    }
}

/// Up to a noise of 10 cm/s, f is found. Up to 6 cm/s the noise of f_hat is no larger than at 1 cm/s.
#[test]
fn noise_of_the_velocity_does_not_become_a_force() {
    let observer = observer(28.7);
    let rms = |noise_m_s: f32| {
        let mut state = 54_u32;
        // Twelve uniform numbers make a nearly normal one.
        let mut white = || {
            let uniform = |_| {
                state ^= state << 13;
                state ^= state >> 17;
                state ^= state << 5;
                state as f32 / 2.0_f32.powi(32) - 0.5
            };
            (0..12).map(uniform).sum::<f32>() * noise_m_s
        };
        let mut body = Body::new(Vector3::zeros(), weight_n());
        let (mut squares, mut mean) = (0.0_f32, 0.0_f32);
        for step in 0..20_000 {
            let noise = Vector3::new(white(), white(), 0.0);
            body.state.velocity_m_s += noise;
            let seen = body.step(&observer, [1.0, -0.5]);
            body.state.velocity_m_s -= noise;
            if step >= 5_000 {
                squares += (seen.x - 1.0).powi(2) / 15_000.0;
                mean += seen.x / 15_000.0;
            }
        }
        assert!((mean - 1.0).abs() < 0.05, "{noise_m_s} m/s: {mean} m/s2");
        squares.sqrt()
    };
    let quiet = rms(0.01);
    assert!((0.01..0.1).contains(&quiet), "{quiet}");
    for (noise_m_s, most) in [(0.02, 1.2), (0.04, 1.2), (0.06, 1.2), (0.1, 1.2)] {
        let noisy = rms(noise_m_s);
        assert!(noisy < most * quiet, "{noise_m_s} m/s: {noisy} m/s2, {quiet} m/s2 at 1 cm/s");
    }
}

/// A vehicle that moves along z, with the observer along z alone.
struct Lift {
    observer: ForceObserver,
    memory: Option<ForceObserverMemory>,
    /// True velocities along z, newest last \[m/s\].
    velocities: Vec<f32>,
}

impl Lift {
    fn new() -> Self {
        let settings =
            DisturbanceObserver { disturbance_z_rad_s: 30.0, disturbance_lag_s: 0.0, ..DisturbanceObserver::DEFAULT };
        let observer = ForceObserver::new(&settings, &Common::DEFAULT, &Parameters::PAPER.to_f32()).unwrap().unwrap();
        Lift { observer, memory: None, velocities: vec![0.0] }
    }

    /// Flies one step with `share` of the weight as thrust, from rotors that give `strength` of it, in an upward force.
    /// The measured velocity is `late` steps old. Returns f along z.
    fn step(&mut self, [share, strength, f_m_s2]: [f32; 3], late: usize) -> f32 {
        let now = self.velocities.len() - 1;
        let velocity_m_s = Vector3::new(0.0, 0.0, self.velocities[now.saturating_sub(late)]);
        let (state, up) = (State { velocity_m_s, ..State::default() }, Vector3::z());
        let hover_n = self.observer.hover_thrust_n(&self.memory).unwrap_or(weight_n());
        let seen = self.observer.advance(&mut self.memory, &state, &up, hover_n, conditions(true, false));
        self.observer.record_thrust(&mut self.memory, share * weight_n());
        self.velocities.push(self.velocities[now] + DT_S * (9.81 * (share * strength - 1.0) + f_m_s2));
        seen.z
    }

    fn softness(&self) -> f32 {
        self.memory.unwrap().softness()
    }
}

/// Along z, f counteracts weak rotors at once, and the hover thrust takes the weakness over. Their sum is what a hover
/// needs.
#[test]
fn the_hover_thrust_is_learnt_from_the_observed_force() {
    for strength in [0.6_f32, 0.9, 1.2] {
        let mut flight = Lift::new();
        let (mut share, mut f) = (1.0, 0.0);
        for step in 0..5_000 {
            // A small motion keeps the velocity from repeating itself.
            let motion = 0.01 * (0.02 * step as f32).sin();
            f = flight.step([share + motion, strength, 0.0], 0);
            // The thrust that compensates f.
            share = 1.0 - f / 9.81;
            if step == 300 {
                assert!((share * strength - 1.0).abs() < 0.05, "{strength}: {share} after 0.3 s");
            }
        }
        let hover_n = flight.observer.hover_thrust_n(&flight.memory).unwrap();
        assert!((hover_n / weight_n() * strength - 1.0).abs() < 0.02, "{strength}: {hover_n} N");
        assert!((share * strength - 1.0).abs() < 0.02, "{strength}: {share}, {f} m/s2");
    }
}

/// While the position is lost, the velocity along z is measured all the same, so that the hover thrust converges
/// instead of following a force that nobody corrects.
#[test]
fn the_hover_thrust_does_not_run_away_without_a_position() {
    for strength in [0.8_f32, 1.2] {
        let mut flight = Lift::new();
        let mut share = 1.0;
        for step in 0..20_000 {
            // The position is lost while f_hat is at its largest.
            if step > 100 {
                flight.memory.as_mut().unwrap().hold();
            }
            let motion = 0.01 * (0.02 * step as f32).sin();
            share = 1.0 - flight.step([share + motion, strength, 0.0], 0) / 9.81;
        }
        let hover_n = flight.observer.hover_thrust_n(&flight.memory).unwrap();
        assert!((hover_n / weight_n() * strength - 1.0).abs() < 0.02, "{strength}: {hover_n} N");
    }
}

/// The force of the feet, until the ground is detected, takes little of the learnt hover thrust. Upside down, nothing
/// is learnt.
#[test]
fn the_hover_thrust_is_not_learnt_from_the_feet_or_upside_down() {
    let mut flight = Lift::new();
    for step in 0..250 {
        // The feet carry the weight.
        flight.step([0.0, 1.0, 9.81 + 0.1 * (0.3 * step as f32).sin()], 0);
    }
    let hover_n = flight.observer.hover_thrust_n(&flight.memory).unwrap();
    assert!(hover_n > 0.7 * weight_n(), "{hover_n} N");

    let mut flight = Lift::new();
    for step in 0..500 {
        let velocity_m_s = Vector3::new(0.0, 0.0, -2.0 * 9.81 * DT_S * step as f32);
        let state = State { velocity_m_s, ..State::default() };
        let (down, hover_n) = (-Vector3::z(), flight.observer.hover_thrust_n(&flight.memory).unwrap_or(weight_n()));
        flight.observer.advance(&mut flight.memory, &state, &down, hover_n, conditions(true, false));
        flight.observer.record_thrust(&mut flight.memory, 0.5 * weight_n());
    }
    assert_eq!(flight.observer.hover_thrust_n(&flight.memory), Some(weight_n()));
}

/// In noise of the velocity the observer is slower, and a strong gust is no jump of the state.
#[test]
fn a_gust_in_noise_is_found() {
    let observer = observer(40.0);
    let mut random = 1_u32;
    let mut noise = || {
        let mut sum = 0.0;
        for _ in 0..12 {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            sum += random as f32 / u32::MAX as f32;
        }
        0.04 * (sum - 6.0)
    };
    let mut body = Body::new(Vector3::zeros(), weight_n());
    for step in 0..2_000 {
        let gust_m_s2 = if step < 1_000 { 0.0 } else { 9.0 };
        let mut measured = body.state;
        measured.velocity_m_s += Vector3::new(noise(), noise(), noise());
        let up = body.up();
        let seen = observer.advance(&mut body.memory, &measured, &up, weight_n(), conditions(true, false));
        observer.record_thrust(&mut body.memory, weight_n());
        body.state.velocity_m_s.x += gust_m_s2 * DT_S;
        // Two poles at a quarter of w take 0.4 s to 90 %.
        if step > 1_500 {
            assert!(seen.x > 0.8 * 9.0, "step {step}: {seen:?}");
        }
    }
}

/// The age of the velocity shows in the motion that the thrust causes, whatever force acts beside it. New states show
/// none, and old ones soften z. An age that ends is forgotten.
#[test]
fn old_states_are_told_by_the_thrust() {
    for f_m_s2 in [0.0, 0.8] {
        for (late, range) in [(0, 0.95..=1.0), (5, 0.9..=1.0), (30, 0.45..=0.7), (40, 0.35..=0.6)] {
            let mut flight = Lift::new();
            let mut fly = |late, seconds: u32| {
                for step in 0..seconds * 1000 {
                    let t = step as f32 * DT_S;
                    let thrust = 1.0 + 0.08 * (12.0 * t).sin() + 0.05 * (19.0 * t).cos();
                    flight.step([thrust, 1.0, f_m_s2 * (1.3 * t).sin()], late);
                }
                flight.softness()
            };
            let soft = fly(late, 8);
            assert!(range.contains(&soft), "{late} ms, {f_m_s2} m/s2: {soft}");
            assert!(fly(0, 8) > 0.95, "{late} ms, {f_m_s2} m/s2");
        }
    }
}

/// A velocity that is measured every 5 to 20 ms shows the same force as one of every step.
#[test]
fn slow_velocities_show_the_same_force() {
    for period in [5_u16, 10, 20] {
        let observer = observer(20.0);
        let mut body = Body::new(Vector3::zeros(), weight_n());
        let mut measured = body.state;
        for step in 0..1_000_u16 {
            if step % period == 0 {
                measured = body.state;
            }
            let up = body.up();
            let seen = observer.advance(&mut body.memory, &measured, &up, weight_n(), conditions(true, false));
            observer.record_thrust(&mut body.memory, weight_n());
            body.state.velocity_m_s.x += 3.0 * DT_S;
            let wt = 20.0 * f32::from(step) * DT_S;
            let [early, late] = [1.35 * wt, 0.65 * wt - 20.0 * DT_S * f32::from(period)].map(|wt| {
                let wt = wt.max(0.0);
                3.0 * (1.0 - (1.0 + wt) * (-wt).exp())
            });
            assert!(
                (late - 0.1..=early + 0.1).contains(&seen.x),
                "{period} ms, step {step}: {late} {} {early}",
                seen.x
            );
        }
    }
}

/// A repeated state changes nothing, and on the ground the disturbance is zero.
#[test]
fn it_waits_for_states_and_forgets_on_the_ground() {
    let observer = observer(28.7);
    let mut body = Body::new(Vector3::zeros(), weight_n());
    for _ in 0..500 {
        body.step(&observer, [1.0, 0.0]);
    }
    let up = body.up();
    let mut look =
        |fresh, stands| observer.advance(&mut body.memory, &body.state, &up, weight_n(), conditions(fresh, stands));
    let held = look(false, false);
    assert!(held.x > 0.9);
    assert_eq!(look(false, false), held);
    assert_eq!(look(true, true), Vector3::zeros());
    assert!(look(true, false).x.abs() < 0.01);
}

/// Motion that is only dead-reckoned shows no wind: f_hat keeps its value.
#[test]
fn what_is_not_measured_is_not_observed() {
    let observer = observer(28.7);
    let mut body = Body::new(Vector3::new(0.1, -0.2, 0.5), weight_n());
    for _ in 0..1000 {
        body.step(&observer, [1.0, 0.5]);
    }
    let before = body.step(&observer, [1.0, 0.5]);
    for step in 0..500_u16 {
        body.memory.as_mut().unwrap().hold();
        body.state.velocity_m_s *= 0.99 + f32::from(step % 2) * 0.02;
        assert_eq!(body.step(&observer, [1.0, 0.5]), before);
    }
    let after = body.step(&observer, [1.0, 0.5]);
    assert!((after - before).abs().max() < 0.02, "{after:?}");
}

/// After an announced gap the observer continues from the present velocity: a difference that arose in the gap is no
/// disturbance, and a new disturbance is found as usual.
#[test]
fn it_observes_again_after_a_gap() {
    let observer = observer(28.7);
    for drift_m_s in [0.8 * JUMP_M_S, -0.8 * JUMP_M_S, 50.0 * JUMP_M_S] {
        let mut body = Body::new(Vector3::zeros(), weight_n());
        for _ in 0..1000 {
            body.step(&observer, [1.0, 0.0]);
        }
        let before = body.step(&observer, [1.0, 0.0]);
        body.memory.as_mut().unwrap().hold();
        body.state.velocity_m_s.x += drift_m_s;
        assert_eq!(body.step(&observer, [1.0, 0.0]), before);
        let after = body.step(&observer, [1.0, 0.0]);
        assert!((after.x - before.x).abs() < 5e-3, "{after:?}, {before:?} before");
        let mut found = after;
        for _ in 0..1000 {
            found = body.step(&observer, [-2.0, 0.5]);
        }
        assert!((found.x + 2.0).abs() < 0.05 && (found.y - 0.5).abs() < 0.05, "{found:?}");
    }
}

/// For a vehicle that is k times slower, the observer follows the same curve k times slower.
#[test]
fn a_slower_observer_is_the_same_on_a_slower_clock() {
    let settings =
        DisturbanceObserver { disturbance_rad_s: 20.0, disturbance_lag_s: 0.05, ..DisturbanceObserver::DEFAULT };
    let vehicle = Parameters::PAPER.to_f32();
    let slow = Settings { disturbance: settings, ..Settings::DEFAULT }.slowed(4.0, 0.2).disturbance;
    let [quick, slow] = [(&settings, DT_S), (&slow, 4.0 * DT_S)].map(|(settings, dt_s)| {
        let observer = ForceObserver::new(settings, &Common { dt_s, ..Common::DEFAULT }, &vehicle).unwrap().unwrap();
        let (mut memory, state, up) = (None, State::default(), Vector3::new(0.05_f32.sin(), 0.0, 0.05_f32.cos()));
        (0..100_u16)
            .map(|_| {
                let seen = observer.advance(&mut memory, &measured(&state), &up, weight_n(), conditions(true, false));
                // Half of the thrust is given, but the vehicle does not move, so the rotor lag matters.
                observer.record_thrust(&mut memory, 0.5 * weight_n());
                seen.x
            })
            .collect::<Vec<_>>()
    });
    for (quick, slow) in quick.into_iter().zip(slow) {
        assert!((quick - slow).abs() < 1e-4, "{quick} became {slow}");
    }
}

proptest! {
    /// f_hat stays finite and within its bound for any states.
    #[test]
    fn it_is_bounded(
        w in 0.1_f32..200.0,
        hover in 0.3_f32..5.0,
        states in prop::collection::vec((-1e3_f32..1e3, -1e3_f32..1e3, -1e3_f32..1e3, 0.0_f32..50.0), 1..200),
    ) {
        let observer = observer(w);
        let mut memory = None;
        for (velocity, angle, yaw, thrust_n) in states {
            let state = State {
                velocity_m_s: Vector3::new(velocity, -velocity, 0.0),
                attitude_rad: Vector3::new(angle, -angle, yaw),
                ..State::default()
            };
            let up = Body { state, memory: None, hover_n: hover }.up();
            let seen = observer.advance(&mut memory, &state, &up, hover, conditions(true, false));
            prop_assert!(seen.iter().all(|f| f.abs() <= ACCELERATION_MAX_M_S2), "{seen:?}");
            observer.record_thrust(&mut memory, thrust_n);
        }
    }
}

/// Known drag is in f at once, and f_hat finds only the rest.
#[test]
fn known_drag_is_f_from_the_start() {
    let drag = KnownDrag { rotor_drag_1_s: 0.4, body_drag_1_m: 0.02, rotor_height_m: 0.0 };
    let settings = DisturbanceObserver { disturbance_rad_s: 30.0, ..DisturbanceObserver::DEFAULT };
    let observer = ForceObserver::new(&settings, &Common { drag, ..Common::DEFAULT }, &Parameters::PAPER.to_f32());
    let observer = observer.unwrap().unwrap();
    let mut body = Body::new(Vector3::zeros(), weight_n());
    body.state.velocity_m_s = Vector3::new(3.0, -4.0, 0.0);
    for _ in 0..500 {
        let v = body.state.velocity_m_s;
        let f = v * -(0.4 + 0.02 * v.norm());
        let seen = body.step(&observer, [f.x, f.y]);
        assert!((seen - f).norm() < 0.02, "{seen:?}, not {f:?}");
    }
}

/// A force that depends on the velocity is remembered: when the velocity returns, the observer finds only what has
/// changed.
#[test]
fn what_was_learnt_at_a_velocity_is_remembered() {
    let settings = DisturbanceObserver { disturbance_rad_s: 30.0, memory_1_s: 2.0, ..DisturbanceObserver::DEFAULT };
    let with = ForceObserver::new(&settings, &Common::DEFAULT, &Parameters::PAPER.to_f32()).unwrap().unwrap();
    let without = ForceObserver::new(
        &DisturbanceObserver { memory_1_s: 0.0, ..settings },
        &Common::DEFAULT,
        &Parameters::PAPER.to_f32(),
    );
    let laps = [with, without.unwrap().unwrap()].map(|observer| {
        let mut memory = None;
        // Largest error of f in each lap of 6 s at up to 4 m/s.
        [(); 20].map(|()| {
            (0..6000_u16).fold(0.0_f32, |worst, step| {
                let (sin, cos) = (f32::from(step) * DT_S * core::f32::consts::TAU / 6.0).sin_cos();
                let v = Vector3::new(4.0 * sin, 3.0 * cos, 0.0);
                let f = v * -0.5;
                // The thrust makes exactly this motion with f.
                let a = Vector3::new(4.0 * cos, -3.0 * sin, 0.0) * (core::f32::consts::TAU / 6.0) - f;
                let up = Vector3::new(a.x / 9.81, a.y / 9.81, 1.0);
                let state = State { velocity_m_s: v, ..State::default() };
                let seen = observer.advance(&mut memory, &state, &up, weight_n(), conditions(true, false));
                observer.record_thrust(&mut memory, weight_n());
                worst.max((seen - f).xy().norm())
            })
        })
    });
    let [with, without] = laps;
    assert!(with[19] < 0.4 * without[19], "{with:?} with, {without:?} without");
    assert!((without[19] - without[1]).abs() < 0.05 * without[1], "{without:?}");
}
