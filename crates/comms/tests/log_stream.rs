//! Log stream to a station that loses parts and acknowledgements.

use afbc_comms::services::log_stream::{LogStream, StreamEvent};
use afbc_comms::services::storage::LogSource;
use afbc_mavlink::{Address, StreamedLog};
use proptest::prelude::*;

const STATION: Address = Address { system: 255, component: 190 };
const OTHER: Address = Address { system: 254, component: 190 };
const HEADER: usize = 16;

/// A log that grows over time.
#[derive(Default)]
struct Source {
    log: Vec<u8>,
    /// Number of bytes consumed, number of bytes written so far, and most bytes returned at once.
    consumed: usize,
    made: usize,
    front: usize,
    runs: bool,
}

impl LogSource for Source {
    fn start_log(&mut self) -> bool {
        (self.consumed, self.made, self.runs) = (0, 0, true);
        true
    }

    fn stop_log(&mut self) {
        self.runs = false;
    }

    fn log_bytes(&self) -> &[u8] {
        &self.log[self.consumed..self.made.min(self.consumed + self.front)]
    }

    fn consume_log(&mut self, bytes: usize) {
        self.consumed += bytes;
        assert!(self.consumed <= self.made);
    }
}

/// Builds a log with records of these lengths: first definitions, then data and other records. Returns the log, the
/// beginnings of all records and the beginning of the data.
fn log(definitions: &[u16], data: &[(u8, u16)]) -> (Vec<u8>, Vec<usize>, usize) {
    let mut log = vec![7; HEADER];
    let mut starts = Vec::new();
    let mut put = |kind: u8, length: u16| {
        starts.push(log.len());
        log.extend_from_slice(&length.to_le_bytes());
        log.push(kind);
        log.extend((0..length).map(|byte| byte as u8 ^ kind));
        log.len()
    };
    let kinds = b"BFIMPQA";
    let end = definitions.iter().enumerate().map(|(place, length)| put(kinds[place % kinds.len()], *length)).last();
    for (kind, length) in data {
        put(*kind, *length);
    }
    (log, starts, end.unwrap_or(HEADER))
}

/// Streams the whole log to a station that loses acknowledgements or parts. Returns all parts once, in order.
fn streamed(source: &mut Source, mut loses: impl FnMut() -> bool) -> Vec<StreamedLog> {
    let mut stream = LogStream::default();
    assert!(stream.start(STATION, source));
    let mut parts: Vec<StreamedLog> = Vec::new();
    let mut idle = 0;
    for tick in 0_u64.. {
        source.made = source.log.len().min(source.made + 37);
        let event = stream.next(source, tick * 50_000);
        idle = if event.is_some() { 0 } else { idle + 1 };
        if let Some(event) = event {
            let StreamEvent::Part(part) = event else { panic!("{event:?}") };
            match parts.last() {
                // The part is repeated until it is acknowledged.
                Some(last) if last.sequence == part.sequence => {
                    assert!(part.to_be_acknowledged && *last == part);
                }
                last => {
                    assert_eq!(part.sequence, last.map_or(0, |last| last.sequence + 1));
                    parts.push(part);
                }
            }
            if part.to_be_acknowledged {
                stream.acknowledge(OTHER, part.sequence);
                stream.acknowledge(STATION, part.sequence.wrapping_add(1));
                if !loses() {
                    stream.acknowledge(STATION, part.sequence);
                }
            }
        }
        if idle > 10 && source.consumed == source.log.len() {
            break;
        }
    }
    stream.stop(source);
    assert!(!source.runs && !stream.is_active());
    parts
}

proptest! {
    /// The parts make up the log. Parts with definitions are acknowledged and have no data. Each part names its first
    /// record.
    #[test]
    fn parts_are_the_log(
        definitions in prop::collection::vec(0_u16..700, 1..12),
        data in prop::collection::vec((prop::sample::select(b"DSLOP".to_vec()), 0_u16..400), 0..40),
        front in 1_usize..600,
        mut losses in any::<u64>(),
    ) {
        // A changed parameter (P) after the first data record belongs to the data.
        let data: Vec<_> = [(b'D', 5)].into_iter().chain(data).collect();
        let (log, starts, end) = log(&definitions, &data);
        let mut source = Source { log: log.clone(), front, ..Source::default() };
        let parts = streamed(&mut source, || {
            losses = losses.rotate_left(7).wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(1);
            (losses >> 32).is_multiple_of(3)
        });
        let mut at = 0;
        for part in &parts {
            let bytes = &part.data[..part.length.into()];
            prop_assert_eq!(bytes, &log[at..at + bytes.len()]);
            prop_assert!(part.data[bytes.len()..].iter().all(|byte| *byte == 0) && part.to == STATION);
            let first = starts.iter().find(|start| (at..at + bytes.len()).contains(start));
            prop_assert_eq!(part.first_record.map(usize::from), first.map(|start| start - at));
            // No part with definitions contains data.
            prop_assert_eq!(part.to_be_acknowledged, at < end);
            prop_assert!(!part.to_be_acknowledged || at + bytes.len() <= end);
            prop_assert!(part.to_be_acknowledged || bytes.len() == part.data.len());
            at += bytes.len();
        }
        // The last part waits for more bytes.
        prop_assert!(log.len() - at < parts.first().map_or(usize::MAX, |part| part.data.len()));
        prop_assert!(at >= end);
    }
}

/// A station that has gone gets no more parts, and the log ends.
#[test]
fn a_station_that_does_not_acknowledge_is_given_up() {
    let (log, ..) = log(&[500, 500], &[(b'D', 100)]);
    let mut source = Source { log, front: 1000, ..Source::default() };
    let mut stream = LogStream::default();
    assert!(stream.start(STATION, &mut source));
    source.made = source.log.len();
    let events: Vec<_> = (0..600).filter_map(|tick| stream.next(&mut source, tick * 10_000)).collect();
    assert_eq!(events.last(), Some(&StreamEvent::Unheard));
    let StreamEvent::Part(first) = events[0] else { panic!("{events:?}") };
    assert!(events[..events.len() - 1].iter().all(|event| *event == StreamEvent::Part(first)));
    assert!((10..=50).contains(&events.len()), "{} times", events.len());
    assert!(!stream.is_active() && !source.runs && stream.next(&mut source, u64::MAX).is_none());
    // A new start begins a new log.
    assert!(stream.start(OTHER, &mut source));
    source.made = source.log.len();
    let Some(StreamEvent::Part(part)) = stream.next(&mut source, 0) else { panic!("a part") };
    assert!(part.to == OTHER && part.sequence == 0 && part.first_record == Some(16));
}

/// A vehicle without a log refuses to stream it.
#[test]
fn without_a_log_there_is_no_stream() {
    struct Nothing;
    impl LogSource for Nothing {}
    let mut stream = LogStream::default();
    assert!(!stream.start(STATION, &mut Nothing) && !stream.is_active());
    assert_eq!(stream.next(&mut Nothing, 0), None);
    stream.stop(&mut Nothing);
}
