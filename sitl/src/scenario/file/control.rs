//! `[gains.AXIS]` and `[settings]`, over those of the profile.

use super::{FileError, Table};
use crate::scenario::words::out_of_range;
use afbc::Settings;
use afbc::adaptive::{EPSILON, ETA, GAMMA, Gains};
use afbc::allocation::FORCE_MAX;
use afbc::backstepping::{self, ALPHA1, ALPHA2};
use afbc::cascade::DT;
use afbc::command_filter::BANDWIDTH;
use afbc::fuzzy::{CENTRE, Membership, WIDTH};
use airframe::{Axis, PerAxis, Range};

/// The gains in `table`; those that it leaves out are as in `default`.
pub(super) fn gains(table: Option<Table<'_>>, default: PerAxis<Gains>) -> Result<PerAxis<Gains>, FileError> {
    let Some(mut table) = table else { return Ok(default) };
    let mut gains = default;
    for axis in Axis::ALL {
        if let Some(table) = table.table(axis.name())? {
            *gains.get_mut(axis) = axis_gains(table, default.get(axis))?;
        }
    }
    table.finish()?;
    Ok(gains)
}

fn axis_gains(mut table: Table<'_>, default: &Gains) -> Result<Gains, FileError> {
    let mut number = |range: &Range, default: f32| number(&mut table, range, default);
    let gains = Gains {
        backstepping: backstepping::Gains {
            alpha1: number(&ALPHA1, default.backstepping.alpha1)?,
            alpha2: number(&ALPHA2, default.backstepping.alpha2)?,
        },
        gamma: number(&GAMMA, default.gamma)?,
        eta: number(&ETA, default.eta)?,
        epsilon: number(&EPSILON, default.epsilon)?,
        membership: Membership {
            centre: number(&CENTRE, default.membership.centre)?,
            width: number(&WIDTH, default.membership.width)?,
        },
        safeguards: default.safeguards,
    };
    // Each gain is in its range; what is left to refuse is how two of them go together.
    gains
        .validate()
        .map_err(|error| table.fault_at(CENTRE.name, format!("{}; change one of the two", out_of_range(&error))))?;
    table.finish()?;
    Ok(gains)
}

/// The settings in `table`; those that it leaves out are as in `default`.
pub(super) fn settings(table: Option<Table<'_>>, default: Settings) -> Result<Settings, FileError> {
    let Some(mut table) = table else { return Ok(default) };
    let settings = Settings {
        dt_s: number(&mut table, &DT, default.dt_s)?,
        command_filter_rad_s: number(&mut table, &BANDWIDTH, default.command_filter_rad_s)?,
        rotor_force_max_n: number(&mut table, &FORCE_MAX, default.rotor_force_max_n)?,
        ..default
    };
    table.finish()?;
    Ok(settings)
}

fn number(table: &mut Table<'_>, range: &Range, default: f32) -> Result<f32, FileError> {
    Ok(table.number(range)?.map_or(default, |number| number as f32))
}
