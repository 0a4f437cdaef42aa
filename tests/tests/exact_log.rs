//! Exact logs in files: their contents, the first difference of a replay, and the commands with other settings.

use crate::exact_flights::{SCENARIO, fly, fly_with, log_of, records};
use afbc::Profile;
use afbc_files::read::FileError;
use afbc_hil::Host;
use afbc_log::exact::{Given, Record};
use afbc_onboard::Configuration;
use afbc_replay::exact::{
    ChangeComparison, ExactReplay, FirstDifference, GivenSignal, QUANTITIES, ReplayFinding, SettingChange, replay,
};
use afbc_report::exact::{ReplayedLog, problem, table};
use afbc_scenario::contender::{ControllerKind, Law};
use afbc_scenario::load;
use afbc_vehicles::{Vehicle, built_in};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

/// A log of a flight without faults.
static LOG: LazyLock<Vec<u8>> = LazyLock::new(|| fly(&load(Path::new(SCENARIO)).unwrap(), 3, 13_000));

/// Returns the path of a file for a test.
fn file(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("exact_log");
    fs::create_dir_all(&folder).unwrap();
    folder.join(format!("{test}.log"))
}

/// Writes these bytes to a file and replays it.
fn read(test: &str, bytes: &[u8], changes: &[&str]) -> Result<ExactReplay, FileError> {
    let path = file(test);
    fs::write(&path, bytes).unwrap();
    let changes: Vec<SettingChange> = changes.iter().map(|change| change.parse().unwrap()).collect();
    replay(&path, None, &changes, |_| {})
}

fn line(test: &str, bytes: &[u8]) -> String {
    let line = read(test, bytes, &[]).map(|_| ()).unwrap_err().to_string();
    assert!(line.contains(&format!("{test}.log")) && !line.contains('\n') && line.contains(';'), "{line}");
    line
}

fn paper() -> Vehicle {
    built_in("paper").unwrap().read().unwrap()
}

/// An image without a vehicle file has the built-in vehicle whose name it writes into the log.
#[test]
fn the_papers_vehicle_is_built_in() {
    assert_eq!(paper().configuration().unwrap(), Configuration::default());
}

#[test]
fn it_says_what_is_in_the_log() {
    let found = read("contents", &LOG, &[]).unwrap();
    assert_eq!((found.vehicle.as_str(), found.law.as_str(), found.rotors), ("paper", "afbc", 4));
    assert_eq!((found.ticks, found.same_ticks, found.starts, found.lost_ticks), (13_000, 13_000, 1, 0));
    let read_records = records(&LOG);
    let armed = |record: &&Record| matches!(record, Record::Tick(_, given) if given.throttles[0] > 0);
    assert_eq!(found.armed_ticks, read_records.iter().filter(armed).count() as u64);
    assert!(found.armed_ticks > 1_000 && found.flights >= 1 && found.is_same());
    let changed = read_records.iter().filter(|record| matches!(record, Record::Parameter { .. })).count();
    assert!(changed > 0 && found.parameters.len() == changed);
    assert!(found.parameters.iter().any(|it| it.name.as_deref() == Some("BAT1_N_CELLS") && it.value == 3.0));
    let log = ReplayedLog { name: "contents", replay: &found };
    let said = table(&log);
    assert!(said.contains("paper under afbc, 13000 ticks (13.0 s)") && said.contains("to the last bit"), "{said}");
    assert_eq!(problem(&log), None);
}

/// The flight image's code repeats flights under every law, with every preset of faults.
#[test]
fn every_law_and_flights_with_faults_are_the_same_again() {
    let scenario = load(Path::new(SCENARIO)).unwrap();
    for (seed, kind) in (0..).zip(ControllerKind::ALL) {
        let host = match kind {
            ControllerKind::Afbc => Host::new().unwrap(),
            kind => Host::under(&paper(), Law::on(kind, &paper(), Profile::Flight).unwrap()).unwrap(),
        };
        let log = fly_with(host, &scenario, seed, 16_000, true);
        let found = read(kind.name(), &log, &[]).unwrap();
        assert!(found.is_same(), "{}: {:?}", kind.name(), found.first_difference);
        assert_eq!((found.law.as_str(), found.same_ticks), (kind.name(), 16_000));
        assert!(found.armed_ticks > 100, "{}", kind.name());
    }
    for seed in 20..40 {
        let log = fly_with(Host::new().unwrap(), &scenario, seed, 16_000, true);
        let found = read("faults", &log, &[]).unwrap();
        assert!(found.is_same() && found.same_ticks == 16_000, "seed {seed}: {:?}", found.first_difference);
    }
}

