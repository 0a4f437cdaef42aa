//! Tests the unmodified flight image on an emulated board: boot, ticks, link, and failures of its crystal and its
//! tasks.
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, missing_docs, unreachable_pub, reason = "test")]

mod common;

use afbc_comms::CLOCK_FAILED;
use afbc_flight_core::Refusal;
use afbc_hil::Station;
use afbc_mavlink::{Address, CommandResult, Decoder, Downlink, HealthArray, Uplink, VehicleCommand};
use common::start_or_skip;
use pil::budget::LinkedImage;
use pil::clock_tree::{FLASH_ACR, RCC_CFGR, RCC_PLLCFGR};
use pil::exercise::motion;
use pil::gdb::{PC, SP, XPSR};
use pil::{EmulatedBoard, FirmwareImage};
use std::collections::HashSet;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// This time is far longer than needed, even on a busy machine.
const PATIENCE: Duration = Duration::from_secs(120);
/// Interval between states sent to the board \[us\]: QEMU's USART handles some 8 kB/s.
const EVERY_US: u64 = 30_000;
/// Tick rates accepted as 1 kHz \[Hz\]: QEMU's USART delivers bytes faster than any line and may delay a tick.
const RATE_HZ: std::ops::RangeInclusive<f32> = 997.0..=1003.0;
/// MAV_CMD_COMPONENT_ARM_DISARM.
const ARM_DISARM: u16 = 400;
/// SysTick's reload value register.
const SYST_RVR: u32 = 0xE000_E014;

/// A simulated tracker that keeps sending the same state and collects the board's messages.
struct Talk {
    board: EmulatedBoard,
    station: Station,
    decoder: Decoder<Downlink>,
    heard: Heard,
    /// Time of the last sent state, on the board's clock \[us\].
    spoke_us: u64,
}

/// The board's messages so far.
#[derive(Debug, Default)]
struct Heard {
    heartbeats: u32,
    /// Newest time in a rotor command or health message \[us since power-up\].
    time_us: u64,
    health: HealthArray,
    answers: HashSet<CommandResult>,
    texts: HashSet<String>,
}

impl Talk {
    fn new(board: EmulatedBoard) -> Self {
        let decoder = Decoder::new(Address { system: 255, component: 190 });
        Talk { board, station: Station::default(), decoder, heard: Heard::default(), spoke_us: 0 }
    }

    /// Sends states, each followed by `command`, until `enough` returns true.
    fn until(&mut self, command: Option<VehicleCommand>, enough: impl Fn(&Heard) -> bool) {
        let start = Instant::now();
        while !enough(&self.heard) {
            assert!(start.elapsed() < PATIENCE, "{:?}", self.heard);
            let (spoke_us, heard) = (self.spoke_us, &mut self.heard);
            self.decoder.feed(&self.board.receive().unwrap(), |_, message| match message {
                Downlink::Heartbeat { .. } => heard.heartbeats += 1,
                // The station's first message requests rotor commands; until they come, time is taken from the health
                // messages.
                Downlink::Health(health) => {
                    heard.time_us = heard.time_us.max(health.time_us);
                    heard.health = health;
                }
                Downlink::CommandAck { command: ARM_DISARM, answer, .. } => drop(heard.answers.insert(answer)),
                Downlink::Text { text, .. } => drop(heard.texts.insert(text.to_str().unwrap().to_owned())),
                Downlink::Rotors { time_us, .. } => heard.time_us = time_us,
                _ => (),
            });
            // Send by the board's own clock, right after its message. The vehicle is at rest, level, at the setpoint.
            // The state is the last message before the command, so that it is fresh when the command arrives.
            if heard.time_us >= spoke_us + EVERY_US {
                let (state, setpoint) = motion(0.0);
                self.station.say(&Uplink::Setpoint(setpoint));
                self.station.track(heard.time_us, state);
                command.iter().for_each(|command| self.station.say(&Uplink::Command(*command)));
                self.spoke_us = heard.time_us;
                self.board.send(&self.station.take()).unwrap();
            }
        }
    }

    /// Requests arming until the only remaining refusal is that the vehicle must report rest for a whole second without
    /// a gap. QEMU's USART is too slow for that.
    fn ask(&mut self) {
        self.until(Some(VehicleCommand::Arm), |heard| heard.texts.contains(Refusal::NotAtRest.reason()));
    }
}

/// FLASH_ACR: five wait states, prefetch and both caches on.
const FLASH_ON: u32 = 5 | 1 << 8 | 1 << 9 | 1 << 10;
/// Bits of RCC_PLLCFGR: the crystal is the PLL's source, and the PLL's divider.
const PLL_FROM_CRYSTAL: u32 = 1 << 22;
const PLL_DIVIDER: u32 = 0x3F;
/// Value of RCC_CFGR for a core that runs from the PLL.
const CORE_FROM_PLL: u32 = 0b10;

