//! The parameters of a running vehicle: table, protocol, and storage.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic, missing_docs)] // tests

use crate::common::Bench;
use afbc_comms::parameters::{LINK_SHARE, Service, VALUE_BYTES};
use afbc_guidance::{BatteryAction, FenceAction, SticksAction};
use afbc_mavlink::{ParameterError, ParameterName, ParameterRequest, ParameterValue};
use afbc_onboard::parameters::{Kept, Kind, Parameter, ParameterTable, REASON_MAX, RecordChange};
use afbc_onboard::{Configuration, Flight, Prepared};
use afbc_store::{Ram, RecordName, Store, hash};
use afbc_types::State;
use proptest::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::LazyLock;

type Sectors = Ram<2048>;

fn name(text: &str) -> RecordName {
    RecordName::new(text).unwrap()
}

fn table() -> ParameterTable {
    ParameterTable::new(Configuration::default())
}

fn all(table: &ParameterTable) -> Vec<Parameter> {
    table.iter().collect()
}

/// Returns the bits of every value, by name.
fn bits(table: &ParameterTable) -> BTreeMap<RecordName, u32> {
    all(table).iter().map(|parameter| (parameter.name, parameter.value.to_bits())).collect()
}

/// The parameters at their defaults, and their bits. They are cached because each access walks over all parameters.
static FIRST: LazyLock<(Vec<Parameter>, BTreeMap<RecordName, u32>)> = LazyLock::new(|| (all(&table()), bits(&table())));

fn blank() -> Store<Sectors> {
    let mut store = Store::open(Sectors::BLANK, 0, hash(b"paper")).unwrap();
    store.make_room().unwrap();
    store
}

/// Returns the table and the notices after a restart with this store.
fn restarted(store: Store<Sectors>, kept: &Kept) -> (ParameterTable, Store<Sectors>, Vec<String>) {
    let mut store = Store::open(store.into_flash(), 0, hash(b"paper")).unwrap();
    store.make_room().unwrap();
    let (mut table, mut notices) = (table(), Vec::new());
    kept.load(&mut table, &mut store, |notice| notices.push(notice.to_string())).unwrap();
    (table, store, notices)
}

#[test]
fn every_parameter_has_a_name_and_a_place() {
    let (table, mut names) = (table(), BTreeSet::new());
    let all = all(&table);
    assert_eq!(all.len(), usize::from(table.count()));
    assert!(all.len() > 100, "{}", all.len());
    for (place, parameter) in (0..).zip(&all) {
        assert!(names.insert(parameter.name), "{} twice", parameter.name);
        assert_eq!((parameter.place, Some(*parameter)), (place, table.at(place)));
        assert_eq!(table.get(parameter.name), Some(*parameter));
        assert!(parameter.range.check(parameter.value).is_ok(), "{}", parameter.name);
    }
    assert_eq!((table.at(table.count()), table.get(name("NO_SUCH_NAME"))), (None, None));
    // There are parameters of every group and type.
    for text in ["V_MASS", "V_INERTIA_Z", "MOT_IDLE", "ARM_TILT_MAX", "EST_GYR_NOISE", "C_FORCE_MAX", "A_ROLL_GAMMA"] {
        assert_eq!(table.get(name(text)).unwrap().kind, Kind::Real32, "{text}");
    }
    assert_eq!(table.get(name("C_BUMPLESS")).unwrap().kind, Kind::Int32);
}

