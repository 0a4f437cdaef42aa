//! Flies over a link that drops, delays, corrupts, truncates, repeats or reorders frames. The firmware's code on the
//! host flies the rigid-body plant; MAVLink frames connect them. (`crates/flight-core/tests/faults.rs` tests the same
//! faults without a plant, to the millisecond.)
//!
//! Times are in ms since the request to arm. Until then the vehicle is held at its start. There is a ground.

use afbc_flight_core::{Mode, Refusal, Request};
use afbc_hil::{Host, Station};
use afbc_mavlink::VehicleCommand;
use afbc_plant::{Contact, Environment, Motion, Plant, PlantModel, Realism};
use afbc_scenario::Scenario;
use afbc_scenario::paper;
use afbc_scenario::trajectory::Trajectory;
use afbc_types::{Parameters, RotorSpeeds};
use core::ops::Range;
use nalgebra::Vector3;
use std::fmt::Write as _;

/// Time after which tracking errors are evaluated \[ms\], for faults from the start on. The start is far from the
/// reference.
const SETTLED_MS: i64 = 5_000;
/// Touch-down speed above which a landing counts as a crash, whose final attitude is arbitrary \[m/s\].
const CRASH_M_S: f64 = 3.0;
/// Time between control ticks \[s\].
const STEP_S: f64 = 0.001;
/// Time for which the vehicle is held before the request to arm, while states and setpoints are sent \[ms\].
const HELD_MS: i64 = 1_100;

// --- Flights. ---

#[derive(Clone, Copy, Debug)]
enum Flight {
    /// Hovers at this height \[m\], starting at rest.
    Hover(f64),
    /// The paper's flight with gusts and uncertainty.
    Paper,
}

impl Flight {
    fn scenario(self) -> Scenario {
        let paper = paper::scenario(PlantModel::RigidBody, afbc_scenario::case::Case::DEFAULT).expect("in range");
        let hover = |height_m: f64| Scenario {
            environment: Environment::calm(Parameters::PAPER).expect("in range"),
            initial: Motion { position_m: Vector3::new(0.0, 0.0, height_m), ..Motion::default() },
            trajectory: Trajectory::Hover { position_m: Vector3::new(0.0, 0.0, height_m), yaw_rad: 0.0 },
            ..paper.clone()
        };
        match self {
            Flight::Hover(height_m) => hover(height_m),
            Flight::Paper => paper,
        }
    }
}

// --- Faults. ---

/// Affected frames, by MAVLink message.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Of {
    States,
    Setpoints,
    Commands,
    Rotors,
    Answers,
    /// All frames from the vehicle.
    Downlink,
    /// All frames to the vehicle.
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
    /// Drops this share of the frames \[%\].
    DropSome(u64),
    /// Drops all frames but every n-th.
    KeepEach(u64),
    /// Delays frames by this many ms.
    Delay(i64),
    /// Delays frames by a random time up to this many ms, so that frames overtake each other.
    Jitter(u64),
    /// Holds frames back until the end of the fault, then delivers them at once.
    HoldBack,
    /// Delivers blocks of this many ms in reverse order.
    Reverse(i64),
    /// Flips one random bit.
    Flip,
    /// Flips one bit in this share of the frames \[%\].
    FlipSome(u64),
    /// Cuts off the second half of the frame.
    Truncate,
    /// Delivers each frame a second time one ms later.
    Twice,
    /// Inserts bytes before the frame that look like the start of a frame.
    Noise,
    /// Delivers the first frame of the fault repeatedly instead of the others.
    Replay,
}

type Fault = (Of, Range<i64>, What);

const FOREVER: i64 = i64::MAX;

// --- Expected results. ---

#[derive(Clone, Copy, Debug)]
enum Expected {
    /// The vehicle continues to fly within this distance of the reference \[m\].
    Flies(f64),
    /// The vehicle coasts and then continues to fly. Its distance from the reference never exceeds the first value, and
    /// during the last 2 s it does not exceed the second value \[m\].
    Recovers(f64, f64),
    /// The vehicle coasts, descends and then continues to fly. Its distance from the reference never exceeds the first
    /// value, and during the last 2 s it does not exceed the second value \[m\].
    Resumes(f64, f64),
    /// The vehicle descends and touches down at most this fast \[m/s\], then disarms on the ground.
    Lands(f64),
    /// The vehicle descends without an attitude and disarms in the air 2.25 s after the last state. It hits the ground
    /// at most this fast \[m/s\].
    GivesUp(f64),
    /// The vehicle disarms at this time \[ms\].
    Stops(i64),
    /// The vehicle does not arm, and reports this reason.
    Refuses(Refusal),
    /// The vehicle does not arm, since no request arrives.
    Stays,
}

