//! Tests of the detectors of tumbling, frozen trackers and landing: thresholds on both sides, times to the tick.
#![allow(clippy::expect_used, reason = "a test that cannot go on should say why")]

use crate::fall_check::{FALL_M_S, FALL_MAX_M_S, FALL_SHARE, FallCheck};
use crate::frozen_tracker::{FrozenTrackerCheck, STANDS_SHARE, TRAVEL_M, TURN_RAD, WINDOW_US};
use crate::landing::{
    CARRIED_US, CARRY_SHARE, FROZEN_US, HOVER_US, LEFT_M, LEFT_M_S, LandDetector, SINKS_M_S, STILL_M_S, STILL_US,
    USUAL_S,
};
use crate::tumble::{LOST_US, SPIN_RAD_S, TILT_COSINE_MIN, Tumble, UPRIGHT_US};
use afbc_types::State;
use nalgebra::Vector3;
use proptest::prelude::*;

const GAP_US: u32 = 1000;

fn along(axis: usize, size: f32) -> Vector3<f32> {
    Vector3::from_fn(|row, _| if row == axis { size } else { 0.0 })
}

// --- Tumbling. ---

fn tilted(roll: f32, pitch: f32) -> State {
    State { attitude_rad: Vector3::new(roll, pitch, 1.0), ..State::default() }
}

/// Returns a state rolled to a tilt with this cosine.
fn cosine(cosine: f32) -> State {
    tilted(cosine.acos(), 0.0)
}

/// Processes this state for so many ticks. Returns true if the vehicle counts as lost.
fn last(tumble: &mut Tumble, state: &State, ticks: u32) -> bool {
    for _ in 0..ticks {
        tumble.advance(state, GAP_US);
    }
    tumble.is_lost()
}

/// Number of ticks until a tumbling vehicle is lost. The first tick starts the time.
const LOST: u32 = LOST_US / GAP_US + 2;

proptest! {
    /// A vehicle is lost exactly if it lies on its side or back for a second, at any combination of roll and pitch.
    #[test]
    fn the_tilt_decides(roll in -3.1..3.1f32, pitch in -3.1..3.1f32) {
        let upright = roll.cos() * pitch.cos() - TILT_COSINE_MIN;
        prop_assume!(upright.abs() > 1e-4);
        let mut tumble = Tumble::default();
        prop_assert!(!last(&mut tumble, &tilted(roll, pitch), LOST - 1));
        prop_assert_eq!(last(&mut tumble, &tilted(roll, pitch), 1), upright < 0.0);
    }

    /// A vehicle is lost if it spins about body x and y together, at any attitude. The rate about z does not count.
    #[test]
    fn the_spin_decides(rate in 0.0..20.0f32, about in -3.1..3.1f32, z in -50.0..50.0f32, roll in -1.0..1.0f32) {
        prop_assume!((rate - SPIN_RAD_S).abs() > 1e-3);
        let rates_rad_s = Vector3::new(rate * about.cos(), rate * about.sin(), z);
        let state = State { rates_rad_s, ..tilted(roll, 0.0) };
        prop_assert_eq!(last(&mut Tumble::default(), &state, LOST), rate > SPIN_RAD_S);
        prop_assert!(!last(&mut Tumble::default(), &state, LOST - 1));
    }
}

#[test]
fn it_is_recovered_once_it_has_been_upright_long_enough() {
    for (upright, recovered) in [(UPRIGHT_US / GAP_US, false), (UPRIGHT_US / GAP_US + 1, true)] {
        let mut tumble = Tumble::default();
        last(&mut tumble, &cosine(0.0), 400);
        assert!(!last(&mut tumble, &State::default(), upright), "not while it is upright");
        // Tips over again: its second is over, or starts again.
        assert_eq!(last(&mut tumble, &cosine(0.0), 1), !recovered);
        assert_eq!(last(&mut tumble, &cosine(0.0), LOST - 2), !recovered);
        assert!(last(&mut tumble, &cosine(0.0), 1));
    }
}