/// Built-in vehicles are found by the names in their logs.
#[test]
fn built_in_vehicles_are_known_by_name() {
    let scenario = load(Path::new(SCENARIO)).unwrap();
    let mut rotors = Vec::new();
    for known in &afbc_vehicles::BUILT_IN {
        let vehicle = known.read().unwrap();
        let on = scenario.clone().on(&vehicle, Profile::Flight).unwrap();
        let log = fly_with(Host::for_vehicle(&vehicle).unwrap(), &on, 1, 3_000, false);
        let found = read(known.name, &log, &[]).unwrap();
        assert!(found.is_same() && found.vehicle == known.name, "{}: {:?}", known.name, found.first_difference);
        rotors.push(found.rotors);
        let wrong = replay(&file(known.name), Some(&other(&vehicle)), &[], |_| {}).unwrap_err().to_string();
        assert!(wrong.contains("--vehicle"), "{wrong}");
    }
    assert!(rotors.contains(&4) && rotors.contains(&6));
}

/// Returns a vehicle that differs from `vehicle`, but has the same name.
fn other(vehicle: &Vehicle) -> Vehicle {
    let mut other = vehicle.clone();
    other.parameters.mass_kg *= 1.01;
    other
}

/// A log that is cut anywhere repeats the ticks before the cut: it never panics and never shows a difference.
#[test]
fn a_log_cut_at_any_byte_is_read_up_to_there() {
    let log = &LOG[..300_000];
    let whole = read("whole", log, &[]).unwrap().same_ticks;
    let mut random = Xoshiro256PlusPlus::seed_from_u64(11);
    let any = (0..20).map(|_| random.next_u32() as usize % log.len());
    for length in (0..500).chain(log.len() - 150..log.len()).chain(any) {
        let ends_whole = length > 0 && log[length - 1] == 0;
        match read("cut", &log[..length], &[]) {
            Ok(found) => {
                assert!(found.first_difference.is_none() && found.damaged.0 == 0, "{length}");
                assert!((1..=whole).contains(&found.same_ticks));
                assert_eq!(found.cut_bytes == 0, ends_whole, "{length}");
            }
            Err(error) => {
                let line = error.to_string();
                assert!(length < 500 && line.contains("cut.log") && line.contains(';'), "{length}: {line}");
            }
        }
    }
}

/// A changed bit of an input, in an otherwise valid frame, is reported at its tick or right after it.
#[test]
fn a_bit_of_an_input_is_named_at_its_tick() {
    let whole = records(&LOG);
    let mut random = Xoshiro256PlusPlus::seed_from_u64(12);
    for _ in 0..8 {
        let at = loop {
            let at = random.next_u32() as usize % whole.len();
            if matches!(&whole[at], Record::Tick(tick, _) if tick.readings.imu.is_some() && tick.number > 2_000) {
                break at;
            }
        };
        let mut changed = whole.clone();
        let Record::Tick(tick, _) = &mut changed[at] else { panic!("a tick") };
        // Lower bits are left out, since rounding of the velocity may hide them.
        let (number, bit) = (tick.number, random.next_u32() % 15 + 8);
        let [_, force] = &mut tick.readings.imu.as_mut().unwrap().value;
        force.z = f32::from_bits(force.z.to_bits() ^ 1 << bit);
        let found = read("input", &log_of(&changed), &[]).unwrap();
        let Some(FirstDifference { tick, finding: ReplayFinding::Given(signals), byte, .. }) = &found.first_difference
        else {
            panic!("bit {bit} of tick {number}: {:?}", found.first_difference)
        };
        assert!((number..number + 3).contains(tick), "bit {bit}: {tick} instead of {number}");
        assert!(signals.contains(&GivenSignal::Estimate), "{signals:?}");
        // The reported byte is the position of the tick's frame.
        let before = changed.iter().take_while(|record| !matches!(record, Record::Tick(it, _) if it.number == *tick));
        assert_eq!(*byte, log_of(&before.cloned().collect::<Vec<_>>()).len());
        let said = problem(&ReplayedLog { name: "input", replay: &found }).unwrap();
        assert!(said.contains(&format!("tick {tick}")) && said.contains("the estimate"), "{said}");
    }
}

