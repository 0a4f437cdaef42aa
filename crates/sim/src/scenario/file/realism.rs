//! `[rotors]`, `[[rotor_fault]]`, `[battery]`, `[drag]`, `[wind]` and `[ground]`: what the paper's vehicle leaves out.

use super::environment::{LENGTH, START};
use crate::reader::words::out_of_range;
use crate::reader::{FileError, Table};
use afbc_plant::rotors::limits::{EFFICIENCY, MAX, ROTOR, TIME_CONSTANT};
use afbc_plant::{
    Battery, Contact, CosineGust, DELAY, Drag, GroundEffect, Realism, RotorFault, Rotors, Sag, Start, Turbulence, Wind,
    battery, contact, drag, ground_effect, turbulence, wind,
};
use afbc_types::{OutOfRange, Parameters, Range};

/// Accepted smallest speed of a rotor \[rad/s\]; no more than the largest.
const MIN: Range = Range::new("min_rad_s", 0.0, MAX.max);
/// Accepted largest force of a rotor \[N\]; the speed that goes with it must be in range too.
const FORCE_MAX: Range = Range::new("force_max_n", 0.001, 10_000.0);
/// Accepted voltage of an empty battery \[V\]; no more than a full one's.
const EMPTY: Range = Range::new("empty_v", 0.1, battery::limits::FULL.max);
/// Accepted time from a gust's rise to its fall \[s\].
const HOLD: Range = Range::new("hold_s", 0.0, LENGTH.max);

/// What is real about a vehicle with these true parameters, in steps of `step_s`.
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

/// `table` is refused on account of how its numbers go together.
fn together(table: &Table<'_>) -> impl Fn(OutOfRange) -> FileError {
    |error| table.fault_at(error.range.name, format!("{}; change it", out_of_range(&error)))
}

fn rotors(root: &mut Table<'_>, truth: &Parameters<f64>) -> Result<Rotors, FileError> {
    let default = Rotors::default();
    let mut rotors = match root.table("rotors")? {
        Some(mut table) => {
            let start = table.choice("start", &[Start::Hover, Start::Idle], |start| match start {
                Start::Hover => "hover",
                Start::Idle => "idle",
            })?;
            let rotors = Rotors {
                time_constant_s: table.number(&TIME_CONSTANT)?.unwrap_or(default.time_constant_s),
                delay_s: table.number(&DELAY)?.unwrap_or(default.delay_s),
                min_rad_s: table.number(&MIN)?.unwrap_or(default.min_rad_s),
                max_rad_s: max_rad_s(&mut table, truth)?.unwrap_or(default.max_rad_s),
                start: start.unwrap_or(default.start),
                ..default
            };
            rotors.validate().map_err(together(&table))?;
            table.finish()?;
            rotors
        }
        None => default,
    };
    rotors.faults = root.few_tables("rotor_fault")?.into_iter().map(fault).collect::<Result<_, _>>()?;
    rotors.battery = root.table("battery")?.map(battery_of).transpose()?;
    Ok(rotors)
}

