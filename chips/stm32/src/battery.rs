//! A battery's voltage and current at two pins of a converter.

use afbc_drivers::battery::{BatteryPins, BatterySensor};
use embassy_stm32::adc::{Adc, AdcChannel, AnyAdcChannel, Instance};
use embassy_time::{Duration, Instant, Ticker};

/// Time between two readings \[ms\].
const PERIOD_MS: u64 = 50;
/// Reference of the converter \[V\].
const RANGE_V: f32 = 3.3;

/// A converter and its two pins.
pub struct BatteryConverter<T: Instance> {
    adc: Adc<'static, T>,
    pins: [AnyAdcChannel<'static, T>; 2],
}

impl<T: Instance> BatteryConverter<T> {
    /// One that reads voltage and current at these pins.
    pub fn new(
        adc: Adc<'static, T>,
        voltage: impl AdcChannel<T> + 'static,
        current: impl AdcChannel<T> + 'static,
    ) -> Self {
        BatteryConverter { adc, pins: [voltage.degrade_adc(), current.degrade_adc()] }
    }
}

/// Reads for ever, by `convert`, which returns numbers up to `end`, and passes each reading on with its time \[us\];
/// none if it is none of a battery.
pub async fn run<T: Instance>(
    mut converter: BatteryConverter<T>,
    end: u16,
    mut convert: impl FnMut(&mut Adc<'static, T>, &mut AnyAdcChannel<'static, T>) -> u16,
    mut take: impl FnMut(u64, Option<BatteryPins>),
) {
    let mut sensor = BatterySensor::new(RANGE_V);
    let mut ticker = Ticker::every(Duration::from_millis(PERIOD_MS));
    loop {
        ticker.next().await;
        let numbers = converter.pins.each_mut().map(|pin| convert(&mut converter.adc, pin));
        let now_us = Instant::now().as_micros();
        take(now_us, sensor.take(now_us, numbers, end).ok());
    }
}