#[test]
fn it_boots_ticks_and_listens() {
    // Boot only returns if the image has set up its clocks.
    let Some(mut board) = start_or_skip(FirmwareImage::Flight, |elf| EmulatedBoard::boot(&elf)) else { return };
    assert!(board.clock_accesses() > 10, "the clock tree was set up");
    assert_eq!(board.clock_register(FLASH_ACR), FLASH_ON);
    assert_eq!(board.clock_register(RCC_PLLCFGR) & (PLL_FROM_CRYSTAL | PLL_DIVIDER), PLL_FROM_CRYSTAL | 4);
    let gdb = board.halt().unwrap();
    assert_eq!(u32::from_le_bytes(gdb.memory(SYST_RVR).unwrap()), 168_000 - 1, "1 kHz at 168 MHz");
    gdb.resume().unwrap();

    let mut talk = Talk::new(board);
    talk.until(None, |heard| heard.heartbeats > 0 && heard.health.rate_hz > 0.0);
    assert!(RATE_HZ.contains(&talk.heard.health.rate_hz), "{:?}", talk.heard);
    talk.ask();
}

/// Address of the system memory with the chip's boot loader (RM0090, table 5).
const SYSTEM_MEMORY: u32 = 0x1FFF_0000;
/// Value of the backup register that requests the boot loader (`firmware/chips/stm32/src/boot_loader.rs`).
const WANTED: u32 = 0xB007_4DF0;

#[test]
fn it_enters_the_boot_loader_once_if_that_is_wanted() {
    let boot = |elf: PathBuf| EmulatedBoard::boot_to_loader(&elf, WANTED, SYSTEM_MEMORY);
    let Some(left) = start_or_skip(FirmwareImage::Flight, boot) else { return };
    assert_eq!(left, 0);
}

#[test]
fn without_a_crystal_it_runs_on_and_does_not_arm() {
    let Some(board) = start_or_skip(FirmwareImage::Flight, |elf| EmulatedBoard::boot_without_crystal(&elf)) else {
        return;
    };
    assert_eq!(board.clock_register(RCC_PLLCFGR) & (PLL_FROM_CRYSTAL | PLL_DIVIDER), 8, "16 MHz / 8, as 8 MHz / 4");
    assert_eq!(board.clock_register(RCC_CFGR) & 0b11, CORE_FROM_PLL);
    assert_eq!(board.clock_register(FLASH_ACR), FLASH_ON);
    let mut talk = Talk::new(board);
    talk.until(None, |heard| heard.health.rate_hz > 0.0);
    talk.until(Some(VehicleCommand::Arm), |heard| heard.texts.contains(Refusal::Unhealthy.reason()));
    assert!(talk.heard.texts.contains(CLOCK_FAILED), "{:?}", talk.heard);
    assert!(!talk.heard.answers.contains(&CommandResult::Accepted), "{:?}", talk.heard);
}

#[test]
fn a_crystal_that_fails_does_not_stop_it() {
    let Some(board) = start_or_skip(FirmwareImage::Flight, |elf| EmulatedBoard::boot(&elf)) else { return };
    let mut talk = Talk::new(board);
    talk.until(None, |heard| heard.health.rate_hz > 0.0);
    talk.ask();
    assert!(!talk.heard.texts.contains(CLOCK_FAILED), "{:?}", talk.heard);

    talk.board.lose_crystal().unwrap();
    assert_eq!(talk.board.clock_register(RCC_PLLCFGR) & (PLL_FROM_CRYSTAL | PLL_DIVIDER), 8);
    assert_eq!(talk.board.clock_register(RCC_CFGR) & 0b11, CORE_FROM_PLL);
    assert_eq!(talk.board.clock_register(FLASH_ACR), FLASH_ON, "the wait states of 168 MHz");

    let failed_us = talk.heard.time_us;
    talk.heard.texts.remove(Refusal::NotAtRest.reason());
    talk.until(None, |heard| heard.texts.contains(CLOCK_FAILED));
    talk.until(Some(VehicleCommand::Arm), |heard| heard.texts.contains(Refusal::Unhealthy.reason()));
    talk.until(None, |heard| heard.time_us > failed_us + 1_000_000 && heard.health.time_us > failed_us + 1_000_000);
    assert!(RATE_HZ.contains(&talk.heard.health.rate_hz), "by its own clock: {:?}", talk.heard);
}