/// A vehicle that comes up from its lowest tilt gets another second, unless it spins or has tipped over again.
#[test]
fn coming_up_gives_another_second() {
    let spinning = State { rates_rad_s: Vector3::new(0.0, SPIN_RAD_S + 1.0, 0.0), ..cosine(-0.5) };
    // Each case has the lowest cosine, the state that the vehicle comes up to, and whether this counts.
    for (lowest, state, counts) in [
        (-1.0, cosine(-0.79), true),
        (-1.0, cosine(-0.81), false),
        (-0.5, cosine(-0.29), true),
        (-0.5, cosine(-0.31), false),
        (-1.0, spinning, false),
    ] {
        let mut tumble = Tumble::default();
        // The way down takes part of the second, too.
        last(&mut tumble, &cosine(0.0), 100);
        last(&mut tumble, &cosine(lowest), LOST - 200);
        last(&mut tumble, &state, 99);
        assert!(!tumble.is_lost());
        assert_eq!(last(&mut tumble, &state, 1), !counts, "from {lowest} to {:?}", state.attitude_rad);
        // The new second starts there, and is granted only once.
        assert!(!counts || !last(&mut tumble, &state, LOST - 101), "from {lowest}");
        assert!(last(&mut tumble, &state, 1));
    }
    // After a moment upright, a turn from upside down to sideways counts as tumbling again.
    let mut tumble = Tumble::default();
    last(&mut tumble, &cosine(-1.0), 300);
    last(&mut tumble, &State::default(), 100);
    last(&mut tumble, &cosine(-1.0), 300);
    assert!(!last(&mut tumble, &cosine(0.0), LOST - 701));
    assert!(last(&mut tumble, &cosine(0.0), 1));
}

/// Ticks without a state count as if the last state continued, but do not start a tumble.
#[test]
fn a_blind_tumble_goes_on() {
    let mut tumble = Tumble::default();
    (0..5000).for_each(|_| tumble.advance_blind(GAP_US));
    assert!(!last(&mut tumble, &State::default(), 1));
    last(&mut tumble, &cosine(-1.0), 1);
    (0..LOST_US / GAP_US).for_each(|_| tumble.advance_blind(GAP_US));
    assert!(!tumble.is_lost());
    tumble.advance_blind(GAP_US);
    assert!(tumble.is_lost());
    // The vehicle is upright again. It has no state for the rest of the recovery time.
    last(&mut tumble, &State::default(), 2);
    (0..UPRIGHT_US / GAP_US).for_each(|_| tumble.advance_blind(GAP_US));
    last(&mut tumble, &State::default(), 1);
    assert!(!last(&mut tumble, &cosine(-1.0), LOST - 1), "it has recovered");
    assert!(last(&mut tumble, &cosine(-1.0), 1));
}

// --- Frozen trackers. ---

/// Returns a state whose pose is not zero.
fn somewhere() -> State {
    State {
        position_m: Vector3::new(3.0, -2.0, 1.0),
        attitude_rad: Vector3::new(0.1, -0.2, 2.0),
        velocity_m_s: Vector3::zeros(),
        rates_rad_s: Vector3::zeros(),
    }
}

/// Sends states for `windows` windows, with the pose moving by the shares `moves` and `turns` of the twist. Returns
/// true if a contradiction is found.
fn contradicts(twist: &State, moves: f32, turns: f32, period_us: u32, windows: u32) -> bool {
    let (begin, begin_us) = (somewhere(), 7_000_000_u64);
    let mut witness = FrozenTrackerCheck::new(&begin, begin_us);
    (1..=windows * WINDOW_US / period_us).any(|index| {
        let after_us = index * period_us;
        let s = after_us as f32 * 1e-6;
        let state = State {
            position_m: begin.position_m + twist.velocity_m_s * (s * moves),
            attitude_rad: begin.attitude_rad + twist.rates_rad_s * (s * turns),
            ..*twist
        };
        let found = witness.contradicts(&state, begin_us + u64::from(after_us));
        assert!(!found || after_us.is_multiple_of(WINDOW_US), "only at the end of a window");
        found
    })
}

