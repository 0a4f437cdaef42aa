//! Tables shared by vehicle files and scenario files: `[vehicle]`, `[rotors]`, `[battery]`, `[drag]`, `[ground]` and
//! instruments. Each function takes missing keys from a default.

use afbc_files::read::words::out_of_range;
use afbc_files::read::{FileError, Table};
use afbc_plant::instruments::Preset;
use afbc_plant::{BatteryModel, Contact, Drag, GroundEffect, RotorLayout, Rotors};
use afbc_types::{Declared, OutOfRange, Parameters, Range};

/// Accepted largest force of a rotor \[N\]; the corresponding speed must also be in range.
pub const FORCE_MAX: Range = Range::new("force_max_n", 0.001, 10_000.0);

/// Quantities against which drag is checked.
#[derive(Clone, Copy, Debug)]
pub struct DragConditions<'a> {
    /// True parameters.
    pub parameters: &'a Parameters<f64>,
    /// Positions of the rotors.
    pub frame: &'a RotorLayout,
    /// Largest speed of a rotor \[rad/s\].
    pub rotor_max_rad_s: f64,
    /// Step of the simulation \[s\].
    pub step_s: f64,
}

/// Tables and keys that rotors, drag and ground depend on.
const ALL: &[&str] =
    &["vehicle", "truth", "rotors", "rotor", "drag", "ground", "settings", "profile", "controllers", "contender"];

/// Reports a failed check of how the table's values fit together and fit the values under the dotted keys `with`.
fn together(
    table: &Table<'_>,
    with: &'static [&'static str],
    checked: Result<(), OutOfRange>,
) -> Result<(), FileError> {
    // Unknown keys come first, since one may be a misspelling of a key in the check.
    table.finish()?;
    checked.or_else(|error| table.clash(error.range.name, with, format!("{}; change it", out_of_range(&error))))
}

/// Reads `table` into `parameters`; checks each value and all of them together.
///
/// # Errors
/// One line about the first mistake.
pub fn declared(table: Option<Table<'_>>, parameters: &mut impl Declared) -> Result<(), FileError> {
    let Some(mut table) = table else { return Ok(()) };
    table.declared(parameters)?;
    together(&table, &[], parameters.validate())
}

/// Reads masses, arm, inertia and rotor factors.
///
/// # Errors
/// One line about the first mistake.
pub fn parameters(table: Option<Table<'_>>, default: Parameters<f64>) -> Result<Parameters<f64>, FileError> {
    let mut parameters = default;
    if let Some(mut table) = table {
        table.declared(&mut parameters)?;
        table.finish()?;
    }
    Ok(parameters)
}

/// Reads lag, delay and limits of the rotors of a vehicle with the true parameters `truth`.
///
/// # Errors
/// The same as for [`parameters`].
pub fn rotors(table: Option<Table<'_>>, default: Rotors, truth: &Parameters<f64>) -> Result<Rotors, FileError> {
    let mut rotors = default;
    if let Some(mut table) = table {
        table.declared(&mut rotors)?;
        max_by_force(&mut table, &mut rotors, truth)?;
        together(&table, ALL, rotors.validate())?;
    }
    Ok(rotors)
}

/// Sets the largest speed from `force_max_n`, if the table gives the largest force instead of the speed.
fn max_by_force(table: &mut Table<'_>, rotors: &mut Rotors, truth: &Parameters<f64>) -> Result<(), FileError> {
    let max = &Rotors::MAX.range;
    let Some(force_n) = table.number(&FORCE_MAX)? else { return Ok(()) };
    if table.has(max.name) {
        let problem = format!("the rotors have two limits; write force_max_n or {}, not both", max.name);
        return table.clash(FORCE_MAX.name, &[], problem);
    }
    let max_rad_s = libm::sqrt(force_n / truth.thrust_factor_n_s2);
    match max.check(max_rad_s) {
        Ok(()) => rotors.max_rad_s = max_rad_s,
        Err(error) => {
            table.clash(FORCE_MAX.name, ALL, format!("the force causes {}; change the force", out_of_range(&error)))?;
        }
    }
    Ok(())
}

