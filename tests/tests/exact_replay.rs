//! An exact log repeats its flight to the last bit, and differences are reported.

use crate::exact_flights::{SCENARIO, fly, log_of, records};
use afbc_log::exact::{FRAME_MAX as RECORD_MAX, Frames, Record, ReplayDifference, ReplayStep, Replayer};
use afbc_onboard::Configuration;
use afbc_scenario::load;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use std::path::Path;

/// Replays the log. Returns the number of ticks and the first difference.
fn replay(log: &[u8]) -> (u32, Option<ReplayDifference>) {
    let (mut replayer, mut frames) = (Replayer::new(Configuration::default()).unwrap(), Frames::default());
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

#[test]
fn flights_are_flown_again_to_the_last_bit() {
    let scenario = load(Path::new(SCENARIO)).unwrap();
    for seed in 0..10 {
        let log = fly(&scenario, seed, 25_000);
        assert_eq!(replay(&log), (25_000, None), "seed {seed}");
        assert!(log.len() < 25_000 * 80, "{} bytes a tick", log.len() / 25_000);
    }
}

/// A changed bit of a reading changes the flight at that tick or soon after. A changed output of a tick, or a missing
/// tick, is reported at once.
#[test]
fn what_differs_is_named() {
    let scenario = load(Path::new(SCENARIO)).unwrap();
    let log = fly(&scenario, 3, 12_000);
    let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
    let whole = records(&log);
    for _ in 0..30 {
        let at = loop {
            let at = random.next_u32() as usize % whole.len();
            if matches!(&whole[at], Record::Tick(tick, _) if tick.readings.imu.is_some() && tick.number > 2_000) {
                break at;
            }
        };
        let mut changed = whole.clone();
        let Record::Tick(tick, given) = &mut changed[at] else { panic!("a tick") };
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
                given.throttles[random.next_u32() as usize % 4] ^= 1 << (random.next_u32() % 11);
                let (ticks, difference) = replay(&log_of(&changed));
                assert_eq!(ticks, number);
                let named =
                    matches!(&difference, Some(ReplayDifference::Given { number: named, .. }) if *named == number);
                assert!(named, "{difference:?}");
            }
            _ => {
                changed.remove(at);
                assert_eq!(replay(&log_of(&changed)), (number, Some(ReplayDifference::Missing(number))));
            }
        }
    }
}

/// A board measures its battery separately from the messages. The battery values that a tick used count, too.
#[test]
fn a_battery_counts() {
    let scenario = load(Path::new(SCENARIO)).unwrap();
    let mut changed = records(&fly(&scenario, 3, 40_000));
    let full = replay(&log_of(&changed));
    assert_eq!(full, (40_000, None));
    for record in &mut changed {
        if let Record::Tick(tick, _) = record
            && tick.number >= 10_000
        {
            tick.battery.as_mut().unwrap().voltage_v = 7.0;
        }
    }
    let (ticks, difference) = replay(&log_of(&changed));
    assert!((10_000..40_000).contains(&ticks), "{ticks}: {difference:?}");
}

/// The longest record fits into a frame.
#[test]
fn every_record_fits() {
    let scenario = load(Path::new(SCENARIO)).unwrap();
    let longest = records(&fly(&scenario, 5, 20_000)).into_iter().map(|record| log_of(&[record]).len()).max().unwrap();
    assert!(longest < RECORD_MAX / 2, "{longest}");
}

/// Damaged bytes are always noticed. They never cause a panic, or pass for the original flight.
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
        // An additional zero between two frames has no effect. The log may end within a frame.
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