#[test]
fn a_panic_of_the_link_does_not_stop_the_tick() {
    let Some((mut board, linked)) =
        start_or_skip(FirmwareImage::Flight, |elf| Ok((EmulatedBoard::boot(&elf)?, LinkedImage::read(&elf)?)))
    else {
        return;
    };
    let address = |name: &str| linked.function_named(name).unwrap();
    let gdb = board.halt().unwrap();
    gdb.run_to(address("firmware::comms::report"), PATIENCE).unwrap();
    gdb.set_register(PC, linked.symbol("_defmt_panic").unwrap() & !1).unwrap();
    for _ in 0..100 {
        gdb.run_to(address("firmware::control::tick"), PATIENCE).unwrap();
        gdb.step().unwrap();
    }
    gdb.resume().unwrap();
    // Bytes sent before the panic still arrive, then nothing: the link's task has ended.
    let start = Instant::now();
    while !board.receive().unwrap().is_empty() {
        assert!(start.elapsed() < PATIENCE, "the link still sends");
    }
}

/// Exception number of USART1's interrupt.
const USART1: u32 = 16 + 37;

/// Waking the link's task for every byte would take most of the processor's time on a busy line.
#[test]
fn few_bytes_do_not_wake_the_link() {
    let Some((mut board, linked)) =
        start_or_skip(FirmwareImage::Flight, |elf| Ok((EmulatedBoard::boot(&elf)?, LinkedImage::read(&elf)?)))
    else {
        return;
    };
    let wake = linked.function_named("embassy_executor::raw::waker::wake").unwrap();
    let ring = linked.symbol("flight::board::RX").unwrap();
    board.send(&[1; 31]).unwrap();
    let gdb = board.halt().unwrap();
    // Ticks keep waking tasks, including the link's.
    while gdb.memory::<32>(ring).unwrap().iter().filter(|byte| **byte == 1).count() < 31 {
        gdb.step().unwrap(); // off the breakpoint
        gdb.run_to(wake, PATIENCE).unwrap();
        assert_ne!(gdb.register(XPSR).unwrap() & 0x1FF, USART1, "READ_MIN is 32");
    }
}

#[test]
fn the_flight_image_has_a_log() {
    let Some((mut board, linked)) =
        start_or_skip(FirmwareImage::Flight, |elf| Ok((EmulatedBoard::boot(&elf)?, LinkedImage::read(&elf)?)))
    else {
        return;
    };
    for line in ["tick {=u32} cycles, longest {=u32}", "started by {=str}"] {
        assert!(linked.log.iter().any(|logged| logged.contains(line)), "{line:?} in {:?}", linked.log);
    }
    // The image logs a line at once, and then one per second.
    let header = linked.symbol("_SEGGER_RTT").unwrap();
    let written = header + 16 + 4 + 4 + 3 * 4;
    let mut said = || {
        let gdb = board.halt().unwrap();
        let said = u32::from_le_bytes(gdb.memory(written).unwrap());
        gdb.resume().unwrap();
        said
    };
    let first = said();
    assert!(first > 0, "started by ...");
    let start = Instant::now();
    while said() == first {
        assert!(start.elapsed() < PATIENCE, "no line per second");
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// Address range of the stack in the core-coupled memory (`memory.x`).
const STACK: std::ops::Range<u32> = 0x1000_0000..0x1001_0000;
const HARD_FAULT: u32 = 3;

#[test]
fn a_stack_that_overflows_ends_in_the_fault_handler() {
    let Some(mut board) = start_or_skip(FirmwareImage::Flight, |elf| EmulatedBoard::boot(&elf)) else { return };
    let start = Instant::now();
    while board.receive().unwrap().is_empty() {
        assert!(start.elapsed() < PATIENCE, "the image does not run");
    }

    let gdb = board.halt().unwrap();
    gdb.set_register(SP, STACK.start + 16).unwrap();
    gdb.resume().unwrap();
    let gdb = loop {
        assert!(start.elapsed() < PATIENCE, "no fault");
        std::thread::sleep(Duration::from_millis(50));
        let gdb = board.halt().unwrap();
        if gdb.register(XPSR).unwrap() & 0x1FF == HARD_FAULT {
            break gdb;
        }
        gdb.resume().unwrap();
    };
    let sp = gdb.register(SP).unwrap();
    assert!(STACK.contains(&(sp - 4)) && sp > STACK.end - 1024, "a fresh stack: {sp:#x}");
    gdb.resume().unwrap();

    // Bytes sent before the fault still arrive, then nothing.
    while !board.receive().unwrap().is_empty() {
        assert!(start.elapsed() < PATIENCE, "the link still sends");
    }
    assert_eq!(board.receive().unwrap(), [0_u8; 0], "it is silent until the watchdog resets it");
}
