//! Tests of the detection of tipped-over, standing and falling vehicles and of frozen trackers, each with made-up
//! states. `tests/tests/frozen.rs` closes the loop.

use afbc_control::{Action, FlightController, Mixer, Trace};
use afbc_flight_core::landing::LandDetector;
use afbc_flight_core::supervisor::REST_US;
use afbc_flight_core::{
    ArmingLimits, EndReason, FlightCore, FlightCoreMemory, Inbox, Mode, Refusal, Request, RequestAnswer, Stamped,
    TickOutcome, Ticketed,
};
use afbc_types::{Inputs, Parameters, RotorForces, RotorSpeeds, Setpoint, State};
use core::f32::consts::{PI, TAU};
use nalgebra::Vector3;
use proptest::prelude::*;

const WEIGHT_N: f32 = 0.486 * 9.81;

/// A controller whose thrust in newtons is the setpoint's height.
struct Lift(Mixer);

impl FlightController for Lift {
    type Memory = ();

    fn dt_s(&self) -> f32 {
        0.001
    }

    fn mixer(&self) -> &Mixer {
        &self.0
    }

    fn trace(_: &()) -> Trace {
        Trace::default()
    }

    fn decide(&self, (): &mut (), _: &State, setpoint: &Setpoint, _: bool) -> Action {
        let force = setpoint.position_m.z / 4.0;
        let given = Inputs { thrust_n: setpoint.position_m.z, ..Inputs::default() };
        Action::new(RotorSpeeds([300.0; 4].into()), RotorForces([force; 4].into()), given, false)
    }
}

struct Bench {
    vehicle: FlightCore<Lift>,
    memory: FlightCoreMemory<()>,
    inbox: Inbox,
    now_us: u64,
    thrust_n: f32,
    /// Position from integrating the velocity \[m\].
    travelled_m: Vector3<f32>,
}

impl Bench {
    fn new() -> Self {
        let limits = ArmingLimits { setpoint_distance_max_m: 100.0, ..ArmingLimits::default() };
        let parameters = Parameters::PAPER.to_f32();
        let lift = Lift(Mixer::new(parameters, 3.0).expect("valid"));
        let vehicle = FlightCore::new(parameters, limits, lift).expect("valid");
        Bench {
            vehicle,
            memory: FlightCoreMemory::default(),
            inbox: Inbox::EMPTY,
            now_us: 0,
            thrust_n: WEIGHT_N,
            travelled_m: Vector3::zeros(),
        }
    }

    /// Runs a tick in which this state is measured with a tracker's noise.
    fn tick(&mut self, state: State) -> TickOutcome {
        let mut value = state;
        self.travelled_m += state.velocity_m_s * 1e-3;
        value.position_m += self.travelled_m;
        value.position_m.x += (self.now_us / 1000 * 7919 % 1000) as f32 * 1e-7;
        self.exactly(value)
    }

    /// Runs a tick in which exactly this state is measured.
    fn exactly(&mut self, value: State) -> TickOutcome {
        self.now_us += 1000;
        let at_us = self.now_us;
        self.inbox.put_state(Stamped { value, at_us });
        let position_m = Vector3::new(0.0, 0.0, self.thrust_n);
        self.inbox.put_setpoint(Stamped { value: Setpoint { position_m, ..Setpoint::default() }, at_us });
        self.vehicle.tick(&mut self.memory, at_us, &self.inbox.take())
    }

    fn ask(&mut self, request: Request) {
        assert!(self.inbox.request(Ticketed { value: request, ticket: 9 }));
    }

    /// Runs `ms` ticks in this state. Returns when and why the flight ended, if it did.
    fn wait(&mut self, ms: u64, state: State) -> Option<(u64, EndReason)> {
        (1..=ms).find_map(|ms| self.tick(state).ended.map(|end| (ms, end)))
    }

    fn answer(&mut self, request: Request, state: State) -> Result<(), Refusal> {
        self.ask(request);
        let RequestAnswer { ticket, request: answered, result } = self.tick(state).answer.expect("answered");
        assert_eq!((ticket, answered), (9, request));
        result
    }

    /// Returns a bench with a vehicle in the air.
    fn flying() -> Self {
        let mut bench = Bench::new();
        assert_eq!(bench.wait(1500, State::default()), None);
        assert_eq!(bench.answer(Request::Arm, State::default()), Ok(()));
        assert_eq!(bench.wait(1000, State::default()), None);
        bench
    }
}

fn rolled(roll_rad: f32) -> State {
    State { attitude_rad: Vector3::new(roll_rad, 0.0, 0.0), ..State::default() }
}

fn climbing(m_s: f32) -> State {
    State { velocity_m_s: Vector3::new(0.0, 0.0, m_s), ..State::default() }
}

/// A vehicle on its side or back for a second is disarmed, in any direction.
#[test]
fn a_vehicle_that_lies_is_disarmed() {
    for roll_rad in [1.45, 2.0, 3.1, -1.6, -3.1] {
        let mut bench = Bench::flying();
        assert_eq!(bench.wait(20_000, rolled(roll_rad)), Some((1002, EndReason::Tumbled)), "{roll_rad} rad");
        assert_eq!(bench.tick(rolled(roll_rad)).motors, RotorSpeeds::default());
        assert_eq!(bench.answer(Request::Arm, rolled(roll_rad)), Err(Refusal::TiltTooLarge));
    }
}