struct Case {
    name: &'static str,
    flight: Flight,
    faults: &'static [Fault],
    /// Requests after the request to arm.
    requests: &'static [(i64, VehicleCommand)],
    end_ms: i64,
    expected: Expected,
}

const fn case(name: &'static str, flight: Flight, faults: &'static [Fault], end_ms: i64, expected: Expected) -> Case {
    Case { name, flight, faults, requests: &[], end_ms, expected }
}

const fn asked(requests: &'static [(i64, VehicleCommand)], case: Case) -> Case {
    Case { requests, ..case }
}

use Expected::{Flies, GivesUp, Lands, Recovers, Refuses, Resumes, Stays, Stops};
use Flight::{Hover, Paper};
use Of::{Answers, Commands, Downlink, Rotors, Setpoints, States, Uplink};
use VehicleCommand::{Arm, Disarm, Kill};
use What::{
    Delay, Drop, DropSome, Flip, FlipSome, HoldBack, Jitter, KeepEach, Noise, Replay, Reverse, Truncate, Twice,
};

#[rustfmt::skip]
const CASES: &[Case] = &[
    // No fault.
    case("hover", Hover(2.0), &[], 10_000, Flies(0.05)),
    case("the paper's flight", Paper, &[], 42_000, Flies(0.5)),

    // Dropped frames. On its way to the reference, 1.5 m above the start, the vehicle is still 0.95 m away after one
    // second.
    case("19 ms without a state", Hover(2.0), &[(States, 3000..3019, Drop)], 10_000, Flies(0.1)),
    case("100 ms without a state, hovering", Hover(2.0), &[(States, 3000..3100, Drop)], 13_000, Recovers(0.1, 0.02)),
    case("240 ms without a state, hovering", Hover(2.0), &[(States, 3000..3240, Drop)], 13_000, Recovers(0.1, 0.02)),
    case("240 ms without a state, climbing towards the reference", Paper,
        &[(States, 1000..1240, Drop)], 15_000, Recovers(0.95, 0.1)),
    case("240 ms without a state, as a gust begins", Paper,
        &[(States, 7_450..7_690, Drop)], 22_000, Recovers(0.5, 0.2)),
    case("240 ms without a state, as parameters change", Paper,
        &[(States, 19_900..20_140, Drop)], 35_000, Recovers(0.5, 0.05)),
    case("100 ms of each second without a state, the paper's flight", Paper,
        &[(States, 5000..5100, Drop), (States, 6000..6100, Drop),
          (States, 7000..7100, Drop), (States, 8000..8100, Drop)],
        20_000, Recovers(0.5, 0.05)),
    case("300 ms without a state, hovering", Hover(2.0),
        &[(States, 3000..3300, Drop)], 15_000, Resumes(0.7, 0.01)),
    case("300 ms without a state, the paper's flight", Paper,
        &[(States, 10_000..10_300, Drop)], 40_000, Resumes(1.1, 0.01)),
    case("300 ms without a state, inertia and thrust off", Paper,
        &[(States, 25_000..25_300, Drop)], 45_000, Resumes(0.9, 0.01)),
    case("a second without a state, the paper's flight", Paper,
        &[(States, 10_000..11_000, Drop)], 40_000, Resumes(1.5, 0.01)),
    case("no state any more, hovering low", Hover(1.5), &[(States, 3000..FOREVER, Drop)], 10_000, Lands(2.0)),
    case("no state any more, hovering high", Hover(5.0), &[(States, 3000..FOREVER, Drop)], 10_000, GivesUp(9.0)),
    case("no state any more, the paper's flight", Paper, &[(States, 10_000..FOREVER, Drop)], 20_000, GivesUp(9.0)),
    // Without states, the vehicle cannot know that inertia and thrust have changed.
    case("no state any more, as parameters change", Paper, &[(States, 19_900..FOREVER, Drop)], 30_000, Lands(10.0)),
    case("the uplink is dead", Hover(1.5), &[(Uplink, 3000..FOREVER, Drop)], 10_000, Lands(2.0)),
    case("half of all states lost by chance, the paper's flight", Paper,
        &[(States, 0..FOREVER, DropSome(50))], 42_000, Flies(0.5)),
    case("one state in 10, the paper's flight", Paper, &[(States, 0..FOREVER, KeepEach(10))], 42_000, Flies(0.5)),
    case("one state in 20, hovering", Hover(2.0), &[(States, 0..FOREVER, KeepEach(20))], 20_000, Flies(0.05)),
    case("no setpoint for 10 s of the paper's flight", Paper, &[(Setpoints, 10_000..20_000, Drop)], 40_000, Flies(4.0)),
    case("no setpoint any more, hovering", Hover(2.0), &[(Setpoints, 3000..FOREVER, Drop)], 15_000, Flies(0.15)),

    // Delayed frames.
    case("states 10 ms late, the paper's flight", Paper, &[(States, 5_000..FOREVER, Delay(10))], 42_000, Flies(0.8)),
    // Each later state is as late as the first state. Such a delay looks like a difference between the clocks.
    case("states 30 ms late", Hover(1.5), &[(States, 3000..FOREVER, Delay(30))], 10_000, Resumes(0.9, 0.1)),
    case("states held back for 100 ms, then all at once", Hover(2.0),
        &[(States, 3000..3100, HoldBack)], 13_000, Recovers(0.1, 0.02)),
    case("states held back for a second, then all at once", Hover(2.0),
        &[(States, 3000..4000, HoldBack)], 15_000, Resumes(1.0, 0.01)),
    case("jitter of 15 ms, the paper's flight", Paper, &[(States, 0..FOREVER, Jitter(15))], 42_000, Flies(0.5)),
    case("setpoints 400 ms late, the paper's flight", Paper,
        &[(Setpoints, 0..FOREVER, Delay(400))], 42_000, Flies(0.6)),

    // These cases have corrupt and truncated frames.
    case("a flipped bit in one state in 4, the paper's flight", Paper,
        &[(States, 0..FOREVER, FlipSome(25))], 42_000, Flies(0.5)),
    case("a flipped bit in each state for 200 ms", Hover(2.0),
        &[(States, 3000..3200, Flip)], 13_000, Recovers(0.1, 0.02)),
    case("a flipped bit in each state from now on", Hover(1.5), &[(States, 3000..FOREVER, Flip)], 10_000, Lands(2.0)),
    case("a flipped bit in each setpoint of the paper's flight for 5 s", Paper,
        &[(Setpoints, 10_000..15_000, Flip)], 40_000, Flies(2.0)),
    case("truncated states for 100 ms", Hover(2.0), &[(States, 3000..3100, Truncate)], 13_000, Recovers(0.1, 0.02)),
    case("noise before everything, the paper's flight", Paper, &[(Uplink, 0..FOREVER, Noise)], 42_000, Flies(0.5)),
    asked(&[(5_000, Kill)],
        case("a flipped bit in a request to stop", Hover(2.0), &[(Commands, 5_000..5_010, Flip)], 10_000, Flies(0.1))),

    // These cases have repeated and reordered frames.
    case("every frame twice, the paper's flight", Paper, &[(Uplink, 0..FOREVER, Twice)], 42_000, Flies(0.5)),
    case("states in blocks of 10, back to front, the paper's flight", Paper,
        &[(States, 0..FOREVER, Reverse(10))], 42_000, Flies(0.6)),
    case("an old state again and again", Hover(1.5), &[(States, 3000..FOREVER, Replay)], 10_000, Lands(2.0)),
    case("an old state again and again for 100 ms of a climb", Paper,
        &[(States, 1000..1100, Replay)], 13_000, Recovers(0.95, 0.2)),

    // These cases disturb frames from the vehicle.
    case("half of all rotor commands lost by chance, the paper's flight", Paper,
        &[(Rotors, 0..FOREVER, DropSome(50))], 42_000, Flies(0.5)),
    case("rotor commands 5 ms late, the paper's flight", Paper, &[(Rotors, 0..FOREVER, Delay(5))], 42_000, Flies(0.5)),
    case("a flipped bit in one rotor command in 4, the paper's flight", Paper,
        &[(Rotors, 0..FOREVER, FlipSome(25))], 42_000, Flies(0.5)),
    case("every frame from the vehicle twice", Paper, &[(Downlink, 0..FOREVER, Twice)], 42_000, Flies(0.5)),
    case("no answers", Hover(2.0), &[(Answers, -HELD_MS..FOREVER, Drop)], 10_000, Flies(0.1)),

    // Requests.
    asked(&[(5_000, Disarm)], case("asked to disarm in flight", Hover(1.5), &[], 10_000, Flies(0.1))),
    asked(&[(5_000, Kill)], case("stopped in flight", Hover(1.5), &[], 10_000, Stops(5_000))),
    asked(&[(3_100, Kill)],
        case("stopped while coasting", Hover(1.5), &[(States, 3000..FOREVER, Drop)], 10_000, Stops(3_100))),
    asked(&[(3_600, Kill)],
        case("stopped while descending", Hover(1.5), &[(States, 3000..FOREVER, Drop)], 10_000, Stops(3_600))),
    asked(&[(3_600, Arm)],
        case("asked to arm while descending", Hover(2.0), &[(States, 3000..3500, Drop)], 15_000, Resumes(0.7, 0.01))),
    asked(&[(5_000, Arm)], case("asked to arm in flight", Hover(2.0), &[], 10_000, Flies(0.1))),

    // On the ground.
    case("never a state", Hover(1.0), &[(States, -HELD_MS..FOREVER, Drop)], 3_000, Refuses(Refusal::StateStale)),
    case("corrupt states only", Hover(1.0), &[(States, -HELD_MS..FOREVER, Flip)], 3_000, Refuses(Refusal::StateStale)),
    case("states stop 30 ms before arming", Hover(1.0),
        &[(States, -30..FOREVER, Drop)], 3_000, Refuses(Refusal::StateStale)),
    case("an old state again and again before arming", Hover(1.0),
        &[(States, -100..FOREVER, Replay)], 3_000, Refuses(Refusal::StateStale)),
    case("a flipped bit in the request to arm", Hover(1.0), &[(Commands, 0..1, Flip)], 3_000, Stays),
    case("the request to arm comes twice", Hover(2.0), &[(Commands, 0..1, Twice)], 10_000, Flies(0.1)),
];