/// Returns the velocity or rate that moves this far in a window.
fn per_window(size: f32) -> f32 {
    size / (WINDOW_US as f32 * 1e-6)
}

#[test]
fn a_pose_must_follow_the_twist() {
    for period_us in [1000, 10_000, 50_000, WINDOW_US] {
        for axis in 0..3 {
            for sign in [1.0, -1.0] {
                let moves = |size: f32, share: f32| {
                    let velocity_m_s = along(axis, sign * per_window(size));
                    contradicts(&State { velocity_m_s, ..somewhere() }, share, 1.0, period_us, 4)
                };
                assert!(moves(1.02 * TRAVEL_M, 0.0) && !moves(0.98 * TRAVEL_M, 0.0), "axis {axis}, {period_us} us");
                let (below, above) = (STANDS_SHARE - 0.02, STANDS_SHARE + 0.02);
                assert!(moves(1.0, below) && !moves(1.0, above), "axis {axis}, {period_us} us");
                assert!(moves(1.0, -below) && !moves(1.0, -above) && !moves(3.0, 1.0), "axis {axis}, {period_us} us");

                let turns = |size: f32, share: f32, yaws: f32| {
                    let mut rates_rad_s = along(axis, sign * per_window(size));
                    rates_rad_s.z += per_window(yaws);
                    contradicts(&State { rates_rad_s, ..somewhere() }, 1.0, share, period_us, 4)
                };
                let tilts = axis < 2;
                assert_eq!(turns(1.02 * TURN_RAD, 0.0, 0.0), tilts, "axis {axis}, {period_us} us");
                assert!(!turns(0.98 * TURN_RAD, 0.0, 0.0), "axis {axis}, {period_us} us");
                assert_eq!(turns(1.0, below, 0.0), tilts, "axis {axis}, {period_us} us");
                assert!(!turns(1.0, above, 0.0), "axis {axis}, {period_us} us");
                // A yaw rate turns roll and pitch into each other: a large one prevents the comparison.
                if tilts {
                    assert!(turns(1.0, 0.0, 0.9 * TURN_RAD) && turns(1.0, 0.0, -0.9 * TURN_RAD));
                    assert!(!turns(1.0, 0.0, 1.1 * TURN_RAD) && !turns(1.0, 0.0, -1.1 * TURN_RAD));
                }
            }
        }
    }
}

/// A changing heading does not hide constant roll and pitch.
#[test]
fn only_roll_and_pitch_are_compared() {
    let mut witness = FrozenTrackerCheck::new(&somewhere(), 0);
    let found = (1..=250_u64).any(|ms| {
        let mut state = State { rates_rad_s: Vector3::new(1.0, 0.0, 0.0), ..somewhere() };
        state.attitude_rad.z += ms as f32 * 1e-3;
        witness.contradicts(&state, ms * 1000)
    });
    assert!(found);
}

/// After a gap longer than a window, nothing is compared with the state before it.
#[test]
fn a_gap_begins_a_window() {
    let fast = State { velocity_m_s: Vector3::new(2.0, 0.0, 0.0), ..somewhere() };
    let window_us = u64::from(WINDOW_US);
    assert!(FrozenTrackerCheck::new(&fast, 5).contradicts(&fast, 5 + window_us));
    let mut witness = FrozenTrackerCheck::new(&fast, 5);
    assert!(!witness.contradicts(&fast, 6 + window_us), "a gap");
    assert!(!witness.contradicts(&fast, 5 + 2 * window_us), "not yet a window since");
    assert!(witness.contradicts(&fast, 6 + 2 * window_us));
    // A pose that was constant in one window may move in the next.
    let mut witness = FrozenTrackerCheck::new(&somewhere(), 0);
    assert!(witness.contradicts(&fast, window_us));
    let moved = State { position_m: somewhere().position_m + Vector3::new(0.5, 0.0, 0.0), ..fast };
    assert!(!witness.contradicts(&moved, 2 * window_us));
    assert!(witness.contradicts(&moved, 3 * window_us));
}