#[test]
fn a_vehicle_that_leans_or_rights_itself_is_not_disarmed() {
    let mut bench = Bench::flying();
    assert_eq!(bench.wait(20_000, rolled(1.2)), None);
    // The vehicle is on its back for a moment. Then it takes more than a second to turn upright.
    assert_eq!(bench.wait(300, rolled(3.1)), None);
    for step in 0..1600 {
        assert_eq!(bench.wait(1, rolled(3.1 - step as f32 * 1e-3)), None, "{step} ms");
    }
    assert_eq!(bench.wait(5_000, rolled(0.1)), None);
    assert_eq!(bench.wait(900, rolled(3.1)), None, "the second begins anew");
}

#[test]
fn a_vehicle_that_spins_is_disarmed() {
    for rate_rad_s in [5.0, 8.0, 12.0, 40.0] {
        let mut bench = Bench::flying();
        let ended = (1..10_000).find_map(|ms| {
            let mut state = rolled((ms as f32 * 1e-3 * rate_rad_s + PI) % TAU - PI);
            state.rates_rad_s.x = rate_rad_s;
            bench.tick(state).ended.map(|end| (ms, end))
        });
        let (ms, end) = ended.expect("over and over");
        assert!(end == EndReason::Tumbled && ms < 2_500, "{rate_rad_s} rad/s: {ms} ms");
    }
    // Rotation about its own z axis is allowed.
    let mut bench = Bench::flying();
    let spinning = State { rates_rad_s: Vector3::new(0.0, 0.0, 12.0), ..State::default() };
    assert_eq!(bench.wait(5_000, spinning), None);
}

#[test]
fn nothing_that_moves_or_turns_is_armed() {
    for (velocity, rate) in [(50.0, 0.0), (0.0, 100.0), (0.6, 0.0), (0.0, 0.6)] {
        let mut bench = Bench::new();
        let moving = State {
            velocity_m_s: Vector3::new(0.0, velocity, 0.0),
            rates_rad_s: Vector3::new(0.0, 0.0, rate),
            ..State::default()
        };
        bench.wait(1_500, moving);
        assert_eq!(bench.answer(Request::Arm, moving), Err(Refusal::NotAtRest), "{velocity} m/s, {rate} rad/s");
        bench.wait(u64::from(REST_US / 1000 - 2), State::default());
        assert_eq!(bench.answer(Request::Arm, State::default()), Err(Refusal::NotAtRest));
        bench.wait(2, State::default());
        assert_eq!(bench.answer(Request::Arm, State::default()), Ok(()));
    }
}

/// A delayed request to arm arrives after the motors were stopped in the air.
#[test]
fn a_late_arm_does_not_start_a_falling_vehicle() {
    let mut bench = Bench::flying();
    bench.ask(Request::Kill);
    assert_eq!(bench.tick(State::default()).ended, Some(EndReason::Killed));
    for ms in 0..500 {
        let falling = climbing(-9.81e-3 * ms as f32);
        assert_eq!(bench.answer(Request::Arm, falling), Err(Refusal::NotAtRest), "{ms} ms");
        assert_eq!(bench.tick(falling).mode, Mode::Disarmed);
    }
    // Arming is refused even at the moment when the vehicle comes to rest.
    assert_eq!(bench.answer(Request::Arm, State::default()), Err(Refusal::NotAtRest));
    assert_eq!(bench.wait(u64::from(REST_US / 1000), State::default()), None);
    assert_eq!(bench.answer(Request::Arm, State::default()), Ok(()));
}

#[test]
fn disarming_is_for_the_ground() {
    // The vehicle is armed. Its rotors do not carry it yet.
    let mut bench = Bench::new();
    bench.thrust_n = 0.3 * WEIGHT_N;
    bench.wait(1500, State::default());
    assert_eq!(bench.answer(Request::Arm, State::default()), Ok(()));
    bench.wait(5000, State::default());
    assert_eq!(bench.answer(Request::Disarm, State::default()), Ok(()));

    // A vehicle in the air does not disarm, even at rest.
    let mut bench = Bench::flying();
    assert_eq!(bench.answer(Request::Disarm, State::default()), Err(Refusal::InFlight));
    assert_eq!(bench.tick(State::default()).mode, Mode::Flying);
    // To land, the vehicle descends and stops, and its thrust is low.
    assert_eq!(bench.wait(1000, climbing(0.6)), None);
    assert_eq!(bench.wait(1000, climbing(-0.6)), None);
    assert_eq!(bench.answer(Request::Disarm, climbing(-0.6)), Err(Refusal::InFlight));
    bench.thrust_n = 0.3 * WEIGHT_N;
    assert_eq!(bench.wait(990, State::default()), None);
    assert_eq!(bench.answer(Request::Disarm, State::default()), Err(Refusal::InFlight), "not for a second yet");
    bench.wait(20, State::default());
    assert_eq!(bench.answer(Request::Disarm, State::default()), Ok(()));
}

