//! The very image that flies, on an emulated board: it boots, ticks, listens and answers.
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, missing_docs, unreachable_pub, reason = "test")]

mod common;

use common::start_or_skip;
use link::{Address, Answer, Command, Decoder, Downlink, Uplink};
use pil::exercise::{Station, motion};
use pil::gdb::{SP, XPSR};
use pil::{Board, Image};
use std::time::{Duration, Instant};

/// Far longer than it takes, even on a machine that is busy with other things.
const PATIENCE: Duration = Duration::from_secs(120);
/// SysTick's reload value register.
const SYST_RVR: u32 = 0xE000_E014;

#[test]
fn it_boots_ticks_and_flies() {
    // That it comes back means that the image got past its clocks.
    let Some(mut board) = start_or_skip(Image::Flight, |elf| Board::boot(&elf)) else { return };
    assert!(board.clock_accesses() > 10, "the clock tree was set up");
    let gdb = board.halt().unwrap();
    assert_eq!(u32::from_le_bytes(gdb.memory(SYST_RVR).unwrap()), 168_000 - 1, "1 kHz at 168 MHz");
    gdb.resume().unwrap();

    let mut station = Station::default();
    let mut decoder = Decoder::<Downlink>::new(Address { system: 255, component: 190 });
    let (mut heartbeats, mut rate_hz, mut accepted, mut spinning) = (0, 0.0, false, false);
    let start = Instant::now();
    let mut spoke = start;
    while !(heartbeats > 0 && rate_hz > 0.0 && accepted && spinning) {
        assert!(start.elapsed() < PATIENCE, "{heartbeats} heartbeats, {rate_hz} Hz, armed {accepted}, {spinning}");

        // Still, level, at its setpoint; the state goes last before the command, to be fresh when that arrives. QEMU's
        // USART takes some 8 kB/s: more would pile up.
        if spoke.elapsed() > Duration::from_millis(150) {
            let (state, setpoint) = motion(0.0);
            station.say(Uplink::Setpoint(setpoint));
            station.say(Uplink::State { sent_us: start.elapsed().as_micros() as u64, state });
            station.say(Uplink::Command(Command::Arm));
            board.send(&station.take()).unwrap();
            spoke = Instant::now();
        }
        decoder.feed(&board.receive().unwrap(), |_, message| match message {
            Downlink::Heartbeat { .. } => heartbeats += 1,
            Downlink::Health(health) => rate_hz = health.rate_hz,
            Downlink::Answer { answer, .. } => accepted |= answer == Answer::Accepted,
            Downlink::Rotors { armed, speeds, .. } => spinning |= armed && speeds.0.min() > 0.0,
            _ => (),
        });
    }
    assert!((997.0..=1003.0).contains(&rate_hz), "the control tick runs at {rate_hz} Hz");
}

/// Bottom of the RAM, and of the stack; and the stack's top (`memory.x`).
const STACK: std::ops::Range<u32> = 0x2000_0000..0x2000_4000;
const HARD_FAULT: u32 = 3;

#[test]
fn a_stack_that_overflows_ends_in_the_fault_handler() {
    let Some(mut board) = start_or_skip(Image::Flight, |elf| Board::boot(&elf)) else { return };
    assert!(!board.receive().unwrap().is_empty(), "it runs");

    let gdb = board.halt().unwrap();
    gdb.set_register(SP, STACK.start + 16).unwrap();
    gdb.resume().unwrap();
    std::thread::sleep(Duration::from_millis(300));
    let gdb = board.halt().unwrap();
    assert_eq!(gdb.register(XPSR).unwrap() & 0x1FF, HARD_FAULT);
    let sp = gdb.register(SP).unwrap();
    assert!(STACK.contains(&(sp - 4)) && sp > STACK.end - 1024, "a fresh stack: {sp:#x}");
    gdb.resume().unwrap();

    // What was sent before it failed, and then nothing.
    board.receive().unwrap();
    assert_eq!(board.receive().unwrap(), [], "it is silent until the watchdog resets it");
}