/// Returns a value, often within the range and often near or beyond its ends.
fn value(parameter: &Parameter, way: u8, share: f32) -> f32 {
    let (min, max) = (parameter.range.min as f32, parameter.range.max as f32);
    match way % 10 {
        0 => min,
        1 => max,
        2 => min - share * (min.abs() + 1.0),
        3 => max + share * (max.abs() + 1.0),
        4 => [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -0.0, 1e-42][(share * 4.99) as usize],
        5 => min + share * (max - min),
        _ => parameter.value * (0.9 + 0.2 * share),
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3000))]
    #[test]
    fn what_is_set_is_read_and_what_is_refused_changes_nothing(
        place in any::<prop::sample::Index>(), way: u8, share in 0.0..1.0_f32,
    ) {
        let mut table = table();
        let (all, before) = &*FIRST;
        let parameter = all[place.index(all.len())];
        let value = value(&parameter, way, share);
        match table.set(parameter.name, value) {
            Ok(set) => {
                prop_assert!(parameter.range.check(value).is_ok());
                prop_assert_eq!(table.get(parameter.name), Some(set));
                // The value is equal, for real numbers even in all bits. A switch has no -0.
                prop_assert_eq!(table.get(parameter.name).unwrap().value, value);
                if parameter.kind == Kind::Real32 {
                    prop_assert_eq!(table.get(parameter.name).unwrap().value.to_bits(), value.to_bits());
                }
                let changed = bits(&table).into_iter().filter(|(name, bits)| before[name] != *bits).count();
                prop_assert_eq!(changed, usize::from(set.value.to_bits() != before[&parameter.name]));
                prop_assert!(Flight::<4>::new(table.configuration()).is_ok());
            }
            Err(reason) => {
                prop_assert_eq!(&bits(&table), before);
                let text = reason.as_str();
                prop_assert!(text.starts_with(&format!("{}: ", parameter.name)), "{text}");
                // The text is not truncated: it ends in a limit or in a whole word.
                let end = text.rsplit([' ', ':']).next().unwrap();
                let is_whole = end.parse::<f64>().is_ok() || ["above", "below", "number"].contains(&end);
                prop_assert!(text.len() <= REASON_MAX && is_whole, "{text}");
            }
        }
    }
}

/// Whole numbers, choices and switches are stored as floats, as they were when the parameters were floats.
#[test]
fn what_was_kept_as_a_float_counts() {
    let mut store = blank();
    for (text, value) in [
        ("GF_ACTION", 3.0_f32),
        ("NAV_RCL_ACT", 2.0),
        ("COM_LOW_BAT_ACT", 0.0),
        ("BAT1_N_CELLS", 4.0),
        ("MAV_SYS_ID", 7.0),
        ("SER_TEL1_BAUD", 57_600.0),
        ("C_BUMPLESS", 0.0),
    ] {
        store.set(name(text), 0, Some(value.to_bits())).unwrap();
    }
    let (table, _, notices) = restarted(store, &Kept::NOW);
    assert_eq!(notices, [""; 0]);
    let Configuration { settings, guidance, link, .. } = table.configuration();
    let failsafe = &guidance.failsafe;
    assert_eq!((failsafe.fence_action, failsafe.sticks_action), (FenceAction::Return, SticksAction::Return));
    assert_eq!((failsafe.battery_action, failsafe.cells), (BatteryAction::Warn, 4));
    assert_eq!((link.system, link.baud, settings.bumpless), (7, 57_600, false));
    // These parameters are also sent as before.
    for (text, value) in [("GF_ACTION", 3.0), ("NAV_RCL_ACT", 2.0), ("SER_TEL1_BAUD", 57_600.0)] {
        let parameter = table.get(name(text)).unwrap();
        assert_eq!((parameter.kind, parameter.value), (Kind::Int32, value));
    }
}

#[test]
fn refusals_say_what_to_change() {
    let mut table = table();
    let mut refused = |text: &str, value| table.set(name(text), value).unwrap_err().to_string();
    assert_eq!(refused("V_MASS", 0.0), "V_MASS: must be 0.01 to 500");
    assert_eq!(refused("V_MASS", f32::NAN), "V_MASS: must be 0.01 to 500");
    assert_eq!(refused("V_MASS", 2.0), "V_MASS: rotor_force_max_n below 6.377");
    assert_eq!(refused("C_FORCE_MAX", 1.0), "C_FORCE_MAX: rotor_force_max_n below 1.55");
    assert_eq!(refused("A_Z_THETAMAX", 0.1), "A_Z_THETAMAX: theta_max below 8.582");
    assert_eq!(refused("V_INERTIA_X", 1.0), "V_INERTIA_X: hover_authority_rad_s2 below 80");
    assert_eq!(refused("C_BUMPLESS", 0.5), "C_BUMPLESS: must be a whole number");
    assert_eq!(refused("C_BUMPLESS", 2.0), "C_BUMPLESS: must be 0 to 1");
    assert_eq!(refused("GF_ACTION", 2.5), "GF_ACTION: must be a whole number");
    assert_eq!(refused("NAV_RCL_ACT", 0.0), "NAV_RCL_ACT: must be 1 to 3");
    assert_eq!(refused("MAV_SYS_ID", 251.0), "MAV_SYS_ID: must be 1 to 250");
    assert_eq!(refused("C_DT", 0.002), "C_DT: dt_s above 0.001");
    assert_eq!(refused("EST_GYR_NOISE", 1.0), "EST_GYR_NOISE: must be 1e-6 to 0.1");
    assert_eq!(refused("EST_GRAVITY", 1.0), "EST_GRAVITY: must be 9.7 to 9.9");
    assert_eq!(refused("V_DRAG", 2.0), "V_DRAG: must be 1e-12 to 1");
    assert_eq!(refused("NOTHING", 1.0), "NOTHING: no such parameter");
}