/// Changes of a throttle, a mode, the estimate and the speeds of a tick are reported by those names.
#[test]
fn each_signal_is_named() {
    let changes: [fn(&mut Given); 4] =
        [|it| it.mode ^= 1, |it| it.estimate ^= 4, |it| it.speeds ^= 2, |it| it.throttles[2] ^= 8];
    let names = ["mode", "the estimate", "the rotor speeds", "throttle 3"];
    for (change, name) in changes.into_iter().zip(names) {
        let mut changed = records(&LOG);
        let given = changed.iter_mut().find_map(|record| match record {
            Record::Tick(tick, given) if tick.number == 4_321 => Some(given),
            _ => None,
        });
        change(given.unwrap());
        let found = read("signal", &log_of(&changed), &[]).unwrap();
        assert_eq!(found.same_ticks, 4_321);
        let said = problem(&ReplayedLog { name: "signal", replay: &found }).unwrap();
        assert!(said.contains("tick 4321 at ") && said.contains(name) && !said.contains('\n'), "{said}");
        assert!(names.iter().filter(|other| said.contains(**other)).count() == 1, "{said}");
    }
}

/// A flipped bit of the file damages a frame, which is reported with the missing ticks.
#[test]
fn a_bit_of_the_file_is_named_by_its_frame() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(13);
    for _ in 0..20 {
        let mut damaged = LOG.clone();
        // The flipped bit is behind the beginning of the log.
        let at = 10_000 + random.next_u32() as usize % (damaged.len() - 20_000);
        damaged[at] ^= 1 << (random.next_u32() % 8);
        let found = read("bit", &damaged, &[]).unwrap();
        let Some(said) = problem(&ReplayedLog { name: "bit", replay: &found }) else { panic!("byte {at} is accepted") };
        let (count, Some(place)) = found.damaged else { panic!("{said}") };
        // If the end mark of a frame is damaged, the frame ends with the next frame, and the next frame's position may
        // be reported.
        assert!(count <= 2 && place <= at + 1 && at < place + 400, "{at}: {place}");
        assert!(said.contains(&format!("byte {place}: ")) && said.contains("copy it again"), "{said}");
    }
}

#[test]
fn what_is_no_log_is_refused_in_one_line() {
    assert!(line("empty", &[]).contains("empty"));
    assert!(line("foreign", b"#!/bin/sh\necho hello\n").contains("the file is not an exact log"));
    assert!(line("zeros", &[0; 1_000]).contains("the file is not an exact log"));
    assert!(line("ulog", b"ULog\x01\x12\x35\x01\0\0\0\0\0\0\0\0").contains("without --exact"));
    let mut random = Xoshiro256PlusPlus::seed_from_u64(14);
    let noise: Vec<u8> = (0..200_000).map(|_| random.next_u32() as u8).collect();
    assert!(line("noise", &noise).contains("the file is not an exact log"));
    let all = records(&LOG);
    let later: Vec<_> = all.iter().filter(|record| !matches!(record, Record::Start(_))).cloned().collect();
    assert!(line("later", &log_of(&later)).contains("no start record"));
    assert!(line("start", &log_of(&all[..1])).contains("no tick"));
    let renamed = |change: fn(&mut afbc_log::exact::StartRecord)| {
        let mut all = all.clone();
        let Record::Start(start) = &mut all[0] else { panic!("a start") };
        change(start);
        log_of(&all)
    };
    assert!(line("version", &renamed(|start| start.version = 1)).contains("version 1"));
    assert!(line("vehicle", &renamed(|start| start.vehicle = "mine".try_into().unwrap())).contains("--vehicle"));
    assert!(line("law", &renamed(|start| start.law = "magic".try_into().unwrap())).contains("law 'magic'"));
    assert!(line("digest", &renamed(|start| start.digest ^= 1)).contains("differs from the one that flew"));
    assert!(line("rotors", &renamed(|start| start.rotors = 6)).contains("6 rotors"));
    let missing = replay(Path::new("no/such.log"), None, &[], |_| {}).unwrap_err().to_string();
    assert!(missing.contains("no/such.log") && missing.contains("cannot be read"), "{missing}");
}

/// Bytes that the link received before the vehicle was powered up are skipped.
#[test]
fn noise_before_the_start_is_skipped() {
    let log = [b"\xff\x80noise\0more".as_slice(), &[0], &LOG[..200_000]].concat();
    let found = read("before", &log, &[]).unwrap();
    assert!(found.is_same() && found.same_ticks > 1_000);
}

/// After a restart, the processor continues in the same log.
#[test]
fn a_restart_is_replayed() {
    let log = [LOG.as_slice(), &LOG].concat();
    let found = read("restart", &log, &[]).unwrap();
    assert_eq!((found.starts, found.ticks, found.same_ticks), (2, 26_000, 26_000));
    assert!(found.is_same());
}

/// Returns the comparison of a replay with these changed settings.
fn changed(changes: &[&str]) -> ChangeComparison {
    let found = read(&format!("change-{}", changes.join("-")), &LOG, changes).unwrap();
    assert!(found.is_same() && found.same_ticks == 13_000);
    found.comparison.unwrap()
}

