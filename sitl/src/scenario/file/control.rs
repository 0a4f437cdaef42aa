//! `controllers`, `[gains.AXIS]`, `[settings]` and `[[contender]]`: who flies.

use super::{FileError, Table};
use crate::contender::{Contender, ControllerKind, Law, backstepping_part};
use crate::scenario::words::out_of_range;
use afbc::adaptive::{EPSILON, ETA, GAMMA, Gains};
use afbc::allocation::FORCE_MAX;
use afbc::backstepping::{self, ALPHA1, ALPHA2};
use afbc::cascade::DT;
use afbc::command_filter::BANDWIDTH;
use afbc::fuzzy::{CENTRE, Membership, WIDTH};
use afbc::{Profile, Settings};
use airframe::{Axis, PerAxis, Range};

/// Most contenders in one file.
const CONTENDERS: usize = 100;
/// Longest name of a contender: what a table has room for.
const NAME_LENGTH: usize = 32;

/// What a contender starts from.
#[derive(Clone, Copy)]
struct Defaults {
    profile: Profile,
    gains: PerAxis<Gains>,
    settings: Settings,
}

impl Defaults {
    fn law(&self, kind: ControllerKind) -> Law {
        match kind {
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
    let settings = match root.table("settings")? {
        Some(mut table) => {
            let dt_s = number(&mut table, &DT, profile.settings().dt_s)?;
            settings(table, Settings { dt_s, ..profile.settings() })?
        }
        None => profile.settings(),
    };
    let defaults = Defaults { profile, gains, settings };

    let tables = root.tables("contender")?;
    if tables.len() > CONTENDERS {
        return Err(root.fault_at("contender", format!("{} contenders; keep {CONTENDERS} at most", tables.len())));
    }
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
    let defaults = match table.choice("profile", &Profile::ALL, Profile::name)? {
        Some(profile) => Defaults {
            profile,
            gains: profile.gains(),
            settings: Settings { dt_s: file.settings.dt_s, ..profile.settings() },
        },
        None => file,
    };
    let law = law(table.table("gains")?, defaults.law(kind))?;
    let settings = match table.table("settings")? {
        Some(table) => {
            table.forbid(DT.name, "one step serves all contenders; set it in the file's own [settings]")?;
            settings(table, defaults.settings)?
        }
        None => defaults.settings,
    };
    table.finish()?;
    Ok(Contender { name, law, settings })
}

/// The law with the gains in `table`; those that it leaves out are as in `default`.
fn law(table: Option<Table<'_>>, mut default: Law) -> Result<Law, FileError> {
    match default {
        Law::Afbc(gains) => per_axis(table, gains, axis_gains).map(Law::Afbc),
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
    let backstepping = alphas(&mut table, &default.backstepping)?;
    let mut number = |range: &Range, default: f32| number(&mut table, range, default);
    let gains = Gains {
        backstepping,
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

/// The settings in `table`, all but the time step; those that it leaves out are as in `default`.
fn settings(mut table: Table<'_>, default: Settings) -> Result<Settings, FileError> {
    let settings = Settings {
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
