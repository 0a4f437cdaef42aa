//! A battery's voltage and current, at two pins of a converter: a divider, and the amplifier of a shunt or a Hall
//! sensor, on the board or in a power module.
//!
//! | fault | found by | then |
//! |---|---|---|
//! | nothing connected, the divider broken | less than 0.05 V at the pin of the voltage | no reading |
//! | shorted to the supply, a battery beyond the divider | the last hundredth of the range | no reading |
//! | the same of the current's pin, at its upper end | the last hundredth of the range | a reading without a current |
//! | no converter | no reading for 2 s, which who reads it sees | no reading |
//!
//! Readings are filtered with a time constant of [`FILTER_S`], anew after each fault.

use crate::part::PartFault;

/// Time constant of the filter \[s\]: several periods of the motor controllers, and less than a battery sags in.
pub const FILTER_S: f32 = 0.2;
/// Least voltage at the pin of the voltage \[V\].
const LEAST_V: f32 = 0.05;
/// Shares of the converter's range beyond which it is at its end.
const SHARE_MAX: f32 = 0.99;

/// Voltages at the pins \[V\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BatteryPins {
    /// That of the battery's voltage.
    pub voltage_v: f32,
    /// That of its current, if it is measured.
    pub current_v: Option<f32>,
}

/// What a volt at the pins stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BatteryScale {
    /// Volts of the battery.
    pub volts_per_volt: f32,
    /// Amperes, from 0 at 0 V.
    pub amperes_per_volt: f32,
}

impl BatteryScale {
    /// Returns this scale with those of the numbers `told` that are above 0.
    #[must_use]
    pub fn changed(self, [volts_per_volt, amperes_per_volt]: [f32; 2]) -> Self {
        let told = |told: f32, own| if told > 0.0 { told } else { own };
        BatteryScale {
            volts_per_volt: told(volts_per_volt, self.volts_per_volt),
            amperes_per_volt: told(amperes_per_volt, self.amperes_per_volt),
        }
    }

    /// Returns voltage \[V\] and current \[A\] of the battery.
    #[must_use]
    pub fn read(&self, pins: &BatteryPins) -> (f32, Option<f32>) {
        (pins.voltage_v * self.volts_per_volt, pins.current_v.map(|volts| volts * self.amperes_per_volt))
    }
}

/// Makes readings of a converter's numbers.
#[derive(Clone, Copy, Debug)]
pub struct BatterySensor {
    /// Voltage at the end of the converter's range \[V\].
    range_v: f32,
    /// Newest reading, with its time \[us\].
    last: Option<(u64, BatteryPins)>,
}

impl BatterySensor {
    /// One on a converter of this range \[V\].
    #[must_use]
    pub const fn new(range_v: f32) -> Self {
        BatterySensor { range_v, last: None }
    }

    /// Takes the numbers of voltage and current, of which `end` is the converter's largest, and returns the filtered
    /// voltages at the pins.
    ///
    /// # Errors
    /// The voltage is none of a battery.
    pub fn take(&mut self, at_us: u64, numbers: [u16; 2], end: u16) -> Result<BatteryPins, PartFault> {
        let [voltage, current] = numbers.map(|number| f32::from(number) / f32::from(end.max(1)));
        let (least, most) = (LEAST_V / self.range_v, SHARE_MAX);
        if !(voltage >= least && voltage <= most) {
            self.last = None;
            return Err(PartFault::Range);
        }
        let new = BatteryPins {
            voltage_v: voltage * self.range_v,
            current_v: (current <= most).then_some(current * self.range_v),
        };
        let reading = self.last.map_or(new, |(last_us, last)| {
            let passed_s = at_us.saturating_sub(last_us) as f32 * 1e-6;
            let towards = |from: f32, to: f32| from + (to - from) * (passed_s / (passed_s + FILTER_S));
            BatteryPins {
                voltage_v: towards(last.voltage_v, new.voltage_v),
                current_v: new.current_v.map(|current| towards(last.current_v.unwrap_or(current), current)),
            }
        });
        self.last = Some((at_us, reading));
        Ok(reading)
    }
}
