//! `[rotors]`, `[[rotor_fault]]`, `[battery]`, `[drag]`, `[wind]` and `[ground]`: effects that the paper's vehicle
//! lacks.

use super::environment::{LENGTH, START};
use crate::reader::words::out_of_range;
use crate::reader::{FileError, Table};
use afbc_plant::rotors::limits::{EFFICIENCY, ROTOR};
use afbc_plant::{
    Battery, Contact, CosineGust, Drag, GroundEffect, Realism, RotorFault, Rotors, Sag, Start, Turbulence, Wind, wind,
};
use afbc_types::{Declared, OutOfRange, Parameters, Range};

/// Accepted largest force of a rotor \[N\]; the corresponding speed must be in range, too.
const FORCE_MAX: Range = Range::new("force_max_n", 0.001, 10_000.0);
/// Accepted time from a gust's rise to its fall \[s\].
const HOLD: Range = Range::new("hold_s", 0.0, LENGTH.max);

/// Reads the effects for a vehicle with these true parameters, in steps of `step_s`.
pub(super) fn read(root: &mut Table<'_>, truth: &Parameters<f64>, step_s: f64) -> Result<Realism, FileError> {
    let rotors = rotors(root, truth)?;
    let drag = match root.table("drag")? {
        Some(table) => Some(drag_of(table, truth, rotors.max_rad_s, step_s)?),
        None => None,
    };
    let wind = match root.table("wind")? {
        Some(table) => wind_of(table)?,
        None => Wind::default(),
    };
    if drag.is_none() && wind != Wind::default() {
        return Err(root.fault_at("wind", "wind acts through drag, and there is none; add [drag]"));
    }
    let (contact, ground_effect) = match root.table("ground")? {
        Some(table) => ground(table, truth, step_s)?,
        None => (None, None),
    };
    Ok(Realism { rotors, drag, wind, contact, ground_effect, seed: 0 })
}

/// Returns errors about the combination of numbers in `table`.
fn together(table: &Table<'_>) -> impl Fn(OutOfRange) -> FileError {
    |error| table.fault_at(error.range.name, format!("{}; change it", out_of_range(&error)))
}

fn rotors(root: &mut Table<'_>, truth: &Parameters<f64>) -> Result<Rotors, FileError> {
    let mut rotors = Rotors::DEFAULT;
    if let Some(mut table) = root.table("rotors")? {
        let start = table.choice("start", &[Start::Hover, Start::Idle], |start| match start {
            Start::Hover => "hover",
            Start::Idle => "idle",
        })?;
        rotors.start = start.unwrap_or(rotors.start);
        table.declared(&mut rotors)?;
        max_by_force(&mut table, &mut rotors, truth)?;
        rotors.validate().map_err(together(&table))?;
        table.finish()?;
    }
    rotors.faults = root.few_tables("rotor_fault")?.into_iter().map(fault).collect::<Result<_, _>>()?;
    rotors.battery = root.table("battery")?.map(battery_of).transpose()?;
    Ok(rotors)
}

/// Reads the largest speed from a force, if it is given as one.
fn max_by_force(table: &mut Table<'_>, rotors: &mut Rotors, truth: &Parameters<f64>) -> Result<(), FileError> {
    let max = &Rotors::MAX.range;
    let Some(force_n) = table.number(&FORCE_MAX)? else { return Ok(()) };
    if table.has(max.name) {
        let problem = format!("a second limit; write it or {}, not both", max.name);
        return Err(table.fault_at(FORCE_MAX.name, problem));
    }
    rotors.max_rad_s = libm::sqrt(force_n / truth.thrust_factor_n_s2);
    let problem = |error| format!("it makes {}; change the force", out_of_range(&error));
    max.check(rotors.max_rad_s).map_err(|error| table.fault_at(FORCE_MAX.name, problem(error)))
}

fn fault(mut table: Table<'_>) -> Result<RotorFault, FileError> {
    let rotor = table.need_number(&ROTOR)?;
    if rotor.fract() != 0.0 {
        return Err(table.fault_at(ROTOR.name, format!("{rotor} is no rotor; it must be 1, 2, 3 or 4")));
    }
    let fault = RotorFault {
        rotor: rotor as u8,
        efficiency: table.need_number(&EFFICIENCY)?,
        start_s: table.need_number(&START)?,
    };
    table.finish()?;
    Ok(fault)
}

fn battery_of(mut table: Table<'_>) -> Result<Battery, FileError> {
    let mut battery = Battery::THREE_CELLS;
    let effect = table.choice("effect", &[Sag::Ceiling, Sag::Speed], |effect| match effect {
        Sag::Ceiling => "ceiling",
        Sag::Speed => "speed",
    })?;
    battery.effect = effect.unwrap_or(battery.effect);
    table.declared(&mut battery)?;
    battery.validate().map_err(together(&table))?;
    table.finish()?;
    Ok(battery)
}

fn drag_of(
    mut table: Table<'_>,
    truth: &Parameters<f64>,
    rotor_max_rad_s: f64,
    step_s: f64,
) -> Result<Drag, FileError> {
    let mut drag = Drag::PAPER;
    table.declared(&mut drag)?;
    drag.validate_for(truth, rotor_max_rad_s, step_s).map_err(together(&table))?;
    table.finish()?;
    Ok(drag)
}

fn wind_of(mut table: Table<'_>) -> Result<Wind, FileError> {
    let mut wind = Wind::DEFAULT;
    table.declared(&mut wind)?;
    wind.turbulence = turbulence_of(&mut table)?;
    wind.gusts = table.few_tables("gust")?.into_iter().map(gust).collect::<Result<_, _>>()?;
    table.finish()?;
    Ok(wind)
}

/// Reads turbulence by name or as a table.
fn turbulence_of(table: &mut Table<'_>) -> Result<Option<Turbulence>, FileError> {
    if !table.holds_table("turbulence") {
        let named = [Turbulence::LIGHT, Turbulence::MODERATE, Turbulence::SEVERE];
        return table.choice("turbulence", &named, |turbulence| match turbulence {
            Turbulence::LIGHT => "light",
            Turbulence::MODERATE => "moderate",
            _ => "severe",
        });
    }
    let Some(mut table) = table.table("turbulence")? else { return Ok(None) };
    let mut turbulence = Turbulence::LIGHT;
    table.declared(&mut turbulence)?;
    table.require(&Turbulence::WIND_20FT.range)?;
    table.finish()?;
    Ok(Some(turbulence))
}

fn gust(mut table: Table<'_>) -> Result<CosineGust, FileError> {
    use wind::limits;
    let gust = CosineGust {
        velocity_m_s: table.need_vector(limits::GUST.name, &limits::GUST)?,
        start_s: table.need_number(&START)?,
        rise_s: table.need_number(&limits::RISE)?,
        hold_s: table.number(&HOLD)?.unwrap_or(0.0),
    };
    table.finish()?;
    Ok(gust)
}

fn ground(
    mut table: Table<'_>,
    truth: &Parameters<f64>,
    step_s: f64,
) -> Result<(Option<Contact>, Option<GroundEffect>), FileError> {
    let (mut contact, mut effect) = (Contact::PAPER, GroundEffect::PAPER);
    table.declared(&mut contact)?;
    contact.validate_for(truth, step_s).map_err(together(&table))?;
    table.declared_but(GroundEffect::ROT_HEIGHT.range.name, &mut effect)?;
    effect.rotor_height_m = contact.rotor_height_m;
    let with_effect = table.boolean("ground_effect")?.unwrap_or(true);
    table.finish()?;
    Ok((Some(contact), with_effect.then_some(effect)))
}
