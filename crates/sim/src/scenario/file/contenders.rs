//! `controllers`, `profile`, `monitor` and `[[contender]]`: the contenders.

use super::control::{per_axis, settings, whole};
use crate::contender::{Contender, ControllerKind, Law};
use crate::reader::{FileError, Table};
use afbc::{Profile, Settings, adaptive};
use afbc_types::{Parameters, PerAxis};

/// Longest name of a contender that fits the tables.
const NAME_LENGTH: usize = 32;

/// Defaults of a contender.
#[derive(Clone, Copy)]
struct Defaults {
    gains: PerAxis<adaptive::Gains>,
    settings: Settings,
    /// Whether AFBC flies under its monitor.
    monitor: bool,
}

impl Defaults {
    fn contender(&self, kind: ControllerKind) -> Contender {
        let law = Law::beside(kind, &self.gains);
        let contender = Contender { name: kind.name().into(), law, settings: self.settings, monitored: false };
        if self.monitor { contender.monitored() } else { contender }
    }
}

/// Reads all contenders, those of `controllers` first.
pub(super) fn read(root: &mut Table<'_>, vehicle: &Parameters) -> Result<Vec<Contender>, FileError> {
    let controllers = root.choices("controllers", &ControllerKind::ALL, ControllerKind::name)?;
    let profile = root.choice("profile", &Profile::ALL, Profile::name)?.unwrap_or(Profile::Paper);
    let mut axes = profile.gains_for(vehicle);
    per_axis(root.table("gains")?, &mut axes)?;
    let settings = settings(root, profile.settings(), true)?;
    let monitor = root.boolean("monitor")?.unwrap_or(false);
    let defaults = Defaults { gains: axes, settings, monitor };

    let tables = root.few_tables("contender")?;
    let kinds = controllers.unwrap_or(if tables.is_empty() { ControllerKind::PAPER.to_vec() } else { Vec::new() });
    let mut contenders: Vec<_> = kinds.into_iter().map(|kind| defaults.contender(kind)).collect();
    for table in tables {
        contenders.push(contender(table, vehicle, defaults, &contenders)?);
    }
    Ok(contenders)
}

fn contender(
    mut table: Table<'_>,
    vehicle: &Parameters,
    file: Defaults,
    others: &[Contender],
) -> Result<Contender, FileError> {
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
            gains: profile.gains_for(vehicle),
            settings: profile.settings().with_dt_s(file.settings.common.dt_s),
            monitor: file.monitor,
        },
        None => file,
    };
    if kind == ControllerKind::Afbc {
        defaults.monitor = table.boolean("monitor")?.unwrap_or(defaults.monitor);
    }
    let mut contender = Contender { name, ..defaults.contender(kind) };
    let gains = table.table("gains")?;
    if kind.in_cascade() {
        per_axis(gains, &mut contender.law)?
    } else {
        whole(gains, &mut contender.law)?
    }
    contender.settings = settings(&mut table, defaults.settings, false)?;
    table.finish()?;
    Ok(contender)
}
