//! What every reference has to keep to.

use afbc_reader::{FileError, Table};
use afbc_types::{Range, Setpoint};
use nalgebra::Vector3;

/// Accepted start of a path \[s\].
pub(super) const START: Range = Range::new("start_s", 0.0, 36_000.0);

/// Returns an error if the reference is too fast for a controller to accept; `peaks` are those of its derivatives from
/// the speed to the snap, in m and s.
pub(super) fn slow_enough(table: &Table<'_>, key: &str, peaks: [f64; 4]) -> Result<(), FileError> {
    let [velocity_m_s, acceleration_m_s2, jerk_m_s3, snap_m_s4] = peaks.map(|size| Vector3::new(size as f32, 0.0, 0.0));
    let fastest = Setpoint { velocity_m_s, acceleration_m_s2, jerk_m_s3, snap_m_s4, ..Setpoint::default() };
    if fastest.is_plausible() {
        return Ok(());
    }
    let [speed, acceleration, jerk, snap] = peaks;
    let peak = format!("it asks for {speed:.3e} m/s, {acceleration:.3e} m/s2, {jerk:.3e} m/s3 and {snap:.3e} m/s4");
    let accepted = "more than a controller accepts (1e3, 1e3, 1e5 and 1e7 of these)";
    Err(table.fault_at(key, format!("{peak}, {accepted}; allow more time")))
}
