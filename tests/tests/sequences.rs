//! Random sequences of modes, links, weather and faults in the closed loop. The rules of [`airborne::checker`] hold at
//! every tick, and afterwards the vehicle is disarmed or flies where it should.
//!
//! `SEQUENCES=1000 cargo test --release -p flight-tests --test all sequences::` flies a thousand sequences; `FIRST=17
//! SEQUENCES=1` flies only number seventeen.

use crate::airborne;
use afbc_comms::services::modes;
use afbc_guidance::FlightMode;
use afbc_mavlink::{
    Address, CommandResult, ControlRequest, Datum, Downlink, Height, MissionMessage, MissionType, Storage, Uplink,
    VehicleCommand,
};
use airborne::checker::{Bounds, End};
use airborne::session::{global, item};
use airborne::{COMPANION, Checker, STATION, Session, Tick, on_all_cores, place, velocity};
use proptest::prelude::*;
use proptest::sample::select;
use proptest::strategy::ValueTree;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use std::env;

/// Number of sequences in an ordinary run.
const SEQUENCES: u64 = 150;
/// Time before the first step, in which an indoor vehicle becomes ready \[ms\]. `READY_OUTDOORS_MS` is for an outdoor
/// vehicle.
const READY_MS: u32 = 4000;
const READY_OUTDOORS_MS: u32 = 9000;
/// Silence after which a station counts as lost \[s\]. `LANDS_MS` is the time in which the vehicle then lands \[ms\].
const LOST_S: f32 = 3.0;
const LANDS_MS: u32 = 45_000;
/// Bounds for the sequences, which have wind, turns in all directions at up to 5 m/s, and a fence of 25 m by 12 m.
const BOUNDS: Bounds =
    Bounds { tilt_rad: 1.2, speed_m_s: 11.0, height_m: 22.0, radius_m: 60.0, touch_m_s: 1.6, cut: false };
/// Parameters of the fence's radius and height \[m\].
const FENCE: [(&str, f32); 2] = [("GF_MAX_HOR_DIST", 25.0), ("GF_MAX_VER_DIST", 12.0)];

#[derive(Clone, Debug)]
enum Step {
    /// A station sends a message.
    Say(Address, Uplink),
    /// A station sends a target repeatedly, or stops doing so.
    Stream(Address, Option<Uplink>),
    Reach(Address, bool),
    Breaks(Address, u32),
    Noise(Vec<u8>),
    Upload(Address, [f32; 3], bool),
    /// Changes weather or causes a fault.
    Line(String),
    Wait(u32),
}

