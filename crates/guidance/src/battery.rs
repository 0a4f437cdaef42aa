//! Charge of the battery from its open-circuit voltage: the measured voltage plus the drop over the internal
//! resistance.

use afbc_control::math::{max, min};

/// Time constant of the charge's low-pass filter \[s\].
const SMOOTH_S: f32 = 2.0;
/// Range of a cell's voltage by which the cells are counted \[V\]: the largest as in Betaflight, and the smallest that
/// is accepted.
const CELL_V: core::ops::Range<f32> = 3.0..4.3;

/// A battery's measurements.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct BatteryReading {
    /// Voltage \[V\].
    pub voltage_v: f32,
    /// Current; 0 if not measured \[A\].
    pub current_a: f32,
    /// State of charge, 0 to 1, if the battery monitor reports one.
    pub charge: Option<f32>,
}

impl BatteryReading {
    /// Returns the number of cells of an unloaded battery, found from its voltage; 0 if the voltage fits no battery.
    pub(crate) fn cells(&self) -> u8 {
        // The conversion saturates. No battery has more than 24 cells.
        let cells = (self.voltage_v / CELL_V.end) as u8;
        let cells = if cells < 24 { cells + 1 } else { 0 };
        if self.voltage_v >= CELL_V.start * f32::from(cells) { cells } else { 0 }
    }
}

/// Properties of the battery's cells. A `number` of 0 means: use the monitor's charge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BatteryCells {
    pub(crate) number: u32,
    pub(crate) empty_v: f32,
    pub(crate) full_v: f32,
    pub(crate) resistance_ohm: f32,
}

impl BatteryCells {
    /// Returns the charge, 0 to 1, if the reading is plausible. Uses the monitor's charge if the number of cells is 0.
    fn charge(&self, reading: &BatteryReading) -> Option<f32> {
        let BatteryReading { voltage_v, current_a, charge } = *reading;
        if self.number == 0 {
            return charge.filter(|charge| (0.0..=1.0).contains(charge));
        }
        let plausible = voltage_v > 0.0 && voltage_v < 1e3 && current_a.abs() < 1e4;
        let cell_v = voltage_v / self.number as f32 + current_a * self.resistance_ohm;
        plausible.then(|| max(min((cell_v - self.empty_v) / (self.full_v - self.empty_v), 1.0), 0.0))
    }

    /// Updates the filtered charge, which is `None` until the first plausible reading.
    pub(crate) fn update(&self, charge: &mut Option<f32>, reading: Option<&BatteryReading>, dt_s: f32) {
        let Some(now) = reading.and_then(|reading| self.charge(reading)) else { return };
        let before = charge.unwrap_or(now);
        *charge = Some(before + (now - before) * (dt_s / SMOOTH_S));
    }
}
