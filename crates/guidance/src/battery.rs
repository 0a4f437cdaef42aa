//! Charge of the battery, from its voltage without load: the voltage that it would have without the current through its
//! resistance.

use afbc_control::math::{max, min};

/// Time constant of the charge \[s\].
const SMOOTH_S: f32 = 2.0;
/// Largest voltage of a cell, as in Betaflight, and smallest of one that counts as one, by which the number of cells is
/// found \[V\].
const CELL_V: core::ops::Range<f32> = 3.0..4.3;

/// A battery's measurements.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct BatteryReading {
    /// Voltage \[V\].
    pub voltage_v: f32,
    /// Current; 0 if it is not measured \[A\].
    pub current_a: f32,
    /// Charge, 0 to 1, if the battery's monitor knows it.
    pub charge: Option<f32>,
}

impl BatteryReading {
    /// Returns the number of cells that a battery at rest has by its voltage; 0 of what is no battery.
    pub(crate) fn cells(&self) -> u8 {
        // Saturates: no number of cells is larger than 24.
        let cells = (self.voltage_v / CELL_V.end) as u8;
        let cells = if cells < 24 { cells + 1 } else { 0 };
        if self.voltage_v >= CELL_V.start * f32::from(cells) { cells } else { 0 }
    }
}

/// What is known of a battery's cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cells {
    pub(crate) number: u32,
    pub(crate) empty_v: f32,
    pub(crate) full_v: f32,
    pub(crate) resistance_ohm: f32,
}

impl Cells {
    /// Returns the charge, 0 to 1, by a plausible reading: of so many cells; as it is told if their number is 0.
    fn charge(&self, reading: &BatteryReading) -> Option<f32> {
        let BatteryReading { voltage_v, current_a, charge } = *reading;
        if self.number == 0 {
            return charge.filter(|charge| (0.0..=1.0).contains(charge));
        }
        let plausible = voltage_v > 0.0 && voltage_v < 1e3 && current_a.abs() < 1e4;
        let cell_v = voltage_v / self.number as f32 + current_a * self.resistance_ohm;
        plausible.then(|| max(min((cell_v - self.empty_v) / (self.full_v - self.empty_v), 1.0), 0.0))
    }

    /// Updates a filtered charge; `None` stays so until the first plausible reading.
    pub(crate) fn update(&self, charge: &mut Option<f32>, reading: Option<&BatteryReading>, dt_s: f32) {
        let Some(now) = reading.and_then(|reading| self.charge(reading)) else { return };
        let before = charge.unwrap_or(now);
        *charge = Some(before + (now - before) * (dt_s / SMOOTH_S));
    }
}
