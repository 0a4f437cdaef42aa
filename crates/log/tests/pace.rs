//! Tests that the log's beginning, and a change of all parameters, are spread over ticks at the chosen pace.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic, missing_docs, reason = "tests")]

#[allow(dead_code, reason = "other tests need the rest")]
mod strict;

use afbc_log::ulog::{BesideTick, BlackBox, LogRing, LogStart};
use afbc_onboard::parameters::{ParameterTable, RecordChange};
use afbc_onboard::{Aged, Configuration, ControlInputs, Flight, Readings, TickInputs, TickRecord};
use afbc_store::RecordName;
use nalgebra::Vector3;
use proptest::prelude::*;
use strict::read;

/// Returns the kinds of the records in these bytes, skipping the log's header if there is one.
fn kinds(bytes: &[u8], has_header: bool) -> Vec<u8> {
    let (mut rest, mut kinds) = (&bytes[if has_header { 16 } else { 0 }..], Vec::new());
    while let [low, high, kind, behind @ ..] = rest {
        kinds.push(*kind);
        rest = &behind[usize::from(u16::from_le_bytes([*low, *high]))..];
    }
    kinds
}

/// Logs ticks at a pace. Restores all parameters in one tick, and changes one parameter in another. Returns the log,
/// the largest number of records per tick that are not data, and the parameters.
fn logged(pace: Option<u16>, ticks: u64, [restored, changed]: [u64; 2]) -> (Vec<u8>, usize, ParameterTable) {
    let configuration = Configuration::default();
    let mut table = ParameterTable::new(configuration.clone());
    let start = LogStart { vehicle: "paper", law: "afbc", hardware: "test", ..LogStart::default() };
    let log = BlackBox::new(&start, &table);
    let mut log = pace.map_or(log.clone(), |pace| log.paced(pace));
    let mut ring = Box::new(LogRing::<65_536>::new());
    let mut flight = Flight::<4>::new(&configuration).unwrap();
    let (mut kept, mut most) = (Vec::new(), 0);
    for number in 1..=ticks {
        let imu = Some(Aged { value: [Vector3::zeros(), Vector3::new(0.0, 0.0, 9.81)], age_us: 0 });
        let readings = Readings { imu, ..Readings::NONE };
        let (mut messages, inputs) =
            (ControlInputs::EMPTY, TickInputs { time_us: 1000 * number, readings, ..TickInputs::default() });
        let before = flight.before(&messages);
        let report = flight.tick(inputs.time_us, &mut messages, &readings);
        let details = flight.details(&inputs, &before, &messages);
        let tick = TickRecord { report: &report, details: &details };
        log.tick(&tick, &BesideTick::default(), &table, &mut ring);
        if number == changed {
            let name = RecordName::new("EST_GATE").unwrap();
            let value = table.set(name, 4.0).unwrap().value;
            log.change(&table, RecordChange::Set(name, Some(value)), &mut ring);
        }
        if number == restored {
            table.restore();
            log.change(&table, RecordChange::Restored, &mut ring);
        }
        let mut bytes = Vec::new();
        while !ring.is_empty() {
            bytes.extend_from_slice(ring.front());
            let length = ring.front().len();
            ring.consume(length);
        }
        let few = kinds(&bytes, number == 1).iter().filter(|kind| b"BFIMPQA".contains(kind)).count();
        most = most.max(few);
        kept.extend(bytes);
    }
    (kept, most, table)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn a_tick_has_few_records_beside_its_data(pace in 1_u16..60, restored in 1_u64..900, changed in 1_u64..900) {
        let ticks = 1_000 + 1_500 / u64::from(pace);
        let (bytes, most, table) = logged(Some(pace), ticks, [restored, changed]);
        // A single changed parameter is written at once if no others wait.
        prop_assert!(most <= usize::from(pace) + 1, "{most}");
        let log = read(&bytes);
        prop_assert_eq!(log.whole, bytes.len());
        let (whole, _, _) = logged(None, 10, [0; 2]);
        let whole = read(&whole);
        let parts = [&log, &whole].map(|log| (&log.formats, &log.information, &log.initial));
        prop_assert_eq!(&parts[0], &parts[1]);
        prop_assert!(log.dropouts.is_empty());
        for parameter in table.iter() {
            let last = log.parameters.iter().rev().find(|(name, _)| name == parameter.name.as_str());
            prop_assert_eq!(last.unwrap().1, f64::from(parameter.value));
        }
        // After the beginning, the data have no gap.
        let times = log.times("sensor_combined");
        prop_assert!(times.len() > 900 && times.windows(2).all(|pair| pair[1] - pair[0] == 1000));
    }
}

/// Without a pace, the first tick writes the whole beginning.
#[test]
fn without_a_pace_it_is_there_at_once() {
    let (bytes, most, _) = logged(None, 5, [0; 2]);
    assert!(most > 300 && read(&bytes).times("sensor_combined").len() == 5);
}
