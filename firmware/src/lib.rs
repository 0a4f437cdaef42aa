//! AFBC on a microcontroller: a thin shell around [`afbc_flight_core`] and [`afbc_onboard`], which hold all
//! logic.
//!
//! # One firmware, an image per board
//!
//! The trait [`board::Board`] hides the differences between boards and chips. Each crate in `firmware/boards/`
//! implements it and builds the board's images. `firmware/boards/emulated` has the same control tick, link,
//! supervisor, executors and time base as the boards that fly. It exchanges bytes with the host once per control tick,
//! so that an emulator can fly it in lockstep.
//!
//! # Priorities
//!
//! Nothing runs in thread mode: every task is in an interrupt executor, and the core idles otherwise. The table begins
//! with the highest priority (see [`executors::priority`]):
//!
//! | | runs | duration |
//! |---|---|---|
//! | 1 | SysTick: the time base, starts the control tick | 1 us per millisecond |
//! | 2 | the links: bytes to and from their rings | 1 us per byte |
//! | 3 | [`samples`]: reading the inertial sensors | |
//! | 4 | [`control`]: the control tick, then the motors' waveform | 50 us per millisecond |
//! | 6 | end of the motors' DMA | 1 us per millisecond |
//! | 7 | [`aux_sensors`]: reading the slow ones, whose drivers may wait for their bus | |
//! | 8 | [`comms`]: the link's messages | |
//! | 12 | [`housekeeping`]: debugger's log, stack; [`parameters`]: to flash; [`indication`]: LED, buzzer; USB | |
//! | 14 | [`logging`]: the black box to a memory card or flash, for which it waits | |
//!
//! The links precede the control tick because a UART may buffer one byte only, and the next comes within 11 us. USB
//! has a low priority because its host waits until the device is ready.
#![no_std]

pub mod aux_sensors;
pub mod board;
pub mod comms;
pub mod control;
pub mod escs;
pub mod executors;
pub mod housekeeping;
mod image;
pub mod indication;
pub mod logging;
pub mod parameters;
pub mod radio;
pub mod recording;
pub mod samples;
pub mod self_tests;
pub mod ticks;
pub mod time;
pub mod vehicle;

#[doc(hidden)]
pub use static_cell::StaticCell;

use board::{Board, Links as _, Parts, Transmitter as _};
use embassy_executor::SendSpawner;

/// Starts all tasks; the core then idles between interrupts. The functions start the tasks whose type depends on the
/// board. [`image!`] defines these functions.
#[expect(clippy::too_many_arguments, reason = "a function for each task, each of a type of its own")]
pub fn run<B: Board>(
    mut core: cortex_m::Peripherals,
    lines: executors::InterruptLines<B::Interrupt>,
    sample: impl FnOnce(SendSpawner, B::Sampler),
    aid: impl FnOnce(SendSpawner, B::Aids),
    control: impl FnOnce(SendSpawner, &'static mut vehicle::Flight, B),
    comms: impl FnOnce(SendSpawner, &'static mut comms::CommsParts, B::Links),
    keeper: impl FnOnce(SendSpawner, parameters::Keeper<B::Memory>),
    logging: impl FnOnce(SendSpawner, logging::LogEnds, B::Log),
) -> ! {
    let executors = executors::start(&mut core, lines);
    let Parts { mut board, sampler, aids, mut links, memory, log } = B::start(&mut core, executors.control);
    let (kept, parts, blocks) = read::<B>(memory, &mut links);
    let (_, table, ..) = parts;
    let configuration = table.configuration();
    board.set_motor_protocol(configuration.outputs.protocol, configuration.escs.answers);
    let flight = control::make(table.configuration());
    // The watchdog does not start earlier, because the start may erase flash for half a second or more, during which no
    // tick feeds it.
    board.unleash_watchdog();
    time::start(core.SYST, B::CORE_HZ);
    comms(executors.comms, parts, links);
    if let Some(spawner) = executors.sampling {
        sample(spawner, sampler);
    }
    if let Some(spawner) = executors.aiding {
        aid(spawner, aids);
    }
    control(executors.control, flight, board);
    keeper(executors.housekeeping, kept);
    housekeeping::spawn(executors.housekeeping);
    // The constant lets the compiler drop this code on a board without logs.
    if B::HAS_LOG
        && let (Some(spawner), Some(blocks)) = (executors.logging, blocks)
    {
        logging(spawner, blocks, log);
    }
    loop {
        B::idle();
    }
}

/// Reads the parameters, sets the links up by them, and creates the state of the link task. It is not inlined, so that
/// the stack does not hold the parameters and the vehicle at the same time. Must run before the watchdog starts, since
/// it reads every stored parameter.
#[inline(never)]
fn read<B: Board>(
    memory: B::Memory,
    links: &mut B::Links,
) -> (parameters::Keeper<B::Memory>, &'static mut comms::CommsParts, Option<logging::LogEnds>) {
    let (kept, table, signing) = parameters::read(memory, B::STORE);
    // Before the radio receiver's link is set up, which has a baud rate of its own.
    for link in links.each() {
        link.transmitter.set_baud(table.configuration().link.baud);
    }
    let radio = if radio::is_possible::<B>() { radio::RadioLine::begin::<B>(&table, links) } else { None };
    // If radio receiver and exact log are set to the same link, the receiver gets it.
    let is_free = radio::leaves_log::<B>(&table);
    let log = if recording::is_possible::<B>() && is_free { recording::ExactLog::begin::<B>(&table) } else { None };
    if recording::is_possible::<B>() {
        ticks::keep_details();
    }
    let (black_box, blocks) = if B::HAS_LOG { Some(logging::LinkLog::begin::<B>()) } else { None }.unzip();
    (kept, comms::make::<B>(table, signing, log, radio, black_box), blocks)
}
