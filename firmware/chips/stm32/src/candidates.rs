//! Tries alternative sensor parts: a board model is sold with different parts on the same pins. The parts are tried in
//! turn until one answers, which is then read forever.

use crate::sensors::{Device, InterruptPin, Polled, interrupted, run_if_it_answers};
use afbc_drivers::{Driver, I2cRegisters, InertialReading, PressureReading, SensorPart, SpiRegisters};
use afbc_types::Stamped;
use embassy_time::Timer;
use embedded_hal_async::i2c::I2c;
use firmware::self_tests::{FIRST_IMU, sensor};

/// Pause after all parts have been tried \[s\].
const PAUSE_S: u64 = 1;

/// A tuple of IMUs on SPI.
#[allow(async_fn_in_trait, reason = "used generically, never boxed")]
pub trait ImuCandidates {
    /// Reads the IMU that answers, at the edges of its interrupt. `kernel_hz` is the SPI's input clock.
    async fn run(
        device: &mut Device,
        interrupt: &mut InterruptPin,
        kernel_hz: u32,
        take: impl FnMut(Stamped<InertialReading>),
    );
}

/// A tuple of barometers on I2C, each with its possible addresses; the empty tuple if the board has none.
#[allow(async_fn_in_trait, reason = "used generically, never boxed")]
pub trait BarometerCandidates {
    /// Reads the barometer that answers.
    async fn run(bus: impl I2c + Clone, take: impl FnMut(Stamped<PressureReading>));
}

macro_rules! candidates {
    ($($part:ident),+) => {
        impl<$($part: SensorPart<Reading = InertialReading> + Default),+> ImuCandidates for ($($part,)+) {
            async fn run(
                device: &mut Device,
                interrupt: &mut InterruptPin,
                kernel_hz: u32,
                mut take: impl FnMut(Stamped<InertialReading>),
            ) {
                loop {
                    $(
                        if let Some(format) = $part::SPI {
                            device.set_clock(kernel_hz, format.clock_hz);
                            let registers = SpiRegisters::new(&mut *device, format);
                            let timing = interrupted(&mut *interrupt);
                            let driver = Driver::new($part::default(), registers, timing);
                            run_if_it_answers(driver, FIRST_IMU, &mut take).await;
                        }
                    )+
                    Timer::after_secs(PAUSE_S).await;
                }
            }
        }

        impl<$($part: SensorPart<Reading = PressureReading> + Default),+> BarometerCandidates for ($($part,)+) {
            async fn run(bus: impl I2c + Clone, mut take: impl FnMut(Stamped<PressureReading>)) {
                loop {
                    $(
                        for address in $part::I2C {
                            let registers = I2cRegisters::new(bus.clone(), *address);
                            let driver = Driver::new($part::default(), registers, Polled);
                            run_if_it_answers(driver, sensor::BAROMETER, &mut take).await;
                        }
                    )+
                    Timer::after_secs(PAUSE_S).await;
                }
            }
        }
    };
}

candidates!(A);
candidates!(A, B);
candidates!(A, B, C);
candidates!(A, B, C, D);
candidates!(A, B, C, D, E);
candidates!(A, B, C, D, E, F);

impl BarometerCandidates for () {
    async fn run(_bus: impl I2c + Clone, _take: impl FnMut(Stamped<PressureReading>)) {}
}
