//! Limits that every reference must keep.

use crate::definition::DURATION;
use crate::trajectory::{Reference, Trajectory};
use afbc_files::read::{FileError, Table};
use afbc_types::Range;

/// Accepted start of a path \[s\].
pub(super) const START: Range = Range::new("start_s", 0.0, 36_000.0);

/// Refuses the key if a controller would refuse a sample of the reference, or if the reference lasts longer than the
/// longest flight.
pub(super) fn flyable(table: &Table<'_>, key: &str, trajectory: &Trajectory) -> Result<(), FileError> {
    // Unknown keys are refused first, since one may be a misspelt key that changes the path.
    table.finish()?;
    let mut refused: Option<Reference> = None;
    trajectory.sample(&mut |at| {
        if !at.setpoint().is_plausible() {
            refused.get_or_insert(at);
        }
    });
    if let Some(at) = refused {
        return table.clash(key, &[], format!("it asks for {}", excess(&at)));
    }
    let end_s = trajectory.end_s().unwrap_or_default();
    if DURATION.max < end_s {
        let longest = format!("no flight lasts longer than {} s", DURATION.max);
        return table.clash(
            key,
            &[],
            format!("the trajectory ends at {end_s:.3e} s, and {longest}; make it shorter or faster"),
        );
    }
    Ok(())
}

/// Returns a message on the part of the reference that a controller refuses, with the cure: its motion, or its place
/// and heading.
fn excess(at: &Reference) -> String {
    let Reference { velocity_m_s, acceleration_m_s2, jerk_m_s3, snap_m_s4, .. } = *at;
    let Reference { yaw_rad, yaw_rate_rad_s, yaw_acceleration_rad_s2, .. } = *at;
    let motion = Reference { velocity_m_s, acceleration_m_s2, jerk_m_s3, snap_m_s4, ..Reference::default() };
    if motion.setpoint().is_plausible() {
        let heading = format!("{yaw_rad:.3e} rad, {yaw_rate_rad_s:.3e} rad/s and {yaw_acceleration_rad_s2:.3e} rad/s2");
        let place = format!("{:.3e} m from the origin and a heading of {heading}", at.position_m.norm());
        return format!(
            "{place}, more than a controller accepts (1e5 m, 1e3 rad, 1e3 rad/s, 1e3 rad/s2); stay nearer, or turn less"
        );
    }
    let [speed, acceleration, jerk, snap] =
        [velocity_m_s, acceleration_m_s2, jerk_m_s3, snap_m_s4].map(|part| part.norm());
    let motion = format!("{speed:.3e} m/s, {acceleration:.3e} m/s2, {jerk:.3e} m/s3 and {snap:.3e} m/s4");
    format!("{motion}, more than a controller accepts (1e3 m/s, 1e3 m/s2, 1e5 m/s3, 1e7 m/s4); allow more time")
}