fn steps() -> impl Strategy<Value = Vec<Step>> {
    let station = || prop_oneof![4 => Just(STATION), 1 => Just(COMPANION)];
    let mode = select(FlightMode::ALL.to_vec());
    let command = prop_oneof![
        6 => Just(VehicleCommand::Arm),
        2 => Just(VehicleCommand::Disarm),
        5 => (0.5_f32..6.0).prop_map(|metres| VehicleCommand::TakeOff(Height { metres, above: Datum::Here })),
        2 => Just(VehicleCommand::Land),
        2 => Just(VehicleCommand::Return),
        6 => mode.prop_map(|mode| VehicleCommand::SelectMode(modes::custom(mode))),
        2 => Just(VehicleCommand::StartMission(0, None)),
        1 => (0_u16..4).prop_map(|number| VehicleCommand::SetCurrent(Some(number), false)),
        1 => Just(VehicleCommand::Home(None)),
        1 => (0.5_f32..5.0).prop_map(VehicleCommand::Speed),
        3 => (-30.0_f32..30.0, -30.0_f32..30.0, 1.0_f32..14.0).prop_map(|(x, y, z)| VehicleCommand::Reposition {
            place: global(x, y, z),
            yaw_rad: f32::NAN,
            speed_m_s: None,
            changes_mode: true,
        }),
        1 => Just(VehicleCommand::CheckArming),
        1 => Just(VehicleCommand::Storage(Storage::Save)),
        1 => Just(VehicleCommand::Engage),
        1 => Just(VehicleCommand::Other(31_999)),
        1 => Just(VehicleCommand::Denied(400)),
    ];
    // Kill is rare, since it ends a flight.
    let command = prop_oneof![60 => command, 1 => Just(VehicleCommand::Kill)];
    let target = prop_oneof![
        (-20.0_f32..20.0, -20.0_f32..20.0, 0.5_f32..10.0).prop_map(|(x, y, z)| place(x, y, z)),
        (-5.0_f32..5.0, -5.0_f32..5.0, -1.5_f32..3.0).prop_map(|(x, y, z)| velocity(x, y, z)),
    ];
    let control = select(vec![ControlRequest::Take, ControlRequest::Release]);
    let line = prop_oneof![
        (-4.0_f64..4.0, -4.0_f64..4.0).prop_map(|(x, y)| format!("wind {x:.1} {y:.1} 0")),
        (-4.0_f64..4.0, -4.0_f64..4.0).prop_map(|(x, y)| format!("gust {x:.1} {y:.1} 0 0.5 1")),
        (1.0_f64..9.0).prop_map(|seconds| format!("fault AID lost {seconds:.1}")),
        (0.3_f64..4.0).prop_map(|seconds| format!("fault imu noisy 0.1 1 {seconds:.1}")),
        (0.03_f64..0.5).prop_map(|share| format!("battery {share:.2}")),
        (1_u8..=4, 0.8_f64..1.0).prop_map(|(rotor, share)| format!("rotor {rotor} {share:.2}")),
    ];
    let step = prop_oneof![
        20 => (station(), command).prop_map(|(from, command)| Step::Say(from, Uplink::Command(command))),
        6 => (station(), target.clone()).prop_map(|(from, target)| Step::Stream(from, Some(target))),
        2 => station().prop_map(|from| Step::Stream(from, None)),
        1 => (station(), target).prop_map(|(from, target)| Step::Say(from, target)),
        3 => (station(), proptest::bool::weighted(0.7)).prop_map(|(of, reaches)| Step::Reach(of, reaches)),
        1 => (station(), select(vec![0, 0, 2, 3, 7])).prop_map(|(of, one_of)| Step::Breaks(of, one_of)),
        2 => proptest::collection::vec(any::<u8>(), 1..300).prop_map(Step::Noise),
        1 => (station(), control).prop_map(|(from, wish)| Step::Say(from, Uplink::Control(wish))),
        1 => station().prop_map(|from| Step::Say(from, Uplink::Mission(MissionMessage::Clear(MissionType::MISSION)))),
        2 => (station(), [-28.0_f32..28.0, -20.0_f32..20.0, 1.5_f32..9.0], any::<bool>())
            .prop_map(|(from, at, lands)| Step::Upload(from, at, lands)),
        4 => line.prop_map(Step::Line),
        20 => (100_u32..2500).prop_map(Step::Wait),
    ];
    proptest::collection::vec(step, 10..45)
}

/// Returns the steps of a sequence. Half of the sequences begin with a flight.
fn sequence(number: u64) -> Vec<Step> {
    let mut seed = [0; 32];
    seed.iter_mut().zip(number.to_le_bytes()).for_each(|(to, from)| *to = from);
    let mut runner = TestRunner::new_with_rng(Config::default(), TestRng::from_seed(RngAlgorithm::ChaCha, &seed));
    let drawn = steps().new_tree(&mut runner).unwrap().current();
    let take_off = VehicleCommand::TakeOff(Height { metres: 3.0, above: Datum::Here });
    let say = |command| Step::Say(STATION, Uplink::Command(command));
    let flies = [say(VehicleCommand::Arm), Step::Wait(100), say(take_off), Step::Wait(3000)];
    let begin = if number.is_multiple_of(4) { &[][..] } else { &flies[..] };
    begin.iter().cloned().chain(drawn).collect()
}

/// Result of a sequence.
struct Flown {
    checker: Checker,
    end: End,
    flew: bool,
}