// --- Landing. ---

const WEIGHT_N: f32 = 10.0;
const DT_S: f32 = 1e-3;

fn moving(velocity_m_s: Vector3<f32>) -> State {
    State { velocity_m_s, ..somewhere() }
}

struct Land(LandDetector);

impl Land {
    fn new() -> Self {
        Land(LandDetector::new(&somewhere(), WEIGHT_N))
    }

    /// Returns the detector of a vehicle that hovers after a climb.
    fn hovering() -> Self {
        let mut land = Land::new();
        land.run(10, &moving(along(2, 1.0)), WEIGHT_N);
        land.run(HOVER_US / GAP_US + 100, &somewhere(), WEIGHT_N);
        assert!(land.0.airborne() && !land.0.contradicts());
        land
    }

    /// Runs so many ticks. Returns true if the vehicle is in the air afterwards.
    fn run(&mut self, ticks: u32, state: &State, thrust_n: f32) -> bool {
        for _ in 0..ticks {
            self.0.advance(state, thrust_n, GAP_US, DT_S);
        }
        self.0.airborne()
    }

    /// Returns the number of ticks until it is on the ground.
    fn lands(&mut self, state: &State, thrust_n: f32) -> Option<u32> {
        (1..=5000).find(|_| !self.run(1, state, thrust_n))
    }
}

#[test]
fn it_is_in_the_air_once_it_has_been_carried() {
    let (enough_n, ticks) = (CARRY_SHARE * WEIGHT_N * 1.001, CARRIED_US / GAP_US);
    let mut land = Land::new();
    assert!(!land.run(ticks - 1, &somewhere(), enough_n));
    assert!(land.run(1, &somewhere(), enough_n));
    // The time must not be interrupted.
    let mut land = Land::new();
    land.run(ticks - 1, &somewhere(), enough_n);
    land.run(1, &somewhere(), CARRY_SHARE * WEIGHT_N);
    assert!(!land.run(ticks - 1, &somewhere(), enough_n) && land.run(1, &somewhere(), enough_n));
    assert!(!Land::new().run(5000, &somewhere(), CARRY_SHARE * WEIGHT_N), "too little");
    // Blind ticks continue the times.
    let mut land = Land::new();
    land.run(1, &somewhere(), enough_n);
    (2..ticks).for_each(|_| land.0.advance_blind(GAP_US));
    assert!(!land.0.airborne() && land.run(1, &somewhere(), enough_n));
}

#[test]
fn it_is_in_the_air_once_it_has_left() {
    for axis in 0..3 {
        for sign in [1.0, -1.0] {
            let at = |size: f32| State { position_m: somewhere().position_m + along(axis, sign * size), ..somewhere() };
            assert!(Land::new().run(1, &at(1.01 * LEFT_M), 0.0) && !Land::new().run(5000, &at(0.99 * LEFT_M), 0.0));
            let fast = |size: f32| moving(along(axis, sign * size));
            assert!(Land::new().run(1, &fast(1.01 * LEFT_M_S), 0.0));
            assert!(!Land::new().run(5000, &fast(0.99 * LEFT_M_S), 0.0));
        }
    }
}