/// A vehicle that adopts a configuration flies exactly like one that was built with it. An armed vehicle adopts none.
#[test]
fn a_disarmed_vehicle_flies_what_is_set() {
    let mut table = table();
    table.set(name("C_LIMITS_CLIMB"), 0.5).unwrap();
    table.set(name("A_Z_ALPHA1"), 1.2).unwrap();
    table.set(name("ARM_TILT_MAX"), 0.3).unwrap();
    let prepared = Prepared::new(table.configuration()).unwrap();
    let flown = |adopts: bool| {
        let mut bench = Bench::new();
        if !adopts {
            bench.flight = Flight::<4>::new(table.configuration()).unwrap();
        }
        let mut reports = Vec::new();
        for tick in 0..2500_u32 {
            if adopts && tick == 0 {
                assert!(bench.flight.adopt(&prepared));
            }
            if tick == 1100 {
                bench.follow();
                bench.hear(afbc_mavlink::Uplink::Command(afbc_mavlink::VehicleCommand::Arm));
            }
            let above = State { position_m: nalgebra::Vector3::new(0.1, 0.0, 0.2), ..State::default() };
            reports.push(bench.tick(&above).0);
        }
        assert!(reports.last().unwrap().mode.armed());
        let unchanged = bench.flight.clone();
        let default = Prepared::new(&Configuration::default()).unwrap();
        assert!(!bench.flight.adopt(&default));
        assert_eq!(format!("{unchanged:?}"), format!("{:?}", bench.flight));
        reports
    };
    let (built, adopted) = (flown(false), flown(true));
    assert_eq!(built, adopted);
    let mut plain = Bench::new();
    let plain: Vec<_> = (0..2500)
        .map(|tick| {
            if tick == 1100 {
                plain.follow();
                plain.hear(afbc_mavlink::Uplink::Command(afbc_mavlink::VehicleCommand::Arm));
            }
            let above = State { position_m: nalgebra::Vector3::new(0.1, 0.0, 0.2), ..State::default() };
            plain.tick(&above).0
        })
        .collect();
    assert_ne!(built, plain, "the parameters make no difference");
}

fn padded(text: &str) -> ParameterName {
    let mut bytes = [0; 16];
    bytes[..text.len()].copy_from_slice(text.as_bytes());
    bytes
}

/// Returns all values sent in `ms` ticks of 1 ms.
fn reported(
    service: &mut Service,
    now_us: &mut u64,
    ms: u64,
    link_bytes_s: u32,
    table: &ParameterTable,
) -> Vec<ParameterValue> {
    let mut said = Vec::new();
    for _ in 0..ms {
        *now_us += 1000;
        said.extend(core::iter::from_fn(|| service.next_value(*now_us, link_bytes_s, table)));
    }
    said
}

fn real(text: &str, value: f32) -> ParameterRequest {
    ParameterRequest::Set { name: padded(text), value: value.to_le_bytes(), kind: 9 }
}

