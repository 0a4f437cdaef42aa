//! The emulated board for processor-in-the-loop tests. The host replaces pins and timers through semihosting. The
//! processor and its clock stop while the host works. The memory map is that of the flight image, `memory.x` at the
//! workspace's root.
//!
//! Two FIFOs, `to_firmware` and `from_firmware`, carry the wire format of [`afbc_onboard::ReplyHead`].

use afbc_onboard::{Aged, Readings, ReplyHead};
use afbc_store::Ram;
use afbc_types::ROTORS_MAX;
use core::cell::Cell;
use embassy_executor::SendSpawner;
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::pipe::Pipe;
use embassy_sync::signal::Signal;
use firmware::board::{self, Board, BoardLink, Parts};
use firmware::housekeeping;
use firmware::samples::{self, NoSensors, SampleTime, SampleValue};
use firmware::ticks::Tick;
use semihosting::fs::File;
use semihosting::io::{Read, Write};
use semihosting::process::exit;
use stm32_metapac::Interrupt;

/// Bytes received by the link. At most 4096 may arrive per tick.
static LINK: Pipe<CriticalSectionRawMutex, 4096> = Pipe::new();

/// Sensor readings for the next tick.
static READINGS: Signal<CriticalSectionRawMutex, Readings> = Signal::new();

/// Throttles of the last tick.
static THROTTLES: Mutex<CriticalSectionRawMutex, Cell<[u16; ROTORS_MAX]>> = Mutex::new(Cell::new([0; ROTORS_MAX]));

/// The emulated board.
pub(crate) struct Emulated;

impl Board for Emulated {
    type Interrupt = Interrupt;
    type Sampler = Sampler;
    type Aids = NoSensors;
    type Links = [BoardLink<Receiver, Transmitter>; 1];
    type Log = firmware::logging::NoLog;
    /// Parameters are kept in RAM, since QEMU's flash cannot be written. Every flight begins with the image's
    /// parameters.
    type Memory = Ram<1024>;
    /// Core clock of QEMU's STM32F405. The host computes instruction counts from it.
    const CORE_HZ: u32 = 168_000_000;
    const STORE: u32 = 0;
    const HARDWARE: &'static str = "emulated";
    const OUTPUTS: usize = ROTORS_MAX;

    /// Opens the FIFOs and waits for the bytes of the first tick.
    fn start(_core: &mut cortex_m::Peripherals, _control: SendSpawner) -> Parts<Self> {
        let mut transmitter = Transmitter {
            to_firmware: File::open(c"to_firmware").expect("the host should have made the FIFO"),
            from_firmware: File::create(c"from_firmware").expect("the host should have made the FIFO"),
        };
        transmitter.take_bytes();
        Parts {
            board: Emulated,
            sampler: Sampler,
            aids: NoSensors,
            links: [BoardLink { receiver: Receiver, transmitter }],
            memory: Ram::BLANK,
            log: firmware::logging::NoLog,
        }
    }

    /// There is no watchdog.
    fn unleash_watchdog(&mut self) {}

    /// Spins. While a processor sleeps, QEMU advances its clock from another thread and sometimes counts the same time
    /// twice. Time would then depend on the host's load.
    fn idle() {
        cortex_m::asm::nop();
    }

    /// The emulated clock does not fail.
    fn clock_has_failed(&self) -> bool {
        false
    }

    /// Returns false, since a panic ends the emulator.
    fn task_has_failed(&self) -> bool {
        false
    }

    /// Stores the throttles for the reply.
    fn drive(&mut self, throttles: &[u16; ROTORS_MAX]) {
        THROTTLES.lock(|cell| cell.set(*throttles));
    }

    /// There is no watchdog.
    fn feed_watchdog(&mut self) {}
}

/// Sensors that the host simulates.
pub(crate) struct Sampler;

impl samples::Sampler for Sampler {
    async fn run(self) {
        loop {
            let Readings { imu, aids } = READINGS.wait().await;
            if let Some(Aged { value, age_us }) = imu {
                samples::put(SampleTime::BeforeTick(age_us), SampleValue::Imu(value));
            }
            // Aiding measurements count without an IMU sample too: fixes must reach a vehicle whose inertial sensor has
            // failed.
            for Aged { value, age_us } in aids.into_iter().flatten() {
                samples::put(SampleTime::BeforeTick(age_us), SampleValue::Aid(value));
            }
        }
    }
}

/// Receiving side of the link.
pub(crate) struct Receiver;

impl board::Receiver for Receiver {
    fn receive(&mut self, buffer: &mut [u8]) -> impl Future<Output = usize> {
        LINK.read(buffer)
    }
}

/// Sending side of the link, which also returns control to the host.
pub(crate) struct Transmitter {
    to_firmware: File,
    from_firmware: File,
}

impl board::Transmitter for Transmitter {
    /// Sends the reply and waits for the bytes of the next tick.
    fn transmit(&mut self, tick: &Tick, bytes: &[u8]) -> bool {
        let head = ReplyHead {
            time_us: tick.report.time_us,
            cycles: tick.cycles,
            stack_bytes: housekeeping::stack_bytes(),
            length: bytes.len() as u32,
            throttles: THROTTLES.lock(Cell::get),
        };
        self.from_firmware.write_all(&head.to_bytes()).expect("the host reads");
        self.from_firmware.write_all(bytes).expect("the host reads");
        self.take_bytes();
        true
    }
}

impl Transmitter {
    /// Passes the host's readings to the next tick, and the received bytes to the link. Ends the firmware if the host
    /// has ended.
    fn take_bytes(&mut self) {
        let mut readings = [0; Readings::LEN];
        if self.to_firmware.read_exact(&mut readings).is_err() {
            exit(0);
        }
        READINGS.signal(Readings::from_bytes(&readings));
        let mut length = [0; 4];
        self.to_firmware.read_exact(&mut length).expect("the host should send all that it announced");
        let mut length = u32::from_le_bytes(length) as usize;
        let mut buffer = [0; 256];
        while length > 0 {
            let part = buffer.get_mut(..length.min(256)).unwrap_or_default();
            self.to_firmware.read_exact(part).expect("the host should send all that it announced");
            let mut left = &part[..];
            while !left.is_empty() {
                // The ring buffer first accepts bytes up to its end, then the rest.
                let taken = LINK.try_write(left).expect("the link takes 4096 bytes per tick");
                left = left.get(taken..).unwrap_or_default();
            }
            length -= part.len();
        }
    }
}
