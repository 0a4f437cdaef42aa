//! Parameters over the link: who may set them, when, and what all stations are told.

use crate::common::Bench;
use afbc_comms::parameters::{LINK_SHARE, VALUE_BYTES};
use afbc_comms::services::streams::DEFAULTS;
use afbc_comms::{Comms, Setup};
use afbc_mavlink::{
    Address, CommandResult, Downlink, ParameterName, ParameterRequest, ParameterValue, Storage, Uplink, VehicleCommand,
};
use afbc_onboard::parameters::RecordChange;
use afbc_types::State;
use std::collections::BTreeSet;

const SECOND: Address = Address { system: 245, component: 190 };
const HEIGHT: &str = "MIS_TAKEOFF_ALT";

fn padded(name: &str) -> ParameterName {
    let mut padded = [0; 16];
    padded[..name.len()].copy_from_slice(name.as_bytes());
    padded
}

fn set(name: &str, value: f32) -> Uplink {
    Uplink::Parameter(ParameterRequest::Set { name: padded(name), value: value.to_le_bytes(), kind: 9 })
}

/// Messages received during a number of ticks.
#[derive(Default)]
struct Heard {
    values: Vec<ParameterValue>,
    texts: Vec<String>,
    answers: Vec<CommandResult>,
}

fn listen(bench: &mut Bench, ticks: usize) -> Heard {
    let mut heard = Heard::default();
    for _ in 0..ticks {
        bench.measure(&State::default());
        for message in bench.step().1 {
            match message {
                Downlink::Parameter(value) => heard.values.push(value),
                Downlink::Text { text, .. } => heard.texts.push(text.to_str().expect("words").to_owned()),
                Downlink::CommandAck { answer, .. } => heard.answers.push(answer),
                _ => (),
            }
        }
    }
    heard
}

/// Returns the value of the last PARAM_VALUE of `name`.
fn reported(heard: &Heard, name: &str) -> Option<f32> {
    let value = heard.values.iter().rev().find(|value| value.name == padded(name))?;
    Some(f32::from_le_bytes(value.value))
}

/// Returns the take-off height that the guidance uses.
fn height(bench: &Bench) -> f32 {
    bench.table.configuration().guidance.flying.takeoff_height_m
}

#[test]
fn the_station_in_control_sets_and_everyone_hears_it() {
    let mut bench = Bench::new();
    bench.hear(set(HEIGHT, 4.0));
    let heard = listen(&mut bench, 20);
    assert_eq!(reported(&heard, HEIGHT), Some(4.0));
    assert_eq!((height(&bench), bench.changes.len(), heard.texts.len()), (4.0, 1, 0), "{:?}", heard.texts);
    assert!(matches!(bench.changes[..], [RecordChange::Set(_, Some(4.0))]));
    // Another station is told who is in control, and gets the unchanged value.
    bench.hear_from(SECOND, set(HEIGHT, 7.0));
    let heard = listen(&mut bench, 20);
    assert_eq!((reported(&heard, HEIGHT), height(&bench), bench.changes.len()), (Some(4.0), 4.0, 1));
    assert_eq!(heard.texts, ["245/190 ignored: 255/190 is in control"]);
    // Setting the same value again is a change too, in case the value was not stored.
    bench.hear(set(HEIGHT, 4.0));
    listen(&mut bench, 20);
    assert_eq!((bench.changes[1], bench.changes.len()), (bench.changes[0], 2));
    // Another station may read.
    bench.hear_from(SECOND, Uplink::Parameter(ParameterRequest::ReadName(padded("V_MASS"))));
    assert_eq!(reported(&listen(&mut bench, 20), "V_MASS"), Some(bench.table.configuration().parameters.mass_kg));
}

#[test]
fn refusals_name_the_reason() {
    let mut bench = Bench::new();
    for (name, value, reason) in [
        (HEIGHT, 1000.0, "MIS_TAKEOFF_ALT: must be 0.3 to 100"),
        (HEIGHT, f32::NAN, "MIS_TAKEOFF_ALT: must be 0.3 to 100"),
        ("GF_ACTION", 1.5, "GF_ACTION: must be a whole number"),
        ("NOTHING", 1.0, "NOTHING: no such parameter"),
    ] {
        bench.hear(set(name, value));
        let heard = listen(&mut bench, 20);
        assert_eq!(heard.texts, [reason]);
        assert_eq!(heard.values.len(), usize::from(name != "NOTHING"), "{name}");
    }
    assert!(bench.changes.is_empty());
}

