//! Changes that a vehicle's file does not state: wind, payload, fault.

use super::bisection::largest;
use afbc_plant::noise::Noise;
use afbc_plant::{
    Drag, Environment, Payload, PlantParameter, PlantParameterChange, RotorFault, RotorLayout, Turbulence,
};
use afbc_scenario::Scenario;
use afbc_types::OutOfRange;
use afbc_vehicles::Vehicle;
use core::fmt;
use nalgebra::Vector3;

/// Time at which mass and rotors change \[s\].
const START_S: f64 = 3.0;
/// Largest speed of the wind along x and y \[m/s\].
const WIND_M_S: f64 = 4.0;
/// Largest additional delay of the state \[s\].
const AGE_S: f64 = 0.012;

/// A difference between the simulated vehicle and the vehicle that the controllers know.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ModelMismatch {
    /// No difference.
    Nothing,
    /// Steady wind \[m/s\].
    Wind(Vector3<f64>),
    /// Turbulence.
    Turbulence(Turbulence),
    /// A payload that is attached at 3 s.
    Payload {
        /// The payload's mass divided by the vehicle's.
        share: f64,
        /// Distance below the centre of mass \[m\].
        below_m: f64,
        /// Distance ahead of the centre of mass \[m\].
        ahead_m: f64,
        /// Distance to the left of the centre of mass \[m\].
        left_m: f64,
    },
    /// Factor on the mass from 3 s on.
    Mass(f64),
    /// A rotor that is weak from 3 s on.
    Rotor {
        /// Number of the rotor, from 1.
        rotor: u8,
        /// Remaining fraction of the rotor's thrust.
        efficiency: f64,
    },
    /// Factor on the drag.
    Drag(f64),
    /// Additional delay of the state \[s\].
    Older(f64),
}

impl ModelMismatch {
    /// Names of the kinds, in the order of the variants.
    pub const KINDS: [&str; 8] = ["nothing", "wind", "turbulence", "payload", "mass", "rotor", "drag", "age"];

