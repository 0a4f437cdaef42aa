//! What becomes of a vehicle in flight whose link drops, delays, corrupts, truncates, repeats or reorders frames: the
//! rigid-body plant, and the firmware's code on the host, with real frames between them. (The same faults without a plant,
//! each to the millisecond, are in `crates/vehicle/tests/faults.rs`.)
//!
//! Times are in ms since the request to arm. Until then the vehicle is held where it starts. The ground is at height 0: a
//! vehicle that reaches it stops there, upright and at rest, and must not lift off again.
#![allow(clippy::expect_used, clippy::indexing_slicing, reason = "a test that cannot go on should say why")]

use airframe::{Parameters, RotorSpeeds};
use core::ops::Range;
use link::Command;
use nalgebra::Vector3;
use plant::{Environment, Model, Motion, Plant};
use sitl::in_the_loop::{Host, Station};
use sitl::paper::{self, Case as Reading};
use sitl::scenario::Scenario;
use sitl::trajectory::Trajectory;
use std::fmt::Write as _;
use vehicle::{Mode, Refusal, Request};

/// How long the vehicle is held, tracked and led before it is asked to arm \[ms\].
const HELD_MS: i64 = 1_100;

// --- What is flown. ---

#[derive(Clone, Copy, Debug)]
enum Flight {
    /// At rest at this height \[m\], where it should be.
    Hover(f64),
    /// The paper's, gusts and uncertainty on.
    Paper,
    /// At rest, its setpoint this far above \[m\].
    Below(f64),
}

impl Flight {
    fn scenario(self) -> Scenario {
        let paper = paper::scenario(Model::RigidBody, Reading::DEFAULT).expect("in range");
        let hover = |height_m: f64, setpoint_m: f64| Scenario {
            environment: Environment::calm(Parameters::PAPER).expect("in range"),
            initial: Motion { position_m: Vector3::new(0.0, 0.0, height_m), ..Motion::default() },
            trajectory: Trajectory::Hover { position_m: Vector3::new(0.0, 0.0, setpoint_m), yaw_rad: 0.0 },
            ..paper.clone()
        };
        match self {
            Flight::Hover(height_m) => hover(height_m, height_m),
            Flight::Below(distance_m) => hover(1.0, 1.0 + distance_m),
            Flight::Paper => paper,
        }
    }
}

// --- What goes wrong. ---

/// Which frames, by MAVLink message.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Of {
    States,
    Setpoints,
    Commands,
    Rotors,
    Answers,
    /// Everything from the vehicle.
    Downlink,
    /// Everything to the vehicle.
    Uplink,
}

impl Of {
    fn includes(self, id: u32) -> bool {
        match self {
            Of::States => id == 331,
            Of::Setpoints => id == 84,
            Of::Commands => id == 76,
            Of::Rotors => id == 93,
            Of::Answers => id == 77,
            Of::Uplink => matches!(id, 331 | 84 | 76),
            Of::Downlink => !matches!(id, 331 | 84 | 76),
        }
    }
}

#[derive(Clone, Copy, Debug)]
enum What {
    Drop,
    /// Drops this share \[%\].
    DropSome(u64),
    /// Drops all but each n-th.
    KeepEach(u64),
    /// Adds this many ms.
    Delay(i64),
    /// Adds 0 up to this many ms, by chance: frames overtake each other.
    Jitter(u64),
    /// Keeps everything back until the fault is over, then delivers it at once.
    HoldBack,
    /// Delivers blocks of this many ms back to front.
    Reverse(i64),
    /// Flips one bit, anywhere.
    Flip,
    /// Flips one bit of this share of frames \[%\].
    FlipSome(u64),
    /// Cuts off the second half.
    Truncate,
    /// Delivers it again a ms later.
    Twice,
    /// Puts bytes that look like the beginning of a frame before it.
    Noise,
    /// Delivers the first one of the fault again and again instead.
    Replay,
}

type Fault = (Of, Range<i64>, What);

const FOREVER: i64 = i64::MAX;

// --- What must come of it. ---

