//! Tests the observer alone, and inside the flight core with arbitrary inputs. `crates/sim/tests/observer.rs` compares
//! it with the plant.

use afbc::monitor::MonitorBounds;
use afbc::{Guarded, Profile, guarded};
use afbc_flight_core::dead_reckoning::{DeadReckoning, Reckoning};
use afbc_flight_core::motor::Response;
use afbc_flight_core::observer::{HOLD_US, LATE_US, PoseObserver};
use afbc_flight_core::{ArmingLimits, FlightCore, FlightCoreMemory, Inbox, Mode, Refusal, Request, Stamped, Ticketed};
use afbc_types::{Inputs, Parameters, Pose, PoseSigmas, Setpoint, State};
use nalgebra::Vector3;
use proptest::prelude::*;

const WEIGHT_N: f32 = 0.486 * 9.81;
const HOVER: Inputs = Inputs { thrust_n: WEIGHT_N, roll_n: 0.0, pitch_n: 0.0, yaw_n: 0.0 };

fn dead_reckoning() -> DeadReckoning {
    DeadReckoning::new(&Parameters::PAPER.to_f32(), &Response::DEFAULT, 0.001)
}

/// Runs one tick of observer and dead reckoning.
fn tick(
    observer: &mut PoseObserver,
    dead_reckoning: &DeadReckoning,
    reckoning: &mut Reckoning,
    pose: Option<&Stamped<Pose>>,
    now_us: u64,
) {
    observer.advance(dead_reckoning, reckoning, &HOVER);
    if let Some(pose) = pose {
        observer.correct(pose, now_us);
    }
    dead_reckoning.advance(reckoning, &HOVER);
    dead_reckoning.measure(reckoning, &observer.state().expect("plausible"));
}

proptest! {
    /// A vehicle hovers with a yaw rate in a wind that pushes it steadily. From any start, position, velocity and yaw
    /// rate are found exactly, for any rate and delay of the poses.
    #[test]
    fn steady_motion_is_found_exactly(
        period_ms in 1..50u64,
        late_us in 0..u64::from(LATE_US),
        speed_m_s in -2.0..2.0f32,
        push_m_s2 in -1.0..1.0f32,
        yaw_rate_rad_s in -1.0..1.0f32,
        off_m in -0.5..0.5f32,
        off_rad in -0.2..0.2f32,
    ) {
        let truth = |us: u64| {
            let t = us as f32 * 1e-6;
            let x = speed_m_s * t + 0.5 * push_m_s2 * t * t;
            let yaw_rad = (yaw_rate_rad_s * t + core::f32::consts::PI).rem_euclid(core::f32::consts::TAU)
                - core::f32::consts::PI;
            State {
                position_m: Vector3::new(x, -x, 1.0),
                velocity_m_s: Vector3::new(1.0, -1.0, 0.0) * (speed_m_s + push_m_s2 * t),
                attitude_rad: Vector3::new(0.0, 0.0, yaw_rad),
                rates_rad_s: Vector3::new(0.0, 0.0, yaw_rate_rad_s),
            }
        };
        let dead_reckoning = dead_reckoning();
        let mut start = State { position_m: Vector3::new(off_m, off_m, 1.0 - off_m), ..State::default() };
        start.attitude_rad = Vector3::new(off_rad, -off_rad, off_rad);
        let mut reckoning = dead_reckoning.start(&start);
        let mut observer = PoseObserver::new(&start, &HOVER, 0);
        let end_us = 6_000_000_u64;
        for now_us in (1_000..=end_us).step_by(1_000) {
            let at_us = now_us.saturating_sub(late_us);
            let pose = Stamped { value: Pose::of(&truth(at_us), PoseSigmas::UNKNOWN), at_us };
            let pose = Some(&pose).filter(|_| (now_us / 1_000).is_multiple_of(period_ms) && at_us > 0);
            prop_assert!(pose.is_none_or(|pose| PoseObserver::takes(pose, now_us)));
            tick(&mut observer, &dead_reckoning, &mut reckoning, pose, now_us);
        }
        let (seen, truth) = (observer.state().expect("plausible"), truth(end_us));
        // Positions up to 30 m are rounded to 2e-6 m, velocities from them to 1e-4 m/s.
        prop_assert!((seen.position_m - truth.position_m).amax() < 1e-3, "{seen:?}, not {truth:?}");
        prop_assert!((seen.velocity_m_s - truth.velocity_m_s).amax() < 5e-3, "{seen:?}, not {truth:?}");
        let turn_rad = (seen.attitude_rad - truth.attitude_rad).map(|angle| angle.sin());
        prop_assert!(turn_rad.amax() < 1e-3, "{seen:?}, not {truth:?}");
        prop_assert!((seen.rates_rad_s - truth.rates_rad_s).amax() < 5e-3, "{seen:?}, not {truth:?}");
    }
}

/// Any number that a link or a sensor may send.
fn number(most: f32) -> impl Strategy<Value = f32> {
    prop_oneof![4 => -1.0..1.0f32, 1 => -most..most, 1 => Just(most), 1 => Just(-most), 1 => Just(f32::NAN)]
}

