//! Checks the law's inputs with a law that records them: state and setpoint of every tick, for late, missing and lost
//! states, and for poses instead of states.
#![allow(clippy::expect_used, clippy::indexing_slicing, reason = "a test that cannot go on should say why")]

use super::std::vec::Vec;
use crate::dead_reckoning::{DESCENT_THRUST, DeadReckoning};
use crate::descent::SINK_M_S;
use crate::landing::{STILL_US, USUAL_S};
use crate::motor::Response;
use crate::supervisor::{COAST_US, DESCEND_US, GIVE_UP_US};
use crate::{
    ArmingLimits, EndReason, FlightCore, FlightCoreMemory, Inbox, Mode, Refusal, Request, Stamped, TickOutcome,
    Ticketed,
};
use afbc_control::{Action, FlightController, Mixer, Trace};
use afbc_types::{Inputs, Parameters, Pose, PoseSigmas, RotorForces, RotorSpeeds, Setpoint, State};
use nalgebra::Vector3;

const WEIGHT_N: f32 = 0.486 * 9.81;

/// A law that records its inputs, and always commands the same.
struct Notes {
    mixer: Mixer,
    asks: Inputs,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Noted {
    received: Option<(State, Setpoint)>,
    steps: u32,
    /// Number of steps announced as without a position, and whether the next step is announced so.
    position_lost: u32,
    announced: bool,
    /// Number of times it was told to be on the ground, before its first step and later.
    on_ground: [u32; 2],
}

impl FlightController for Notes {
    type Memory = Noted;

    fn dt_s(&self) -> f32 {
        0.001
    }

    fn mixer(&self) -> &Mixer {
        &self.mixer
    }

    fn trace(noted: &Noted) -> Trace {
        let mut trace = Trace::default();
        trace.inputs.thrust_n = noted.steps as f32;
        trace
    }

    fn on_ground(&self, noted: &mut Noted) {
        let [first, later] = &mut noted.on_ground;
        *(if noted.steps == 0 { first } else { later }) += 1;
    }

    fn position_lost(&self, noted: &mut Noted) {
        noted.announced = true;
    }

    fn decide(&self, noted: &mut Noted, state: &State, setpoint: &Setpoint, fresh: bool) -> Action {
        assert!(fresh && state.is_plausible() && setpoint.is_plausible());
        noted.position_lost += u32::from(noted.announced);
        (noted.received, noted.steps, noted.announced) = (Some((*state, *setpoint)), noted.steps + 1, false);
        Action::new(RotorSpeeds([300.0; 4].into()), RotorForces([1.0; 4].into()), self.asks, false)
    }
}

struct Bench {
    vehicle: FlightCore<Notes>,
    memory: FlightCoreMemory<Noted>,
    inbox: Inbox,
    now_us: u64,
}

fn asks(thrust: f32) -> Inputs {
    Inputs { thrust_n: thrust * WEIGHT_N, roll_n: 0.01, pitch_n: -0.02, yaw_n: 0.0 }
}

/// Motion of the vehicle with constant velocity and rates.
fn at(us: u64) -> State {
    let s = us as f32 * 1e-6;
    State {
        position_m: Vector3::new(1.0, -0.5, 2.0) + Vector3::new(0.3, -0.2, 0.05) * s,
        velocity_m_s: Vector3::new(0.3, -0.2, 0.05),
        attitude_rad: Vector3::new(0.05, -0.1, 0.4) + Vector3::new(0.01, -0.02, 0.03) * s,
        rates_rad_s: Vector3::new(0.01, -0.02, 0.03),
    }
}

fn target() -> Setpoint {
    Setpoint { position_m: Vector3::new(1.5, 0.0, 2.5), ..Setpoint::default() }
}

impl Bench {
    fn new(asks: Inputs) -> Self {
        let parameters = Parameters::PAPER.to_f32();
        let law = Notes { mixer: Mixer::new(parameters, 3.0).expect("valid"), asks };
        let limits = ArmingLimits { setpoint_distance_max_m: 100.0, ..ArmingLimits::default() };
        let vehicle = FlightCore::new(parameters, limits, law).expect("valid");
        Bench { vehicle, memory: FlightCoreMemory::default(), inbox: Inbox::EMPTY, now_us: 0 }
    }