#[derive(Clone, Copy, Debug)]
enum Then {
    /// Flies on, never farther from its reference than this \[m\].
    Flies(f64),
    /// Rides, then flies on: never farther from its reference than the first, within the second for the last 2 s \[m\].
    Recovers(f64, f64),
    /// Comes down at most this fast \[m/s\], and disarms on the ground.
    Lands(f64),
    /// Comes down blind, and disarms in the air 2.25 s after the last state; hits the ground at most this fast \[m/s\].
    GivesUp(f64),
    /// Disarms at this time \[ms\].
    Stops(i64),
    /// Does not arm, and says why.
    Refuses(Refusal),
    /// Does not arm, for it is not asked.
    Stays,
}

struct Case {
    name: &'static str,
    flight: Flight,
    faults: &'static [Fault],
    /// Requests after the one to arm.
    requests: &'static [(i64, Command)],
    end_ms: i64,
    then: Then,
}

const fn case(name: &'static str, flight: Flight, faults: &'static [Fault], end_ms: i64, then: Then) -> Case {
    Case { name, flight, faults, requests: &[], end_ms, then }
}

const fn asked(requests: &'static [(i64, Command)], case: Case) -> Case {
    Case { requests, ..case }
}

use Command::{Arm, Disarm};
use Flight::{Below, Hover, Paper};
use Of::{Answers, Commands, Downlink, Rotors, Setpoints, States, Uplink};
use Then::{Flies, GivesUp, Lands, Recovers, Refuses, Stays, Stops};
use What::{Delay, Drop, DropSome, Flip, FlipSome, HoldBack, Jitter, KeepEach, Noise, Replay, Reverse, Truncate, Twice};

