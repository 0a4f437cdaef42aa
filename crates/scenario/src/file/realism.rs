//! Reads effects that the paper's vehicle lacks: `[rotors]`, `[[rotor_fault]]`, `[battery]`, `[drag]`, `[wind]` and
//! `[ground]`.

use super::environment::{LENGTH, START};
use afbc_files::read::{FileError, Table};
use afbc_plant::rotors::limits::{EFFICIENCY, ROTOR};
use afbc_plant::{
    BatteryModel, Contact, CosineGust, Drag, GroundEffect, Realism, RotorFault, RotorLayout, Turbulence, Wind, wind,
};
use afbc_types::{Parameters, Range};
use afbc_vehicles::parts::{self, DragConditions};

/// Accepted time between a gust's rise and its fall \[s\].
const HOLD: Range = Range::new("hold_s", 0.0, LENGTH.max);

/// Reads the effects for a vehicle with these true parameters, this frame and at most `count` rotors, in steps of
/// `step_s`. Missing keys are taken from `default`.
pub(super) fn read(
    root: &mut Table<'_>,
    default: &Realism,
    truth: &Parameters<f64>,
    (frame, count): (&RotorLayout, usize),
    step_s: f64,
) -> Result<Realism, FileError> {
    let mut rotors = parts::rotors(root.table("rotors")?, default.rotors.clone(), truth)?;
    let faults = root.few_tables("rotor_fault")?.into_iter().map(|table| fault(table, count));
    rotors.faults = faults.collect::<Result<_, _>>()?;
    if let Some(table) = root.table("battery")? {
        rotors.battery = Some(parts::battery(table, rotors.battery.unwrap_or(BatteryModel::THREE_CELLS))?);
    }
    let conditions = DragConditions { parameters: truth, frame, rotor_max_rad_s: rotors.max_rad_s, step_s };
    let drag = match root.table("drag")? {
        Some(table) => Some(parts::drag(table, default.drag.unwrap_or(Drag::PAPER), "", &conditions)?),
        None => default.drag,
    };
    let wind = match root.table("wind")? {
        Some(table) => wind_of(table)?,
        None => Wind::default(),
    };
    if drag.is_none() && wind != Wind::default() {
        root.clash("wind", &["drag", "vehicle"], "wind only acts through drag, and the vehicle has none; add [drag]")?;
    }
    let (contact, ground_effect) = match root.table("ground")? {
        Some(table) => {
            let contact = default.contact.unwrap_or(Contact::PAPER);
            let default = (contact, default.ground_effect.unwrap_or(GroundEffect::PAPER));
            let (contact, ground_effect) = parts::ground(table, default, "", truth, step_s)?;
            (Some(contact), ground_effect)
        }
        None => (default.contact, default.ground_effect),
    };
    // The scenario's seed is used instead of this seed.
    Ok(Realism { rotors, drag, wind, contact, ground_effect, seed: 0 })
}

/// Reads a fault of one of `count` rotors.
fn fault(mut table: Table<'_>, count: usize) -> Result<RotorFault, FileError> {
    let rotor = table.need_number(&Range { max: count as f64, ..ROTOR })?;
    if rotor.fract() != 0.0 {
        return Err(
            table.fault_at(ROTOR.name, format!("there is no rotor {rotor}; write a whole number, 1 to {count}"))
        );
    }
    let fault = RotorFault {
        rotor: rotor as u8,
        efficiency: table.need_number(&EFFICIENCY)?,
        start_s: table.need_number(&START)?,
    };
    table.finish()?;
    Ok(fault)
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
