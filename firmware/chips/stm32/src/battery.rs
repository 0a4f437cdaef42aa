//! Reads a battery's voltage and current at two ADC pins.

use afbc_drivers::battery::{BatteryScale, BatterySensor};
use embassy_stm32::adc::{Adc, AdcChannel, AnyAdcChannel, Instance};
use embassy_time::{Duration, Instant, Ticker};
use firmware::aux_sensors;

/// Time between two readings \[ms\].
const PERIOD_MS: u64 = 50;
/// Reference voltage of the ADC \[V\].
const RANGE_V: f32 = 3.3;

/// Function that reads a pin once and waits for the result.
pub type Convert<T> = fn(&mut Adc<'static, T>, &mut AnyAdcChannel<'static, T>) -> u16;

/// An ADC and its two battery pins.
pub struct BatteryConverter<T: Instance> {
    adc: Adc<'static, T>,
    pins: [AnyAdcChannel<'static, T>; 2],
    end: u16,
    convert: Convert<T>,
    scale: BatteryScale,
}

impl<T: Instance> BatteryConverter<T> {
    /// Creates the reader of these pins. `convert` returns numbers up to `end`; `scale` describes the board's voltage
    /// divider and current amplifier.
    pub fn new(
        adc: Adc<'static, T>,
        voltage: impl AdcChannel<T> + 'static,
        current: impl AdcChannel<T> + 'static,
        (end, convert): (u16, Convert<T>),
        scale: BatteryScale,
    ) -> Self {
        BatteryConverter { adc, pins: [voltage.degrade_adc(), current.degrade_adc()], end, convert, scale }
    }

    /// Reads the voltage and current forever and passes them on, or none if they cannot be a battery's.
    pub async fn run(mut self) {
        let mut sensor = BatterySensor::new(RANGE_V);
        let mut ticker = Ticker::every(Duration::from_millis(PERIOD_MS));
        loop {
            ticker.next().await;
            let numbers = self.pins.each_mut().map(|pin| (self.convert)(&mut self.adc, pin));
            let now_us = Instant::now().as_micros();
            aux_sensors::put_battery(now_us, sensor.take(now_us, numbers, self.end).ok(), self.scale);
        }
    }
}