    fn tick(&mut self, put: impl FnOnce(&mut Inbox, u64)) -> TickOutcome {
        self.now_us += 1000;
        put(&mut self.inbox, self.now_us);
        self.inbox.put_setpoint(Stamped { value: target(), at_us: self.now_us });
        self.vehicle.tick(&mut self.memory, self.now_us, &self.inbox.take())
    }

    /// Runs a tick in which the link delivers the state of `age_us` ago.
    fn linked(&mut self, age_us: u64) -> TickOutcome {
        self.tick(|inbox, now_us| put_linked(inbox, now_us - age_us))
    }

    /// Runs a tick with the vehicle's own estimate.
    fn own(&mut self) -> TickOutcome {
        self.tick(|inbox, now_us| inbox.locate(Stamped { value: at(now_us), at_us: now_us }))
    }

    /// Runs a tick with an own estimate without a position.
    fn position_lost(&mut self, value: State) -> TickOutcome {
        self.tick(|inbox, at_us| inbox.put_position_lost(Some(Stamped { value, at_us }), Refusal::PositionUnknown))
    }

    /// Runs a tick with the pose of `age_us` ago.
    fn posed(&mut self, age_us: u64) -> TickOutcome {
        self.tick(|inbox, now_us| {
            let at_us = now_us - age_us;
            inbox.put_pose(Stamped { value: Pose::of(&at(at_us), PoseSigmas::UNKNOWN), at_us });
        })
    }

    fn nothing(&mut self) -> TickOutcome {
        self.tick(|_, _| {})
    }

    /// Returns a bench in the air, flying on states from the link or on its own estimate.
    fn flying(asks: Inputs, own: bool) -> Self {
        let mut bench = Bench::new(asks);
        let mut run = |ticks: u32| {
            for _ in 0..ticks {
                let _ = if own { bench.own() } else { bench.linked(0) };
            }
        };
        run(1500);
        assert!(bench.inbox.request(Ticketed { value: Request::Arm, ticket: 0 }));
        for _ in 0..1500 {
            let _ = if own { bench.own() } else { bench.linked(0) };
        }
        assert!(bench.memory.airborne() && bench.memory.mode() == Mode::Flying);
        bench
    }

    fn noted(&self) -> Noted {
        *self.memory.control().expect("armed")
    }

    fn received(&self) -> (State, Setpoint) {
        self.noted().received.expect("stepped")
    }

