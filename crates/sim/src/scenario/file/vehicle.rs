//! `[vehicle]`, what the controller believes, and `[truth]`, what flies.

use crate::reader::{FileError, Table};
use afbc_types::{Parameters, limits};

/// The parameters in `table`; those that it leaves out are as in `default`.
pub(super) fn read(table: Option<Table<'_>>, default: Parameters<f64>) -> Result<Parameters<f64>, FileError> {
    let Some(mut table) = table else { return Ok(default) };
    let inertia_kg_m2 = table.vector(limits::INERTIA.name, [&limits::INERTIA; 3])?;
    let vehicle = Parameters {
        mass_kg: table.number(&limits::MASS)?.unwrap_or(default.mass_kg),
        arm_m: table.number(&limits::ARM)?.unwrap_or(default.arm_m),
        inertia_kg_m2: inertia_kg_m2.unwrap_or(default.inertia_kg_m2),
        rotor_inertia_kg_m2: table.number(&limits::ROTOR_INERTIA)?.unwrap_or(default.rotor_inertia_kg_m2),
        thrust_factor_n_s2: table.number(&limits::THRUST_FACTOR)?.unwrap_or(default.thrust_factor_n_s2),
        drag_factor_n_m_s2: table.number(&limits::DRAG_FACTOR)?.unwrap_or(default.drag_factor_n_m_s2),
        gravity_m_s2: table.number(&limits::GRAVITY)?.unwrap_or(default.gravity_m_s2),
    };
    table.finish()?;
    Ok(vehicle)
}
