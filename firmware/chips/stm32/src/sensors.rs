//! Buses and timing of sensors.

use afbc_drivers::alignment::CW270_FLIP;
use afbc_drivers::data_ready::{DataReady, DataReadyPin};
use afbc_drivers::{Driver, PartFault, PartTiming, Registers, SensorPart};
use afbc_types::Stamped;
use core::marker::PhantomData;
use core::sync::atomic::{AtomicU32, Ordering};
use embassy_stm32::exti::{self, ExtiInput};
use embassy_stm32::gpio::{ExtiPin, Level, Output, Pin, Pull, Speed};
use embassy_stm32::interrupt::typelevel;
use embassy_stm32::mode::Async;
use embassy_stm32::pac::EXTI;
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{self, MODE_3, Spi};
use embassy_stm32::time::Hertz;
use embassy_stm32::{Peri, i2c};
use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embassy_sync::mutex::Mutex;
use embassy_time::{Duration, Instant, Timer};
use embedded_hal_async::spi::{ErrorType, Operation, SpiDevice};
use firmware::self_tests::{self, Asked};
use nalgebra::Matrix3;

/// Alignment of the compass in a usual GNSS module: it faces down and is rotated by 270 degrees.
pub const COMPASS: Matrix3<f32> = CW270_FLIP;

/// Control period \[us\].
const PERIOD_US: u32 = 1_000;

/// Drive strength of select pins: PC13 to PC15 allow no faster one, and an edge of 100 ns ends before the first clock.
pub const SELECT: Speed = Speed::Low;

/// A part that is alone on its SPI.
pub struct Device {
    spi: Spi<'static, Async, Master>,
    select: Output<'static>,
}

impl Device {
    /// Creates the part behind a select pin, which is high from now on.
    pub fn new(spi: Spi<'static, Async, Master>, select: Peri<'static, impl Pin>) -> Self {
        Device { spi, select: Output::new(select, Level::High, SELECT) }
    }

    /// Sets the fastest clock not above `most_hz`; `kernel_hz` is the SPI's input clock.
    pub fn set_clock(&mut self, kernel_hz: u32, most_hz: u32) {
        // These settings are always valid.
        let _ = self.spi.set_config(&spi(divided(kernel_hz, most_hz)));
    }
}

/// Returns the fastest clock not above `most_hz` that a prescaler of 2, 4 ... 256 makes from `kernel_hz`; the slowest
/// clock if all are above.
pub(crate) fn divided(kernel_hz: u32, most_hz: u32) -> u32 {
    (1..8).map(|power| kernel_hz >> power).find(|hz| *hz <= most_hz).unwrap_or(kernel_hz >> 8)
}

/// A part's select pin while it is low. Dropping it, also with an abandoned transfer, sets the pin high.
struct Selected<'a>(&'a mut Output<'static>);

impl Drop for Selected<'_> {
    fn drop(&mut self) {
        self.0.set_high();
    }
}

impl ErrorType for Device {
    type Error = spi::Error;
}

impl SpiDevice for Device {
    async fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), spi::Error> {
        operate(&mut self.spi, &mut self.select, operations).await
    }
}

/// An SPI shared by several parts of one task.
pub type SharedSpi = Mutex<NoopRawMutex, Spi<'static, Async, Master>>;

/// A part that shares its SPI.
pub struct SharedDevice<'a> {
    spi: &'a SharedSpi,
    select: Output<'static>,
    config: spi::Config,
}

impl<'a> SharedDevice<'a> {
    /// Creates the part behind a select pin; all select pins of the SPI must be high before the first transfer. The
    /// clock is the fastest not above `most_hz`; `kernel_hz` is the SPI's input clock.
    pub fn new(spi: &'a SharedSpi, select: Output<'static>, kernel_hz: u32, most_hz: u32) -> Self {
        SharedDevice { spi, select, config: self::spi(divided(kernel_hz, most_hz)) }
    }
}

impl ErrorType for SharedDevice<'_> {
    type Error = spi::Error;
}

impl SpiDevice for SharedDevice<'_> {
    async fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), spi::Error> {
        // The bus is locked until the end of the transfer, since the SPI has this part's clock meanwhile.
        let mut spi = self.spi.lock().await;
        // These settings are always valid.
        let _ = spi.set_config(&self.config);
        operate(&mut spi, &mut self.select, operations).await
    }
}

