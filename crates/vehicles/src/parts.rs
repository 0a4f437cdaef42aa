//! The tables that vehicle files and scenario files share: `[vehicle]`, `[rotors]`, `[battery]`, `[drag]`, `[ground]`,
//! instruments.
//! Each function takes what a table leaves out from a default.

use afbc_files::read::words::out_of_range;
use afbc_files::read::{FileError, Table};
use afbc_plant::instruments::Preset;
use afbc_plant::{Battery, Contact, Drag, Frame, GroundEffect, Rotors};
use afbc_types::{Declared, OutOfRange, Parameters, Range};

/// Accepted largest force of a rotor \[N\]; the speed that goes with it must be in range too.
pub const FORCE_MAX: Range = Range::new("force_max_n", 0.001, 10_000.0);

/// What drag depends on: the vehicle, its fastest rotor, and the step of the simulation.
#[derive(Clone, Copy, Debug)]
pub struct DragConditions<'a> {
    /// True parameters.
    pub parameters: &'a Parameters<f64>,
    /// Where the rotors are.
    pub frame: &'a Frame,
    /// Largest speed of a rotor \[rad/s\].
    pub rotor_max_rad_s: f64,
    /// Step of the simulation \[s\].
    pub step_s: f64,
}

/// What rotors, drag and ground depend on.
const ALL: &[&str] =
    &["vehicle", "truth", "rotors", "rotor", "drag", "ground", "settings", "profile", "controllers", "contender"];

/// Refuses `table` on account of how its numbers go together, and with those under the dotted keys `with`.
fn together(
    table: &Table<'_>,
    with: &'static [&'static str],
    checked: Result<(), OutOfRange>,
) -> Result<(), FileError> {
    // First, for an unknown key may be a misspelt one of these.
    table.finish()?;
    checked.or_else(|error| table.clash(error.range.name, with, format!("{}; change it", out_of_range(&error))))
}

/// What `table` says of `parameters`, each in its range and all together.
///
/// # Errors
/// One line on the first thing that is wrong, here and below.
pub fn declared(table: Option<Table<'_>>, parameters: &mut impl Declared) -> Result<(), FileError> {
    let Some(mut table) = table else { return Ok(()) };
    table.declared(parameters)?;
    together(&table, &[], parameters.validate())
}

/// Masses, arm, inertia and rotor factors.
///
/// # Errors
/// One line on the first thing that is wrong, here and below.
pub fn parameters(table: Option<Table<'_>>, default: Parameters<f64>) -> Result<Parameters<f64>, FileError> {
    let mut parameters = default;
    if let Some(mut table) = table {
        table.declared(&mut parameters)?;
        table.finish()?;
    }
    Ok(parameters)
}

/// Lag, delay and limits of the rotors of a vehicle with these true parameters.
///
/// # Errors
/// As [`parameters`].
pub fn rotors(table: Option<Table<'_>>, default: Rotors, truth: &Parameters<f64>) -> Result<Rotors, FileError> {
    let mut rotors = default;
    if let Some(mut table) = table {
        table.declared(&mut rotors)?;
        max_by_force(&mut table, &mut rotors, truth)?;
        together(&table, ALL, rotors.validate())?;
    }
    Ok(rotors)
}

/// The largest speed, if it is given by the force that goes with it.
fn max_by_force(table: &mut Table<'_>, rotors: &mut Rotors, truth: &Parameters<f64>) -> Result<(), FileError> {
    let max = &Rotors::MAX.range;
    let Some(force_n) = table.number(&FORCE_MAX)? else { return Ok(()) };
    if table.has(max.name) {
        let problem = format!("a second limit; write it or {}, not both", max.name);
        return table.clash(FORCE_MAX.name, &[], problem);
    }
    let max_rad_s = libm::sqrt(force_n / truth.thrust_factor_n_s2);
    match max.check(max_rad_s) {
        Ok(()) => rotors.max_rad_s = max_rad_s,
        Err(error) => {
            table.clash(FORCE_MAX.name, ALL, format!("it makes {}; change the force", out_of_range(&error)))?;
        }
    }
    Ok(())
}

/// Reads `[battery]`; what it does not say is as in `default`.
///
/// # Errors
/// As [`parameters`].
pub fn battery(mut table: Table<'_>, default: Battery) -> Result<Battery, FileError> {
    let mut battery = default;
    table.declared(&mut battery)?;
    together(&table, &[], battery.validate())?;
    Ok(battery)
}

/// What the air does. A key called `elsewhere` is not accepted; none is called "".
///
/// # Errors
/// As [`parameters`].
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

/// Feet and propellers near the ground. A key called `elsewhere` is not accepted; none is called "".
///
/// # Errors
/// As [`parameters`].
pub fn ground(
    mut table: Table<'_>,
    (mut contact, mut effect): (Contact, GroundEffect),
    elsewhere: &str,
    truth: &Parameters<f64>,
    step_s: f64,
) -> Result<(Contact, Option<GroundEffect>), FileError> {
    table.declared_but(elsewhere, &mut contact)?;
    table.declared_but(GroundEffect::ROT_HEIGHT.range.name, &mut effect)?;
    // The height is given once, so that feet and propellers cannot disagree about it.
    effect.rotor_height_m = contact.rotor_height_m;
    let with_effect = table.boolean("ground_effect")?.unwrap_or(true);
    together(&table, ALL, contact.validate_for(truth, step_s))?;
    Ok((contact, with_effect.then_some(effect)))
}

/// Groups of an inertial sensor.
pub const TRIADS: [&str; 2] = ["gyro", "accel"];

/// Reads an instrument by the name of a part, or as a table, with a table for each of its groups, that may name one.
/// What a table leaves out is as in `base`, or perfect.
///
/// # Errors
/// As [`parameters`].
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

/// The part that a table names, if it does.
///
/// # Errors
/// As [`parameters`].
pub fn preset<T: Copy>(table: &mut Table<'_>, presets: &[Preset<T>]) -> Result<Option<T>, FileError> {
    Ok(table.choice("part", presets, |preset| preset.name)?.map(|preset| preset.settings))
}

/// The groups of a part, each a table.
///
/// # Errors
/// As [`parameters`].
pub fn groups<T: Declared>(table: &mut Table<'_>, part: &mut T, groups: &[&'static str]) -> Result<(), FileError> {
    groups.iter().try_for_each(|group| {
        let Some(mut table) = table.table(group)? else { return Ok(()) };
        table.declared_in(group, part)?;
        table.finish()
    })
}