/// A vehicle has landed after a second at rest without being carried, if it was seen to descend before.
#[test]
fn it_has_landed_after_a_second_at_rest() {
    for sinks in [1.01 * SINKS_M_S, 0.99 * SINKS_M_S] {
        let mut land = Land::hovering();
        land.run(1, &moving(along(2, -sinks)), WEIGHT_N);
        let landed = land.lands(&somewhere(), 0.1 * WEIGHT_N);
        assert_eq!(landed, (sinks > SINKS_M_S).then_some(STILL_US / GAP_US + 1), "{sinks} m/s");
    }
    // Sideways or upward motion is no descent.
    for up in [along(0, -1.0), along(1, -1.0), along(2, 1.0)] {
        let mut land = Land::hovering();
        land.run(1, &moving(up), WEIGHT_N);
        assert_eq!(land.lands(&somewhere(), 0.1 * WEIGHT_N), None);
    }
    // Motion along any axis, thrust, or a tick without a state restarts the second.
    let disturb: [&dyn Fn(&mut Land); 5] = [
        &|land| assert!(land.run(1, &moving(along(0, 1.01 * STILL_M_S)), 0.0)),
        &|land| assert!(land.run(1, &moving(along(1, -1.01 * STILL_M_S)), 0.0)),
        &|land| assert!(land.run(1, &moving(along(2, 1.01 * STILL_M_S)), 0.0)),
        &|land| assert!(land.run(1, &somewhere(), 0.7 * WEIGHT_N)),
        &|land| land.0.advance_blind(GAP_US),
    ];
    for (index, disturb) in disturb.into_iter().enumerate() {
        let mut land = Land::hovering();
        land.run(1, &moving(along(2, -1.0)), WEIGHT_N);
        assert!(land.run(STILL_US / GAP_US - 300, &moving(Vector3::repeat(0.99 * STILL_M_S)), 0.1 * WEIGHT_N));
        disturb(&mut land);
        let ticks = land.lands(&somewhere(), 0.1 * WEIGHT_N).expect("landed");
        assert!((STILL_US / GAP_US..=STILL_US / GAP_US + 1).contains(&ticks), "{index}: {ticks} ticks");
    }
}

/// A vehicle that has not left its resting place lands without a descent, and may take off from there again.
#[test]
fn what_was_carried_only_lands_where_it_stood() {
    let mut land = Land::new();
    land.run(CARRIED_US / GAP_US, &somewhere(), WEIGHT_N);
    let here = State { position_m: somewhere().position_m + along(0, 0.9 * LEFT_M), ..somewhere() };
    assert_eq!(land.lands(&here, 0.1 * WEIGHT_N), Some(STILL_US / GAP_US + 1));
    let next = State { position_m: here.position_m + along(0, 0.9 * LEFT_M), ..here };
    assert!(!land.run(100, &next, 0.0), "it stands where it has landed");
    let far = State { position_m: here.position_m + along(0, 1.1 * LEFT_M), ..here };
    assert!(land.run(1, &far, 0.0));
}

/// The usual thrust is the mean in the air, larger for a heavy vehicle.
#[test]
fn the_usual_thrust_is_learnt_in_the_air() {
    let mut land = Land::new();
    land.run(5000, &somewhere(), 0.5 * WEIGHT_N);
    land.run(1, &moving(along(2, 1.0)), WEIGHT_N);
    let seconds = 3.0;
    land.run((seconds / DT_S) as u32, &somewhere(), 2.0 * WEIGHT_N);
    land.run(1, &moving(along(2, -1.0)), 2.0 * WEIGHT_N);
    let usual_n = WEIGHT_N * (2.0 - (-seconds / USUAL_S).exp());
    let carries = |thrust_n: f32| {
        let mut land = Land(land.0);
        // The time without thrust is as short as possible, because the usual thrust is a mean and decays meanwhile.
        land.run(STILL_US / GAP_US - 5, &somewhere(), 0.0);
        let thrust_n = thrust_n * (-(STILL_US as f32) * 1e-6 / USUAL_S).exp();
        land.run(1, &somewhere(), thrust_n);
        land.lands(&somewhere(), 0.0).expect("landed") > 100
    };
    assert!(carries(1.01 * CARRY_SHARE * usual_n) && !carries(0.99 * CARRY_SHARE * usual_n), "{usual_n} N");
}

