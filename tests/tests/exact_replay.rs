//! A flight is flown again from its exact log, to the last bit, and what differs is named.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::indexing_slicing,
    missing_docs,
    reason = "a test that cannot go on should say why"
)]

use afbc_hil::Host;
use afbc_link::telemetry::BatteryStatus;
use afbc_link::{Address, Command, Datum, FRAME_MAX, Height, ParameterRequest, Sender, Uplink};
use afbc_onboard::Configuration;
use afbc_recorder::{FRAME_MAX as RECORD_MAX, Frames, Record, ReplayDifference, ReplayStep, Replayer, write};
use afbc_scenario::{Scenario, load};
use afbc_sim::flight::World;
use afbc_station::AuxSensors;
use afbc_types::{ROTORS_MAX, RotorSpeeds, State};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use std::cell::RefCell;
use std::path::Path;
use std::rc::Rc;

const STATION: Address = Address { system: 255, component: 190 };
/// Types of parameters, as MAV_PARAM_TYPE.
const INT32: u8 = 6;
const REAL32: u8 = 9;
/// From the ground, outdoors.
const SCENARIO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../twin/scenarios/hover.toml");

/// What a station sends in this millisecond, if anything: a flight with whatever comes to a tester's mind.
fn sends(ms: u64, random: &mut Xoshiro256PlusPlus) -> Option<Uplink> {
    let command = |command| Some(Uplink::Command(command));
    match ms {
        500 => return Some(set(b"BAT1_N_CELLS", 3_i32.to_le_bytes(), INT32)),
        6_000 | 7_000 | 8_000 | 9_000 => return command(Command::Arm),
        6_300 | 7_300 | 8_300 | 9_300 => return command(Command::TakeOff(Height { metres: 4.0, above: Datum::Home })),
        18_000 => return command(Command::Land),
        _ if ms.is_multiple_of(1_000) => return Some(Uplink::Heartbeat),
        _ => {}
    }
    match random.next_u32() % 300 {
        // Parameters alone before it flies.
        number if ms < 9_500 && number != 4 => None,
        0 => command(Command::Speed(1.0 + (random.next_u32() % 5) as f32)),
        1 => command(Command::Engage),
        2 => command(Command::SelectStandardMode((random.next_u32() % 8) as u8)),
        3 => command(Command::Home(None)),
        4 => {
            let speed_m_s = 2.0_f32 + (random.next_u32() % 9) as f32;
            Some(set(b"MPC_XY_VEL_MAX", speed_m_s.to_le_bytes(), REAL32))
        }
        5 => Some(Uplink::State { sent_us: ms * 1_000, state: State::default(), sigmas: Default::default() }),
        6 if ms > 12_000 => command(Command::Return),
        _ => None,
    }
}

/// Sets a parameter.
fn set(name: &[u8], value: [u8; 4], kind: u8) -> Uplink {
    let mut letters = [0; 16];
    letters.iter_mut().zip(name).for_each(|(to, from)| *to = *from);
    Uplink::Parameter(ParameterRequest::Set { name: letters, value, kind })
}

/// Flies, with noise on the link, and returns the log.
fn fly(scenario: &Scenario, seed: u64, ticks: u64) -> Vec<u8> {
    let (log, mut host) = (Rc::new(RefCell::new(Vec::new())), Host::new().unwrap());
    let sink = Rc::clone(&log);
    host.record(move |frame| sink.borrow_mut().extend_from_slice(frame));
    let battery = BatteryStatus { voltage_mv: 12_500, current_ca: 500, ..BatteryStatus::default() };
    host.comms().set_aux_sensors(AuxSensors { battery: Some(battery), ..AuxSensors::default() });
    let mut world = World::released(&Scenario { seed, ..scenario.clone() }, 1e-3).unwrap();
    let (mut random, mut sender) = (Xoshiro256PlusPlus::seed_from_u64(seed), Sender::new(STATION));
    let (mut speeds, mut buffer) = (RotorSpeeds::<ROTORS_MAX>::default(), [0; FRAME_MAX]);
    for ms in 0..ticks {
        world.advance(&speeds);
        world.look();
        host.sense(&world.readings().copied().unwrap_or_default());
        let mut bytes =
            sends(ms, &mut random).map_or(Vec::new(), |message| sender.send(&message, &mut buffer).to_vec());
        if random.next_u32() % 50 == 0 {
            bytes.extend((0..random.next_u32() % 40).map(|_| random.next_u32() as u8));
        }
        // Late ticks, too.
        let tick = host.tick(&bytes, 1_000 * (ms + 1) + u64::from(random.next_u32() % 20), 50.0);
        speeds = tick.report.motors;
    }
    drop(host);
    Rc::try_unwrap(log).unwrap().into_inner()
}

/// Flies again; returns the number of ticks and the first difference.
fn replay(log: &[u8]) -> (u32, Option<ReplayDifference>) {
    let (mut replayer, mut frames) = (Replayer::new(Configuration::<4>::default()).unwrap(), Frames::default());
    let (mut ticks, mut armed) = (0, false);
    for record in log.iter().filter_map(|byte| frames.take(*byte)) {
        match replayer.take(&record) {
            ReplayStep::Nothing => {}
            ReplayStep::Same(report) => (ticks, armed) = (ticks + 1, armed || report.mode.armed()),
            ReplayStep::Differs(difference, _) => return (ticks, Some(difference)),
        }
    }
    assert!(armed || ticks < 10_000, "it flew");
    (ticks, None)
}