fn vector(most: f32) -> impl Strategy<Value = Vector3<f32>> {
    (number(most), number(most), number(most)).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

fn any_state() -> impl Strategy<Value = State> {
    (vector(2e5), vector(2e3), vector(2e3), vector(2e3)).prop_map(|(position_m, velocity_m_s, attitude_rad, rates)| {
        State { position_m, velocity_m_s, attitude_rad, rates_rad_s: rates }
    })
}

fn any_pose() -> impl Strategy<Value = Pose> {
    let sigma = || prop_oneof![Just(None), number(1.0).prop_map(Some), (1e-4..0.05f32).prop_map(Some)];
    (vector(2e5), vector(4.0), prop::option::of(vector(2.0)), sigma(), sigma()).prop_map(
        |(position_m, attitude_rad, quaternion, sigma_m, sigma_rad)| {
            let sigmas = PoseSigmas { position_m: sigma_m, attitude_rad: sigma_rad };
            let pose = Pose::of(&State { position_m, attitude_rad, ..State::default() }, sigmas);
            quaternion.map_or(pose, |q| Pose { attitude: [0.3, q.x, q.y, q.z], ..pose })
        },
    )
}

/// Input of the flight core in a tick.
#[derive(Clone, Debug)]
enum Event {
    Estimate(State),
    Link(State, u64),
    Pose(Pose, u64),
    Lost(Option<State>),
    Nothing(u64),
}

fn event() -> impl Strategy<Value = Event> {
    let age_us = || prop_oneof![0..60_000u64, any::<u64>()];
    prop_oneof![
        1 => any_state().prop_map(Event::Estimate),
        1 => (any_state(), age_us()).prop_map(|(state, age_us)| Event::Link(state, age_us)),
        6 => (any_pose(), age_us()).prop_map(|(pose, age_us)| Event::Pose(pose, age_us)),
        1 => prop::option::of(any_state()).prop_map(Event::Lost),
        3 => (1..300u64).prop_map(Event::Nothing),
    ]
}

type Memory = FlightCoreMemory<guarded::Memory<4>>;

/// Returns a vehicle at rest, flying on its own estimate.
fn flying() -> (FlightCore<Guarded>, Memory, Inbox, u64) {
    let (vehicle, settings) = (Parameters::PAPER.to_f32(), Profile::Flight.settings());
    let gains = Profile::Flight.gains();
    let bounds = MonitorBounds::new(&gains, &vehicle, &settings);
    let law = Guarded::new(vehicle, settings, gains, bounds).expect("valid");
    let vehicle = FlightCore::new(vehicle, ArmingLimits::default(), law).expect("valid");
    let (mut memory, mut inbox, mut now_us) = (Memory::default(), Inbox::EMPTY, 0);
    for ms in 0..2_000 {
        now_us += 1_000;
        inbox.locate(Stamped { value: State::default(), at_us: now_us });
        inbox.put_setpoint(Stamped { value: Setpoint::default(), at_us: now_us });
        if ms == 1_200 {
            inbox.request(Ticketed { value: Request::Arm, ticket: 0 });
        }
        let _ = vehicle.tick(&mut memory, now_us, &inbox.take());
    }
    assert_eq!(memory.mode(), Mode::Flying);
    (vehicle, memory, inbox, now_us)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    /// For any inputs, in any order and with any times, the state is plausible and the rotor speeds are finite.
    #[test]
    fn nothing_that_arrives_makes_the_outcome_infinite(events in prop::collection::vec(event(), 1..60)) {
        let (vehicle, mut memory, mut inbox, mut now_us) = flying();
        for event in events {
            let mut ticks = 1;
            let at = |age_us: u64| now_us.wrapping_sub(age_us);
            match event {
                // An own estimate is always plausible.
                Event::Estimate(value) => {
                    if value.is_plausible() {
                        inbox.locate(Stamped { value, at_us: now_us + 1_000 });
                    }
                }
                Event::Link(value, age_us) => inbox.put_state(Stamped { value, at_us: at(age_us) }),
                Event::Pose(value, age_us) => inbox.put_pose(Stamped { value, at_us: at(age_us) }),
                Event::Lost(state) => {
                    let state = state.filter(State::is_plausible);
                    let state = state.map(|value| Stamped { value, at_us: now_us });
                    inbox.put_position_lost(state, Refusal::PositionUnknown);
                }
                Event::Nothing(wait) => ticks = wait,
            }
            for _ in 0..ticks {
                now_us += 1_000;
                let outcome = vehicle.tick(&mut memory, now_us, &inbox.take());
                prop_assert!(outcome.motors.0.iter().all(|speed| (0.0..1e4).contains(speed)), "{outcome:?}");
                prop_assert!(memory.state().is_some_and(State::is_plausible), "{:?}", memory.state());
            }
        }
    }
}

/// Without poses, the last one counts for 0.1 s. Then the state ages as usual.
#[test]
fn without_poses_it_is_blind() {
    let (vehicle, mut memory, mut inbox, mut now_us) = flying();
    let mut at = |pose: Option<f32>| {
        now_us += 1_000;
        if let Some(x) = pose {
            let value = Pose { position_m: Vector3::new(x, 0.0, 0.0), ..Pose::default() };
            inbox.put_pose(Stamped { value, at_us: now_us - 5_000 });
        }
        inbox.put_setpoint(Stamped { value: Setpoint::default(), at_us: now_us });
        let health = vehicle.tick(&mut memory, now_us, &inbox.take()).health;
        (health.observed, health.state_age_us)
    };
    for ms in 0..500 {
        assert_eq!(at(Some(1e-4 * (ms % 7) as f32)), (true, 0), "{ms} ms");
    }
    let held_ms = u64::from(HOLD_US - 5_000) / 1_000;
    for ms in 1..=400 {
        let expected = if ms <= held_ms { (true, 0) } else { (false, (ms - held_ms) as u32 * 1_000) };
        assert_eq!(at(None), expected, "{ms} ms");
    }
    assert_eq!(at(Some(0.001)), (true, 0), "back");
}
