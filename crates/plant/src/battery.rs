//! A battery whose voltage sags under load and falls with its charge.

use afbc_types::{Choice, OutOfRange, Range, parameters};
use libm::sqrt;

parameters! {
    /// The Rint model, an open-circuit voltage behind a resistance (He, Xiong, Fan 2011, *Evaluation of lithium-ion
    /// battery equivalent circuit models for state of charge estimation by an experimental approach*, Energies 4), with
    /// an open-circuit voltage that falls linearly with the charge drawn.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct BatteryModel {
        /// Open-circuit voltage when full, at which the rotors reach their largest speed.
        #[parameter(FULL, "V", 1.0..=1000.0)]
        pub full_v: f64 = 12.6,
        /// Open-circuit voltage when empty, at most that when full.
        #[parameter(EMPTY, "V", 0.1..=1000.0)]
        pub empty_v: f64 = 9.9,
        /// Internal resistance.
        #[parameter(RESISTANCE, "ohm", 0.0..=10.0)]
        pub resistance_ohm: f64 = 0.06,
        /// Charge when full.
        #[parameter(CAPACITY, "A h", 0.001..=1000.0)]
        pub capacity_a_h: f64 = 1.5,
        /// Charge at the start, as a share of the capacity.
        #[parameter(CHARGE, "1", 0.0..=1.0)]
        pub initial_charge: f64 = 1.0,
        /// Efficiency of speed controller and motor together: mechanical power of the rotors divided by electrical
        /// power.
        #[parameter(EFFICIENCY, "1", 0.05..=1.0)]
        pub efficiency: f64 = 0.5,
        /// Power that avionics and payload draw.
        #[parameter(AVIONICS, "W", 0.0..=10_000.0)]
        pub avionics_w: f64 = 3.0,
        /// Effect of a low voltage: reduces only the largest rotor speed, or every rotor speed.
        #[choice(EFFECT)]
        pub effect: Sag = Sag::Ceiling,
    }
    together(battery) {
        Range { max: battery.full_v, ..BatteryModel::EMPTY.range }.check(battery.empty_v)
    }
}

/// Effect of a low voltage on the rotors, in proportion to the voltage divided by the full voltage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum Sag {
    /// Reduces the largest speed: the speed controllers hold the commanded speed as long as they can.
    Ceiling,
    /// Reduces every speed: the speed controllers apply a share of the voltage, without speed feedback.
    Speed,
}

impl Choice for Sag {
    const ALL: &'static [Self] = &[Sag::Ceiling, Sag::Speed];
    const WORDS: &'static [&'static str] = &["ceiling", "speed"];
}

impl BatteryModel {
    /// Three lithium-polymer cells of 1.5 A h, which carry the paper's vehicle for about a quarter of an hour.
    pub const THREE_CELLS: Self = Self::DEFAULT;
}

/// State of a battery.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BatteryState {
    /// Terminal voltage under load \[V\].
    pub voltage_v: f64,
    /// Current \[A\].
    pub current_a: f64,
    /// Remaining charge, as a share of the capacity.
    pub charge: f64,
}

/// Battery in simulation.
#[derive(Clone, Debug)]
pub(crate) struct SimulatedBattery {
    battery: BatteryModel,
    /// Share of the capacity drawn by one ampere in one step \[1/A\].
    per_ampere: f64,
    pub(crate) now: BatteryState,
}

impl SimulatedBattery {
    pub(crate) fn new(battery: BatteryModel, step_s: f64) -> Self {
        let now = BatteryState { voltage_v: 0.0, current_a: 0.0, charge: battery.initial_charge };
        let mut discharge = SimulatedBattery { battery, per_ampere: step_s / (3600.0 * battery.capacity_a_h), now };
        discharge.now.voltage_v = discharge.open_circuit_v();
        discharge
    }

    /// Returns the open-circuit voltage \[V\], 0 for an empty battery, so that nothing flies without charge.
    fn open_circuit_v(&self) -> f64 {
        let BatteryModel { full_v, empty_v, .. } = self.battery;
        if self.now.charge > 0.0 { empty_v + (full_v - empty_v) * self.now.charge } else { 0.0 }
    }

    /// Sets the remaining charge as a share of the capacity. The voltage follows with the next load.
    ///
    /// # Errors
    /// Returns an error if the share is out of range.
    pub(crate) fn charge(&mut self, share: f64) -> Result<(), OutOfRange> {
        BatteryModel::CHARGE.range.check(share)?;
        self.now.charge = share;
        Ok(())
    }

    /// Returns the voltage divided by the full voltage, which scales the rotor speeds.
    #[inline]
    pub(crate) fn voltage_share(&self) -> f64 {
        self.now.voltage_v / self.battery.full_v
    }

    pub(crate) fn effect(&self) -> Sag {
        self.battery.effect
    }

    /// Supplies rotors that draw `rotor_w` of mechanical power for one step.
    ///
    /// Power P at the terminals draws the smaller current with (V_oc - R I) I = P. Above V_oc^2 / 4R there is no
    /// solution, and the battery gives its largest power.
    #[inline]
    pub(crate) fn supply(&mut self, rotor_w: f64) {
        let BatteryModel { resistance_ohm: r, efficiency, avionics_w, .. } = self.battery;
        let power_w = rotor_w / efficiency + avionics_w;
        let v = self.open_circuit_v();
        // With the root in the divisor there is no division by R, which may be 0, and no loss of digits where R I is
        // small.
        let current_a = if v > 0.0 { 2.0 * power_w / (v + sqrt((v * v - 4.0 * r * power_w).max(0.0))) } else { 0.0 };
        // At the limit the formula above overshoots; V_oc / 2R is the current of a matched load.
        let current_a = if r > 0.0 { current_a.min(v / (2.0 * r)) } else { current_a };
        self.now.voltage_v = v - r * current_a;
        self.now.current_a = current_a;
        self.now.charge = (self.now.charge - current_a * self.per_ampere).max(0.0);
    }
}