#[test]
fn a_list_is_complete_and_leaves_the_link_to_others() {
    for baud in [57_600, 115_200, 921_600] {
        let (mut table, mut service, mut now_us) = (table(), Service::default(), 0);
        let bytes_s = baud / 10;
        reported(&mut service, &mut now_us, 1000, bytes_s, &table);
        service.hear(ParameterRequest::List, &mut table, true);
        let start_us = now_us;
        let mut list = Vec::new();
        let mut most_in_a_second = 0;
        while list.len() < usize::from(table.count()) {
            let second = reported(&mut service, &mut now_us, 100, bytes_s, &table);
            most_in_a_second = most_in_a_second.max(second.len() as u32 * VALUE_BYTES * 10);
            list.extend(second);
            assert!(now_us < 60_000_000, "{}", list.len());
        }
        // The list takes 20 to 50 % of the link, and a burst of four values comes on top.
        let share =
            f64::from(table.count()) * f64::from(VALUE_BYTES) / f64::from(bytes_s) / ((now_us - start_us) as f64 / 1e6);
        assert!(share > 0.2 && share < 0.5, "{baud}: {share}");
        assert!(most_in_a_second <= bytes_s / 2 + 4 * VALUE_BYTES * 10, "{baud}: {most_in_a_second}");
        assert_eq!(LINK_SHARE, 40);
        let places: Vec<u16> = list.iter().map(|reported| reported.index).collect();
        assert_eq!(places, (0..table.count()).collect::<Vec<_>>());
        for (reported, parameter) in list.iter().zip(all(&table)) {
            assert_eq!((reported.count, reported.name), (table.count(), parameter.name.to_bytes()));
            assert_eq!(reported.value, parameter.kind.encode(parameter.value));
        }
        assert!(reported(&mut service, &mut now_us, 2000, bytes_s, &table).is_empty());
    }
}

/// If another station asks during a list, both stations get all values.
#[test]
fn two_stations_hear_everything() {
    let (mut table, mut service, mut now_us) = (table(), Service::default(), 0);
    service.hear(ParameterRequest::List, &mut table, true);
    reported(&mut service, &mut now_us, 300, 5760, &table);
    service.hear(ParameterRequest::List, &mut table, true);
    let second: BTreeSet<u16> =
        reported(&mut service, &mut now_us, 10_000, 5760, &table).iter().map(|reported| reported.index).collect();
    assert_eq!(second.len(), usize::from(table.count()));
}

#[test]
fn gaps_are_filled_by_place_and_by_name() {
    let (mut table, mut service, mut now_us) = (table(), Service::default(), 0);
    for ask in [
        ParameterRequest::ReadIndex(3),
        ParameterRequest::ReadName(padded("V_MASS")),
        ParameterRequest::ReadIndex(table.count() - 1),
    ] {
        assert_eq!(service.hear(ask, &mut table, false), Default::default());
    }
    // An error names the missing parameter.
    for (ask, name, place) in [
        (ParameterRequest::ReadIndex(table.count()), [0; 16], table.count() as i16),
        (ParameterRequest::ReadIndex(u16::MAX), [0; 16], -1),
        (ParameterRequest::ReadName(padded("NOTHING")), padded("NOTHING"), -1),
        (ParameterRequest::ReadName([0xFF; 16]), [0xFF; 16], -1),
        (ParameterRequest::ReadName([0; 16]), [0; 16], -1),
    ] {
        let heard = service.hear(ask, &mut table, false);
        let error = ParameterError { name, index: place, error: ParameterError::DOES_NOT_EXIST };
        assert_eq!((heard.error, heard.change, heard.refused), (Some(error), None, None));
    }
    let said = reported(&mut service, &mut now_us, 1000, 5760, &table);
    assert_eq!(said.iter().map(|reported| reported.index).collect::<Vec<_>>(), [3, 0, table.count() - 1]);
}

