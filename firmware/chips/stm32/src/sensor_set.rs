//! Sensors of a usual flight controller: an IMU alone on an SPI, barometer and external compass on one I2C, an external
//! GNSS receiver, and the battery.

use crate::battery::BatteryConverter;
use crate::candidates::{BarometerCandidates, ImuCandidates};
use crate::i2c::Bus;
use crate::receiver;
use crate::sensors::{COMPASS, Device, InterruptPin, Polled, run};
use afbc_drivers::alignment::turned;
use afbc_drivers::qmc5883l::Qmc5883l;
use afbc_drivers::{Driver, I2cRegisters};
use core::marker::PhantomData;
use embassy_embedded_hal::shared_bus::asynch::i2c::I2cDevice;
use embassy_futures::join::join4;
use embassy_stm32::peripherals::ADC1;
use embassy_stm32::usart::BufferedUart;
use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embassy_sync::mutex::Mutex;
use firmware::samples::{SampleTime, SampleValue, Sampler};
use firmware::self_tests::sensor;
use firmware::{aux_sensors, samples};
use nalgebra::Matrix3;

/// I2C address of a QMC5883L.
const COMPASS_ADDRESS: u8 = 0x0D;

/// The IMU, one of the candidates `P`.
pub struct Imu<P> {
    device: Device,
    interrupt: InterruptPin,
    kernel_hz: u32,
    to_body: Matrix3<f32>,
    parts: PhantomData<P>,
}

impl<P> Imu<P> {
    /// Creates the IMU. `kernel_hz` is the SPI's input clock; `to_body` rotates the IMU's axes to the body's.
    pub fn new(device: Device, interrupt: InterruptPin, kernel_hz: u32, to_body: Matrix3<f32>) -> Self {
        Imu { device, interrupt, kernel_hz, to_body, parts: PhantomData }
    }
}

impl<P: ImuCandidates> Sampler for Imu<P> {
    async fn run(mut self) {
        let Imu { device, interrupt, kernel_hz, to_body, .. } = &mut self;
        P::run(device, interrupt, *kernel_hz, |reading| {
            let value = SampleValue::Imu(turned(&reading.value, to_body));
            samples::put(SampleTime::At(reading.at_us), value);
        })
        .await;
    }
}

/// The slow sensors, with a barometer of the candidates `P`.
pub struct SlowSensors<P> {
    bus: Bus,
    receiver: BufferedUart<'static>,
    battery: BatteryConverter<ADC1>,
    parts: PhantomData<P>,
}

impl<P> SlowSensors<P> {
    /// Creates the sensors: barometer and compass on `bus`, the GNSS receiver and the battery.
    pub fn new(bus: Bus, receiver: BufferedUart<'static>, battery: BatteryConverter<ADC1>) -> Self {
        SlowSensors { bus, receiver, battery, parts: PhantomData }
    }
}

impl<P: BarometerCandidates> Sampler for SlowSensors<P> {
    async fn run(self) {
        // A lock without synchronisation suffices, since all users of the bus are in this task.
        let bus = Mutex::<NoopRawMutex, _>::new(self.bus);
        let compass = I2cRegisters::new(I2cDevice::new(&bus), COMPASS_ADDRESS);
        join4(
            P::run(I2cDevice::new(&bus), |reading| aux_sensors::put_pressure(&reading)),
            run(Driver::new(Qmc5883l, compass, Polled), sensor::MAGNETOMETER, |reading| {
                aux_sensors::put_field(&reading, &COMPASS)
            }),
            receiver::run(self.receiver, aux_sensors::put_fix),
            self.battery.run(),
        )
        .await;
    }
}