#[rustfmt::skip]
const CASES: &[Case] = &[
    // Nothing.
    case("hover", Hover(2.0), &[], 10_000, Flies(0.1)),
    case("the paper's flight", Paper, &[], 60_000, Flies(2.0)),

    // Dropping.
    case("20 ms without a state", Hover(2.0), &[(States, 3000..3020, Drop)], 10_000, Flies(0.1)),
    case("100 ms without a state, hovering", Hover(2.0), &[(States, 3000..3100, Drop)], 13_000, Recovers(0.1, 0.1)),
    case("250 ms without a state, hovering", Hover(2.0), &[(States, 3000..3250, Drop)], 13_000, Recovers(0.1, 0.1)),
    case("250 ms without a state, climbing towards the reference", Paper, &[(States, 1000..1250, Drop)], 15_000, Recovers(2.0, 0.5)),
    case("250 ms without a state, as a gust begins", Paper, &[(States, 7_450..7_700, Drop)], 22_000, Recovers(2.0, 0.5)),
    case("250 ms without a state, as parameters change", Paper, &[(States, 19_900..20_150, Drop)], 35_000, Recovers(2.0, 0.5)),
    case("100 ms of each second without a state, the paper's flight", Paper,
        &[(States, 5000..5100, Drop), (States, 6000..6100, Drop), (States, 7000..7100, Drop), (States, 8000..8100, Drop)],
        20_000, Recovers(2.0, 0.5)),
    case("300 ms without a state, hovering", Hover(2.0), &[(States, 3000..3300, Drop)], 15_000, Lands(1.0)),
    case("300 ms without a state, the paper's flight", Paper, &[(States, 10_000..10_300, Drop)], 40_000, Lands(1.0)),
    case("300 ms without a state, inertia and thrust off", Paper, &[(States, 25_000..25_300, Drop)], 60_000, Lands(1.0)),
    case("a second without a state, the paper's flight", Paper, &[(States, 10_000..11_000, Drop)], 40_000, Lands(1.0)),
    case("no state any more, hovering low", Hover(1.5), &[(States, 3000..FOREVER, Drop)], 10_000, Lands(3.0)),
    case("no state any more, hovering high", Hover(5.0), &[(States, 3000..FOREVER, Drop)], 10_000, GivesUp(10.0)),
    case("no state any more, the paper's flight", Paper, &[(States, 2_000..FOREVER, Drop)], 10_000, GivesUp(10.0)),
    case("the uplink is dead", Hover(1.5), &[(Uplink, 3000..FOREVER, Drop)], 10_000, Lands(3.0)),
    case("half of all states lost by chance, the paper's flight", Paper, &[(States, 0..FOREVER, DropSome(50))], 60_000, Flies(2.0)),
    case("one state in 10, the paper's flight", Paper, &[(States, 0..FOREVER, KeepEach(10))], 60_000, Flies(2.0)),
    case("one state in 20, hovering", Hover(2.0), &[(States, 0..FOREVER, KeepEach(20))], 20_000, Flies(0.2)),
    case("no setpoint for 10 s of the paper's flight", Paper, &[(Setpoints, 10_000..20_000, Drop)], 40_000, Flies(5.0)),
    case("no setpoint any more, hovering", Hover(2.0), &[(Setpoints, 3000..FOREVER, Drop)], 15_000, Flies(0.1)),

    // Delaying.
    case("states 10 ms late, the paper's flight", Paper, &[(States, 5_000..FOREVER, Delay(10))], 60_000, Flies(2.0)),
    case("states 30 ms late", Hover(1.5), &[(States, 3000..FOREVER, Delay(30))], 10_000, Lands(3.0)),
    case("states held back for 100 ms, then all at once", Hover(2.0), &[(States, 3000..3100, HoldBack)], 13_000, Recovers(0.1, 0.1)),
    case("states held back for a second, then all at once", Hover(2.0), &[(States, 3000..4000, HoldBack)], 15_000, Lands(1.0)),
    case("jitter of 15 ms, the paper's flight", Paper, &[(States, 0..FOREVER, Jitter(15))], 60_000, Flies(2.0)),
    case("setpoints 400 ms late, the paper's flight", Paper, &[(Setpoints, 0..FOREVER, Delay(400))], 60_000, Flies(2.0)),

    // Corrupting and truncating.
    case("a flipped bit in one state in 4, the paper's flight", Paper, &[(States, 0..FOREVER, FlipSome(25))], 60_000, Flies(2.0)),
    case("a flipped bit in each state for 200 ms", Hover(2.0), &[(States, 3000..3200, Flip)], 13_000, Recovers(0.1, 0.1)),
    case("a flipped bit in each state from now on", Hover(1.5), &[(States, 3000..FOREVER, Flip)], 10_000, Lands(3.0)),
    case("a flipped bit in each setpoint of the paper's flight for 5 s", Paper, &[(Setpoints, 10_000..15_000, Flip)], 40_000, Flies(5.0)),
    case("truncated states for 100 ms", Hover(2.0), &[(States, 3000..3100, Truncate)], 13_000, Recovers(0.1, 0.1)),
    case("noise before everything, the paper's flight", Paper, &[(Uplink, 0..FOREVER, Noise)], 60_000, Flies(2.0)),
    asked(&[(5_000, Disarm)], case("a flipped bit in a request to disarm", Hover(2.0), &[(Commands, 5_000..5_010, Flip)], 10_000, Flies(0.1))),

    // Repeating and reordering.
    case("every frame twice, the paper's flight", Paper, &[(Uplink, 0..FOREVER, Twice)], 60_000, Flies(2.0)),
    case("states in blocks of 10, back to front, the paper's flight", Paper, &[(States, 0..FOREVER, Reverse(10))], 60_000, Flies(2.0)),
    case("an old state again and again", Hover(1.5), &[(States, 3000..FOREVER, Replay)], 10_000, Lands(3.0)),
    case("an old state again and again for 100 ms of a climb", Paper, &[(States, 1000..1100, Replay)], 13_000, Recovers(2.0, 0.5)),

    // The way back.
    case("half of all rotor commands lost by chance, the paper's flight", Paper, &[(Rotors, 0..FOREVER, DropSome(50))], 60_000, Flies(2.0)),
    case("rotor commands 5 ms late, the paper's flight", Paper, &[(Rotors, 0..FOREVER, Delay(5))], 60_000, Flies(2.0)),
    case("a flipped bit in one rotor command in 4, the paper's flight", Paper, &[(Rotors, 0..FOREVER, FlipSome(25))], 60_000, Flies(2.0)),
    case("every frame from the vehicle twice", Paper, &[(Downlink, 0..FOREVER, Twice)], 60_000, Flies(2.0)),
    case("no answers", Hover(2.0), &[(Answers, -HELD_MS..FOREVER, Drop)], 10_000, Flies(0.1)),

    // Requests.
    asked(&[(5_000, Disarm)], case("disarmed in flight", Hover(1.5), &[], 10_000, Stops(5_000))),
    asked(&[(3_100, Disarm)], case("disarmed while riding", Hover(1.5), &[(States, 3000..FOREVER, Drop)], 10_000, Stops(3_100))),
    asked(&[(3_600, Disarm)], case("disarmed while descending", Hover(1.5), &[(States, 3000..FOREVER, Drop)], 10_000, Stops(3_600))),
    asked(&[(3_600, Arm)], case("asked to arm while descending", Hover(2.0), &[(States, 3000..3500, Drop)], 15_000, Lands(1.0))),
    asked(&[(5_000, Arm)], case("asked to arm in flight", Hover(2.0), &[], 10_000, Flies(0.1))),

    // On the ground.
    case("never a state", Hover(1.0), &[(States, -HELD_MS..FOREVER, Drop)], 3_000, Refuses(Refusal::StateStale)),
    case("corrupt states only", Hover(1.0), &[(States, -HELD_MS..FOREVER, Flip)], 3_000, Refuses(Refusal::StateStale)),
    case("states stop 30 ms before arming", Hover(1.0), &[(States, -30..FOREVER, Drop)], 3_000, Refuses(Refusal::StateStale)),
    case("an old state again and again before arming", Hover(1.0), &[(States, -100..FOREVER, Replay)], 3_000, Refuses(Refusal::StateStale)),
    case("never a setpoint", Hover(1.0), &[(Setpoints, -HELD_MS..FOREVER, Drop)], 3_000, Refuses(Refusal::SetpointMissing)),
    case("setpoints stop 600 ms before arming", Hover(1.0), &[(Setpoints, -600..FOREVER, Drop)], 3_000, Refuses(Refusal::SetpointMissing)),
    case("a setpoint far away", Below(2.5), &[], 3_000, Refuses(Refusal::SetpointTooFar)),
    case("a flipped bit in the request to arm", Hover(1.0), &[(Commands, 0..1, Flip)], 3_000, Stays),
    case("the request to arm comes twice", Hover(2.0), &[(Commands, 0..1, Twice)], 10_000, Flies(0.1)),
];