/// Flies a sequence. Also passes each tick to `see`.
fn fly(number: u64, mut see: impl FnMut(&Tick)) -> Flown {
    let indoors = number % 2 == 1;
    let mut session = Session::new(indoors, number);
    let cells = [("BAT1_N_CELLS", 3.0), ("BAT1_V_EMPTY", 3.3), ("BAT1_V_CHARGED", 4.2), ("BAT1_R_INTERNAL", 0.02)];
    let rest = [("COM_DL_LOSS_T", LOST_S), ("RTL_RETURN_ALT", 6.0), ("GF_ACTION", (number % 5) as f32)];
    FENCE.iter().chain(&cells).chain(&rest).for_each(|(name, value)| session.set(name, *value));
    let mut checker = Checker::new(BOUNDS, LOST_S, true);
    let mut flew = false;
    let mut run = |session: &mut Session, checker: &mut Checker, milliseconds: u32| {
        for _ in 0..milliseconds {
            let tick = session.step();
            checker.see(&tick);
            see(&tick);
            flew |= checker.armed() && tick.truth.position_m.z > 1.0;
        }
    };
    run(&mut session, &mut checker, if indoors { READY_MS } else { READY_OUTDOORS_MS });
    for step in sequence(number) {
        match step {
            Step::Say(from, message) => session.say(from, message),
            Step::Stream(from, target) => session.stream(from, target),
            Step::Reach(of, reaches) => session.reach(of, reaches),
            Step::Breaks(of, one_of) => session.breaks(of, one_of),
            Step::Noise(bytes) => session.noise(&bytes),
            Step::Upload(from, [x, y, z], lands) => {
                let last = if lands { item(1, 20, [0.0; 3]) } else { item(1, 16, [-x, y, z]) };
                session.upload(from, vec![item(0, 16, [x, y, z]), last]);
            }
            Step::Line(line) => session.line(&line.replace("AID", if indoors { "tracker" } else { "gnss" })),
            Step::Wait(milliseconds) => run(&mut session, &mut checker, milliseconds),
        }
        run(&mut session, &mut checker, 20);
    }
    // All faults are removed. The stations fall silent, or stay without giving more orders.
    session.line("clear");
    session.line("wind 0 0 0");
    let silent = !number.is_multiple_of(3);
    for station in [STATION, COMPANION] {
        session.stream(station, None);
        session.breaks(station, 0);
        session.reach(station, !silent && station == STATION);
    }
    let mut waited_ms = 0;
    let lands = |checker: &Checker| silent || matches!(checker.mode(), FlightMode::Land | FlightMode::Return);
    while waited_ms < LANDS_MS && (checker.armed() && lands(&checker) || waited_ms < 12_000) {
        run(&mut session, &mut checker, 500);
        waited_ms += 500;
    }
    // The rotors have time to stop.
    run(&mut session, &mut checker, 500);
    let end = checker.end();
    Flown { checker, end, flew }
}

/// Returns the rules that do not hold. A killed vehicle falls; a vehicle without stations lands.
fn complaints(number: u64, flown: &Flown) -> Vec<String> {
    let mut complaints = flown.checker.complaints.clone();
    let silent = !number.is_multiple_of(3);
    if silent && flown.end != End::Disarmed {
        complaints.push(format!("no station is heard, and it ends {:?} in {:?}", flown.end, flown.checker.mode()));
    }
    complaints
}

#[test]
fn random_sequences_end_where_they_should() {
    let of = |name: &str| env::var(name).ok().and_then(|number| number.parse().ok());
    let (first, count) = (of("FIRST").unwrap_or(1), of("SEQUENCES").unwrap_or(SEQUENCES));
    let numbers: Vec<u64> = (first..first + count).collect();
    let flown = on_all_cores(&numbers, |number| fly(*number, |_| ()));
    let mut wrong = Vec::new();
    for (number, flown) in numbers.iter().zip(&flown) {
        let complaints = complaints(*number, flown);
        if !complaints.is_empty() || count == 1 {
            let Checker { extremes, texts, .. } = &flown.checker;
            wrong.push(format!(
                "sequence {number}: {complaints:#?}\n{extremes:?} {:?}\n{texts:?}",
                flown.checker.last().unwrap()
            ));
        }
    }
    let flew = flown.iter().filter(|flown| flown.flew).count();
    let ends = |end: End| flown.iter().filter(|flown| flown.end == end).count();
    println!(
        "{count} sequences: {flew} flew, {} end disarmed, {} hold, {} fly on, {} wrong",
        ends(End::Disarmed),
        ends(End::Holds),
        ends(End::Flies),
        wrong.len()
    );
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
    assert!(count < 10 || flew * 2 > numbers.len(), "{flew} of {count} flew");
}

