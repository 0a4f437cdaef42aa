//! The serial line under full load.

use crate::common;
use afbc_comms::services::streams::{DEFAULTS, id};
use afbc_comms::{Comms, Setup};
use afbc_mavlink::{Address, Downlink, Encoder, FRAME_MAX, ParameterRequest, Uplink, VehicleCommand};
use afbc_onboard::parameters::ParameterTable;
use afbc_onboard::{Configuration, Link};
use afbc_types::State;
use common::Bench;
use std::collections::BTreeMap;

/// Size of the board's transmit buffer \[bytes\], `TX` in `firmware/boards/stm32f405/src/board.rs`. Bytes that do not
/// fit are lost.
const RING: usize = 1024;

/// Returns a vehicle on a line of `baud`.
fn on(baud: u32) -> Bench {
    let mut bench = Bench::new();
    bench.table =
        ParameterTable::new(Configuration { link: Link { baud, ..Link::DEFAULT }, ..Configuration::default() });
    bench.comms = Comms::with(Setup::of(&bench.table.configuration().link));
    bench
}

/// Totals of a run with every stream requested each millisecond while stations send commands.
struct Load {
    bytes: usize,
    /// Number of commands sent, and of commands answered.
    asked: usize,
    answered: usize,
    /// Longest time from a command to its answer at the end of the line \[ms\].
    waited_ms: usize,
    /// Number of messages of each stream.
    streams: BTreeMap<u32, usize>,
    parameters: usize,
}

fn load(baud: usize, seconds: usize) -> Load {
    let mut bench = on(baud as u32);
    let line_per_ms = baud as f64 / 10_000.0;
    for (message, _) in DEFAULTS {
        bench.hear(Uplink::Command(VehicleCommand::SetInterval { message, interval_us: 1_000 }));
        bench.step();
    }
    bench.hear(Uplink::Parameter(ParameterRequest::List));
    let mut load = Load { bytes: 0, asked: 0, answered: 0, waited_ms: 0, streams: BTreeMap::new(), parameters: 0 };
    let (mut ring, mut asked_ms) = (0.0_f64, BTreeMap::new());
    for tick in 0..1000 * seconds {
        // A state arrives every 10 ms, and a command every 50 ms from one of two stations.
        if tick.is_multiple_of(10) {
            bench.measure(&State::default());
        }
        if tick.is_multiple_of(50) {
            let (number, from) =
                (20_000 + tick as u16 % 10_000, Address { system: 250 + (tick / 50 % 2) as u8, component: 1 });
            bench.hear_from(from, Uplink::Command(VehicleCommand::Other(number)));
            asked_ms.insert(number, (from, tick));
            load.asked += 1;
        }
        // Requests for the arming checks cause many texts at once.
        if tick % 500 < 200 && tick.is_multiple_of(10) {
            bench.hear(Uplink::Command(VehicleCommand::CheckArming));
        }
        let (_, said) = bench.step();
        let mut length = 0;
        let mut out = [0; FRAME_MAX];
        for message in &said {
            length += Encoder::new(common::STATION).send(message, &mut out).len();
            let sent_ms = ((ring + length as f64) / line_per_ms) as usize;
            match message {
                Downlink::CommandAck { command, to, .. } => {
                    if let Some((from, asked)) = asked_ms.remove(command) {
                        assert_eq!(from, *to);
                        load.answered += 1;
                        load.waited_ms = load.waited_ms.max(tick - asked + sent_ms);
                    }
                }
                Downlink::Parameter(_) => load.parameters += 1,
                _ => {}
            }
            *load.streams.entry(u32::from(out[7]) | u32::from(out[8]) << 8).or_default() += 1;
        }
        assert!(ring + length as f64 <= RING as f64, "{baud} baud, {tick} ms: {length} bytes on top of {ring:.0}");
        ring = (ring + length as f64 - line_per_ms).max(0.0);
        load.bytes += length;
    }
    load
}

/// At any baud rate all streams at full rate fit the line, the transmit buffer never overflows, every command is
/// answered soon, and no stream starves.
#[test]
fn everything_at_full_rate_fits_the_line() {
    for baud in [57_600, 115_200, 921_600] {
        let seconds = 10;
        let load = load(baud, seconds);
        let (line, share) = (baud / 10 * seconds, load.bytes as f64 / (baud / 10 * seconds) as f64);
        assert!(load.bytes <= line, "{baud} baud: {} bytes of {line}", load.bytes);
        // The line must be used well, or else streams would be slower than necessary.
        assert!(share > 0.85, "{baud} baud: {share:.2} of the line");
        assert_eq!(load.answered, load.asked, "{baud} baud");
        assert!(load.waited_ms <= 200, "{baud} baud: {} ms", load.waited_ms);
        assert_eq!(load.streams[&id::HEARTBEAT], seconds, "{baud} baud");
        let count = ParameterTable::new(Configuration::default()).count();
        assert_eq!(load.parameters, usize::from(count), "{baud} baud");
        for message in [id::ATTITUDE, id::LOCAL_POSITION_NED, id::SYS_STATUS, id::DEBUG_FLOAT_ARRAY] {
            let sent = load.streams.get(&message).copied().unwrap_or(0);
            assert!(sent >= 2 * seconds, "{baud} baud: message {message} {sent} times");
        }
    }
}

/// Rotor commands get the rest of the line while they are sent.
#[test]
fn rotor_commands_have_the_rest_of_a_fast_line() {
    let mut bench = on(921_600);
    let wanted = DEFAULTS.iter().map(|(message, _)| *message).chain([id::HIL_ACTUATOR_CONTROLS]);
    for message in wanted {
        bench.hear(Uplink::Command(VehicleCommand::SetInterval { message, interval_us: 1_000 }));
        bench.step();
    }
    let (mut bytes, mut rotors) = (0, 0);
    for tick in 0..10_000 {
        if tick % 10 == 0 {
            bench.measure(&State::default());
        }
        for message in bench.step().1 {
            bytes += Encoder::new(common::STATION).send(&message, &mut [0; FRAME_MAX]).len();
            rotors += usize::from(matches!(message, Downlink::Rotors { .. }));
        }
    }
    assert!(bytes <= 921_600, "{bytes} bytes");
    assert!(rotors >= 1000, "{rotors}");
}