    /// Returns the name of the change's kind.
    pub const fn kind(&self) -> &'static str {
        let [nothing, wind, turbulence, payload, mass, rotor, drag, age] = Self::KINDS;
        match self {
            ModelMismatch::Nothing => nothing,
            ModelMismatch::Wind(_) => wind,
            ModelMismatch::Turbulence(_) => turbulence,
            ModelMismatch::Payload { .. } => payload,
            ModelMismatch::Mass(_) => mass,
            ModelMismatch::Rotor { .. } => rotor,
            ModelMismatch::Drag(_) => drag,
            ModelMismatch::Older(_) => age,
        }
    }

    /// Draws a change.
    pub(super) fn draw(noise: &mut Noise, vehicle: &Vehicle) -> Self {
        let kind = whole(noise, Self::KINDS.len());
        // The number of random values drawn is the same for all kinds of change, so the kind does not affect later
        // draws.
        let [a, b, c, d] = [(); 4].map(|()| noise.uniform());
        let between = |low: f64, high: f64, at: f64| low + (high - low) * at;
        let arm_m = vehicle.parameters.arm_m;
        match kind {
            0 => ModelMismatch::Nothing,
            1 => {
                ModelMismatch::Wind(Vector3::new(between(-WIND_M_S, WIND_M_S, a), between(-WIND_M_S, WIND_M_S, b), 0.0))
            }
            2 => ModelMismatch::Turbulence(Turbulence::LIGHT),
            3 => ModelMismatch::Payload {
                share: between(0.05, 0.25, a),
                below_m: between(0.1, 0.4, d) * arm_m,
                ahead_m: between(-0.3, 0.3, b) * arm_m,
                left_m: between(-0.3, 0.3, c) * arm_m,
            },
            4 => ModelMismatch::Mass(between(0.85, 1.2, a)),
            5 => {
                let rotor = 1 + (b * vehicle.rotors.len() as f64) as u8;
                ModelMismatch::Rotor { rotor, efficiency: between(0.65, 0.95, a) }
            }
            6 => ModelMismatch::Drag(if a < 0.5 { 0.5 } else { doubled(vehicle) }),
            _ => ModelMismatch::Older(AGE_S * a),
        }
    }

    /// Returns the change reduced to this fraction; 0 means no change.
    pub(super) fn scaled(self, share: f64) -> Self {
        let factor = |factor: f64| 1.0 + share * (factor - 1.0);
        match self {
            ModelMismatch::Wind(wind_m_s) => ModelMismatch::Wind(wind_m_s * share),
            ModelMismatch::Turbulence(turbulence) => {
                ModelMismatch::Turbulence(Turbulence { wind_20ft_m_s: turbulence.wind_20ft_m_s * share, ..turbulence })
            }
            ModelMismatch::Payload { share: all, below_m, ahead_m, left_m } => {
                ModelMismatch::Payload { share: all * share, below_m, ahead_m, left_m }
            }
            ModelMismatch::Mass(mass) => ModelMismatch::Mass(factor(mass)),
            ModelMismatch::Rotor { rotor, efficiency } => {
                ModelMismatch::Rotor { rotor, efficiency: factor(efficiency) }
            }
            ModelMismatch::Drag(drag) => ModelMismatch::Drag(factor(drag)),
            // A delay costs no thrust, so reducing it would not leave more thrust.
            ModelMismatch::Nothing | ModelMismatch::Older(_) => self,
        }
    }

    /// Applies the change to a flight.
    ///
    /// # Errors
    /// The first parameter that the change puts out of range.
    pub(super) fn put(&self, scenario: &mut Scenario) -> Result<(), OutOfRange> {
        let vehicle = scenario.vehicle;
        let (start_s, end_s) = (START_S, f64::INFINITY);
        match *self {
            ModelMismatch::Nothing => {}
            ModelMismatch::Wind(wind_m_s) => scenario.realism.wind.steady_m_s = wind_m_s,
            ModelMismatch::Turbulence(turbulence) => scenario.realism.wind.turbulence = Some(turbulence),
            ModelMismatch::Payload { share, below_m, ahead_m, left_m } => {
                let mass_kg = share * vehicle.mass_kg;
                let payload = Payload { mass_kg, below_m, ahead_m, left_m, start_s, end_s };
                scenario.environment = Environment::calm(vehicle)?.with_payloads(vec![payload])?;
            }
            ModelMismatch::Mass(factor) => {
                let change = PlantParameterChange { quantity: PlantParameter::Mass, factor, start_s, end_s };
                scenario.environment = Environment::new(vehicle, vec![change], Vec::new())?;
            }
            ModelMismatch::Rotor { rotor, efficiency } => {
                scenario.realism.rotors.faults = vec![RotorFault { rotor, efficiency, start_s }];
            }
            // The vehicle's file, which tells the controllers the drag, stays as it is.
            ModelMismatch::Drag(factor) => {
                scenario.realism.drag = scenario.realism.drag.map(|drag| times(drag, factor))
            }
            ModelMismatch::Older(age_s) => {
                scenario.sensing.delay_s += age_s;
                scenario.instruments.tracker.iter_mut().for_each(|tracker| tracker.delay_s += age_s);
                scenario.instruments.gnss.iter_mut().for_each(|gnss| gnss.delay_s += age_s);
            }
        }
        Ok(())
    }
}

impl fmt::Display for ModelMismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ModelMismatch::Nothing => f.write_str("unchanged, as in its file"),
            ModelMismatch::Wind(wind_m_s) => write!(f, "in a wind of {:.1} m/s", wind_m_s.norm()),
            ModelMismatch::Turbulence(_) => f.write_str("in light turbulence"),
            ModelMismatch::Payload { share, .. } => write!(f, "with a payload of {:.0} %", 100.0 * share),
            ModelMismatch::Mass(factor) => write!(f, "mass {:+.0} %", 100.0 * (factor - 1.0)),
            ModelMismatch::Rotor { rotor, efficiency } => write!(f, "rotor {rotor} at {:.0} %", 100.0 * efficiency),
            ModelMismatch::Drag(factor) => write!(f, "drag times {factor:.2}"),
            ModelMismatch::Older(age_s) => write!(f, "with its state delayed by {:.0} ms", 1e3 * age_s),
        }
    }
}

/// Draws a whole number below `count`.
pub(super) fn whole(noise: &mut Noise, count: usize) -> usize {
    (noise.uniform() * count as f64) as usize
}

fn times(drag: Drag, factor: f64) -> Drag {
    Drag { blade_n_s2_m: drag.blade_n_s2_m * factor, area_m2: drag.area_m2 * factor, ..drag }
}

/// Returns 2, or the largest smaller factor on this vehicle's drag that the plant accepts.
fn doubled(vehicle: &Vehicle) -> f64 {
    let (Some(drag), Ok(frame)) = (vehicle.realism.drag, RotorLayout::new(&vehicle.rotors)) else { return 1.0 };
    let max_rad_s = vehicle.realism.rotors.max_rad_s;
    let fits = |more: f64| times(drag, 1.0 + more).validate_for(&vehicle.parameters, &frame, max_rad_s, 0.001).is_ok();
    1.0 + largest(1.0, fits)
}