#[test]
fn every_set_is_answered_and_an_armed_vehicle_refuses() {
    let (mut table, mut service, mut now_us) = (table(), Service::default(), 0);
    let mut set = |ask, disarmed| {
        let heard = service.hear(ask, &mut table, disarmed);
        // The answer is sent at once, however slow the link is.
        let said = reported(&mut service, &mut now_us, 1, 1, &table);
        assert_eq!(said.len(), 1, "{ask:?}");
        let value = f32::from_le_bytes(said[0].value);
        (heard.change, heard.refused.map(|reason| reason.to_string()), value)
    };
    let refused = |text: &str| Some(text.to_owned());
    let change = |text: &str, value| Some(RecordChange::Set(name(text), value));
    assert_eq!(set(real("V_MASS", 0.5), true), (change("V_MASS", Some(0.5)), None, 0.5));
    assert_eq!(set(real("V_MASS", 0.5), false), (None, None, 0.5), "nothing changes");
    assert_eq!(set(real("V_MASS", 0.6), false), (None, refused("V_MASS: not while armed"), 0.5));
    assert_eq!(set(real("V_MASS", 600.0), true), (None, refused("V_MASS: must be 0.01 to 500"), 0.5));
    assert_eq!(set(real("V_MASS", f32::NAN), true), (None, refused("V_MASS: must be 0.01 to 500"), 0.5));
    assert_eq!(set(real("V_MASS", 0.486), true), (change("V_MASS", None), None, 0.486), "the default is not kept");
    let ask = |value: [u8; 4], kind| ParameterRequest::Set { name: padded("C_BUMPLESS"), value, kind };
    let as_integer = |(change, refused, value): (_, _, f32)| (change, refused, value.to_bits());
    let off = change("C_BUMPLESS", Some(0.0));
    // A switch can be set in the encoding of MAVSDK, in that of ArduPilot's stations, and as a plain number.
    for (on, kind) in
        [(1_i32.to_le_bytes(), 6), (1.0_f32.to_le_bytes(), 6), (1.0_f32.to_le_bytes(), 9), ([1, 0, 0, 0], 1)]
    {
        assert_eq!(as_integer(set(ask([0; 4], kind), true)), (off, None, 0));
        assert_eq!(as_integer(set(ask(on, kind), true)), (change("C_BUMPLESS", None), None, 1));
    }
    let odd = refused("C_BUMPLESS: value has the wrong type");
    assert_eq!(as_integer(set(ask([1, 0, 0, 0], 8), true)), (None, odd, 1));
    let heard = service.hear(real("NOTHING", 1.0), &mut table, true);
    assert_eq!(heard.refused.unwrap().as_str(), "NOTHING: no such parameter");
    assert!(reported(&mut service, &mut now_us, 1000, 5760, &table).is_empty());
}

#[test]
fn defaults_are_restored_and_listed() {
    let (mut table, mut service, mut now_us) = (table(), Service::default(), 0);
    let image = table.clone();
    service.hear(real("V_MASS", 0.5), &mut table, true);
    assert!(service.restore(&mut table, false).is_err());
    assert_ne!(table, image);
    assert_eq!(service.restore(&mut table, true), Ok(RecordChange::Restored));
    assert_eq!(table, image);
    assert_eq!(reported(&mut service, &mut now_us, 10_000, 11_520, &table).len(), 1 + usize::from(table.count()));
}

