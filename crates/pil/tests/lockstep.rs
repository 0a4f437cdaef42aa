//! The `pil` image against the host: the same calls, the same bits.
#![expect(clippy::unwrap_used, clippy::panic, missing_docs, reason = "test")]

mod common;

use common::{Station, image_or_skip, motion};
use link::{Command, Uplink};
use onboard::{Comms, Flight};
use pil::{Emulator, Image, Reply};
use vehicle::{Inbox, Mode};

const TICKS: u64 = 6_000;

/// What reaches the link before each tick: a flight, and everything that can go wrong with its link.
fn bytes_of_tick(station: &mut Station, tick: u64) -> Vec<u8> {
    let (state, setpoint) = motion(tick as f32 * 1e-3);
    // Two gaps: one to ride out, one that ends in a descent.
    let tracked = !(2_500..2_600).contains(&tick) && !(4_000..5_000).contains(&tick);
    if tracked {
        station.say(Uplink::State { sent_us: tick * 1000, state });
    }
    if tick % 10 == 0 {
        station.say(Uplink::Setpoint(setpoint));
    }
    match tick {
        100 | 1_500 => station.command(Command::Arm), // refused first: the rate is not known yet
        5_900 => station.command(Command::Disarm),
        _ => (),
    }
    let mut bytes = station.take();
    match tick % 97 {
        13 => bytes.truncate(bytes.len() / 2),
        31 => bytes.extend_from_slice(b"\xFD\xFDnoise\x00\xFF"),
        53 => bytes.iter_mut().skip(20).take(1).for_each(|byte| *byte ^= 0x10),
        _ => (),
    }
    bytes
}

/// All replies of one flight.
fn fly(mut emulator: Emulator) -> Vec<Reply> {
    let mut station = Station::new();
    (0..TICKS).map(|tick| emulator.exchange(&bytes_of_tick(&mut station, tick)).unwrap()).collect()
}

#[test]
fn every_bit_is_the_hosts() {
    let Some(emulator) = image_or_skip(Image::Pil, |elf| Emulator::start(&elf)) else { return };
    let replies = fly(emulator);

    let (mut flight, mut comms, mut inbox) = (Flight::new().unwrap(), Comms::new(), Inbox::default());
    let mut station = Station::new();
    let mut modes = Vec::new();
    for (tick, reply) in replies.iter().enumerate() {
        let news = comms.receive(&bytes_of_tick(&mut station, tick as u64));
        onboard::post(&mut inbox, &news);
        let report = flight.tick(reply.time_us, &inbox.take());
        let mut bytes = Vec::new();
        comms.report(&report, reply.cycles, |frame| bytes.extend_from_slice(frame));

        assert_eq!(report.throttles, reply.throttles, "throttles of tick {tick}");
        assert_eq!(bytes, reply.bytes, "bytes of tick {tick}");
        assert_eq!(report.health.rate.late_ticks, 0, "tick {tick} came late");
        modes.push(report.mode);
    }
    modes.dedup();
    let [disarmed, flying, riding, descending] = [Mode::Disarmed, Mode::Flying, Mode::Riding, Mode::Descending];
    assert_eq!(modes, [disarmed, flying, riding, flying, riding, descending, disarmed]);

    let counts = replies.iter().map(|reply| reply.instructions);
    println!("instructions of the worst tick: {}", counts.max().unwrap());
}

#[test]
fn every_run_is_the_same() {
    let Some(emulator) = image_or_skip(Image::Pil, |elf| Emulator::start(&elf)) else { return };
    let first = fly(emulator);
    let second = fly(image_or_skip(Image::Pil, |elf| Emulator::start(&elf)).unwrap());
    let differs = first.iter().zip(&second).position(|(a, b)| a != b);
    assert_eq!(differs, None, "tick that differs");
}