/// A state at rest in the air without thrust shows a frozen tracker, unless the vehicle has descended before. A descent
/// counts until the vehicle has hovered after it.
#[test]
fn rest_in_the_air_without_thrust_contradicts() {
    let mut land = Land::hovering();
    land.run(FROZEN_US / GAP_US, &somewhere(), 0.1 * WEIGHT_N);
    assert!(!land.0.contradicts());
    land.run(1, &somewhere(), 0.1 * WEIGHT_N);
    assert!(land.0.contradicts());
    assert!(land.run(5000, &somewhere(), 0.1 * WEIGHT_N), "that is no landing");

    for (hovers, forgotten) in [(HOVER_US / GAP_US - 1, false), (HOVER_US / GAP_US, true)] {
        let mut land = Land::hovering();
        land.run(1, &moving(along(2, -1.0)), WEIGHT_N);
        land.run(hovers, &somewhere(), WEIGHT_N);
        // From now on, the rotors do not carry the vehicle. One tick of motion restarts the times.
        land.run(1, &moving(along(0, 2.0 * STILL_M_S)), 0.1 * WEIGHT_N);
        land.run(FROZEN_US / GAP_US + 1, &somewhere(), 0.1 * WEIGHT_N);
        assert_eq!(land.0.contradicts(), forgotten, "{hovers} ms");
        assert_eq!(land.lands(&somewhere(), 0.1 * WEIGHT_N).is_none(), forgotten, "{hovers} ms");
    }
    // A vehicle that has not left its resting place does not contradict.
    let mut land = Land::new();
    land.run(CARRIED_US / GAP_US, &somewhere(), WEIGHT_N);
    land.run(FROZEN_US / GAP_US + 100, &somewhere(), 0.0);
    assert!(!land.0.contradicts());
}

/// Returns the number of ticks until a vehicle counts as standing. Its rotors give this share of the usual thrust, its
/// vertical velocity is off by `bias_m_s`, and it accelerates by `acceleration_m_s2`.
fn held(share: f32, acceleration_m_s2: f32, bias_m_s: f32) -> Option<u32> {
    let mut fall = FallCheck::default();
    assert!(!fall.stands(&along(2, bias_m_s), 1.0, DT_S));
    (1..=900).find(|tick| fall.stands(&along(2, bias_m_s + acceleration_m_s2 * *tick as f32 * DT_S), share, DT_S))
}

/// A vehicle that its rotors do not carry, and that does not fall, stands, even with an error in its velocity.
#[test]
fn what_does_not_fall_stands() {
    for (share, bias_m_s) in [(0.0, 0.0), (0.3, 0.0), (0.3, -0.4), (0.3, 0.4), (0.5, -0.4)] {
        let ticks = held(share, 0.0, bias_m_s).expect("it stands") as f32;
        assert!((ticks - FALL_M_S / (9.81 * (1.0 - share)) / DT_S).abs() < 3.0, "{share}: {ticks} ticks");
    }
    assert_eq!(held(CARRY_SHARE * 1.05, 0.0, 0.0), None, "carried");
    // The vehicle falls with slightly more or less than the share of a free fall that decides.
    for share in [0.0, 0.3, 0.5] {
        let falls = |of_it: f32| held(share, -of_it * 9.81 * (1.0 - share), 0.5);
        assert_eq!(falls(FALL_SHARE + 0.1), None);
        assert!(falls(FALL_SHARE - 0.1).is_some());
    }
    // Fast vehicles may be carried by their drag, or roll on wheels.
    for axis in 0..3 {
        for (size, stands) in [(1.01, false), (0.99, true), (-1.01, false), (-0.99, true)] {
            let (mut fall, velocity_m_s) = (FallCheck::default(), along(axis, size * FALL_MAX_M_S));
            fall.stands(&velocity_m_s, 1.0, DT_S);
            assert_eq!((0..900).any(|_| fall.stands(&velocity_m_s, 0.0, DT_S)), stands, "{axis}: {size}");
        }
    }
}

