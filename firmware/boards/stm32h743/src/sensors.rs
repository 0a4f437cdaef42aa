//! The sensors of the Matek H743. Both IMUs face down, the first turned by 180 degrees, the second by 270. The readings
//! of IMUs and compass are rotated here to the body axes (x forward, y left, z up).

use afbc_drivers::alignment::{CW0_FLIP, CW90_FLIP, turned};
use afbc_drivers::dps310::Dps310;
use afbc_drivers::icm426xx::{Icm42605, Icm42688p};
use afbc_drivers::qmc5883l::Qmc5883l;
use afbc_drivers::{Driver, I2cRegisters, SpiRegisters};
use chip_stm32::battery::BatteryConverter;
use chip_stm32::i2c::Bus;
use chip_stm32::receiver;
use chip_stm32::sensors::{COMPASS, Device, Interrupted, Polled, run};
use embassy_futures::join::{join, join4};
use embassy_stm32::peripherals::ADC1;
use embassy_stm32::usart::BufferedUart;
use firmware::samples::Sampler;
use firmware::self_tests::{FIRST_IMU, SECOND_IMU, sensor};
use firmware::{aux_sensors, samples};

/// The inertial sensors.
pub(crate) struct Imus {
    pub(crate) first: Driver<Icm42688p<true>, SpiRegisters<Device>, Interrupted>,
    pub(crate) second: Driver<Icm42605<true>, SpiRegisters<Device>, Interrupted>,
}

impl Sampler for Imus {
    const IS_REDUNDANT: bool = true;

    async fn run(self) {
        join(
            run(self.first, FIRST_IMU, |reading| {
                samples::put_first_imu(reading.at_us, turned(&reading.value, &CW0_FLIP));
            }),
            run(self.second, SECOND_IMU, |reading| {
                samples::put_second_imu(reading.at_us, turned(&reading.value, &CW90_FLIP));
            }),
        )
        .await;
    }
}

/// The slow sensors and the GNSS receiver.
pub(crate) struct Aids {
    pub(crate) compass: Driver<Qmc5883l, I2cRegisters<Bus>, Polled>,
    pub(crate) barometer: Driver<Dps310, I2cRegisters<Bus>, Polled>,
    pub(crate) battery: BatteryConverter<ADC1>,
    pub(crate) receiver: BufferedUart<'static>,
}

impl Sampler for Aids {
    async fn run(self) {
        join4(
            run(self.compass, sensor::MAGNETOMETER, |reading| aux_sensors::put_field(&reading, &COMPASS)),
            run(self.barometer, sensor::BAROMETER, |reading| aux_sensors::put_pressure(&reading)),
            self.battery.run(),
            receiver::run(self.receiver, aux_sensors::put_fix),
        )
        .await;
    }
}
