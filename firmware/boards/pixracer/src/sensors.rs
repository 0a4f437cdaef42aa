//! The sensors of a Pixracer. The IMUs and the internal compass face down; their x axes point forward.

use afbc_drivers::alignment::{CW180_FLIP, turned};
use afbc_drivers::lis3mdl::Lis3mdl;
use afbc_drivers::mpu::{Icm20608, Mpu9250};
use afbc_drivers::ms5611::Ms5611;
use afbc_drivers::qmc5883l::Qmc5883l;
use afbc_drivers::{Driver, I2cRegisters, PartTiming, SensorPart, SpiRegisters};
use chip_stm32::battery::BatteryConverter;
use chip_stm32::i2c::Bus;
use chip_stm32::receiver;
use chip_stm32::sensors::{COMPASS, Device, InterruptPin, Polled, SharedDevice, SharedSpi, interrupted, run};
use core::sync::atomic::{AtomicBool, Ordering};
use embassy_futures::join::{join3, join4};
use embassy_stm32::gpio::Output;
use embassy_stm32::mode::Async;
use embassy_stm32::peripherals::ADC1;
use embassy_stm32::spi::{self, Spi};
use embassy_stm32::usart::BufferedUart;
use firmware::samples::Sampler;
use firmware::self_tests::{FIRST_IMU, SECOND_IMU, sensor};
use firmware::{aux_sensors, samples};

/// True once an external compass has been read. The internal compass, near the power currents, is not used then.
static IS_COMPASS_OUTSIDE: AtomicBool = AtomicBool::new(false);

/// The inertial sensors and the internal compass, on one SPI bus.
pub(crate) struct Inside {
    pub(crate) spi: Spi<'static, Async, spi::mode::Master>,
    pub(crate) kernel_hz: u32,
    /// Chip selects of ICM-20608-G, MPU-9250 and LIS3MDL.
    pub(crate) selects: [Output<'static>; 3],
    /// Interrupt pins of the IMUs.
    pub(crate) ready: [InterruptPin; 2],
}

impl Sampler for Inside {
    const IS_REDUNDANT: bool = true;

    async fn run(self) {
        let spi = SharedSpi::new(self.spi);
        let [first, second, compass] = self.selects;
        let [first_ready, second_ready] = self.ready.map(interrupted);
        // Without interrupt edges, the first IMU is read first in every control period.
        join3(
            run(driver(Icm20608 {}, &spi, first, self.kernel_hz, first_ready), FIRST_IMU, |reading| {
                samples::put_first_imu(reading.at_us, turned(&reading.value, &CW180_FLIP));
            }),
            run(driver(Mpu9250 {}, &spi, second, self.kernel_hz, second_ready), SECOND_IMU, |reading| {
                samples::put_second_imu(reading.at_us, turned(&reading.value, &CW180_FLIP));
            }),
            run(driver(Lis3mdl {}, &spi, compass, self.kernel_hz, Polled), sensor::MAGNETOMETER, |reading| {
                if !IS_COMPASS_OUTSIDE.load(Ordering::Relaxed) {
                    aux_sensors::put_field(&reading, &CW180_FLIP);
                }
            }),
        )
        .await;
    }
}

/// Returns the driver of a part on the shared SPI bus, whose kernel clock is `kernel_hz`.
fn driver<'a, P: SensorPart, T: PartTiming>(
    part: P,
    spi: &'a SharedSpi,
    select: Output<'static>,
    kernel_hz: u32,
    timing: T,
) -> Driver<P, SpiRegisters<SharedDevice<'a>>, T> {
    let format = P::SPI.expect("a part on SPI");
    Driver::new(part, SpiRegisters::new(SharedDevice::new(spi, select, kernel_hz, format.clock_hz), format), timing)
}

/// The slow sensors, and the external compass and GNSS receiver.
pub(crate) struct Aids {
    pub(crate) barometer: Driver<Ms5611, SpiRegisters<Device>, Polled>,
    pub(crate) compass: Driver<Qmc5883l, I2cRegisters<Bus>, Polled>,
    pub(crate) receiver: BufferedUart<'static>,
    pub(crate) battery: BatteryConverter<ADC1>,
}

impl Sampler for Aids {
    async fn run(self) {
        join4(
            run(self.barometer, sensor::BAROMETER, |reading| aux_sensors::put_pressure(&reading)),
            run(self.compass, sensor::MAGNETOMETER, |reading| {
                IS_COMPASS_OUTSIDE.store(true, Ordering::Relaxed);
                aux_sensors::put_field(&reading, &COMPASS);
            }),
            receiver::run(self.receiver, aux_sensors::put_fix),
            self.battery.run(),
        )
        .await;
    }
}
