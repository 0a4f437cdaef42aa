//! How the converter is read.

use chip_stm32::battery::Convert;
use embassy_stm32::adc::SampleTime;
use embassy_stm32::peripherals::ADC1;

/// Numbers of 12 bits; the longest sample, since the dividers of batteries are of tens of kiloohms.
pub const SLOWLY: (u16, Convert<ADC1>) = (0xFFF, |adc, pin| adc.blocking_read(pin, SampleTime::CYCLES480));
