//! Reads the contenders: `controllers`, `profile`, `monitor` and `[[contender]]`.

use super::control::settings;
use crate::contender::{Contender, ControllerKind, Law};
use crate::laws::{law_gains, per_axis, whole};
use afbc::{LAG_S, Profile, Settings, adaptive};
use afbc_files::read::{FileError, Table};
use afbc_types::{Parameters, PerAxis};
use afbc_vehicles::Vehicle;

/// Longest name of a contender that fits the tables.
const NAME_LENGTH: usize = 32;

/// Vehicle that the contenders fly: from a vehicle file, or the paper's with these nominal parameters.
#[derive(Clone, Copy)]
pub(super) enum FlownVehicle<'a> {
    File(&'a Vehicle),
    Paper(&'a Parameters<f64>),
}

impl FlownVehicle<'_> {
    /// Returns AFBC's gains for the vehicle.
    fn gains(self, profile: Profile) -> PerAxis<adaptive::Gains> {
        match self {
            FlownVehicle::File(vehicle) => vehicle.gains(profile),
            FlownVehicle::Paper(parameters) => profile.gains_for(&parameters.to_f32(), LAG_S),
        }
    }

    fn settings(self, profile: Profile) -> Settings {
        match self {
            FlownVehicle::File(vehicle) => vehicle.settings(profile),
            FlownVehicle::Paper(_) => profile.settings(),
        }
    }

    /// Returns the law of this kind; `afbc` are AFBC's gains.
    fn law(self, kind: ControllerKind, profile: Profile, afbc: &PerAxis<adaptive::Gains>) -> Result<Law, FileError> {
        let law = Law::beside(kind, afbc);
        match self {
            FlownVehicle::File(vehicle) if !kind.in_cascade() => Law::on(kind, vehicle, profile),
            FlownVehicle::File(vehicle) if kind != ControllerKind::Afbc && profile == Profile::Flight => {
                law_gains(vehicle, law)
            }
            _ => Ok(law),
        }
    }
}

/// Defaults for a contender.
#[derive(Clone, Copy)]
struct Defaults<'a> {
    flown: FlownVehicle<'a>,
    profile: Profile,
    gains: PerAxis<adaptive::Gains>,
    settings: Settings,
    /// True if AFBC flies under its monitor.
    monitor: bool,
}

impl Defaults<'_> {
    fn contender(&self, kind: ControllerKind) -> Result<Contender, FileError> {
        let law = self.flown.law(kind, self.profile, &self.gains)?;
        let contender = Contender { name: kind.name().into(), law, settings: self.settings, monitored: false };
        Ok(if self.monitor { contender.monitored() } else { contender })
    }
}

/// Reads all contenders, those of `controllers` first.
pub(super) fn read(root: &mut Table<'_>, flown: FlownVehicle<'_>) -> Result<Vec<Contender>, FileError> {
    let controllers = root.choices("controllers", &ControllerKind::all(), ControllerKind::name)?;
    let profile = root.choice("profile", &Profile::ALL, Profile::name)?.unwrap_or(Profile::Flight);
    let mut axes = flown.gains(profile);
    per_axis(root.table("gains")?, &mut axes)?;
    let settings = settings(root, flown.settings(profile), true)?;
    let monitor = root.boolean("monitor")?.unwrap_or(false);
    let defaults = Defaults { flown, profile, gains: axes, settings, monitor };

    let tables = root.few_tables("contender")?;
    // A file that lists its own contenders has no others unless `controllers` names them.
    let kinds = controllers.unwrap_or(if tables.is_empty() { ControllerKind::PAPER.to_vec() } else { Vec::new() });
    // An error may be in the gains of the vehicle's file.
    let of_vehicle = |error| root.through("vehicle", error);
    let contenders = kinds.into_iter().map(|kind| defaults.contender(kind)).collect::<Result<Vec<_>, _>>();
    let mut contenders = contenders.map_err(of_vehicle)?;
    for table in tables {
        contenders.push(contender(table, defaults, &contenders).map_err(of_vehicle)?);
    }
    Ok(contenders)
}

fn contender(mut table: Table<'_>, file: Defaults<'_>, others: &[Contender]) -> Result<Contender, FileError> {
    let name = table.need_text("name", "give the contender a name, such as \"gentle\"")?.to_owned();
    let is_known = table.knows("name");
    if !(1..=NAME_LENGTH).contains(&name.chars().count()) || name.chars().any(char::is_control) {
        let problem = format!("this cannot be a name; write one plain line of 1 to {NAME_LENGTH} characters");
        return Err(table.fault_at("name", problem));
    }
    if is_known && others.iter().any(|other| other.name == name) {
        return Err(table.fault_at("name", format!("\"{name}\" is the name of another contender; choose another")));
    }
    let kind = table.need_choice("controller", &ControllerKind::all(), ControllerKind::name)?;
    let mut defaults = match table.choice("profile", &Profile::ALL, Profile::name)? {
        Some(profile) => Defaults {
            profile,
            gains: file.flown.gains(profile),
            // All contenders use the file's time step, whatever the profile's is.
            settings: file.flown.settings(profile).with_dt_s(file.settings.common.dt_s),
            ..file
        },
        None => file,
    };
    if kind == ControllerKind::Afbc {
        defaults.monitor = table.boolean("monitor")?.unwrap_or(defaults.monitor);
    }
    let mut contender = Contender { name, ..defaults.contender(kind)? };
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
