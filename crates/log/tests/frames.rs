//! Tests that frames and records are read as they were written, and that damaged or foreign frames are rejected.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs, reason = "tests")]

use afbc_guidance::BatteryReading;
use afbc_log::exact::{
    FRAME_MAX, FrameError, Frames, Given, Record, Recorder, StartRecord, VERSION, WORD_MAX, decode, write,
};
use afbc_onboard::parameters::{ParameterTable, RecordChange};
use afbc_onboard::{Configuration, ControlInputs, Flight, Readings, Report, TickInputs};
use afbc_store::RecordName;
use afbc_types::{PLUS, Rotor, RotorSpeeds, Rotors, State};
use nalgebra::Vector3;
use proptest::prelude::*;

fn start(version: u16, name: &str) -> Record {
    let table = ParameterTable::new(Configuration::default());
    Record::Start(StartRecord { version, ..StartRecord::of(name, "afbc", &table) })
}

fn record() -> impl Strategy<Value = Record> {
    prop_oneof![
        "[a-z]{0,30}".prop_map(|name| start(VERSION, &name)),
        ("[A-Z_]{1,16}", any::<u16>(), -1e9..1e9_f32).prop_map(|(name, configuration, value)| {
            Record::Parameter { configuration, name: RecordName::new(&name).unwrap(), value }
        }),
        any::<u16>().prop_map(|configuration| Record::Restored { configuration }),
        any::<u32>().prop_map(|tick| Record::Inputs { tick, inputs: ControlInputs::EMPTY }),
        (any::<u32>(), any::<u64>(), prop::option::of(any::<u16>())).prop_map(|(number, time_us, adopted)| {
            Record::Tick(TickInputs { number, time_us, adopted, ..TickInputs::default() }, Given::default())
        }),
    ]
}

fn framed(record: &Record) -> Vec<u8> {
    write(record, &mut [0; FRAME_MAX]).unwrap().to_vec()
}

/// Fault of a frame in transit.
#[derive(Clone, Debug)]
enum Fate {
    Arrives,
    /// A byte is changed to another one, but never to zero.
    Changes(prop::sample::Index, u8),
    /// This many of its first bytes are lost, but not all.
    Loses(prop::sample::Index),
    /// The frame becomes this many bytes longer than the longest allowed frame.
    IsLong(usize),
}

fn fate() -> impl Strategy<Value = Fate> {
    prop_oneof![
        3 => Just(Fate::Arrives),
        1 => (any::<prop::sample::Index>(), 1..=254_u8).prop_map(|(at, by)| Fate::Changes(at, by)),
        1 => any::<prop::sample::Index>().prop_map(Fate::Loses),
        1 => (1..3_000_usize).prop_map(Fate::IsLong),
    ]
}

/// Returns the CRC-32 (ISO-HDLC), computed bit by bit.
fn crc32(bytes: impl IntoIterator<Item = u8>) -> u32 {
    !bytes.into_iter().fold(!0_u32, |crc, byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xEDB8_8320 } else { crc >> 1 })
    })
}

/// Returns the frame of these bytes, without its terminating zero. The bytes may be of any version.
fn frame_of(body: &[u8]) -> Vec<u8> {
    let mut frame = [0; 2 * FRAME_MAX];
    let length = cobs::encode(&[body, &crc32(body.iter().copied()).to_le_bytes()].concat(), &mut frame);
    frame[..length].to_vec()
}