    fn steps(&self) -> u32 {
        self.noted().steps
    }
}

fn put_linked(inbox: &mut Inbox, at_us: u64) {
    inbox.put_state(Stamped { value: at(at_us), at_us });
}

fn off(seen: &State, expected: &State) -> f32 {
    let offs = [
        seen.position_m - expected.position_m,
        seen.velocity_m_s - expected.velocity_m_s,
        seen.attitude_rad - expected.attitude_rad,
        seen.rates_rad_s - expected.rates_rad_s,
    ];
    offs.iter().map(Vector3::amax).fold(0.0, f32::max)
}

/// The law is told once when it starts on the ground, and again after idling there. A law that continues in the air is
/// not told.
#[test]
fn the_law_is_told_where_it_begins() {
    let mut bench = Bench::flying(asks(1.0), true);
    assert_eq!(bench.noted().on_ground, [1, 0]);
    for rests in [true, false] {
        bench.inbox.set_idle_on_ground(rests);
        for _ in 0..50 {
            let _ = bench.own();
        }
    }
    assert_eq!(bench.noted().on_ground, [1, 0], "it was in the air");
    let mut bench = Bench::new(asks(1.0));
    bench.inbox.set_idle_on_ground(true);
    for tick in 0..2100 {
        if tick == 1500 {
            assert!(bench.inbox.request(Ticketed { value: Request::Arm, ticket: 0 }));
        }
        bench.inbox.set_idle_on_ground(tick < 2000);
        let _ = bench.own();
        if tick == 1900 {
            assert_eq!((bench.noted().on_ground, bench.noted().steps), ([0, 0], 0));
        }
    }
    assert_eq!((bench.noted().on_ground, bench.noted().steps), ([1, 0], 100));
}

/// A late state is extrapolated to the present by its velocity and rates. The law thus gets the true state of a
/// steadily moving vehicle, however late its states are.
#[test]
fn late_states_are_carried_on_to_the_present() {
    for late_us in [0, 1000, 7000, 13_500, u64::from(COAST_US)] {
        let mut bench = Bench::flying(asks(1.0), false);
        for tick in 0..50 {
            let outcome = bench.linked(late_us);
            // States that are older than the last state before this loop are ignored, so skip them.
            if tick > late_us / 1000 {
                assert_eq!(u64::from(outcome.health.state_age_us), late_us);
                let (state, setpoint) = bench.received();
                assert!(off(&state, &at(bench.now_us)) < 1e-5, "{late_us} us: {state:?}");
                assert_eq!(setpoint, target());
                assert_eq!(bench.memory.state(), Some(&at(bench.now_us - late_us)));
            }
        }
    }
    let mut bench = Bench::flying(asks(1.0), false);
    let _ = bench.linked(0);
    assert_eq!(bench.received().0, at(bench.now_us), "as it is, to the bit");
}

/// Between two states, roll and pitch are reckoned from the inputs and the rest is extrapolated. The law does not run
/// on a stale state.
#[test]
fn between_states_roll_and_pitch_are_reckoned() {
    for own in [false, true] {
        let mut bench = Bench::flying(asks(1.0), own);
        let dead_reckoning = DeadReckoning::new(&Parameters::PAPER.to_f32(), &Response::DEFAULT, 1e-3);
        let given = asks(1.0);
        let last = at(bench.now_us);
        // The inputs are constant for long. The rotors have reached these inputs, and the trim has learnt most of what
        // explains the constant rates.
        let mut reckoning = dead_reckoning.start(&last);
        reckoning.acting_n = nalgebra::Vector2::new(given.roll_n, given.pitch_n);
        let steps = bench.steps();
        for age_ms in 1..=COAST_US / 1000 {
            let outcome = bench.nothing();
            assert_eq!((outcome.mode, outcome.health.state_age_us), (Mode::Flying, age_ms * 1000));
            dead_reckoning.advance(&mut reckoning, &given);
            let (state, _) = bench.received();
            let there = at(bench.now_us);
            let expected = State {
                attitude_rad: Vector3::new(state.attitude_rad.x, state.attitude_rad.y, there.attitude_rad.z),
                rates_rad_s: Vector3::new(state.rates_rad_s.x, state.rates_rad_s.y, there.rates_rad_s.z),
                ..there
            };
            assert!(off(&state, &expected) < 1e-5, "{age_ms} ms: {state:?}, not {expected:?}");
            // The trim is 78 % learnt after 1.5 s.
            let learnt = 1.0 - (-1.5_f32).exp();
            let t = age_ms as f32 * 1e-3;
            for (axis, input, authority) in [(0, given.roll_n, 0.25 / 0.0038), (1, given.pitch_n, 0.25 / 0.0038)] {
                let rate = last.rates_rad_s[axis] + authority * input * (1.0 - learnt) * t;
                let received = state.rates_rad_s[axis];
                assert!(
                    (received - rate).abs() < 2e-3 + 0.3 * (rate - last.rates_rad_s[axis]).abs(),
                    "{received}, not {rate}"
                );
            }
        }
        assert_eq!(bench.steps() - steps, COAST_US / 1000);
        let _ = bench.nothing();
        assert_eq!(bench.steps() - steps, COAST_US / 1000, "no step of the law on a stale state");
        let inputs = bench.memory.trace::<Notes, 4>().inputs;
        assert!((inputs.thrust_n / WEIGHT_N - 1.0).abs() < 0.01 && inputs != given, "{inputs:?}");
        let _ = if own { bench.own() } else { bench.linked(0) };
        assert_eq!(bench.memory.trace::<Notes, 4>().inputs.thrust_n, bench.steps() as f32, "the law's own again");
    }
}

/// A state counts only if it is newer than the last one and no older than 20 ms on arrival.
#[test]
fn an_older_state_does_not_replace_a_newer_one() {
    let mut bench = Bench::flying(asks(1.0), false);
    let _ = bench.linked(2000);
    let last_us = bench.now_us;
    let newest = *bench.memory.state().expect("seen");
    for _ in 0..3 {
        let _ = bench.tick(|inbox, _| put_linked(inbox, last_us - 5000));
        assert_eq!(bench.memory.state(), Some(&newest));
    }
    let late = |bench: &mut Bench, late_us: u64| {
        for _ in 0..25 {
            let _ = bench.nothing();
        }
        let age_us = bench.linked(late_us).health.state_age_us;
        u64::from(age_us) == late_us
    };
    assert!(late(&mut bench, u64::from(COAST_US)) && !late(&mut bench, u64::from(COAST_US) + 1));
}

/// Coasting holds the thrust, a blind descent reduces it, and the forces match these inputs.
#[test]
fn blind_inputs_reach_the_motors() {
    let mut bench = Bench::flying(asks(1.1), false);
    let mut trims = Vec::new();
    for age_us in (1000..=DESCEND_US + 50_000).step_by(1000) {
        let outcome = bench.nothing();
        if age_us > COAST_US {
            let inputs = bench.memory.trace::<Notes, 4>().inputs;
            let action = bench.vehicle_action(&inputs);
            assert_eq!((outcome.motors, outcome.forces), (action.speeds, action.forces), "{age_us} us");
            let share = if age_us > DESCEND_US { DESCENT_THRUST } else { 1.0 };
            trims.push(inputs.thrust_n / share);
        }
    }
    // A mean over 1 s after 1.5 s of flight, starting at the weight.
    let trim_n = WEIGHT_N * (1.1 - 0.1 * (-1.5_f32).exp());
    assert!(trims.iter().all(|thrust_n| (thrust_n - trim_n).abs() < 0.01 * WEIGHT_N), "{trims:?}");
}

impl Bench {
    fn vehicle_action(&self, inputs: &Inputs) -> Action {
        Mixer::<4>::new(Parameters::PAPER.to_f32(), 3.0).expect("valid").action(inputs)
    }
}

/// Without a position, the law sees the last place with a fading estimated motion, and a setpoint that descends there.
/// Height, vertical velocity and attitude are passed unchanged.
#[test]
fn without_a_position_the_law_sees_a_fading_motion_and_the_vehicle_sinks() {
    let mut bench = Bench::flying(asks(1.0), true);
    for flight in 0..2 {
        let seen = *bench.memory.state().expect("seen");
        let began_us = bench.now_us;
        let noted = bench.noted();
        // The last state with a position counts while fresh. The estimate's horizontal position and velocity are wrong.
        let wrong = |now_us: u64| State {
            position_m: Vector3::new(500.0, -700.0, at(now_us).position_m.z),
            velocity_m_s: Vector3::new(1.0, -2.0, -0.05),
            ..at(now_us)
        };
        let mut first = None;
        for ms in 1..=400_u64 {
            let now_us = bench.now_us + 1000;
            let outcome = bench.position_lost(wrong(now_us));
            if ms <= u64::from(COAST_US) / 1000 {
                assert_eq!(bench.noted().position_lost, noted.position_lost, "{ms} ms");
                continue;
            }
            let begin = *first.get_or_insert(ms);
            let (state, setpoint) = bench.received();
            let t = (ms - begin + 1) as f32 * 1e-3;
            let fade = (-0.5 * t).exp();
            let way = 2.0 * (fade - (-t).exp());
            let expected = State {
                position_m: Vector3::new(
                    seen.position_m.x + way,
                    seen.position_m.y - 2.0 * way,
                    wrong(now_us).position_m.z,
                ),
                velocity_m_s: Vector3::new(fade, -2.0 * fade, -0.05),
                ..wrong(now_us)
            };
            assert!(off(&state, &expected) < 3e-3, "{ms} ms: {state:?}, not {expected:?}");
            let place = Vector3::new(seen.position_m.x, seen.position_m.y, 0.0);
            let sunk = setpoint.position_m - place;
            let from_m = wrong(began_us + begin * 1000).position_m.z;
            assert!((sunk - Vector3::new(0.0, 0.0, from_m - SINK_M_S * t)).amax() < 2e-3, "{ms} ms: {setpoint:?}");
            assert_eq!(setpoint.velocity_m_s, Vector3::new(0.0, 0.0, -SINK_M_S));
            assert_eq!(bench.noted().position_lost - noted.position_lost, (ms - begin + 1) as u32, "announced");
            let descends = ms * 1000 > u64::from(DESCEND_US);
            assert_eq!(outcome.mode, if descends { Mode::Descending } else { Mode::Coasting });
            // In the first round, the position returns before the descent begins.
            if flight == 0 && ms == 150 {
                break;
            }
        }
        if flight == 0 {
            for _ in 0..300 {
                let _ = bench.own();
            }
            assert_eq!((bench.memory.mode(), bench.received().1), (Mode::Flying, target()));
        }
    }
    // If the position returns during the descent, the descent continues from the present place.
    let _ = bench.own();
    let here = at(bench.now_us);
    assert_eq!(bench.received().0, here);
    let sinks = here.position_m - Vector3::new(0.0, 0.0, SINK_M_S * 1e-3);
    assert!((bench.received().1.position_m - sinks).amax() < 1e-5, "{:?}", bench.received().1);
}

/// The descent goes on while the attitude is known, and ends when it is stale. The thrust decides the landing, whatever
/// speed and place the estimate reports.
#[test]
fn a_vehicle_adrift_lands_by_its_thrust_or_gives_up() {
    let fast =
        State { position_m: Vector3::new(9e3, 0.0, 2.0), velocity_m_s: Vector3::repeat(-9.0), ..State::default() };
    let mut bench = Bench::flying(asks(1.0), true);
    for _ in 0..3 * GIVE_UP_US / 1000 {
        assert_eq!(bench.position_lost(fast).ended, None, "carried");
    }
    let ended = (1..5000).find_map(|ms| bench.nothing().ended.map(|end| (ms, end)));
    assert_eq!(ended, Some((GIVE_UP_US / 1000 + 1, EndReason::StateLost)));

    let mut bench = Bench::flying(asks(0.2), true);
    let (mut ms, ended) = (
        0,
        loop {
            if let Some(ended) = bench.position_lost(fast).ended {
                break ended;
            }
            assert!(bench.now_us < 20_000_000, "not landed");
        },
    );
    ms += bench.now_us / 1000 - 3000;
    assert_eq!(ended, EndReason::Landed);
    // The descent lands after a second without thrust, counted at the latest from its start. The usual thrust is the
    // weight.
    assert!(ms <= u64::from(DESCEND_US + STILL_US) / 1000 + 30 && USUAL_S > 1.0, "{ms} ms");
    // A vehicle on its side is lost.
    let mut bench = Bench::flying(asks(1.0), true);
    let over = State { attitude_rad: Vector3::new(2.0, 0.0, 0.0), ..State::default() };
    let ended = (0..3000).find_map(|_| bench.position_lost(over).ended);
    assert_eq!(ended, Some(EndReason::Tumbled));
}

/// Poses are used once states are stale, and only then. The observed motion starts from the last state, and a state
/// from the link replaces it.
#[test]
fn poses_replace_states_that_are_missing_and_give_way_to_them() {
    let mut bench = Bench::flying(Inputs { thrust_n: WEIGHT_N, ..Inputs::default() }, false);
    // States from the link arrive along with poses: the states count.
    for ms in 0..200 {
        let outcome = bench.tick(|inbox, now_us| {
            if ms % 10 == 0 {
                put_linked(inbox, now_us);
            }
            inbox.put_pose(Stamped { value: Pose::of(&at(now_us), PoseSigmas::UNKNOWN), at_us: now_us });
        });
        assert_eq!((outcome.health.observed, outcome.health.state_age_us), (false, ms % 10 * 1000));
    }
    let age_ms = u64::from(bench.nothing().health.state_age_us) / 1000;
    for ms in 1..=500 {
        let health = bench.posed(4000).health;
        let stale = age_ms + ms > u64::from(COAST_US) / 1000;
        assert_eq!(health.observed, stale, "{ms} ms");
        assert_eq!(health.state_age_us, if stale { 0 } else { ((age_ms + ms) * 1000) as u32 });
        if stale {
            // Until the disturbance is learnt, the tilt causes an error of a tenth of gravity.
            let state = bench.received().0;
            assert!(off(&state, &at(bench.now_us)) < 0.4, "{ms} ms: {state:?}, not {:?}", at(bench.now_us));
        }
    }
    // The link sends a state that is older than the observed one.
    let outcome = bench.linked(3000);
    assert_eq!((outcome.health.observed, outcome.health.state_age_us), (false, 3000));
    assert_eq!(bench.memory.state(), Some(&at(bench.now_us - 3000)));
    assert!(!bench.posed(1000).health.observed, "as long as it is fresh");
}

/// Poses replace a failed own estimate at once, since a working one would have taken them. The estimate's next state
/// replaces the poses.
#[test]
fn poses_replace_an_estimate_at_once() {
    let mut bench = Bench::flying(Inputs { thrust_n: WEIGHT_N, ..Inputs::default() }, true);
    for ms in 1..=300 {
        let outcome = bench.posed(4000);
        assert_eq!((outcome.health.observed, outcome.health.state_age_us), (true, 0), "{ms} ms");
        assert!(off(&bench.received().0, &at(bench.now_us)) < 0.4, "{:?}", bench.received().0);
        assert_eq!(outcome.mode, Mode::Flying);
    }
    // Poses that are too old or too uncertain are not used.
    for ms in 1..=120 {
        let outcome = bench.posed(60_000);
        assert_eq!(outcome.health.observed, ms <= 96, "{ms} ms");
    }
    assert!(bench.posed(4000).health.observed);
    assert!(!bench.own().health.observed);
    assert_eq!(bench.memory.state(), Some(&at(bench.now_us)));
    assert!(!bench.nothing().health.observed, "it was replaced");

    // A disarmed vehicle does not observe.
    assert!(bench.inbox.request(Ticketed { value: Request::Kill, ticket: 0 }));
    let _ = bench.own();
    (0..50).for_each(|_| assert!(!bench.posed(4000).health.observed));
}

/// Unlike states from a link, the own estimate's are not checked for repetition.
#[test]
fn an_estimate_may_repeat_itself() {
    for own in [false, true] {
        let mut bench = Bench::flying(asks(1.0), own);
        let value = at(bench.now_us);
        for _ in 0..10 {
            let _ = bench.tick(|inbox, at_us| {
                let state = Stamped { value, at_us };
                if own { inbox.locate(state) } else { inbox.put_state(state) }
            });
        }
        let health = bench.nothing().health;
        // The link's last state is still there and is refused once more.
        let expected = if own { (0, 1000) } else { (11, 11_000) };
        assert_eq!((health.frozen_states, health.state_age_us), expected, "own: {own}");
    }
}

/// A disarmed vehicle has no trace and is not in the air, but keeps the last flight's memory. A failed clock is
/// reported.
#[test]
fn after_a_flight_its_memory_remains_and_no_trace() {
    let mut bench = Bench::flying(asks(1.0), false);
    let _ = bench.nothing();
    let trace = bench.memory.trace::<Notes, 4>();
    assert_eq!(trace.inputs.thrust_n, bench.steps() as f32);
    assert!(bench.inbox.request(Ticketed { value: Request::Kill, ticket: 0 }));
    assert_eq!(bench.linked(0).ended, Some(EndReason::Killed));
    assert!(!bench.memory.airborne() && bench.steps() > 1000);
    assert_eq!(bench.memory.trace::<Notes, 4>(), Trace::default());
    assert!(!bench.linked(0).health.rate.clock_failed);
    bench.memory.distrust_clock();
    assert!(bench.linked(0).health.rate.clock_failed);
    assert_eq!(FlightCoreMemory::<Noted>::default().control(), None);
    assert_eq!(FlightCoreMemory::<Noted>::default().state(), None);

    // A vehicle without a state has no trace either after it has been killed.
    let mut bench = Bench::flying(asks(1.0), false);
    for _ in 0..50 {
        let _ = bench.nothing();
    }
    assert_ne!(bench.memory.trace::<Notes, 4>(), Trace::default());
    assert!(bench.inbox.request(Ticketed { value: Request::Kill, ticket: 0 }));
    let _ = bench.nothing();
    assert_eq!(bench.memory.trace::<Notes, 4>(), Trace::default());
}
