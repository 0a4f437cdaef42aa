//! Interface between firmware and board. A crate in `firmware/boards/` implements [`Board`] and builds its images by
//! [`image!`](crate::image!). Firmware and board meet nowhere else.

pub use afbc_types::ROTORS_MAX;

use crate::samples::Sampler;
use crate::ticks::Tick;
use afbc_flight_core::protocol::MotorProtocol;
use afbc_log::storage::LogKeeper;
use cortex_m::interrupt::InterruptNumber;
use embassy_executor::SendSpawner;
use embedded_storage::nor_flash::NorFlash;

/// A board: its clock, sensors, links, flash, motors, watchdog and health.
pub trait Board: Sized + 'static {
    /// Interrupt lines of the chip.
    type Interrupt: InterruptNumber;
    /// Inertial sensors, or [`NoSensors`](crate::samples::NoSensors).
    type Sampler: Sampler + Send + 'static;
    /// Slow sensors that aid the estimate, such as a barometer.
    type Aids: Sampler + Send + 'static;
    /// Links: `[BoardLink<R, T>; N]`.
    type Links: Links + 'static;
    /// Storage of the logs, or [`NoLog`](crate::logging::NoLog).
    type Log: LogKeeper + Send + 'static;
    /// Flash that has two sectors for the parameters, starting at [`STORE`](Self::STORE).
    type Memory: NorFlash + Send + 'static;
    /// Clock of the core and of SysTick \[Hz\], in whole MHz.
    const CORE_HZ: u32;
    /// Offset of the parameters' sectors \[bytes\].
    const STORE: u32;
    /// Name of the board in logs.
    const HARDWARE: &'static str;
    /// True if the storage holds only minutes of logs. Logs are then small
    /// ([`BlackBox::small`](afbc_log::ulog::BlackBox::small)).
    const SMALL_LOGS: bool = false;
    /// True if the board keeps logs.
    const HAS_LOG: bool = false;
    /// Largest number of motors that the board can drive.
    const OUTPUTS: usize;
    /// True if a task of the board shows the vehicle's state by LED or buzzer ([`indication`](crate::indication)).
    const INDICATES: bool = false;
    /// Index of the link meant for a radio receiver, if there is one.
    const RADIO_LINK: Option<usize> = None;
    /// True if the board has a UART for the telemetry of its motor controllers ([`escs`](crate::escs)).
    const ESCS: bool = false;
    /// True if the board supports bidirectional DSHOT, by which motor controllers answer on their signal lines.
    const ANSWERS: bool = false;
    /// Function that restarts the chip into its boot loader, if it has one.
    const BOOT_LOADER: Option<fn() -> !> = None;

    /// Runs first after a reset, before any setup. If [`BOOT_LOADER`](Self::BOOT_LOADER) has caused the
    /// reset, the boot loader is entered here.
    fn after_reset() {}

    /// Sets up clocks and peripherals, after which the core runs at [`CORE_HZ`](Self::CORE_HZ). Must be called once.
    /// Tasks that the board spawns on `control` run right after the control tick.
    fn start(core: &mut cortex_m::Peripherals, control: SendSpawner) -> Parts<Self>;

    /// Sets the protocol of the motor outputs, before the first output, and whether the motor controllers answer. Does
    /// nothing on a board that has only one protocol.
    fn set_motor_protocol(&mut self, _protocol: MotorProtocol, _answers: bool) {}

    /// Starts the watchdog, if there is one. No flash is erased after this call.
    fn unleash_watchdog(&mut self);

    /// Waits for the next interrupt; may return earlier.
    fn idle() {
        cortex_m::asm::wfi();
    }

    /// True if the crystal has failed and another clock has replaced it.
    fn clock_has_failed(&self) -> bool;

    /// True if a task that is not needed in flight has panicked.
    fn task_has_failed(&self) -> bool;

    /// Outputs throttles to the motors: 0, or 48 to 2047; 0 where there is no motor.
    fn drive(&mut self, throttles: &[u16; ROTORS_MAX]);

    /// Feeds the watchdog.
    fn feed_watchdog(&mut self);
}

/// Parts of a board after its setup.
pub struct Parts<B: Board> {
    /// The board itself, used by the control tick.
    pub board: B,
    /// Inertial sensors, used by the sampling task.
    pub sampler: B::Sampler,
    /// Slow sensors, used by their own task.
    pub aids: B::Aids,
    /// Links, used by the link task.
    pub links: B::Links,
    /// Flash of the parameters.
    pub memory: B::Memory,
    /// Storage of the logs.
    pub log: B::Log,
}

/// The receiving and the sending side of a link.
pub struct BoardLink<R, T> {
    /// Receiving side.
    pub receiver: R,
    /// Sending side.
    pub transmitter: T,
}

/// Links of a board, all of one type. The firmware listens on each link and sends the same messages on all.
pub trait Links {
    /// Receiving side of a link.
    type Receiver: Receiver;
    /// Sending side of a link.
    type Transmitter: Transmitter;
    /// Number of links, at least one.
    const COUNT: usize;

    /// Returns the links.
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
    /// Reads the next bytes and returns their number; waits for at least one byte. No byte is lost if the future is
    /// dropped before it is ready.
    fn receive(&mut self, buffer: &mut [u8]) -> impl Future<Output = usize> + Send;

    /// True for a link, such as USB, that can be plugged in only at the vehicle. If no link is wired, the first one
    /// counts as wired.
    fn is_wired(&self) -> bool {
        false
    }
}

/// Sending side of a link.
pub trait Transmitter {
    /// Sets the baud rate in both directions, before anything is sent. Does nothing on a link without a UART.
    fn set_baud(&mut self, _baud: u32) {}

    /// Sets the UART up for SBUS: 100,000 baud, 8E2, inverted if the chip can. Does nothing on a link without a UART.
    fn set_sbus(&mut self) {}

    /// Sends the messages of `tick` without waiting for the line. Returns false, and sends nothing, if the line is too
    /// far behind.
    fn transmit(&mut self, tick: &Tick, bytes: &[u8]) -> bool;
}
