//! Parameter ratios for the equations of motion, computed once per change.

use afbc_types::Parameters;
use nalgebra::Vector3;

/// Ratios of a vehicle's parameters, precomputed because divisions are slow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ratios {
    /// 1/m, and the diagonal of I^-1.
    pub(crate) per_mass: f64,
    pub(crate) per_inertia: Vector3<f64>,
    /// Coefficients a_1, a_3, a_5 of (6).
    pub(crate) coupling: Vector3<f64>,
}

impl Ratios {
    pub(crate) fn new(vehicle: &Parameters<f64>) -> Self {
        let i = &vehicle.inertia_kg_m2;
        Ratios {
            per_mass: 1.0 / vehicle.mass_kg,
            per_inertia: i.map(|i| 1.0 / i),
            coupling: Vector3::new((i.y - i.z) / i.x, (i.z - i.x) / i.y, (i.x - i.y) / i.z),
        }
    }
}