#[test]
fn nothing_is_set_or_restored_while_armed() {
    let mut bench = Bench::flying();
    let before = height(&bench);
    bench.hear(set(HEIGHT, 4.0));
    bench.hear(Uplink::Command(VehicleCommand::Storage(Storage::Reset)));
    let heard = listen(&mut bench, 20);
    assert_eq!(reported(&heard, HEIGHT), Some(before));
    assert_eq!(heard.texts, ["MIS_TAKEOFF_ALT: not while armed"]);
    assert!(matches!(heard.answers[..], [CommandResult::Refused(_)]), "{:?}", heard.answers);
    assert!(bench.changes.is_empty());
}

#[test]
fn defaults_are_restored_by_command() {
    let mut bench = Bench::new();
    let before = bench.table.clone();
    bench.hear(set(HEIGHT, 4.0));
    bench.hear(set("RTL_RETURN_ALT", 20.0));
    listen(&mut bench, 20);
    assert_eq!(bench.changes.len(), 2);
    bench.hear_from(SECOND, Uplink::Command(VehicleCommand::Storage(Storage::Reset)));
    listen(&mut bench, 20);
    assert_eq!(bench.changes.len(), 2);
    bench.hear(Uplink::Command(VehicleCommand::Storage(Storage::Reset)));
    let heard = listen(&mut bench, 2000);
    assert_eq!((bench.changes.last(), heard.answers), (Some(&RecordChange::Restored), vec![CommandResult::Accepted]));
    assert_eq!(bench.table, before);
    // A list of all parameters follows, for every station.
    assert_eq!(heard.values.len(), usize::from(before.count()));
}

/// A list is complete and keeps within its share of the link, at 57,600 baud and faster.
#[test]
fn a_list_leaves_the_link_to_others() {
    for bytes_per_s in [5_000, 46_000, 100_000] {
        let mut bench = Bench::new();
        bench.comms = Comms::with(Setup { bytes_per_s, ..Setup::default() });
        bench.hear(Uplink::Parameter(ParameterRequest::List));
        let count = bench.table.count();
        let seconds = u32::from(count) * VALUE_BYTES * 100 / (LINK_SHARE * bytes_per_s) + 1;
        let (mut places, mut bytes) = (BTreeSet::new(), 0);
        for _ in 0..1000 * seconds {
            for message in bench.step().1 {
                if let Downlink::Parameter(value) = message {
                    assert_eq!(value.count, count);
                    assert!(places.insert(value.index));
                    bytes += VALUE_BYTES;
                }
            }
            let share = u64::from(bytes_per_s) * u64::from(LINK_SHARE) * bench.now_us / 100_000_000;
            assert!(u64::from(bytes) <= share + 5 * u64::from(VALUE_BYTES), "{bytes} at {} us", bench.now_us);
        }
        assert_eq!(places, (0..count).collect());
    }
}

/// COM_DL_LOSS_T is the silence after which another station may take control.
#[test]
fn a_silent_station_loses_control_after_the_time_that_is_set() {
    let mut bench = Bench::new();
    bench.hear(set("COM_DL_LOSS_T", 2.0));
    listen(&mut bench, 1900);
    bench.hear_from(SECOND, set(HEIGHT, 4.0));
    listen(&mut bench, 200);
    assert_eq!(bench.changes.len(), 1);
    bench.hear_from(SECOND, set(HEIGHT, 4.0));
    listen(&mut bench, 20);
    assert_eq!((bench.changes.len(), height(&bench)), (2, 4.0));
}

/// On a fast link with full streams, parameter values use the bytes that the streams leave in each tick.
#[test]
fn values_are_sent_beside_full_streams() {
    let mut bench = Bench::new();
    bench.comms = Comms::with(Setup { bytes_per_s: 1_000_000, ..Setup::default() });
    for (message, _) in DEFAULTS {
        bench.hear(Uplink::Command(VehicleCommand::SetInterval { message, interval_us: 1_000 }));
        listen(&mut bench, 1);
    }
    listen(&mut bench, 100);
    bench.hear(Uplink::Parameter(ParameterRequest::List));
    let places: BTreeSet<_> = listen(&mut bench, 1000).values.iter().map(|value| value.index).collect();
    assert_eq!(places.len(), usize::from(bench.table.count()));
}