fn records(log: &[u8]) -> Vec<Record> {
    let mut frames = Frames::default();
    let records = log.iter().filter_map(|byte| frames.take(*byte)).collect();
    assert_eq!(frames.damaged(), 0);
    records
}

fn log_of(records: &[Record]) -> Vec<u8> {
    records.iter().flat_map(|record| write(record, &mut [0; RECORD_MAX]).unwrap().to_vec()).collect()
}

#[test]
fn flights_are_flown_again_to_the_last_bit() {
    let scenario = load(Path::new(SCENARIO)).unwrap();
    for seed in 0..10 {
        let log = fly(&scenario, seed, 25_000);
        assert_eq!(replay(&log), (25_000, None), "seed {seed}");
        assert!(log.len() < 25_000 * 80, "{} bytes a tick", log.len() / 25_000);
    }
}

/// A bit of a reading that is not as it was changes the flight, from that tick on or soon after; what a tick gave that
/// is not as it was is named at once, and so is a tick that is missing.
#[test]
fn what_differs_is_named() {
    let scenario = load(Path::new(SCENARIO)).unwrap();
    let log = fly(&scenario, 3, 12_000);
    let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
    let whole = records(&log);
    for _ in 0..30 {
        let at = loop {
            let at = random.next_u32() as usize % whole.len();
            if matches!(&whole[at], Record::Tick(tick) if tick.readings.imu.is_some() && tick.number > 2_000) {
                break at;
            }
        };
        let mut changed = whole.clone();
        let Record::Tick(tick) = &mut changed[at] else { panic!("a tick") };
        let number = tick.number;
        match random.next_u32() % 3 {
            0 => {
                let [rates, _] = &mut tick.readings.imu.as_mut().unwrap().value;
                rates.x = f32::from_bits(rates.x.to_bits() ^ 1 << (random.next_u32() % 22 + 1));
                let (ticks, difference) = replay(&log_of(&changed));
                assert!((number..number + 3).contains(&ticks), "{ticks}: {difference:?}");
                assert!(matches!(difference, Some(ReplayDifference::Given { .. })), "{difference:?}");
            }
            1 => {
                tick.given.throttles[random.next_u32() as usize % 4] ^= 1 << (random.next_u32() % 11);
                let (ticks, difference) = replay(&log_of(&changed));
                assert_eq!(ticks, number);
                let named =
                    matches!(difference, Some(ReplayDifference::Given { number: named, .. }) if named == number);
                assert!(named, "{difference:?}");
            }
            _ => {
                changed.remove(at);
                assert_eq!(replay(&log_of(&changed)), (number, Some(ReplayDifference::Missing(number))));
            }
        }
    }
}

/// A board measures its battery beside the messages; what a tick took of it counts, too.
#[test]
fn a_battery_counts() {
    let scenario = load(Path::new(SCENARIO)).unwrap();
    let mut changed = records(&fly(&scenario, 3, 40_000));
    let full = replay(&log_of(&changed));
    assert_eq!(full, (40_000, None));
    for record in &mut changed {
        if let Record::Tick(tick) = record
            && tick.number >= 10_000
        {
            tick.battery.as_mut().unwrap().voltage_v = 7.0;
        }
    }
    let (ticks, difference) = replay(&log_of(&changed));
    assert!((10_000..40_000).contains(&ticks), "{ticks}: {difference:?}");
}

/// The longest record has room in a frame.
#[test]
fn every_record_fits() {
    let scenario = load(Path::new(SCENARIO)).unwrap();
    let longest = records(&fly(&scenario, 5, 20_000)).into_iter().map(|record| log_of(&[record]).len()).max().unwrap();
    assert!(longest < RECORD_MAX / 2, "{longest}");
}

/// Damaged bytes are noticed, whatever they are: never a panic, never another flight that passes for this one.
#[test]
fn damaged_bytes_are_noticed() {
    let scenario = load(Path::new(SCENARIO)).unwrap();
    let log = fly(&scenario, 4, 1_000);
    let mut random = Xoshiro256PlusPlus::seed_from_u64(8);
    for _ in 0..100 {
        let mut damaged = log.clone();
        let at = random.next_u32() as usize % damaged.len();
        match random.next_u32() % 3 {
            0 => damaged[at] ^= 1 << (random.next_u32() % 8),
            1 => drop(damaged.remove(at)),
            _ => damaged.insert(at, random.next_u32() as u8),
        }
        let (ticks, difference) = replay(&damaged);
        // A zero more between two frames is nothing; the log may end with what is left of a frame.
        let read = records_or_none(&damaged);
        let is_noticed = read.as_ref().is_none_or(|read| *read == records(&log)) || difference.is_some();
        assert!(is_noticed || ticks == 999, "{at}: {ticks}");
    }
    let noise: Vec<u8> = (0..100_000).map(|_| random.next_u32() as u8).collect();
    assert_eq!(replay(&noise), (0, None));
}

fn records_or_none(log: &[u8]) -> Option<Vec<Record>> {
    let mut frames = Frames::default();
    let records = log.iter().filter_map(|byte| frames.take(*byte)).collect();
    (frames.damaged() == 0).then_some(records)
}
