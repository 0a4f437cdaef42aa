//! A battery's voltage and current, measured at two ADC pins. A divider scales the voltage; the amplifier of a shunt or
//! a Hall sensor, on the board or in a power module, gives the current.
//!
//! | fault | detected by | result |
//! |---|---|---|
//! | nothing connected, the divider broken | voltage pin below 0.05 V | no reading |
//! | voltage pin shorted to supply, or battery voltage too high | last hundredth of the range | no reading |
//! | current pin shorted to supply, or current too high | last hundredth of the range | a reading without a current |
//! | ADC failed | no reading for 2 s, to be checked by the caller | no reading |
//!
//! Readings are low-pass filtered with the time constant [`FILTER_S`]. The filter restarts after each fault.

use crate::part::PartFault;

/// Time constant of the filter \[s\]: several periods of the motor controllers, but shorter than the battery's voltage
/// sag.
pub const FILTER_S: f32 = 0.2;
/// Lowest plausible voltage at the voltage pin \[V\].
const LEAST_V: f32 = 0.05;
/// Share of the ADC's range above which a pin counts as saturated.
const SHARE_MAX: f32 = 0.99;

/// Voltages at the ADC pins \[V\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BatteryPins {
    /// Voltage pin.
    pub voltage_v: f32,
    /// Current pin, if the current is measured.
    pub current_v: Option<f32>,
}

/// Scale factors from pin voltages to the battery.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BatteryScale {
    /// Battery volts per volt at the pin.
    pub volts_per_volt: f32,
    /// Battery amperes per volt at the pin; 0 A at 0 V.
    pub amperes_per_volt: f32,
}

impl BatteryScale {
    /// Returns this scale with the given factors that are above 0; the others stay.
    #[must_use]
    pub fn changed(self, [volts_per_volt, amperes_per_volt]: [f32; 2]) -> Self {
        let told = |told: f32, own| if told > 0.0 { told } else { own };
        BatteryScale {
            volts_per_volt: told(volts_per_volt, self.volts_per_volt),
            amperes_per_volt: told(amperes_per_volt, self.amperes_per_volt),
        }
    }

    /// Returns the battery's voltage \[V\] and current \[A\].
    #[must_use]
    pub fn read(&self, pins: &BatteryPins) -> (f32, Option<f32>) {
        (pins.voltage_v * self.volts_per_volt, pins.current_v.map(|volts| volts * self.amperes_per_volt))
    }
}

/// Converts ADC samples to readings.
#[derive(Clone, Copy, Debug)]
pub struct BatterySensor {
    /// Full-scale voltage of the ADC \[V\].
    range_v: f32,
    /// Newest reading and its time \[us\].
    last: Option<(u64, BatteryPins)>,
}

impl BatterySensor {
    /// Creates a sensor for an ADC with this full-scale voltage \[V\].
    #[must_use]
    pub const fn new(range_v: f32) -> Self {
        BatterySensor { range_v, last: None }
    }

    /// Takes samples of voltage and current, on an ADC whose largest number is `end`. Returns the filtered pin
    /// voltages.
    ///
    /// # Errors
    /// If the voltage cannot be a battery's.
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