// --- The air between. ---

/// Numbers that look like chance, the same every time.
struct Chance(u64);

impl Chance {
    fn next(&mut self, below: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % below
    }
}

/// One direction of the link.
struct Air {
    faults: &'static [Fault],
    chance: Chance,
    sent: u64,
    /// When it arrives \[ms\], the order of arrival in that ms, and what.
    under_way: Vec<(i64, i64, Vec<u8>)>,
    replayed: Option<Vec<u8>>,
}

impl Air {
    fn new(faults: &'static [Fault]) -> Self {
        Air { faults, chance: Chance(1), sent: 0, under_way: Vec::new(), replayed: None }
    }

    /// Sends the frames in `bytes`, and returns what arrives in this ms.
    fn pass(&mut self, now_ms: i64, bytes: &[u8]) -> Vec<u8> {
        let mut rest = bytes;
        while !rest.is_empty() {
            let (frame, behind) = rest.split_at(usize::from(rest[1]) + 12);
            self.send(now_ms, frame.to_vec());
            rest = behind;
        }
        let mut arrived: Vec<_> = self.under_way.extract_if(.., |(at_ms, ..)| *at_ms <= now_ms).collect();
        arrived.sort_by_key(|&(at_ms, order, _)| (at_ms, order));
        arrived.into_iter().flat_map(|(.., frame)| frame).collect()
    }

    fn send(&mut self, now_ms: i64, mut frame: Vec<u8>) {
        let id = u32::from_le_bytes([frame[7], frame[8], frame[9], 0]);
        let fault = self.faults.iter().find(|(of, when, _)| of.includes(id) && when.contains(&now_ms));
        self.sent += 1;
        let (mut at_ms, mut order) = (now_ms, self.sent as i64);
        let Air { chance, .. } = self;
        match fault.map(|(_, when, what)| (when, *what)) {
            None => {}
            Some((_, Drop)) => return,
            Some((_, DropSome(percent))) if chance.next(100) < percent => return,
            Some((_, KeepEach(n))) if !now_ms.unsigned_abs().is_multiple_of(n) => return,
            Some((_, DropSome(_) | KeepEach(_))) => {}
            Some((_, Delay(ms))) => at_ms += ms,
            Some((_, Jitter(ms))) => at_ms += chance.next(ms + 1) as i64,
            Some((when, HoldBack)) => at_ms = when.end,
            Some((_, Reverse(ms))) => {
                at_ms += ms - 1 - now_ms.rem_euclid(ms);
                order = -order;
            }
            Some((_, FlipSome(percent))) if chance.next(100) >= percent => {}
            Some((_, Flip | FlipSome(_))) => {
                let bit = chance.next(8 * frame.len() as u64) as usize;
                frame[bit / 8] ^= 1 << (bit % 8);
            }
            Some((_, Truncate)) => frame.truncate(frame.len() / 2),
            Some((_, Twice)) => self.under_way.push((at_ms + 1, order, frame.clone())),
            Some((_, Noise)) => {
                frame.splice(0..0, [0xFD, 9, 0, 0, 1, 0xFD, 0x55]);
            }
            Some((_, Replay)) => frame.clone_from(self.replayed.get_or_insert(frame.clone())),
        }
        self.under_way.push((at_ms, order, frame));
    }
}