proptest! {
    /// Every PARAM_SET of a parameter is answered or counted, for any messages of stations, and the vehicle can fly.
    #[test]
    fn any_questions(
        asks in prop::collection::vec((0..5_u8, any::<u16>(), any::<[u8; 4]>(), any::<u8>(), any::<bool>()), 0..200),
        link_bytes_s: u32,
    ) {
        let (mut table, mut service, mut now_us, mut sets) = (table(), Service::default(), 0_u64, 0);
        let all = all(&table);
        let mut answers = 0;
        for (way, place, value, kind, disarmed) in asks {
            let known = all[usize::from(place) % all.len()].name.to_bytes();
            let ask = match way {
                0 => ParameterRequest::List,
                1 => ParameterRequest::ReadIndex(place % 300),
                2 => ParameterRequest::ReadName(known),
                3 => ParameterRequest::Set { name: known, value, kind: kind % 11 },
                _ => {
                    let name = [value, value, value, value].as_flattened().try_into().unwrap();
                    ParameterRequest::Set { name, value, kind }
                }
            };
            let before = table.configuration().clone();
            let heard = service.hear(ask, &mut table, disarmed);
            prop_assert!(disarmed || *table.configuration() == before);
            // Setting the present value counts as a change too, since that value may not have been stored.
            prop_assert!(heard.change.is_some() || *table.configuration() == before);
            prop_assert!(heard.change.is_none() || way >= 3);
            sets += u32::from(way == 3);
            if kind.is_multiple_of(3) {
                now_us = now_us.wrapping_add(u64::from(place));
                let values = core::iter::from_fn(|| service.next_value(now_us, link_bytes_s, &table));
                answers += values.take(3).count() as u32;
            }
        }
        prop_assert!(Flight::<4>::new(table.configuration()).is_ok());
        answers += core::iter::from_fn(|| service.next_value(now_us, 0, &table)).count() as u32;
        prop_assert!(answers + service.dropped() >= sets, "{answers} answers to {sets} sets");
    }

    /// After any sequence of changes and restarts, all stored values are exactly those that were set.
    #[test]
    fn what_is_kept_is_what_was_set(
        acts in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0.0..1.0_f32), 1..80),
    ) {
        let (mut now, mut store, mut service) = (table(), blank(), Service::default());
        let all = all(&now);
        for (place, way, share) in acts {
            let change = match way {
                250.. => Some(service.restore(&mut now, true).unwrap()),
                200..250 => {
                    let (found, opened, notices) = restarted(store, &Kept::NOW);
                    prop_assert_eq!((bits(&found), notices), (bits(&now), vec![]));
                    store = opened;
                    None
                }
                _ => {
                    let parameter = all[place.index(all.len())];
                    let value = value(&parameter, way, share);
                    let name = parameter.name.to_bytes();
                    let ask = ParameterRequest::Set { name, value: value.to_le_bytes(), kind: 9 };
                    service.hear(ask, &mut now, true).change
                }
            };
            if let Some(change) = change && Kept::NOW.keep(&mut store, change).is_err() {
                store.make_room().unwrap();
                Kept::NOW.keep(&mut store, change).unwrap();
            }
        }
        let (found, mut store, notices) = restarted(store, &Kept::NOW);
        prop_assert_eq!((bits(&found), notices), (bits(&now), vec![]));
        // Only values that differ from the defaults are stored.
        let (image, mut kept) = (bits(&table()), BTreeMap::new());
        store.visit(|name, _, bits| _ = kept.insert(name, bits)).unwrap();
        let differing: BTreeMap<RecordName, u32> =
            bits(&now).into_iter().filter(|(name, bits)| image[name] != *bits).collect();
        prop_assert_eq!(kept, differing);
    }

    #[test]
    fn garbage_gives_the_defaults_and_a_notice(bytes in prop::collection::vec(any::<u8>(), 4096)) {
        let mut flash = Sectors::BLANK;
        embedded_storage::nor_flash::NorFlash::write(&mut flash, 0, &bytes).unwrap();
        let mut store = Store::open(flash, 0, hash(b"paper")).unwrap();
        store.make_room().unwrap();
        let (mut found, mut notices) = (table(), Vec::new());
        Kept::NOW.load(&mut found, &mut store, |notice| notices.push(notice.to_string())).unwrap();
        prop_assert_eq!(notices, ["parameters: store unreadable, using defaults"]);
        prop_assert_eq!(bits(&found), bits(&table()));
        prop_assert_eq!(restarted(store, &Kept::NOW).2, Vec::<String>::new());
    }
}