/// The largest speed, by itself or by the force that goes with it.
fn max_rad_s(table: &mut Table<'_>, truth: &Parameters<f64>) -> Result<Option<f64>, FileError> {
    let (speed, force) = (table.number(&MAX)?, table.number(&FORCE_MAX)?);
    let Some(force_n) = force else { return Ok(speed) };
    if speed.is_some() {
        let problem = format!("a second limit; write it or {}, not both", MAX.name);
        return Err(table.fault_at(FORCE_MAX.name, problem));
    }
    let speed_rad_s = libm::sqrt(force_n / truth.thrust_factor_n_s2);
    let problem = |error| format!("it makes {}; change the force", out_of_range(&error));
    MAX.check(speed_rad_s).map_err(|error| table.fault_at(FORCE_MAX.name, problem(error)))?;
    Ok(Some(speed_rad_s))
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
    use battery::limits;
    let default = Battery::THREE_CELLS;
    let effect = table.choice("effect", &[Sag::Ceiling, Sag::Speed], |effect| match effect {
        Sag::Ceiling => "ceiling",
        Sag::Speed => "speed",
    })?;
    let battery = Battery {
        full_v: table.number(&limits::FULL)?.unwrap_or(default.full_v),
        empty_v: table.number(&EMPTY)?.unwrap_or(default.empty_v),
        resistance_ohm: table.number(&limits::RESISTANCE)?.unwrap_or(default.resistance_ohm),
        capacity_a_h: table.number(&limits::CAPACITY)?.unwrap_or(default.capacity_a_h),
        initial_charge: table.number(&limits::INITIAL_CHARGE)?.unwrap_or(default.initial_charge),
        efficiency: table.number(&limits::EFFICIENCY)?.unwrap_or(default.efficiency),
        avionics_w: table.number(&limits::AVIONICS)?.unwrap_or(default.avionics_w),
        effect: effect.unwrap_or(default.effect),
    };
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
    use drag::limits;
    let default = Drag::PAPER;
    let drag = Drag {
        air_density_kg_m3: table.number(&limits::AIR_DENSITY)?.unwrap_or(default.air_density_kg_m3),
        blade_n_s2_m: table.number(&limits::BLADE)?.unwrap_or(default.blade_n_s2_m),
        rotor_height_m: table.number(&limits::ROTOR_HEIGHT)?.unwrap_or(default.rotor_height_m),
        area_m2: table.vector(limits::AREA.name, [&limits::AREA; 3])?.unwrap_or(default.area_m2),
        centre_m: table.vector(limits::CENTRE.name, [&limits::CENTRE; 3])?.unwrap_or(default.centre_m),
    };
    drag.validate(truth, rotor_max_rad_s, step_s).map_err(together(&table))?;
    table.finish()?;
    Ok(drag)
}

fn wind_of(mut table: Table<'_>) -> Result<Wind, FileError> {
    use wind::limits;
    let wind = Wind {
        steady_m_s: table.vector(limits::STEADY.name, [&limits::STEADY; 3])?.unwrap_or_default(),
        turbulence: turbulence_of(&mut table)?,
        gusts: table.few_tables("gust")?.into_iter().map(gust).collect::<Result<_, _>>()?,
    };
    table.finish()?;
    Ok(wind)
}

/// A name, or a table.
fn turbulence_of(table: &mut Table<'_>) -> Result<Option<Turbulence>, FileError> {
    use turbulence::limits;
    if !table.holds_table("turbulence") {
        let named = [Turbulence::LIGHT, Turbulence::MODERATE, Turbulence::SEVERE];
        return table.choice("turbulence", &named, |turbulence| match turbulence {
            Turbulence::LIGHT => "light",
            Turbulence::MODERATE => "moderate",
            _ => "severe",
        });
    }
    let Some(mut table) = table.table("turbulence")? else { return Ok(None) };
    let default = Turbulence::LIGHT.airspeed_floor_m_s;
    let turbulence = Turbulence {
        wind_20ft_m_s: table.need_number(&limits::WIND_20FT)?,
        airspeed_floor_m_s: table.number(&limits::AIRSPEED_FLOOR)?.unwrap_or(default),
    };
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
    use contact::limits;
    let (default, effect) = (Contact::PAPER, GroundEffect::PAPER);
    let contact = Contact {
        sink_m: table.number(&limits::SINK)?.unwrap_or(default.sink_m),
        damping_ratio: table.number(&limits::DAMPING_RATIO)?.unwrap_or(default.damping_ratio),
        friction: table.number(&limits::FRICTION)?.unwrap_or(default.friction),
        foot_radius_m: table.number(&limits::FOOT_RADIUS)?.unwrap_or(default.foot_radius_m),
        foot_depth_m: table.number(&limits::FOOT_DEPTH)?.unwrap_or(default.foot_depth_m),
        rotor_height_m: table.number(&limits::ROTOR_HEIGHT)?.unwrap_or(default.rotor_height_m),
    };
    contact.validate(truth, step_s).map_err(together(&table))?;
    let effect = GroundEffect {
        rotor_radius_m: table.number(&ground_effect::limits::ROTOR_RADIUS)?.unwrap_or(effect.rotor_radius_m),
        rotor_height_m: contact.rotor_height_m,
    };
    let with_effect = table.boolean("ground_effect")?.unwrap_or(true);
    table.finish()?;
    Ok((Some(contact), with_effect.then_some(effect)))
}