/// Tests the checker itself: it must complain about each of these falsified records.
#[test]
fn the_checker_complains_of_falsified_records() {
    let mut session = Session::new(true, 1);
    let mut ticks = Vec::new();
    session.arm(|tick| ticks.push(tick.clone()));
    session.say(STATION, Uplink::Command(VehicleCommand::TakeOff(Height { metres: 2.0, above: Datum::Here })));
    let mut run = |session: &mut Session, milliseconds: u32| {
        ticks.extend((0..milliseconds).map(|_| session.step()));
    };
    run(&mut session, 6000);
    session.say(STATION, Uplink::Command(VehicleCommand::Land));
    run(&mut session, 9000);
    let judge = |ticks: &[Tick]| {
        let mut checker = Checker::new(Bounds::DEFAULT, 10.0, true);
        ticks.iter().for_each(|tick| checker.see(tick));
        checker.end();
        checker.complaints
    };
    assert_eq!(judge(&ticks), [""; 0]);
    let is_answer = |message: &Downlink, id: u16| match message {
        Downlink::CommandAck { command, answer: CommandResult::Accepted, .. } => *command == id,
        _ => false,
    };
    let is_text = |message: &Downlink, wanted: &str| match message {
        Downlink::Text { text, .. } => text.to_str().is_ok_and(|text| text.contains(wanted)),
        _ => false,
    };
    let high = ticks.iter().position(|tick| tick.truth.position_m.z > 1.5).unwrap();
    type Falsify<'a> = Box<dyn Fn(&mut Vec<Tick>) + 'a>;
    let without = |unwanted: &'static dyn Fn(&Downlink) -> bool| -> Falsify<'_> {
        Box::new(move |ticks| ticks.iter_mut().for_each(|tick| tick.heard.retain(|message| !unwanted(message))))
    };
    let falsified: [(&str, Falsify<'_>); 10] = [
        ("armed by nobody", without(Box::leak(Box::new(move |it: &Downlink| is_answer(it, 400))))),
        ("the heartbeat says", without(Box::leak(Box::new(move |it: &Downlink| is_text(it, "land: ordered"))))),
        ("nobody was told", without(Box::leak(Box::new(move |it: &Downlink| is_text(it, "on the ground"))))),
        ("disarmed motors turn", Box::new(|ticks| ticks[500].truth.rotor_rad_s = 50.0)),
        (
            "commanded to turn",
            Box::new(|ticks| {
                for message in &mut ticks[10].heard {
                    if let Downlink::Rotors { speeds, .. } = message {
                        speeds.0[2] = 1.0;
                    }
                }
            }),
        ),
        (
            "disarmed in the air",
            Box::new(move |ticks| {
                for message in ticks[high..].iter_mut().flat_map(|tick| &mut tick.heard) {
                    if let Downlink::Rotors { armed, .. } = message {
                        *armed = false;
                    }
                }
            }),
        ),
        (
            "motors off in the air",
            Box::new(move |ticks| {
                ticks[high..high + 500].iter_mut().for_each(|tick| tick.truth.rotor_rad_s = 0.0);
            }),
        ),
        ("tilt", Box::new(move |ticks| ticks[high].truth.tilt_rad = 1.0)),
        (
            "touches the ground",
            Box::new(move |ticks| {
                let touch = (high..).find(|place| ticks[*place].truth.on_ground).unwrap();
                ticks[touch - 1].truth.velocity_m_s.z = -2.0;
            }),
        ),
        (
            "ends armed on the ground or falling",
            Box::new(move |ticks| {
                let touch = (high..).find(|place| ticks[*place].truth.on_ground).unwrap();
                ticks.truncate(touch + 1);
            }),
        ),
    ];
    for (wanted, falsify) in falsified {
        let mut record = ticks.clone();
        falsify(&mut record);
        let complaints = judge(&record);
        assert!(complaints.iter().any(|complaint| complaint.contains(wanted)), "{wanted}: {complaints:?}");
    }
}