/// An exactly repeated state is no measurement, but only in the air.
#[test]
fn a_repeated_state_is_as_old_as_its_first() {
    let mut bench = Bench::new();
    for _ in 0..1500 {
        assert_eq!(bench.exactly(State::default()).health.state_age_us, 0, "at rest nothing need change");
    }
    assert_eq!(bench.answer(Request::Arm, State::default()), Ok(()));
    bench.wait(1000, State::default());
    bench.exactly(State::default());
    for age_ms in 1..=2_251 {
        let outcome = bench.exactly(State::default());
        let mode = match age_ms {
            0..=20 => Mode::Flying,
            21..=250 => Mode::Coasting,
            251..=2250 => Mode::Descending,
            _ => Mode::Disarmed,
        };
        assert_eq!((outcome.mode, outcome.health.state_age_us), (mode, age_ms * 1000));
        assert_eq!(outcome.health.frozen_states, age_ms);
    }
}

/// A constant pose with noise and a moving twist is distrusted, along and about every axis.
#[test]
fn a_constant_pose_with_a_moving_twist_is_distrusted() {
    for axis in 0..5 {
        let mut bench = Bench::flying();
        let mut frozen = State::default();
        match axis {
            0..3 => frozen.velocity_m_s[axis] = -1.0,
            _ => frozen.rates_rad_s[axis - 3] = 1.0,
        }
        // The vehicle counts as airborne because of its speed. The detection takes at most two windows.
        let stands = |bench: &mut Bench| {
            bench.travelled_m = Vector3::zeros();
            bench.tick(frozen)
        };
        let seen = (1..5_000).find(|_| stands(&mut bench).mode != Mode::Flying).expect("seen");
        assert!(seen <= 521, "axis {axis}: {seen} ms");
        let ended = (1..5_000).find_map(|_| stands(&mut bench).ended).expect("and is not believed again");
        assert_eq!(ended, EndReason::StateLost);
    }
}

/// A constant pose in the air with decreasing thrust is no landing.
#[test]
fn a_vehicle_that_hangs_without_thrust_has_not_landed() {
    let mut bench = Bench::flying();
    bench.wait(1000, climbing(0.6));
    bench.wait(3000, State::default());
    bench.thrust_n = 0.1;
    let (ms, end) = bench.wait(10_000, State::default()).expect("ended");
    assert_eq!(end, EndReason::StateLost);
    assert!((2_500..3_500).contains(&ms), "{ms} ms");
}

proptest! {
    /// For any states and requests, no motor turns while disarmed, and arming requires rest.
    #[test]
    fn any_flight(
        script in prop::collection::vec((0u8..8, -4.0f32..4.0, -4.0f32..4.0, 0.0f32..10.0, 1u64..600), 1..40),
    ) {
        let mut bench = Bench::new();
        let mut at_rest_us = 0;
        for (what, turn, climb, thrust_n, ms) in script {
            bench.thrust_n = thrust_n;
            let request = match what {
                0 | 1 => Some(Request::Arm),
                2 => Some(Request::Disarm),
                3 => Some(Request::Kill),
                _ => None,
            };
            if let Some(request) = request {
                bench.ask(request);
            }
            let mut state = State::default();
            if what % 2 == 1 {
                state.attitude_rad.x = turn;
                state.velocity_m_s.z = climb;
            }
            for _ in 0..ms {
                let before = bench.memory.mode();
                let outcome = bench.tick(state);
                let at_rest = climb.abs() <= 0.5 || what % 2 == 0;
                at_rest_us = if at_rest { at_rest_us + 1000 } else { 0 };
                prop_assert!(outcome.mode.armed() || outcome.motors == RotorSpeeds::default());
                if before == Mode::Disarmed && outcome.mode.armed() {
                    prop_assert!(at_rest_us >= REST_US);
                }
                prop_assert_eq!(outcome.ended.is_some(), before.armed() && !outcome.mode.armed());
            }
        }
    }
}

/// If the position returns at the moment of touchdown, the states show no descent. The descent before counts.
#[test]
fn a_descent_without_a_position_counts_when_the_position_comes_back() {
    let (weight_n, gap_us, dt_s) = (10.0, 1000, 1e-3);
    let mut landing = LandDetector::new(&State::default(), weight_n);
    let mut now = |state: &State, thrust_n: f32, position_lost: bool, milliseconds: u32| {
        for _ in 0..milliseconds {
            if position_lost {
                landing.advance_adrift(state, thrust_n, gap_us, dt_s);
            } else {
                landing.advance(state, thrust_n, gap_us, dt_s);
            }
        }
        landing.airborne()
    };
    assert!(now(&climbing(1.0), weight_n, false, 1000), "takes off");
    assert!(now(&State::default(), weight_n, true, 5000), "descends");
    assert!(now(&State::default(), weight_n, false, 300), "touches the ground");
    assert!(!now(&State::default(), 0.0, false, 1200), "stands");
}