/// Returns the largest differences of rotor speeds, attitude setpoint, position setpoint and estimate.
fn largest(comparison: &ChangeComparison) -> [f64; 4] {
    let of = |names: &[&str]| {
        let figures = QUANTITIES.iter().zip(&comparison.figures);
        let chosen = figures.filter(|(quantity, _)| names.contains(&quantity.name));
        chosen.map(|(_, figure)| figure.largest).fold(0.0, f64::max)
    };
    [
        of(&["omega1_rad_s", "omega2_rad_s", "omega3_rad_s", "omega4_rad_s"]),
        of(&["roll_setpoint_rad", "pitch_setpoint_rad"]),
        of(&["x_setpoint_m", "y_setpoint_m", "z_setpoint_m"]),
        of(&["x_m", "y_m", "z_m", "roll_rad", "pitch_rad", "yaw_rad"]),
    ]
}

/// A changed setting affects what depends on it, and nothing earlier in the tick.
#[test]
fn a_change_changes_what_it_should() {
    let value = |name: &str| {
        let table = afbc_onboard::parameters::ParameterTable::new(Configuration::default());
        let found = table.iter().find(|parameter| parameter.name.as_str() == name);
        found.unwrap_or_else(|| panic!("{name}")).value
    };
    // With unchanged values, all bits are the same.
    let same = changed(&[&format!("V_MASS={}", value("V_MASS")), "law=afbc"]);
    assert_eq!(largest(&same), [0.0; 4]);
    assert!(same.figures.iter().any(|figure| figure.count > 1_000) && same.other_mode == 0);
    // A gain of the law changes commands, but neither the estimate nor the position setpoint.
    let gain = changed(&[&format!("A_Z_ALPHA1={}", 1.2 * value("A_Z_ALPHA1"))]);
    let [speeds, _, setpoint, estimate] = largest(&gain);
    assert!(speeds > 0.1 && setpoint == 0.0 && estimate == 0.0, "{:?}", largest(&gain));
    // Another law also changes commands, but neither the estimate nor the position setpoint.
    let law = changed(&["law=pid"]);
    let [speeds, attitude, setpoint, estimate] = largest(&law);
    assert!(speeds > 1.0 && attitude > 1e-4 && setpoint == 0.0 && estimate == 0.0, "{:?}", largest(&law));
    // A setting of the estimator changes everything.
    let estimator = changed(&["EST_ACC_NOISE=0.5"]);
    let [speeds, _, _, estimate] = largest(&estimator);
    assert!(speeds > 0.0 && estimate > 1e-4, "{:?}", largest(&estimator));
    // A setting of the guidance changes the setpoint, but not the estimate.
    let guidance = changed(&["MPC_Z_VEL_MAX_UP=0.5"]);
    let [speeds, _, setpoint, estimate] = largest(&guidance);
    assert!(speeds > 0.0 && setpoint > 0.05 && estimate == 0.0, "{:?}", largest(&guidance));
    // There are a hundred rows per second.
    assert_eq!(gain.rows.len(), 1_300);
}

/// The figures follow from the rows.
#[test]
fn figures_follow_from_the_rows() {
    let comparison = changed(&["law=pid"]);
    for (index, figure) in comparison.figures.iter().enumerate() {
        let differences = comparison.rows.iter().filter_map(|row| row.differences().nth(index).flatten());
        let most = differences.map(f64::abs).fold(0.0, f64::max);
        // There is a row for every tenth tick, also for ticks in which one of the two flights is disarmed.
        let rms = figure.rms().unwrap_or_default();
        assert!(rms <= figure.largest + 1e-12, "{}", QUANTITIES[index].name);
        if comparison.other_mode == 0 && figure.count > 0 && QUANTITIES[index].rotor.is_some() {
            assert!(most <= figure.largest + 1e-9, "{}: {most} {}", QUANTITIES[index].name, figure.largest);
        }
    }
}

#[test]
fn changes_that_cannot_be_are_refused() {
    for (change, wanted) in [
        ("law=magic", "no such law"),
        ("V_MASS", "KEY=VALUE"),
        ("V_MASS=heavy", "a number"),
        ("V_MASS=nan", "a number"),
        ("=1", "no such parameter"),
    ] {
        let said = change.parse::<SettingChange>().unwrap_err();
        assert!(said.contains(wanted), "{change}: {said}");
    }
    for (change, wanted) in [("NO_SUCH=1", "no such parameter"), ("V_MASS=-1", "must be"), ("V_MASS=30", "cannot fly")]
    {
        let said = read("refused", &LOG, &[change]).map(|_| ()).unwrap_err().to_string();
        assert!(said.contains("--change") && said.contains(wanted) && !said.contains('\n'), "{change}: {said}");
    }
}