#[test]
fn a_later_image_reads_what_an_earlier_one_wrote() {
    let mut store = blank();
    let earlier = Kept { edition: 3, renamed: &[], changed: &[] };
    for (text, value) in [
        ("V_MASS", 0.5),
        ("OLD_NAME", 0.3),
        ("GONE", 1.0),
        ("MOT_IDLE", 0.04),
        ("C_LIMITS_CLIMB", 1e9),
        ("C_LIMITS_TILT", 0.9),
    ] {
        earlier.keep(&mut store, RecordChange::Set(name(text), Some(value))).unwrap();
    }
    let later = Kept {
        edition: 4,
        renamed: &[("OLD_NAME", "ARM_TILT_MAX")],
        changed: &[("MOT_IDLE", 4), ("C_LIMITS_TILT", 3)],
    };
    let (mut found, mut store, notices) = restarted(store, &later);
    let image = table();
    let expected = [("V_MASS", 0.5), ("ARM_TILT_MAX", 0.3), ("C_LIMITS_TILT", 0.9)];
    for (text, value) in expected {
        assert_eq!(found.get(name(text)).unwrap().value, value, "{text}");
    }
    for text in ["MOT_IDLE", "C_LIMITS_CLIMB"] {
        assert_eq!(found.get(name(text)), image.get(name(text)), "{text}");
    }
    let reasons: BTreeSet<&str> = notices.iter().map(String::as_str).collect();
    let expected = [
        "GONE: no such parameter",
        "MOT_IDLE: its meaning changed, set it again",
        "C_LIMITS_CLIMB: must be 0.1 to 1e6",
    ];
    assert_eq!(reasons, BTreeSet::from(expected));
    // The new name takes over. Resetting it does not bring the old name's value back.
    found.set(name("ARM_TILT_MAX"), 0.2).unwrap();
    later.keep(&mut store, RecordChange::Set(name("ARM_TILT_MAX"), Some(0.2))).unwrap();
    let (found, mut store, _) = restarted(store, &later);
    assert_eq!(found.get(name("ARM_TILT_MAX")).unwrap().value, 0.2);
    later.keep(&mut store, RecordChange::Set(name("ARM_TILT_MAX"), None)).unwrap();
    let (found, ..) = restarted(store, &later);
    assert_eq!(found.get(name("ARM_TILT_MAX")), image.get(name("ARM_TILT_MAX")));
}

/// A stored value with which the vehicle could not fly is ignored with a notice. All other stored values count.
#[test]
fn values_with_which_the_vehicle_could_not_fly_are_left_out() {
    let (mut store, keep) = (blank(), |store: &mut Store<_>, text: &str, value| {
        Kept::NOW.keep(store, RecordChange::Set(name(text), Some(value))).unwrap();
    });
    // The mass is possible only with the larger limit of Theta_hat, which is stored after the mass.
    keep(&mut store, "V_MASS", 0.7);
    keep(&mut store, "A_Z_THETAMAX", 20.0);
    keep(&mut store, "MOT_IDLE", 0.04);
    keep(&mut store, "V_INERTIA_X", 1.0);
    let (found, _, notices) = restarted(store, &Kept::NOW);
    let value = |text| found.get(name(text)).unwrap().value;
    assert_eq!((value("A_Z_THETAMAX"), value("MOT_IDLE"), value("V_INERTIA_X")), (20.0, 0.04, 0.0038));
    assert_eq!(notices, ["V_INERTIA_X: hover_authority_rad_s2 below 80"]);
    assert_eq!(value("V_MASS"), 0.7);
    assert!(table().set(name("V_MASS"), 0.7).is_err());
}

/// Messages that do not fit the queues are counted once each. Answered messages are not counted.
#[test]
fn what_is_dropped_is_counted() {
    for ask in [ParameterRequest::ReadIndex(3), ParameterRequest::ReadName(padded("V_MASS")), real("V_MASS", 0.486)] {
        let (mut table, mut service) = (table(), Service::default());
        for number in 0..40 {
            service.hear(ask, &mut table, true);
            assert_eq!(service.dropped(), u32::max(number, 31) - 31);
        }
        let mut now_us = 0;
        assert_eq!(reported(&mut service, &mut now_us, 10_000, 5760, &table).len(), 32);
    }
}

/// Reads take their share of the link at any rate, and after a pause no more than a burst.
#[test]
fn reads_take_their_share() {
    for link_bytes_s in [5_184, 10_000, 82_944] {
        let (mut table, mut service, mut now_us) = (table(), Service::default(), 0);
        service.hear(ParameterRequest::List, &mut table, true);
        let first = reported(&mut service, &mut now_us, 1, link_bytes_s, &table).len();
        assert!(first <= 4, "{first} at once");
        let count = reported(&mut service, &mut now_us, 500, link_bytes_s, &table).len();
        let share = link_bytes_s as usize / 2 * LINK_SHARE as usize / 100 / VALUE_BYTES as usize;
        assert!(count.abs_diff(share.min(all(&table).len() - first)) <= 5, "{count} of {share}");
    }
}