/// Reads `[battery]`; missing keys are as in `default`.
///
/// # Errors
/// The same as for [`parameters`].
pub fn battery(mut table: Table<'_>, default: BatteryModel) -> Result<BatteryModel, FileError> {
    let mut battery = default;
    table.declared(&mut battery)?;
    together(&table, &[], battery.validate())?;
    Ok(battery)
}

/// Reads `[drag]`. The key called `elsewhere` is refused; "" refuses none.
///
/// # Errors
/// The same as for [`parameters`].
pub fn drag(
    mut table: Table<'_>,
    default: Drag,
    elsewhere: &str,
    conditions: &DragConditions<'_>,
) -> Result<Drag, FileError> {
    let DragConditions { parameters, frame, rotor_max_rad_s, step_s } = *conditions;
    let mut drag = default;
    table.declared_but(elsewhere, &mut drag)?;
    together(&table, ALL, drag.validate_for(parameters, frame, rotor_max_rad_s, step_s))?;
    Ok(drag)
}

/// Reads `[ground]`: feet and ground effect. The key called `elsewhere` is refused; "" refuses none.
///
/// # Errors
/// The same as for [`parameters`].
pub fn ground(
    mut table: Table<'_>,
    (mut contact, mut effect): (Contact, GroundEffect),
    elsewhere: &str,
    truth: &Parameters<f64>,
    step_s: f64,
) -> Result<(Contact, Option<GroundEffect>), FileError> {
    table.declared_but(elsewhere, &mut contact)?;
    table.declared_but(GroundEffect::ROT_HEIGHT.range.name, &mut effect)?;
    // The height is given only once, so that feet and propellers cannot disagree about it.
    effect.rotor_height_m = contact.rotor_height_m;
    let with_effect = table.boolean("ground_effect")?.unwrap_or(true);
    together(&table, ALL, contact.validate_for(truth, step_s))?;
    Ok((contact, with_effect.then_some(effect)))
}

/// Tables within the table of an inertial sensor.
pub const TRIADS: [&str; 2] = ["gyro", "accel"];

/// Reads an instrument under `key`: either the name of a part, or a table with one subtable per group. The table may
/// name a part, too. Missing keys are as in that part, else as in `base`, else those of a perfect instrument.
///
/// # Errors
/// The same as for [`parameters`].
pub fn instrument<T: Declared + Default + Copy>(
    table: &mut Table<'_>,
    key: &'static str,
    base: Option<T>,
    presets: &[Preset<T>],
    groups: &[&'static str],
) -> Result<Option<T>, FileError> {
    if !table.holds_table(key) {
        return Ok(table.choice(key, presets, |preset| preset.name)?.map(|preset| preset.settings));
    }
    let Some(mut table) = table.table(key)? else { return Ok(None) };
    let mut settings = preset(&mut table, presets)?.or(base).unwrap_or_default();
    table.declared(&mut settings)?;
    self::groups(&mut table, &mut settings, groups)?;
    table.finish()?;
    Ok(Some(settings))
}

/// Returns the part that the table names, if any.
///
/// # Errors
/// The same as for [`parameters`].
pub fn preset<T: Copy>(table: &mut Table<'_>, presets: &[Preset<T>]) -> Result<Option<T>, FileError> {
    Ok(table.choice("part", presets, |preset| preset.name)?.map(|preset| preset.settings))
}

/// Reads the subtables of a part, one per group.
///
/// # Errors
/// The same as for [`parameters`].
pub fn groups<T: Declared>(table: &mut Table<'_>, part: &mut T, groups: &[&'static str]) -> Result<(), FileError> {
    groups.iter().try_for_each(|group| {
        let Some(mut table) = table.table(group)? else { return Ok(()) };
        table.declared_in(group, part)?;
        table.finish()
    })
}
