//! Compares the `pil` image with the host: the same calls must give the same bits.
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, missing_docs, unreachable_pub, reason = "test")]

mod common;

use afbc_comms::services::streams::DEFAULTS;
use afbc_flight_core::Mode;
use afbc_hil::{Host, HostTick, Station};
use afbc_mavlink::{Uplink, VehicleCommand};
use common::start_or_skip;
use pil::exercise::{TICKS, bytes_of_tick};
use pil::{Emulator, FirmwareImage, TickReply};

/// Returns all replies of one flight.
fn fly(mut emulator: Emulator) -> Vec<TickReply> {
    let mut station = Station::default();
    (0..TICKS).map(|tick| emulator.exchange(&bytes_of_tick(&mut station, tick)).unwrap()).collect()
}

#[test]
fn every_bit_is_the_hosts() {
    let Some(emulator) = start_or_skip(FirmwareImage::Pil, |elf| Emulator::start(&elf)) else { return };
    let replies = fly(emulator);

    let (mut host, mut station) = (Host::new().unwrap(), Station::default());
    let mut modes = Vec::new();
    for (tick, reply) in replies.iter().enumerate() {
        let HostTick { report, bytes, .. } =
            host.tick(&bytes_of_tick(&mut station, tick as u64), reply.time_us, reply.tick_us());
        assert_eq!(report.throttles, reply.throttles, "throttles of tick {tick}");
        assert_eq!(bytes, reply.bytes, "bytes of tick {tick}");
        assert_eq!(report.health.rate.off_ticks(), 0, "tick {tick} came at the wrong time");
        modes.push(report.mode);
    }
    modes.dedup();
    let [disarmed, flying, coasting, descending] = [Mode::Disarmed, Mode::Flying, Mode::Coasting, Mode::Descending];
    assert_eq!(modes, [disarmed, flying, coasting, flying, coasting, descending, disarmed]);

    let counts = replies.iter().map(|reply| reply.instructions);
    println!("instructions of the worst tick: {}", counts.max().unwrap());
}

#[test]
fn every_run_is_the_same() {
    let Some(emulator) = start_or_skip(FirmwareImage::Pil, |elf| Emulator::start(&elf)) else { return };
    let first = fly(emulator);
    let second = fly(start_or_skip(FirmwareImage::Pil, |elf| Emulator::start(&elf)).unwrap());
    let differs = first.iter().zip(&second).position(|(a, b)| a != b);
    assert_eq!(differs, None, "index of the first tick that differs");
}

/// Every stream runs at its highest rate, with states, targets and requests in every tick, also on a processor of half
/// the speed. The link's work must never delay a tick, and every tick must be reported.
#[test]
fn no_tick_is_late_while_every_stream_runs_at_full_rate() {
    for slower in [0, 1] {
        let start = |elf: std::path::PathBuf| Emulator::start_slower(&elf, slower);
        let Some(mut emulator) = start_or_skip(FirmwareImage::Pil, start) else { return };
        let (mut station, mut sent) = (Station::default(), 0);
        for (place, (message, _)) in DEFAULTS.iter().enumerate() {
            let command = VehicleCommand::SetInterval { message: *message, interval_us: 1_000 };
            station.say(&Uplink::Command(command));
            if place % 4 == 3 {
                emulator.exchange(&station.take()).unwrap();
            }
        }
        let mut last_us: Option<u64> = None;
        for tick in 0..3_000 {
            station.say(&Uplink::Command(VehicleCommand::RequestMessage { message: 148, index: 0 }));
            let reply = emulator.exchange(&[station.take(), bytes_of_tick(&mut station, tick)].concat()).unwrap();
            let gap_us = last_us.map_or(1_000, |last_us| reply.time_us - last_us);
            assert!(
                gap_us.abs_diff(1000) <= 10 << slower,
                "{slower}: {gap_us} us between ticks, at {} us",
                reply.time_us
            );
            last_us = Some(reply.time_us);
            sent += reply.bytes.len();
        }
        println!("{slower}: {sent} bytes in 3 s");
    }
}

/// The control tick must come exactly once per control period, at its start, on a processor of any speed. A faster or
/// slower processor creates its tasks at other moments of the first period.
#[test]
fn the_tick_keeps_its_time_on_any_processor() {
    for slower in 0..3 {
        let start = |elf: std::path::PathBuf| Emulator::start_slower(&elf, slower);
        let Some(mut emulator) = start_or_skip(FirmwareImage::Pil, start) else { return };
        let mut station = Station::default();
        // At a quarter of the speed, tick and link together need more than a period, and ticks would go unreported. So
        // the link then has nothing to receive in every second tick.
        let has_bytes = |tick: u64| slower < 2 || tick.is_multiple_of(2);
        let ticks = (0..2_500).map(|tick| {
            let bytes = bytes_of_tick(&mut station, tick);
            emulator.exchange(if has_bytes(tick) { &bytes } else { &[] }).unwrap()
        });
        let times: Vec<u64> = ticks.map(|reply| reply.time_us).collect();
        // The firmware needs some 300 instructions from the interrupt to the tick.
        let latest_us = 10 << slower;
        for pair in times.windows(2) {
            let gap_us = pair[1] - pair[0];
            assert!(gap_us.abs_diff(1000) <= latest_us, "{slower}: {gap_us} us between ticks, at {} us", pair[1]);
        }
        assert!(times.iter().all(|time_us| time_us % 1000 <= latest_us), "{slower}: {:?}", &times[..20]);
    }
}
