//! Reads the ADC.

use chip_stm32::battery::Convert;
use embassy_stm32::adc::SampleTime;
use embassy_stm32::peripherals::ADC1;

/// Full scale of 12 bits, and a read with the longest sampling time: a battery's divider has tens of kiloohms.
pub const SLOWLY: (u16, Convert<ADC1>) = (0xFFF, |adc, pin| adc.blocking_read(pin, SampleTime::CYCLES480));