// --- The vehicle and the ground. ---

struct World {
    plant: Plant,
    motion: Motion,
    touchdown_m_s: Option<f64>,
    lifted_off_again: bool,
}

impl World {
    fn step(&mut self, speeds: &RotorSpeeds) {
        let Parameters { thrust_factor_n_s2, mass_kg, gravity_m_s2, .. } = Parameters::PAPER;
        if self.touchdown_m_s.is_some() {
            let thrust_n = thrust_factor_n_s2 * speeds.0.cast::<f64>().norm_squared();
            self.lifted_off_again |= thrust_n > mass_kg * gravity_m_s2;
            return;
        }
        self.plant.step(speeds, 0.001);
        self.motion = self.plant.motion();
        if self.motion.position_m.z <= 0.0 {
            self.touchdown_m_s = Some(self.motion.velocity_m_s.norm());
            let Motion { position_m, attitude_rad, .. } = self.motion;
            self.motion = Motion {
                position_m: Vector3::new(position_m.x, position_m.y, 0.0),
                attitude_rad: Vector3::new(0.0, 0.0, attitude_rad.z),
                ..Motion::default()
            };
        }
    }
}

// --- The flight. ---

#[derive(Debug, Default)]
struct Seen {
    /// When each mode begins \[ms\], and at which height \[m\].
    modes: Vec<(i64, Mode, f64)>,
    answers: Vec<Result<Request, Refusal>>,
    /// What the station was told about arming.
    refused: Option<&'static str>,
    /// Largest distance from the reference while armed, from the first fault on, and over the last 2 s \[m\].
    worst_m: f64,
    last_m: f64,
    /// Largest roll or pitch while armed \[rad\].
    tilt_rad: f64,
    touchdown_m_s: Option<f64>,
    /// What must never happen.
    violations: Vec<String>,
}

fn fly(case: &Case) -> Seen {
    let scenario = case.flight.scenario();
    let plant = Plant::new(scenario.model, scenario.initial, scenario.environment.clone());
    let mut world = World { plant, motion: scenario.initial, touchdown_m_s: None, lifted_off_again: false };
    let (mut station, mut host) = (Station::new(), Host::new().expect("in range"));
    let (mut up, mut down) = (Air::new(case.faults), Air::new(case.faults));
    let fault_ms = case.faults.iter().map(|(_, when, _)| when.start).min().unwrap_or(0);
    let (mut seen, mut released) = (Seen::default(), false);

    for now_ms in -HELD_MS..=case.end_ms {
        // Station.
        let reference = scenario.trajectory.at(now_ms.max(0) as f64 * 1e-3);
        station.track((now_ms + 2 * HELD_MS) as u64 * 1000, world.motion.measure());
        station.lead(reference.setpoint());
        if now_ms == 0 {
            station.command(Command::Arm);
        }
        case.requests.iter().filter(|(at_ms, _)| *at_ms == now_ms).for_each(|(_, command)| station.command(*command));

        // Vehicle.
        let tick = host.next_tick(&up.pass(now_ms, &station.take()));
        station.hear(&down.pass(now_ms, &tick.bytes));
        let report = &tick.report;

        // What is seen of it.
        let height_m = world.motion.position_m.z;
        if seen.modes.last().is_none_or(|(_, mode, _)| *mode != report.mode) {
            seen.modes.push((now_ms, report.mode, height_m));
        }
        seen.answers.extend(report.answer);
        seen.refused = station.heard().refusal().or(seen.refused);
        let mut never = |what: &str, happened: bool| {
            if happened && seen.violations.len() < 3 {
                seen.violations.push(format!("{what} at {now_ms} ms"));
            }
        };
        let stopped = report.throttles == [0; 4] && report.motors == RotorSpeeds::default();
        never("motors turn while disarmed", !report.mode.armed() && !stopped);
        never("motors stop while armed", report.mode.armed() && report.throttles.contains(&0));
        never("the station hears of motors that turn while disarmed",
            !station.heard().armed && station.heard().speeds != RotorSpeeds::default());
        if report.mode.armed() && now_ms >= fault_ms.max(0) && world.touchdown_m_s.is_none() {
            let distance_m = (world.motion.position_m - reference.position_m).norm();
            let eta = &world.motion.attitude_rad;
            seen.worst_m = seen.worst_m.max(distance_m);
            seen.tilt_rad = seen.tilt_rad.max(eta.x.abs()).max(eta.y.abs());
            if now_ms > case.end_ms - 2000 {
                seen.last_m = seen.last_m.max(distance_m);
            }
        }

        // Plant.
        released |= report.mode.armed();
        if released {
            world.step(&station.heard().speeds);
        }
    }
    seen.touchdown_m_s = world.touchdown_m_s;
    if world.lifted_off_again {
        seen.violations.push("it lifts off from the ground again".into());
    }
    seen
}