/// Returns the bytes of a record's frame, without checksum and encoding.
fn body(record: &Record) -> Vec<u8> {
    let mut frame = framed(record);
    frame.pop();
    let length = cobs::decode_in_place(&mut frame).unwrap();
    frame.truncate(length - 4);
    frame
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    /// All intact frames are read, in order. Each other frame is counted once as damaged, and nothing else is counted.
    #[test]
    fn a_stream_has_the_records_that_arrive(
        frames in prop::collection::vec((record(), fate(), 0..3_usize), 0..20)
    ) {
        let (mut bytes, mut arrive, mut damaged) = (Vec::new(), Vec::new(), 0);
        for (record, fate, zeros) in frames {
            let mut frame = framed(&record);
            let inner = frame.len() - 1;
            damaged += 1;
            match fate {
                Fate::Arrives => {
                    arrive.push(record);
                    damaged -= 1;
                }
                Fate::Changes(at, by) => {
                    let byte = &mut frame[at.index(inner)];
                    // Changes the byte to another one between 1 and 255.
                    *byte = ((u32::from(*byte) - 1 + u32::from(by)) % 255) as u8 + 1;
                }
                Fate::Loses(count) => drop(frame.drain(..1 + count.index(inner - 1))),
                Fate::IsLong(more) => frame.splice(..0, vec![7; FRAME_MAX - inner + more]).for_each(drop),
            }
            bytes.extend(frame);
            // Zeros in a row do not make a frame.
            bytes.extend(vec![0; zeros]);
        }
        let mut reader = Frames::default();
        let read: Vec<_> = bytes.iter().filter_map(|byte| reader.take(*byte)).collect();
        prop_assert_eq!(read, arrive);
        prop_assert_eq!(reader.damaged(), damaged);
    }

    /// A start of another version yields that version. Any other intact but unknown frame is only reported as foreign.
    #[test]
    fn another_version_is_told(version in any::<u16>(), record in record(), more in 1..5_usize, kind in 5..128_u8) {
        let decoded = |mut frame: Vec<u8>| {
            frame.pop_if(|byte| *byte == 0);
            decode(&mut frame)
        };
        let foreign = Err(FrameError::Foreign(Some(version).filter(|version| *version != VERSION)));
        if version == VERSION {
            prop_assert_eq!(decoded(framed(&start(version, "x"))), Ok(start(version, "x")));
        } else {
            prop_assert_eq!(decoded(framed(&start(version, "x"))), foreign.clone());
        }
        prop_assert_eq!(decoded(frame_of(&body(&record))), Ok(record.clone()));
        // The record is longer than a record of this version.
        let longer = |record: &Record| [body(record), vec![1; more]].concat();
        prop_assert_eq!(decoded(frame_of(&longer(&start(version, "x")))), foreign);
        if !matches!(record, Record::Start(_)) {
            prop_assert_eq!(decoded(frame_of(&longer(&record))), Err(FrameError::Foreign(None)));
        }
        // A kind of record that this version does not have.
        prop_assert_eq!(decoded(frame_of(&[&[kind], &body(&record)[1..]].concat())), Err(FrameError::Foreign(None)));
        prop_assert_eq!(decoded(frame_of(&[])), Err(FrameError::Foreign(None)));
    }

    /// A name is written up to the last whole letter that fits.
    #[test]
    fn a_name_or_its_beginning_is_written(vehicle in "\\PC{0,30}", law in "[a-z]{0,40}") {
        let table = ParameterTable::new(Configuration::default());
        let written = StartRecord::of(&vehicle, &law, &table);
        for (name, word) in [(&vehicle, &written.vehicle), (&law, &written.law)] {
            prop_assert!(name.starts_with(word.as_str()));
            let next = name[word.len()..].chars().next();
            prop_assert!(next.is_none_or(|letter| word.len() + letter.len_utf8() > WORD_MAX), "{word} of {name}");
        }
        prop_assert_eq!(usize::from(written.rotors), 4);
        prop_assert_eq!(written.parameters, table.count());
    }

    /// A start records the parameters whose bits differ from the image's, and each of them changes its digest.
    #[test]
    fn a_start_has_what_differs_from_the_image(
        places in prop::collection::vec(any::<prop::sample::Index>(), 0..8),
        share in 0.0..1.0_f32,
    ) {
        let image = ParameterTable::new(Configuration::default());
        let mut table = image.clone();
        for place in &places {
            let parameter = image.at(place.index(usize::from(image.count())) as u16).unwrap();
            // Sets another value, or the other zero. The table may refuse it.
            let is_zero = parameter.value == 0.0 && share < 0.5;
            let value = if is_zero { -0.0 } else { parameter.value * (0.9 + 0.2 * share) };
            let _ = table.set(parameter.name, value);
        }
        let mut records = Vec::new();
        let mut send = |frame: &[u8]| records.push(decode(&mut frame[..frame.len() - 1].to_vec()).unwrap());
        Recorder::default().start(["x", "afbc"], &table, &mut send);
        let differs = |(now, then): &(afbc_onboard::parameters::Parameter, afbc_onboard::parameters::Parameter)| {
            now.value.to_bits() != then.value.to_bits()
        };
        let changed: Vec<_> = table.iter().zip(image.iter()).filter(differs).map(|(now, _)| now).collect();
        prop_assert_eq!(&records[0], &Record::Start(StartRecord::of("x", "afbc", &table)));
        let told: Vec<_> = records[1..].iter().map(|record| match record {
            Record::Parameter { configuration: 0, name, value } => Some((*name, value.to_bits())),
            _ => None,
        }).collect();
        let wanted: Vec<_> = changed.iter().map(|now| Some((now.name, now.value.to_bits()))).collect();
        prop_assert_eq!(told, wanted);
        let [mine, theirs] = [&table, &image].map(|table| StartRecord::of("x", "afbc", table).digest);
        prop_assert_eq!(mine == theirs, changed.is_empty());
    }

    /// A tick's outputs contain half checksums of the state and the speeds, verified by independent code, and the
    /// throttles and the mode.
    #[test]
    fn what_a_tick_gave_is_told_by_checksums(
        values in prop::array::uniform12(-1e3..1e3_f32),
        speeds in prop::array::uniform4(0.0..1e3_f32),
        throttles in prop::array::uniform4(0..2_048_u16),
        estimates in any::<bool>(),
    ) {
        let vector = |k: usize| Vector3::from_column_slice(&values[3 * k..3 * k + 3]);
        let state = State {
            position_m: vector(0),
            velocity_m_s: vector(1),
            attitude_rad: vector(2),
            rates_rad_s: vector(3),
        };
        let report = Flight::<4>::new(&Configuration::default()).unwrap().tick(
            1_000,
            &mut ControlInputs::EMPTY.clone(),
            &Readings::NONE,
        );
        let motors = RotorSpeeds::<4>(speeds.into()).padded();
        let throttles = std::array::from_fn(|rotor: usize| throttles.get(rotor).copied().unwrap_or_default());
        let report = Report { estimate: estimates.then_some(state), motors, throttles, ..report };
        let bytes = |values: &[f32]| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<_>>();
        let given = Given::of(&report);
        prop_assert_eq!(given.estimate, if estimates { crc32(bytes(&values)) as u16 } else { 0 });
        // The checksum covers the largest number of rotors; missing rotors have speed 0.
        prop_assert_eq!(given.speeds, crc32(bytes(&[speeds, [0.0; 4]].concat())) as u16);
        prop_assert_eq!(given.throttles, throttles);
        prop_assert_eq!(given.mode, report.mode as u8);
    }
}

