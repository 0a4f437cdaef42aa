//! `[gains.AXIS]`, `[settings]` and `[limits]`, of a file or of a contender.

use crate::reader::words::out_of_range;
use crate::reader::{FileError, Table};
use afbc::adaptive::{EPSILON, ETA, GAMMA, Gains};
use afbc::backstepping::{self, ALPHA1, ALPHA2};
use afbc::fuzzy::{CENTRE, Membership, WIDTH};
use afbc::limits::{ACCELERATION, CLIMB, SPEED, TILT, TILT_RATE};
use afbc::safeguards::{DEAD_ZONE, DELTA_MAX, KAPPA, SIGMA, THETA_MAX};
use afbc::{Limits, Safeguards, Settings};
use afbc_control::command_filter::BANDWIDTH;
use afbc_control::mixer::FORCE_MAX;
use afbc_control::settings::DT;
use afbc_types::{Axis, PerAxis, Range};

/// One table for each axis; what is left out is as in `default`.
pub(super) fn per_axis<G: Copy>(
    table: Option<Table<'_>>,
    default: PerAxis<G>,
    read: fn(Table<'_>, &G) -> Result<G, FileError>,
) -> Result<PerAxis<G>, FileError> {
    let Some(mut table) = table else { return Ok(default) };
    let mut gains = default;
    for axis in Axis::ALL {
        if let Some(table) = table.table(axis.name())? {
            gains[axis] = read(table, &default[axis])?;
        }
    }
    table.finish()?;
    Ok(gains)
}

fn alphas(table: &mut Table<'_>, default: &backstepping::Gains) -> Result<backstepping::Gains, FileError> {
    Ok(backstepping::Gains {
        alpha1: number(table, &ALPHA1, default.alpha1)?,
        alpha2: number(table, &ALPHA2, default.alpha2)?,
    })
}

pub(super) fn axis_backstepping(
    mut table: Table<'_>,
    default: &backstepping::Gains,
) -> Result<backstepping::Gains, FileError> {
    let gains = alphas(&mut table, default)?;
    table.finish()?;
    Ok(gains)
}

pub(super) fn axis_gains(mut table: Table<'_>, default: &Gains) -> Result<Gains, FileError> {
    let gains = Gains {
        backstepping: alphas(&mut table, &default.backstepping)?,
        gamma: number(&mut table, &GAMMA, default.gamma)?,
        eta: number(&mut table, &ETA, default.eta)?,
        epsilon: number(&mut table, &EPSILON, default.epsilon)?,
        membership: Membership {
            centre: number(&mut table, &CENTRE, default.membership.centre)?,
            width: number(&mut table, &WIDTH, default.membership.width)?,
        },
        safeguards: safeguards(&mut table, &default.safeguards)?,
    };
    // Each gain is in its range; what is left to refuse is how two of them go together.
    gains
        .validate()
        .map_err(|error| table.fault_at(CENTRE.name, format!("{}; change one of the two", out_of_range(&error))))?;
    table.finish()?;
    Ok(gains)
}

fn safeguards(table: &mut Table<'_>, default: &Safeguards) -> Result<Safeguards, FileError> {
    Ok(Safeguards {
        sigma: number(table, &SIGMA, default.sigma)?,
        kappa: number(table, &KAPPA, default.kappa)?,
        theta_max: number(table, &THETA_MAX, default.theta_max)?,
        delta_max: number(table, &DELTA_MAX, default.delta_max)?,
        dead_zone: number(table, &DEAD_ZONE, default.dead_zone)?,
    })
}

/// `[settings]` and `[limits]` in `parent`; what they leave out is as in `default`. Only the file's own have a time step.
pub(super) fn settings(parent: &mut Table<'_>, default: Settings, with_step: bool) -> Result<Settings, FileError> {
    let mut settings = default;
    if let Some(mut table) = parent.table("settings")? {
        if !with_step {
            table.forbid(DT.name, "one step serves all contenders; set it in the file's own [settings]")?;
        }
        settings = Settings {
            common: afbc_control::Settings {
                dt_s: if with_step { number(&mut table, &DT, default.common.dt_s)? } else { default.common.dt_s },
                rotor_force_max_n: number(&mut table, &FORCE_MAX, default.common.rotor_force_max_n)?,
            },
            command_filter_rad_s: number(&mut table, &BANDWIDTH, default.command_filter_rad_s)?,
            tilt_by_thrust: table.boolean("tilt_by_thrust")?.unwrap_or(default.tilt_by_thrust),
            freeze_on_ground: table.boolean("freeze_on_ground")?.unwrap_or(default.freeze_on_ground),
            bumpless: table.boolean("bumpless")?.unwrap_or(default.bumpless),
            anti_windup: table.boolean("anti_windup")?.unwrap_or(default.anti_windup),
            limits: default.limits,
        };
        table.finish()?;
    }
    if let Some(table) = parent.table("limits")? {
        settings.limits = limits(table, &default.limits)?;
    }
    Ok(settings)
}

fn limits(mut table: Table<'_>, default: &Limits) -> Result<Limits, FileError> {
    let limits = Limits {
        tilt_max_rad: number(&mut table, &TILT, default.tilt_max_rad)?,
        tilt_rate_max_rad_s: number(&mut table, &TILT_RATE, default.tilt_rate_max_rad_s)?,
        acceleration_max_m_s2: number(&mut table, &ACCELERATION, default.acceleration_max_m_s2)?,
        speed_max_m_s: number(&mut table, &SPEED, default.speed_max_m_s)?,
        climb_max_m_s: number(&mut table, &CLIMB, default.climb_max_m_s)?,
    };
    table.finish()?;
    Ok(limits)
}

fn number(table: &mut Table<'_>, range: &Range, default: f32) -> Result<f32, FileError> {
    Ok(table.number(range)?.map_or(default, |number| number as f32))
}