/// What is not as it should be.
fn faults_of(case: &Case, seen: &Seen) -> Vec<String> {
    let mut wrong = seen.violations.clone();
    let mut must = |what: String, holds: bool| {
        if !holds {
            wrong.push(what);
        }
    };
    let modes: Vec<_> = seen.modes.iter().map(|(_, mode, _)| *mode).collect();
    let rode = modes.contains(&Mode::Riding);
    let (last_ms, last_mode, last_height_m) = *seen.modes.last().expect("one at least");
    match case.then {
        Flies(within_m) => {
            must("it keeps flying".into(), modes == [Mode::Disarmed, Mode::Flying]);
            must(format!("within {within_m} m"), seen.worst_m <= within_m);
        }
        Recovers(within_m, settled_m) => {
            must("it rides".into(), rode && !modes.contains(&Mode::Descending));
            must("it flies in the end".into(), last_mode == Mode::Flying);
            must(format!("within {within_m} m"), seen.worst_m <= within_m);
            must(format!("in the end within {settled_m} m"), seen.last_m <= settled_m);
        }
        Lands(within_m_s) | GivesUp(within_m_s) => {
            must("it rides, descends, disarms".into(), modes.ends_with(&[Mode::Riding, Mode::Descending, Mode::Disarmed]));
            let on_the_ground = last_height_m == 0.0;
            must("it disarms on the ground, or in the air".into(), on_the_ground == matches!(case.then, Lands(_)));
            must(format!("it lands at no more than {within_m_s} m/s"), seen.touchdown_m_s.is_some_and(|m_s| m_s <= within_m_s));
        }
        Stops(at_ms) => must(format!("it disarms at {at_ms} ms"), (last_ms, last_mode) == (at_ms, Mode::Disarmed)),
        Refuses(refusal) => {
            must(format!("{refusal:?}"), seen.answers == [Err(refusal)] && modes == [Mode::Disarmed]);
            must("it says so".into(), seen.refused == Some(refusal.reason()));
        }
        Stays => must("it stays disarmed".into(), seen.answers.is_empty() && modes == [Mode::Disarmed]),
    }
    wrong
}

#[test]
fn every_case_ends_as_it_should() {
    let mut failures = String::new();
    for case in CASES {
        let seen = fly(case);
        let Seen { worst_m, last_m, tilt_rad, touchdown_m_s, modes, .. } = &seen;
        println!("{:<62} {worst_m:.3} {last_m:.3} m, {tilt_rad:.2} rad, {touchdown_m_s:.2?} m/s, {modes:.2?}", case.name);
        let wrong = faults_of(case, &seen);
        if !wrong.is_empty() {
            let _ = writeln!(failures, "{}: expected {:?}: {wrong:?}: {seen:?}", case.name, case.then);
        }
    }
    assert!(failures.is_empty(), "\n{failures}");
    assert!(CASES.len() >= 20);
}