/// A falling vehicle does not count as standing, even with slow rotors and the oldest usable velocity.
#[test]
fn what_falls_late_does_not_stand() {
    for (lag_s, from_m_s) in [(0.02, -0.3), (0.07, -0.3), (0.1, -0.3), (0.1, -1.0), (0.1, 0.5)] {
        let mut fall = FallCheck::default();
        fall.stands(&along(2, from_m_s), 1.0, DT_S);
        for tick in 0..900 {
            let time_s = (tick as f32 * DT_S - 0.02).max(0.0);
            let falls_m_s = 9.81 * (time_s - lag_s * (1.0 - (-time_s / lag_s).exp()));
            let stands = fall.stands(&along(2, from_m_s - falls_m_s), 0.0, DT_S);
            assert!(!stands, "{lag_s} s, from {from_m_s} m/s, after {tick} ms");
        }
    }
}

/// After a touchdown, a vehicle counts as landed only if it was seen to descend.
#[test]
fn a_touch_down_ends_a_descent() {
    for (sinks, airborne) in [(1.01 * SINKS_M_S, false), (0.99 * SINKS_M_S, true)] {
        let mut land = Land::hovering();
        land.run(1, &moving(along(2, -sinks)), WEIGHT_N);
        land.0.touch_down(&somewhere());
        assert_eq!(land.0.airborne(), airborne, "{sinks} m/s");
    }
}

/// A vehicle idling on the ground stands at its present place, if known. Everything but the usual thrust is reset.
#[test]
fn a_resting_vehicle_stands_where_it_is() {
    let there = State { position_m: somewhere().position_m + along(1, 20.0), ..somewhere() };
    for state in [Some(&there), None] {
        let mut land = Land::hovering();
        land.run(100, &moving(along(2, -1.0)), 0.1 * WEIGHT_N);
        land.0.rest(state);
        assert!(!land.0.airborne());
        let stands = *state.unwrap_or(&somewhere());
        let mut same = land.0;
        same.advance(&stands, 0.0, GAP_US, DT_S);
        assert!(!same.airborne());
        let left = State { position_m: stands.position_m + along(1, 1.1 * LEFT_M), ..stands };
        let mut gone = land.0;
        gone.advance(&left, 0.0, GAP_US, DT_S);
        assert!(gone.airborne());
        // All times restart.
        assert!(!land.run(CARRIED_US / GAP_US - 1, &stands, WEIGHT_N) && land.run(1, &stands, WEIGHT_N));
    }
}

/// Without a velocity, the thrust alone decides. The descent also counts for states that return.
#[test]
fn a_vehicle_adrift_lands_by_its_thrust() {
    let mut land = Land::hovering();
    let runs = |land: &mut Land, ticks: u32, thrust_n: f32| {
        (1..=ticks).find(|_| {
            land.0.advance_adrift(&moving(Vector3::new(3.0, -4.0, -5.0)), thrust_n, GAP_US, DT_S);
            !land.0.airborne()
        })
    };
    assert_eq!(runs(&mut land, 4000, WEIGHT_N), None, "carried");
    let mut back = Land(land.0);
    assert_eq!(runs(&mut land, 4000, 0.1 * WEIGHT_N), Some(STILL_US / GAP_US + 1));
    // The vehicle has not hovered since, so its descent counts.
    assert!(back.run(1, &somewhere(), WEIGHT_N));
    assert_eq!(back.lands(&somewhere(), 0.1 * WEIGHT_N), Some(STILL_US / GAP_US + 1));
    // A vehicle on the ground stays on the ground, whatever its state drifts to.
    let mut land = Land::new();
    land.0.advance_adrift(&moving(Vector3::new(3.0, -4.0, -5.0)), 0.1 * WEIGHT_N, GAP_US, DT_S);
    assert!(!land.0.airborne());
}
