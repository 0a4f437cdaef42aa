//! Reads `[initial]`, the initial state.

use crate::trajectory::Reference;
use afbc_files::read::{FileError, Table};
use afbc_plant::Motion;
use afbc_types::Range;
use nalgebra::Vector3;

/// Accepted coordinates of a position \[m\].
pub(super) const POSITION: Range = Range::new("position_m", -1e4, 1e4);
/// Accepted speed along each axis \[m/s\].
const VELOCITY: Range = Range::new("velocity_m_s", -100.0, 100.0);
/// Accepted roll and pitch \[rad\]: a vehicle at 90 degrees is lost (assumption A3).
const TILT: Range = Range::new("attitude_rad", -1.5, 1.5);
/// Accepted yaw \[rad\].
const YAW: Range = Range::new("attitude_rad", -100.0, 100.0);
/// Accepted rate about each axis \[rad/s\].
const RATES: Range = Range::new("rates_rad_s", -100.0, 100.0);

/// Reads the motion in `table`. Missing keys are as at the start of the reference, level and without rates.
pub(super) fn initial(table: Option<Table<'_>>, start: &Reference) -> Result<Motion, FileError> {
    let default = Motion {
        position_m: start.position_m,
        velocity_m_s: start.velocity_m_s,
        attitude_rad: Vector3::new(0.0, 0.0, start.yaw_rad),
        rates_rad_s: Vector3::zeros(),
    };
    let Some(mut table) = table else { return Ok(default) };
    let motion = Motion {
        position_m: table.vector(POSITION.name, [&POSITION; 3])?.unwrap_or(default.position_m),
        velocity_m_s: table.vector(VELOCITY.name, [&VELOCITY; 3])?.unwrap_or(default.velocity_m_s),
        attitude_rad: table.vector(TILT.name, [&TILT, &TILT, &YAW])?.unwrap_or(default.attitude_rad),
        rates_rad_s: table.vector(RATES.name, [&RATES; 3])?.unwrap_or(default.rates_rad_s),
    };
    table.finish()?;
    Ok(motion)
}