/// Changes are numbered. Messages that bring nothing, or only a battery reading, are not recorded.
#[test]
fn changes_are_numbered_and_nothing_is_not_recorded() {
    let (mut recorder, mut records) = (Recorder::default(), Vec::new());
    let mut table = ParameterTable::new(Configuration::default());
    let mut send = |frame: &[u8]| records.push(decode(&mut frame[..frame.len() - 1].to_vec()).unwrap());
    let name = RecordName::new("EST_GATE").unwrap();
    let value = table.set(name, 4.0).unwrap().value;
    assert_eq!(recorder.change(&table, RecordChange::Set(name, Some(value)), &mut send), 1);
    table.restore();
    assert_eq!(recorder.change(&table, RecordChange::Restored, &mut send), 2);
    recorder.inputs(7, &ControlInputs::EMPTY, &mut send);
    let mut measured = ControlInputs::EMPTY;
    measured.battery = Some(BatteryReading { voltage_v: 12.0, current_a: 1.0, charge: None });
    recorder.inputs(8, &measured, &mut send);
    let mut news = ControlInputs::EMPTY;
    news.inbox.set_idle_on_ground(true);
    recorder.inputs(9, &news, &mut send);
    let wanted = [
        Record::Parameter { configuration: 1, name, value },
        Record::Restored { configuration: 2 },
        Record::Inputs { tick: 9, inputs: news },
    ];
    assert_eq!(records, wanted);
}

/// Each rotor's position and direction of rotation changes the digest.
#[test]
fn the_digest_is_of_the_rotors_too() {
    let digest = |change: fn(&mut Rotor)| {
        let mut rotors = PLUS;
        change(&mut rotors[2]);
        let configuration = Configuration { rotors: Rotors::new(&rotors), ..Configuration::default() };
        StartRecord::of("x", "afbc", &ParameterTable::new(configuration)).digest
    };
    let all = [
        digest(|_| ()),
        digest(|rotor| rotor.x += 1e-3),
        digest(|rotor| rotor.y += 1e-3),
        digest(|rotor| rotor.pushes_left ^= true),
    ];
    assert!((1..4).all(|k| !all[..k].contains(&all[k])), "{all:?}");
}