/// Runs the operations with the select pin low.
async fn operate(
    spi: &mut Spi<'static, Async, Master>,
    select: &mut Output<'static>,
    operations: &mut [Operation<'_, u8>],
) -> Result<(), spi::Error> {
    select.set_low();
    let _selected = Selected(select);
    for operation in operations {
        match operation {
            Operation::Read(into) => spi.read(into).await?,
            Operation::Write(bytes) => spi.write(bytes).await?,
            Operation::Transfer(into, bytes) => spi.transfer(into, bytes).await?,
            Operation::TransferInPlace(bytes) => spi.transfer_in_place(bytes).await?,
            Operation::DelayNs(ns) => Timer::after(Duration::from_micros(u64::from(*ns).div_ceil(1000))).await,
        }
    }
    Ok(())
}

/// Reads a part like [`run`], but returns if its first reading fails.
pub async fn run_if_it_answers<P: SensorPart, B: Registers, T: PartTiming>(
    mut driver: Driver<P, B, T>,
    bits: u32,
    mut take: impl FnMut(Stamped<P::Reading>),
) {
    match driver.reading().await {
        Ok(reading) => {
            defmt::info!("{=str}: works", P::NAME);
            take(reading);
            run(driver, bits, take).await;
        }
        Err(fault) => defmt::warn!("{=str}: {}", P::NAME, defmt::Display2Format(&fault)),
    }
}

/// Reads a part forever, passes on each reading with its time, and logs when the part fails and when it works again. If
/// the part has a self-test, runs it on request between two readings. Reports the result for the sensor with these
/// `bits` (`MAV_SYS_STATUS_SENSOR`).
pub async fn run<P: SensorPart, B: Registers, T: PartTiming>(
    mut driver: Driver<P, B, T>,
    bits: u32,
    mut take: impl FnMut(Stamped<P::Reading>),
) {
    let mut last: Option<PartFault> = None;
    let mut asked = Asked::default();
    loop {
        if P::SELF_TEST.is_some() && asked.is_new() {
            let result = driver.self_test().await;
            if let Err(fault) = result {
                defmt::warn!("{=str}: {}", P::NAME, defmt::Display2Format(&fault));
            }
            self_tests::put(bits, result.is_ok());
        }
        match driver.reading().await {
            Ok(reading) => {
                if last.take().is_some() {
                    defmt::info!("{=str}: works", P::NAME);
                }
                take(reading);
            }
            Err(fault) => {
                // Log a fault only once: a failed part is tried again forever.
                if last != Some(fault) {
                    defmt::warn!("{=str}: {}", P::NAME, defmt::Display2Format(&fault));
                }
                last = Some(fault);
            }
        }
    }
}

/// Returns the SPI settings for a part with this clock.
pub fn spi(clock_hz: u32) -> spi::Config {
    let mut config = spi::Config::default();
    config.mode = MODE_3;
    config.frequency = Hertz(clock_hz);
    config
}

/// Returns the I2C settings: fast mode, and a timeout that ends a transfer whose part holds the line.
pub fn i2c() -> i2c::Config {
    let mut config = i2c::Config::default();
    config.frequency = Hertz(400_000);
    config.timeout = Duration::from_millis(5);
    config
}

/// Number of external interrupt lines; a line serves the pin of the same number on one port.
const LINES: usize = 16;
/// Time of the last interrupt of each line, lower 32 bits \[us\].
static STAMPS: [AtomicU32; LINES] = [const { AtomicU32::new(0) }; LINES];

/// Handler that records the time of an external interrupt; it must be bound before embassy's.
pub struct StampHandler<I>(PhantomData<I>);

impl<I: typelevel::Interrupt> typelevel::Handler<I> for StampHandler<I> {
    #[expect(unsafe_code, reason = "as the trait has it; nothing here is unsafe")]
    unsafe fn on_interrupt() {
        // Only the lower half of the time is stored, since this core cannot store 64 bits at once.
        let now_us = Instant::now().as_micros() as u32;
        // Masked lines may have pending edges, too.
        let lines = EXTI.pr(0).read().0 & EXTI.imr(0).read().0;
        for (line, stamp) in STAMPS.iter().enumerate() {
            if lines >> line & 1 != 0 {
                stamp.store(now_us, Ordering::Relaxed);
            }
        }
    }
}

/// A part's interrupt pin, for rising edges. Edges interrupt only while a task waits for one, so a noisy wire costs no
/// more than the waits.
pub struct InterruptPin {
    input: ExtiInput<'static, Async>,
    line: usize,
}

impl InterruptPin {
    /// Creates the interrupt pin with the external interrupt line of the same number.
    pub fn new<T: ExtiPin + Pin, I: typelevel::Interrupt>(
        pin: Peri<'static, T>,
        line: Peri<'static, T::ExtiChannel>,
        irqs: impl typelevel::Binding<I, exti::InterruptHandler<I>> + typelevel::Binding<I, StampHandler<I>>,
    ) -> Self
    where
        T::ExtiChannel: exti::Channel<IRQ = I>,
    {
        let number = usize::from(pin.pin());
        // The pin is pulled down, so that a broken wire reads low.
        InterruptPin { input: ExtiInput::new(pin, line, Pull::Down, irqs), line: number }
    }
}

impl DataReadyPin for InterruptPin {
    async fn next(&mut self) -> u64 {
        self.input.wait_for_rising_edge().await;
        let now_us = Instant::now().as_micros();
        let stamp = STAMPS.get(self.line).map_or(now_us as u32, |stamp| stamp.load(Ordering::Relaxed));
        // The difference of the lower halves is right even if they have wrapped in between.
        now_us.saturating_sub(u64::from((now_us as u32).wrapping_sub(stamp)))
    }
}

/// Timing of a part with an interrupt; while none comes, the part is read at every control period.
pub type Interrupted<E = InterruptPin> = DataReady<E, Polled>;

/// Makes the timing of a part with this interrupt pin.
pub fn interrupted<E: DataReadyPin>(pin: E) -> Interrupted<E> {
    DataReady::new(pin, Polled, PERIOD_US)
}

/// Timing of a part whose interrupt is not wired: it is read at the start of every control period.
pub struct Polled;

impl PartTiming for Polled {
    fn now_us(&self) -> u64 {
        Instant::now().as_micros()
    }

    async fn wait(&self, us: u32) {
        Timer::after(Duration::from_micros(us.into())).await;
    }

    async fn ready(&mut self, _us: u32) -> bool {
        Timer::at(firmware::time::next_period()).await;
        true
    }
}