// --- The link. ---

/// Generator of pseudo-random numbers, the same in every run.
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
    /// Time of arrival \[ms\], order of arrival within that ms, and the frame.
    under_way: Vec<(i64, i64, Vec<u8>)>,
    replayed: Option<Vec<u8>>,
}

impl Air {
    fn new(faults: &'static [Fault]) -> Self {
        Air { faults, chance: Chance(1), sent: 0, under_way: Vec::new(), replayed: None }
    }

    /// Sends the frames in `bytes`. Returns the bytes that arrive in this ms.
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

// --- The flight. ---

#[derive(Debug, Default)]
struct Seen {
    /// Start of each mode \[ms\], with the height at that time \[m\].
    modes: Vec<(i64, Mode, f64)>,
    answers: Vec<Result<Request, Refusal>>,
    /// Reason of a refusal to arm that the station received.
    refused: Option<&'static str>,
    /// Largest distance from the reference while armed, from the first fault on \[m\]. `last_m` is the same for the
    /// last 2 s.
    worst_m: f64,
    last_m: f64,
    /// Largest roll or pitch while armed \[rad\].
    tilt_rad: f64,
    /// Speed at the first ground contact \[m/s\].
    touchdown_m_s: Option<f64>,
    /// Largest height after the first ground contact \[m\].
    bounce_m: f64,
    /// True if the vehicle had touched the ground when the last mode began. `last_tilt_rad` is its roll or pitch at
    /// that time.
    touched_down_before: bool,
    last_tilt_rad: f64,
    /// Violations of rules that always hold.
    violations: Vec<String>,
}

fn fly(case: &Case) -> Seen {
    let scenario = case.flight.scenario();
    let ground = Realism { contact: Some(Contact::PAPER), ..Realism::default() };
    let mut plant =
        Plant::with_realism(scenario.model, scenario.initial, scenario.environment.clone(), &ground, STEP_S)
            .expect("in range");
    let (mut station, mut host) = (Station::new(), Host::new().expect("in range"));
    let (mut up, mut down) = (Air::new(case.faults), Air::new(case.faults));
    let first_ms = case.faults.iter().map(|(_, when, _)| when.start).min().unwrap_or(0);
    let from_ms = if first_ms > 0 { first_ms } else { SETTLED_MS };
    let (mut seen, mut released) = (Seen::default(), false);

    for now_ms in -HELD_MS..=case.end_ms {
        // Station.
        let reference = scenario.trajectory.at(now_ms.max(0) as f64 * 1e-3);
        let motion = plant.motion();
        station.track((now_ms + 2 * HELD_MS) as u64 * 1000, motion.measure());
        station.lead(reference.setpoint());
        if now_ms.rem_euclid(1_000) == 0 {
            // The heartbeat and the mode are sent again after an outage, which ends the mode.
            station.beat();
            station.follow();
        }
        if now_ms == 0 {
            station.command(VehicleCommand::Arm);
        }
        case.requests.iter().filter(|(at_ms, _)| *at_ms == now_ms).for_each(|(_, command)| station.command(*command));

        // Vehicle.
        let tick = host.next_tick(&up.pass(now_ms, &station.take()));
        station.hear(&down.pass(now_ms, &tick.bytes));
        let report = &tick.report;

        // Observation.
        let (height_m, eta) = (motion.position_m.z, &motion.attitude_rad);
        let tilt_rad = eta.x.abs().max(eta.y.abs());
        let on_ground = plant.telemetry().is_some_and(|telemetry| telemetry.on_ground);
        if seen.modes.last().is_none_or(|(_, mode, _)| *mode != report.mode) {
            seen.modes.push((now_ms, report.mode, height_m));
            (seen.touched_down_before, seen.last_tilt_rad) = (seen.touchdown_m_s.is_some(), tilt_rad);
        }
        seen.answers.extend(report.answer.map(|answer| answer.result.map(|()| answer.request)));
        seen.refused = station.heard().refusal().or(seen.refused);
        let mut never = |what: &str, happened: bool| {
            if happened && seen.violations.len() < 3 {
                seen.violations.push(format!("{what} at {now_ms} ms"));
            }
        };
        let stopped = report.throttles == [0; 8] && report.motors == RotorSpeeds::default();
        never("motors turn while disarmed", !report.mode.armed() && !stopped);
        never("motors stop while armed", report.mode.armed() && report.throttles[..4].contains(&0));
        never(
            "the station hears of motors that turn while disarmed",
            !station.heard().armed && station.heard().speeds != RotorSpeeds::default(),
        );
        if report.mode.armed() && now_ms >= from_ms && seen.touchdown_m_s.is_none() {
            let distance_m = (motion.position_m - reference.position_m).norm();
            seen.worst_m = seen.worst_m.max(distance_m);
            seen.tilt_rad = seen.tilt_rad.max(tilt_rad);
            if now_ms > case.end_ms - 2000 {
                seen.last_m = seen.last_m.max(distance_m);
            }
        }

        // Plant.
        if seen.touchdown_m_s.is_none() && on_ground {
            seen.touchdown_m_s = Some(motion.velocity_m_s.norm());
        }
        if seen.touchdown_m_s.is_some() {
            seen.bounce_m = seen.bounce_m.max(height_m);
        }
        released |= report.mode.armed();
        if released {
            plant.step(&station.heard().speeds, STEP_S);
        }
        let since_ms = seen.modes.last().map_or(0, |(at_ms, ..)| now_ms - at_ms);
        if released && !report.mode.armed() && on_ground && since_ms > 500 {
            break;
        }
    }
    seen
}

/// Returns the deviations from the expected result.
fn wrong(case: &Case, seen: &Seen) -> Vec<String> {
    let mut wrong = seen.violations.clone();
    let mut must = |what: String, holds: bool| {
        if !holds {
            wrong.push(what);
        }
    };
    let modes: Vec<_> = seen.modes.iter().map(|(_, mode, _)| *mode).collect();
    let coasted = modes.contains(&Mode::Coasting);
    let (last_ms, last_mode, _) = *seen.modes.last().expect("one at least");
    match case.expected {
        Flies(within_m) => {
            must("it keeps flying".into(), modes == [Mode::Disarmed, Mode::Flying]);
            must(format!("within {within_m} m"), seen.worst_m <= within_m);
        }
        Recovers(within_m, settled_m) => {
            must("it coasts".into(), coasted && !modes.contains(&Mode::Descending));
            must("it flies in the end".into(), last_mode == Mode::Flying);
            must(format!("within {within_m} m"), seen.worst_m <= within_m);
            must(format!("in the end within {settled_m} m"), seen.last_m <= settled_m);
        }
        Resumes(within_m, settled_m) => {
            must(
                "it coasts, descends, flies".into(),
                modes.ends_with(&[Mode::Coasting, Mode::Descending, Mode::Flying]),
            );
            must("it stays in the air".into(), seen.touchdown_m_s.is_none());
            must(format!("within {within_m} m"), seen.worst_m <= within_m);
            must(format!("in the end within {settled_m} m"), seen.last_m <= settled_m);
        }
        Lands(within_m_s) | GivesUp(within_m_s) => {
            must(
                "it coasts, descends, disarms".into(),
                modes.ends_with(&[Mode::Coasting, Mode::Descending, Mode::Disarmed]),
            );
            let lands = matches!(case.expected, Lands(_));
            must("it disarms on the ground, or in the air".into(), seen.touched_down_before == lands);
            must(
                format!("it lands at no more than {within_m_s} m/s"),
                seen.touchdown_m_s.is_some_and(|m_s| m_s <= within_m_s),
            );
            if within_m_s < CRASH_M_S {
                must("it stays on the ground".into(), seen.bounce_m < 0.3);
                must("it lands on its feet".into(), seen.last_tilt_rad < 0.1);
            }
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

/// Computes a result for each item on two threads, and returns the results in order.
fn in_parallel<T: Sync, R: Send>(of: &[T], work: fn(&T) -> R) -> Vec<R> {
    let (even, odd): (Vec<_>, Vec<_>) = std::thread::scope(|scope| {
        let odd = scope.spawn(|| of.iter().skip(1).step_by(2).map(work).collect());
        (of.iter().step_by(2).map(work).collect(), odd.join().expect("no panic"))
    });
    let (mut even, mut odd) = (even.into_iter(), odd.into_iter());
    (0..of.len()).filter_map(|index| if index % 2 == 0 { even.next() } else { odd.next() }).collect()
}

/// Flies every case. Fails with a list of all that did not end as expected.
fn check(cases: &[Case]) {
    let mut failures = String::new();
    for (case, seen) in cases.iter().zip(in_parallel(cases, fly)) {
        let Seen { worst_m, last_m, tilt_rad, touchdown_m_s, modes, .. } = &seen;
        println!(
            "{:<62} {worst_m:.3} {last_m:.3} m, {tilt_rad:.2} rad, {touchdown_m_s:.2?} m/s, {modes:.2?}",
            case.name
        );
        let wrong = wrong(case, &seen);
        if !wrong.is_empty() {
            let Case { name, faults, expected, .. } = case;
            let _ = writeln!(failures, "{name}, {faults:?}: expected {expected:?}: {wrong:?}: {seen:.3?}");
        }
    }
    assert!(failures.is_empty(), "\n{failures}");
}

#[test]
fn every_case_ends_as_it_should() {
    assert!(CASES.len() >= 20);
    check(CASES);
}

/// Outages may begin at any time of the paper's flight. The vehicle coasts through short ones and recovers. In longer
/// ones it descends, and it flies on when states have been back for a second.
#[test]
fn an_outage_may_come_at_any_time() {
    let outage = |start_ms: i64, length_ms: i64, end_ms: i64, expected: Expected| {
        let faults = vec![(States, start_ms..start_ms + length_ms, Drop)].leak();
        case("an outage in the paper's flight", Paper, faults, start_ms + end_ms, expected)
    };
    let cases: Vec<_> = (500..58_000)
        .step_by(5_100)
        .flat_map(|start_ms| {
            [
                // The first outage begins while the vehicle is still 1.36 m away from the reference, on its way from
                // 1.5 m.
                outage(start_ms, 240, 8_000, Recovers(if start_ms < 2_000 { 1.4 } else { 0.6 }, 0.5)),
                outage(start_ms, 300, 15_000, Resumes(if start_ms < 2_000 { 2.0 } else { 1.1 }, 0.5)),
                // A second after the rotors have lost 40 % of their thrust, the mean thrust that the blind descent
                // takes over is still too small, and the law has to stop a fall of 2.5 m/s.
                outage(start_ms, 1000, 15_000, Resumes(if start_ms == 20_900 { 3.0 } else { 2.2 }, 0.5)),
            ]
        })
        .collect();
    check(&cases);
}
