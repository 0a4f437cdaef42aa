//! Interface between firmware and board. A crate in `firmware/boards/` implements it and builds its images by
//! [`image!`](crate::image!), the only place where firmware and board meet.

use crate::samples::Sampler;
use crate::ticks::Tick;
use crate::vehicle::ROTORS;
use afbc_flight_core::protocol::MotorProtocol;
use afbc_log::storage::LogKeeper;
use cortex_m::interrupt::InterruptNumber;
use embassy_executor::SendSpawner;
use embedded_storage::nor_flash::NorFlash;

/// A board: its clock, sensors, links, flash, motors, watchdog and health.
pub trait Board: Sized + 'static {
    /// Interrupt lines of its chip.
    type Interrupt: InterruptNumber;
    /// Its inertial sensors, or [`NoSensors`](crate::samples::NoSensors).
    type Sampler: Sampler + Send + 'static;
    /// Its slow sensors: whatever aids the estimate.
    type Aids: Sampler + Send + 'static;
    /// Its links: `[BoardLink<R, T>; N]`.
    type Links: Links + 'static;
    /// What keeps its logs, or [`NoLog`](crate::logging::NoLog).
    type Log: LogKeeper + Send + 'static;
    /// Flash with two sectors for the parameters, from [`STORE`](Self::STORE) on.
    type Memory: NorFlash + Send + 'static;
    /// Clock of the core and of SysTick \[Hz\], in whole MHz.
    const CORE_HZ: u32;
    /// Offset of the parameters' sectors \[bytes\].
    const STORE: u32;
    /// Its name in logs.
    const HARDWARE: &'static str;
    /// True if it has room for minutes of logs only, which are small then
    /// ([`BlackBox::small`](afbc_log::ulog::BlackBox::small)).
    const SMALL_LOGS: bool = false;
    /// True if it keeps logs.
    const HAS_LOG: bool = false;
    /// Most motors that it drives.
    const OUTPUTS: usize;
    /// True if it has a task that shows by LED or buzzer how the vehicle is ([`indication`](crate::indication)).
    const INDICATES: bool = false;
    /// Index of the link that is meant for a radio receiver, if one is.
    const RADIO_LINK: Option<usize> = None;
    /// True if it has a line for the telemetry of its motor controllers ([`escs`](crate::escs)).
    const ESCS: bool = false;
    /// True if it hears motor controllers that answer on their own lines (bidirectional DSHOT).
    const ANSWERS: bool = false;
    /// Restarts the chip into its boot loader, if it has one.
    const BOOT_LOADER: Option<fn() -> !> = None;

    /// Runs first after a reset, before anything is set up: what [`BOOT_LOADER`](Self::BOOT_LOADER) needs then.
    fn after_reset() {}

    /// Brings up clocks and peripherals; the core runs at [`CORE_HZ`](Self::CORE_HZ) from then on. To be called once. A
    /// board's tasks spawned on `control` run right after the control tick.
    fn start(core: &mut cortex_m::Peripherals, control: SendSpawner) -> Parts<Self>;

    /// Sets how throttles are sent to the motors, before the first are, and whether their controllers answer; nothing
    /// if there is only one way.
    fn set_motor_protocol(&mut self, _protocol: MotorProtocol, _answers: bool) {}

    /// Starts the watchdog, if there is one; nothing is erased from now on.
    fn unleash_watchdog(&mut self);

    /// Waits for the next interrupt, or a part of that time.
    fn idle() {
        cortex_m::asm::wfi();
    }

    /// True if the crystal has failed and another clock has taken over.
    fn clock_has_failed(&self) -> bool;

    /// True if a task that is not needed in flight has panicked.
    fn task_has_failed(&self) -> bool;

    /// Outputs throttles to the motors: 0, or 48 to 2047.
    fn drive(&mut self, throttles: [u16; ROTORS]);

    /// Feeds the watchdog.
    fn feed_watchdog(&mut self);
}

/// What a board has brought up.
pub struct Parts<B: Board> {
    /// What the control tick uses.
    pub board: B,
    /// What the sampling task uses.
    pub sampler: B::Sampler,
    /// What the slow sensors' task uses.
    pub aids: B::Aids,
    /// What the links' task uses.
    pub links: B::Links,
    /// Where the parameters are kept.
    pub memory: B::Memory,
    /// Where logs are kept.
    pub log: B::Log,
}

/// Both sides of a link.
pub struct BoardLink<R, T> {
    /// Receiving side.
    pub receiver: R,
    /// Sending side.
    pub transmitter: T,
}

/// The links of a board, of one kind: each is listened to, and all are told the same.
pub trait Links {
    /// Receiving side of each.
    type Receiver: Receiver;
    /// Sending side of each.
    type Transmitter: Transmitter;
    /// Number of links, at least one.
    const COUNT: usize;

    /// Returns them.
    fn each(&mut self) -> &mut [BoardLink<Self::Receiver, Self::Transmitter>];
}

impl<R: Receiver, T: Transmitter, const N: usize> Links for [BoardLink<R, T>; N] {
    type Receiver = R;
    type Transmitter = T;
    const COUNT: usize = N;

    fn each(&mut self) -> &mut [BoardLink<R, T>] {
        self
    }
}

/// Receiving side of a link.
pub trait Receiver {
    /// Reads the next bytes and returns their number; waits for at least one. Nothing is lost if the future is dropped
    /// before it is ready.
    fn receive(&mut self, buffer: &mut [u8]) -> impl Future<Output = usize> + Send;

    /// True for a link that only somebody with the vehicle in their hands can have plugged in. If no link is, the first
    /// one counts as such.
    fn is_wired(&self) -> bool {
        false
    }
}

/// Sending side of a link.
pub trait Transmitter {
    /// Sets the baud rate of the line in both directions, before anything is sent; nothing if there is no such line.
    fn set_baud(&mut self, _baud: u32) {}

    /// Sets the line up for SBUS: 100,000 baud, 8E2, and inverted if the chip can; nothing if there is no such line.
    fn set_sbus(&mut self) {}

    /// Sends the messages after `tick`, without waiting for the line. False if that is too far behind: then none of
    /// them is sent.
    fn transmit(&mut self, tick: &Tick, bytes: &[u8]) -> bool;
}
