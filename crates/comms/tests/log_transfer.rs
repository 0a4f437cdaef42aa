//! Log download by LOG_REQUEST_LIST, LOG_REQUEST_DATA and LOG_REQUEST_END.

use crate::memory::{Memory, bytes};
use afbc_comms::services::log_transfer::{LogMessage, LogTransfer};
use afbc_mavlink::{LOG_DATA_MAX, LogEntry, LogRequest};
use proptest::prelude::*;

fn sent(logs: &mut LogTransfer, store: &mut Memory) -> Vec<LogMessage> {
    let mut messages = Vec::new();
    while logs.is_busy() {
        messages.extend(logs.next(store));
    }
    messages
}

fn ask(store: &mut Memory, request: LogRequest) -> Vec<LogMessage> {
    let mut logs = LogTransfer::default();
    logs.hear(request);
    sent(&mut logs, store)
}

fn store(sizes: &[usize]) -> Memory {
    Memory { logs: sizes.iter().map(|size| bytes(*size, 1 + *size as u32)).collect(), ..Memory::default() }
}

#[test]
fn logs_are_listed_in_any_range() {
    let mut three = store(&[10, 0, 700]);
    let entry = |log: u16| {
        let size = [10, 0, 700][usize::from(log)];
        LogMessage::Entry(LogEntry { log, count: 3, last: 2, utc_s: 1_700_000_000 + u32::from(log), size })
    };
    for (first, last, listed) in [
        (0, u16::MAX, 0..=2),
        (0, 0, 0..=0),
        (1, 2, 1..=2),
        // A request beyond the last log gets the last log, so that the station does not wait in vain.
        (7, 9, 2..=2),
        (u16::MAX, u16::MAX, 2..=2),
        (2, 0, 2..=2),
    ] {
        let listed: Vec<_> = listed.map(entry).collect();
        assert_eq!(ask(&mut three, LogRequest::List { first, last }), listed, "{first} to {last}");
    }
    let none = LogMessage::Entry(LogEntry::default());
    assert_eq!(ask(&mut store(&[]), LogRequest::List { first: 0, last: u16::MAX }), [none]);
}

/// Reads a log like a station: all data until a part is not full.
fn read(messages: &[LogMessage], log: u16, offset: u32) -> Vec<u8> {
    let mut read = Vec::new();
    for (place, message) in messages.iter().enumerate() {
        let LogMessage::Data(data) = message else { panic!("{message:?}") };
        assert_eq!((data.log, data.offset), (log, offset + read.len() as u32));
        assert!(usize::from(data.count) == LOG_DATA_MAX || place == messages.len() - 1);
        read.extend_from_slice(&data.data[..data.count.into()]);
        assert!(data.data[data.count.into()..].iter().all(|byte| *byte == 0));
    }
    read
}

#[test]
fn the_end_of_a_log_is_told() {
    for size in [0, 1, 89, 90, 91, 180, 1000] {
        let mut one = store(&[size]);
        let messages = ask(&mut one, LogRequest::Data { log: 0, offset: 0, bytes: u32::MAX });
        assert_eq!(read(&messages, 0, 0), one.logs[0]);
        let LogMessage::Data(last) = messages[messages.len() - 1] else { panic!("data") };
        assert!(usize::from(last.count) < LOG_DATA_MAX, "{size}");
        // A request for exactly the log's size gets no more than that.
        let messages = ask(&mut one, LogRequest::Data { log: 0, offset: 0, bytes: size as u32 });
        assert_eq!((read(&messages, 0, 0), messages.len()), (one.logs[0].clone(), size.div_ceil(90).max(1)));
    }
    // Beyond the end, and for a missing log, one empty part is sent at once.
    for (log, offset) in [(0, 91), (0, u32::MAX), (7, 0)] {
        let messages = ask(&mut store(&[90]), LogRequest::Data { log, offset, bytes: 900 });
        assert_eq!((read(&messages, log, offset), messages.len()), (vec![], 1));
    }
}

#[test]
fn the_last_request_counts() {
    let mut two = store(&[5000, 5000]);
    let mut logs = LogTransfer::default();
    logs.hear(LogRequest::Data { log: 0, offset: 0, bytes: u32::MAX });
    (0..3).for_each(|_| assert!(logs.next(&mut two).is_some()));
    logs.hear(LogRequest::Data { log: 1, offset: 90, bytes: 90 });
    let messages = sent(&mut logs, &mut two);
    assert_eq!(read(&messages, 1, 90), two.logs[1][90..180]);
    for end in [LogRequest::End, LogRequest::Erase] {
        logs.hear(LogRequest::List { first: 0, last: 9 });
        logs.hear(LogRequest::Data { log: 0, offset: 0, bytes: u32::MAX });
        assert!(logs.is_busy());
        logs.hear(end);
        assert!(!logs.is_busy() && logs.next(&mut two).is_none());
    }
}

/// MAVProxy requests twenty gaps at once.
#[test]
fn several_gaps_are_filled_in_turn() {
    let mut one = store(&[10_000]);
    let mut logs = LogTransfer::default();
    for _ in 0..2 {
        for gap in 0..20 {
            logs.hear(LogRequest::Data { log: 0, offset: 400 * gap, bytes: 270 });
        }
    }
    let messages = sent(&mut logs, &mut one);
    assert_eq!(messages.len(), 60);
    for (gap, parts) in (0..20).zip(messages.chunks(3)) {
        assert_eq!(read(parts, 0, 400 * gap), one.logs[0][400 * gap as usize..][..270]);
    }
    // A request for the rest of the log replaces all gaps, and a new request for the rest replaces the old request.
    logs.hear(LogRequest::Data { log: 0, offset: 0, bytes: 90 });
    for offset in [0, 9_000] {
        logs.hear(LogRequest::Data { log: 0, offset, bytes: u32::MAX });
    }
    assert_eq!(read(&sent(&mut logs, &mut one), 0, 9_000), one.logs[0][9_000..]);
}

proptest! {
    /// A station that loses random parts and requests each gap again, as MAVSDK and QGroundControl do, gets the whole
    /// log, even from slow storage.
    #[test]
    fn a_log_with_gaps_is_completed(size in 0..5000_usize, lost in any::<u64>(), slow in 0_u32..4) {
        let mut one = Memory { slow, ..store(&[size]) };
        let mut held = vec![None; size];
        let (mut round, mut number) = (0, 0_u32);
        while let Some(gap) = held.iter().position(Option::is_none) {
            round += 1;
            prop_assert!(round < 500);
            let end = held[gap..].iter().position(Option::is_some).map_or(size, |length| gap + length);
            let request = LogRequest::Data { log: 0, offset: gap as u32, bytes: (end - gap) as u32 };
            for message in ask(&mut one, request) {
                let LogMessage::Data(data) = message else { panic!("{message:?}") };
                number += 1;
                if lost >> (number % 64) & 1 == 0 || round > 100 {
                    for (place, byte) in (data.offset as usize..).zip(&data.data[..data.count.into()]) {
                        held[place] = Some(*byte);
                    }
                }
            }
        }
        prop_assert_eq!(held.into_iter().flatten().collect::<Vec<_>>(), one.logs[0].clone());
    }
}
