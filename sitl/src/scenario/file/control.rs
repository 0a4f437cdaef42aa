//! `controllers`, `profile`, `[gains.AXIS]`, `[settings]`, `[limits]`, `monitor` and `[[contender]]`: who flies.

use super::{FileError, Table};
use crate::contender::{Contender, ControllerKind, Law, backstepping_part};
use crate::scenario::words::out_of_range;
use afbc::adaptive::{EPSILON, ETA, GAMMA, Gains};
use afbc::allocation::FORCE_MAX;
use afbc::backstepping::{self, ALPHA1, ALPHA2};
use afbc::cascade::DT;
use afbc::command_filter::BANDWIDTH;
use afbc::fuzzy::{CENTRE, Membership, WIDTH};
use afbc::limits::{ACCELERATION, CLIMB, SPEED, TILT, TILT_RATE};
use afbc::safeguards::{DEAD_ZONE, DELTA_MAX, KAPPA, SIGMA, THETA_MAX};
use afbc::{Limits, Profile, Safeguards, Settings};
use airframe::{Axis, PerAxis, Range};

/// Longest name of a contender: what a table has room for.
const NAME_LENGTH: usize = 32;

/// What a contender starts from.
#[derive(Clone, Copy)]
struct Defaults {
    profile: Profile,
    gains: PerAxis<Gains>,
    settings: Settings,
    /// Whether AFBC flies under its monitor.
    monitor: bool,
}

impl Defaults {
    fn law(&self, kind: ControllerKind) -> Law {
        match kind {
            ControllerKind::Afbc if self.monitor => Law::Guarded(self.gains),
            ControllerKind::Afbc => Law::Afbc(self.gains),
            ControllerKind::Backstepping => Law::Backstepping(backstepping_part(&self.gains)),
            _ => Law::of(kind, self.profile),
        }
    }
}

/// Everyone who flies, those of `controllers` first.
pub(super) fn contenders(root: &mut Table<'_>) -> Result<Vec<Contender>, FileError> {
    let controllers = root.choices("controllers", &ControllerKind::ALL, ControllerKind::name)?;
    let profile = root.choice("profile", &Profile::ALL, Profile::name)?.unwrap_or(Profile::Paper);
    let gains = per_axis(root.table("gains")?, profile.gains(), axis_gains)?;
    let settings = settings(root, profile.settings(), true)?;
    let monitor = root.boolean("monitor")?.unwrap_or(false);
    let defaults = Defaults { profile, gains, settings, monitor };

    let tables = root.few_tables("contender")?;
    let kinds = controllers.unwrap_or(if tables.is_empty() { ControllerKind::PAPER.to_vec() } else { Vec::new() });
    let short = |kind: ControllerKind| Contender { name: kind.name().into(), law: defaults.law(kind), settings };
    let mut contenders: Vec<_> = kinds.into_iter().map(short).collect();
    for table in tables {
        contenders.push(contender(table, defaults, &contenders)?);
    }
    Ok(contenders)
}

fn contender(mut table: Table<'_>, file: Defaults, others: &[Contender]) -> Result<Contender, FileError> {
    let name = table.need_text("name", "give it one, such as \"gentle\"")?.to_owned();
    if !(1..=NAME_LENGTH).contains(&name.chars().count()) || name.chars().any(char::is_control) {
        let problem = format!("it cannot be a name; make it one plain line of 1 to {NAME_LENGTH} characters");
        return Err(table.fault_at("name", problem));
    }
    if others.iter().any(|other| other.name == name) {
        return Err(table.fault_at("name", format!("\"{name}\" is the name of another contender; choose another")));
    }
    let kind = table.need_choice("controller", &ControllerKind::ALL, ControllerKind::name)?;
    let mut defaults = match table.choice("profile", &Profile::ALL, Profile::name)? {
        Some(profile) => Defaults {
            profile,
            gains: profile.gains(),
            settings: Settings { dt_s: file.settings.dt_s, ..profile.settings() },
            monitor: file.monitor,
        },
        None => file,
    };
    if kind == ControllerKind::Afbc {
        defaults.monitor = table.boolean("monitor")?.unwrap_or(defaults.monitor);
    }
    let law = law(table.table("gains")?, defaults.law(kind))?;
    let settings = settings(&mut table, defaults.settings, false)?;
    table.finish()?;
    Ok(Contender { name, law, settings })
}

/// The law with the gains in `table`; those that it leaves out are as in `default`.
fn law(table: Option<Table<'_>>, mut default: Law) -> Result<Law, FileError> {
    match default {
        Law::Afbc(gains) => per_axis(table, gains, axis_gains).map(Law::Afbc),
        Law::Guarded(gains) => per_axis(table, gains, axis_gains).map(Law::Guarded),
        Law::Backstepping(gains) => per_axis(table, gains, axis_backstepping).map(Law::Backstepping),
        _ => {
            let Some(mut table) = table else { return Ok(default) };
            default.each_gain(|range, gain| {
                *gain = number(&mut table, range, *gain)?;
                Ok(())
            })?;
            table.finish()?;
            Ok(default)
        }
    }
}

/// One table for each axis; what is left out is as in `default`.
fn per_axis<G: Copy>(
    table: Option<Table<'_>>,
    default: PerAxis<G>,
    read: fn(Table<'_>, &G) -> Result<G, FileError>,
) -> Result<PerAxis<G>, FileError> {
    let Some(mut table) = table else { return Ok(default) };
    let mut gains = default;
    for axis in Axis::ALL {
        if let Some(table) = table.table(axis.name())? {
            *gains.get_mut(axis) = read(table, default.get(axis))?;
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

fn axis_backstepping(mut table: Table<'_>, default: &backstepping::Gains) -> Result<backstepping::Gains, FileError> {
    let gains = alphas(&mut table, default)?;
    table.finish()?;
    Ok(gains)
}

fn axis_gains(mut table: Table<'_>, default: &Gains) -> Result<Gains, FileError> {
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
        heed_saturation: table.boolean("heed_saturation")?.unwrap_or(default.heed_saturation),
    })
}

/// `[settings]` and `[limits]` in `parent`; what they leave out is as in `default`. Only the file's own have a time step.
fn settings(parent: &mut Table<'_>, default: Settings, with_step: bool) -> Result<Settings, FileError> {
    let mut settings = default;
    if let Some(mut table) = parent.table("settings")? {
        if !with_step {
            table.forbid(DT.name, "one step serves all contenders; set it in the file's own [settings]")?;
        }
        settings = Settings {
            dt_s: if with_step { number(&mut table, &DT, default.dt_s)? } else { default.dt_s },
            command_filter_rad_s: number(&mut table, &BANDWIDTH, default.command_filter_rad_s)?,
            rotor_force_max_n: number(&mut table, &FORCE_MAX, default.rotor_force_max_n)?,
            tilt_by_thrust: table.boolean("tilt_by_thrust")?.unwrap_or(default.tilt_by_thrust),
            heed_ground: table.boolean("heed_ground")?.unwrap_or(default.heed_ground),
            bumpless: table.boolean("bumpless")?.unwrap_or(default.bumpless),
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
