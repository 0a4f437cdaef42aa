//! Reads the events in flight: `[[gust]]`, `[[change]]`, `[[payload]]` and `[[outage]]`.

use crate::definition::Outage;
use afbc_files::read::words::out_of_range;
use afbc_files::read::{FileError, Table};
use afbc_plant::{
    Environment, Gust, GustKind, PAYLOAD_AHEAD, PAYLOAD_BELOW, PAYLOAD_LEFT, Payload, PlantParameter,
    PlantParameterChange,
};
use afbc_types::{Axis, Parameters, Range};

/// Accepted start of an event \[s\].
pub(super) const START: Range = Range::new("start_s", 0.0, 36_000.0);
/// Accepted duration of an event \[s\]; an event without a duration lasts to the end.
pub(super) const LENGTH: Range = Range::new("duration_s", 0.001, 36_000.0);
/// Accepted factor of a change; the changed parameter must also be in its range.
const FACTOR: Range = Range::new("factor", 0.001, 1000.0);
/// Accepted factor on a moment of the rotors; below 0 the moment has the wrong sign.
const MOMENT_FACTOR: Range = Range::new("factor", -1000.0, 1000.0);
/// Accepted mass of a payload \[kg\].
const PAYLOAD_MASS: Range = Range::new("mass_kg", 0.0, afbc_plant::PAYLOAD_MASS.max);

/// Accepted sizes of a gust along x, y or z.
const LINEAR: [(Range, GustKind); 2] = [
    (Range::new("acceleration_m_s2", -1000.0, 1000.0), GustKind::Acceleration),
    (Range::new("force_n", -10_000.0, 10_000.0), GustKind::Force),
];
/// Accepted sizes of a gust about roll, pitch or yaw.
const ANGULAR: [(Range, GustKind); 2] = [
    (Range::new("angular_acceleration_rad_s2", -1000.0, 1000.0), GustKind::Acceleration),
    (Range::new("moment_n_m", -10_000.0, 10_000.0), GustKind::Force),
];

/// Keys on which masses and rotors depend.
const ALL: &[&str] = &["truth", "vehicle", "change", "payload"];

/// Reads the environment of a vehicle with these true parameters.
pub(super) fn read(root: &mut Table<'_>, truth: Parameters<f64>) -> Result<Environment, FileError> {
    let gusts = root.tables("gust")?.into_iter().map(gust).collect::<Result<_, _>>()?;
    let tables = root.few_tables("change")?;
    let mut environment = Environment::new(truth, Vec::new(), gusts)
        .map_err(|error| root.fault_at("truth", format!("{}; change it", out_of_range(&error))))?;
    for mut table in tables {
        // Overlapping changes multiply, so each change is checked together with the previous ones.
        let mut changes = environment.changes().to_vec();
        changes.push(change(&mut table)?);
        table.finish()?;
        match Environment::new(truth, changes, environment.gusts().to_vec()) {
            Ok(changed) => environment = changed,
            Err(error) => {
                table.clash(
                    FACTOR.name,
                    ALL,
                    format!("the factor causes {}; change the factor", out_of_range(&error)),
                )?;
            }
        }
    }
    let mut payloads = Vec::new();
    for mut table in root.few_tables("payload")? {
        payloads.push(payload(&mut table)?);
        table.finish()?;
        match environment.clone().with_payloads(payloads.clone()) {
            Ok(laden) => environment = laden,
            Err(error) => {
                let problem = format!("the payload causes {}; change the payload", out_of_range(&error));
                table.clash(PAYLOAD_MASS.name, ALL, problem)?;
                payloads.pop();
            }
        }
    }
    Ok(environment)
}

/// Reads the outages.
pub(super) fn outages(root: &mut Table<'_>) -> Result<Vec<Outage>, FileError> {
    let outage = |mut table: Table<'_>| {
        let [start_s, end_s] = interval(&mut table)?;
        table.finish()?;
        Ok(Outage { start_s, end_s })
    };
    root.few_tables("outage")?.into_iter().map(outage).collect()
}

fn payload(table: &mut Table<'_>) -> Result<Payload, FileError> {
    let mass_kg = table.need_number(&PAYLOAD_MASS)?;
    let [below_m, ahead_m, left_m] = [PAYLOAD_BELOW, PAYLOAD_AHEAD, PAYLOAD_LEFT].map(|range| table.number(&range));
    let [below_m, ahead_m, left_m] = [below_m?, ahead_m?, left_m?].map(Option::unwrap_or_default);
    let [start_s, end_s] = interval(table)?;
    Ok(Payload { mass_kg, below_m, ahead_m, left_m, start_s, end_s })
}

fn gust(mut table: Table<'_>) -> Result<Gust, FileError> {
    let axis = table.need_choice("axis", &Axis::ALL, Axis::name)?;
    let [(acceleration, by_acceleration), (force, by_force)] = match axis {
        Axis::X | Axis::Y | Axis::Z => LINEAR,
        Axis::Roll | Axis::Pitch | Axis::Yaw => ANGULAR,
    };
    let sizes = format!("axis \"{}\" takes {} or {}", axis.name(), acceleration.name, force.name);
    let (by, of) = (table.number(&acceleration)?, table.number(&force)?);
    let [start_s, end_s] = interval(&mut table)?;
    table.finish()?;
    match (by, of) {
        (Some(_), Some(_)) => table.clash(force.name, &[], format!("the gust has two sizes; {sizes}, not both"))?,
        (None, None) => table.clash(acceleration.name, &[], format!("missing; {sizes}"))?,
        _ => {}
    }
    let (kind, size) = by.map_or((by_force, of.unwrap_or_default()), |size| (by_acceleration, size));
    Ok(Gust { axis, kind, size, start_s, end_s })
}

fn change(table: &mut Table<'_>) -> Result<PlantParameterChange, FileError> {
    let quantities = [
        PlantParameter::Mass,
        PlantParameter::Inertia,
        PlantParameter::ThrustFactor,
        PlantParameter::DragFactor,
        PlantParameter::RollMoment,
        PlantParameter::PitchMoment,
        PlantParameter::YawMoment,
    ];
    let quantity = table.need_choice("parameter", &quantities, |quantity| match quantity {
        PlantParameter::Mass => "mass",
        PlantParameter::Inertia => "inertia",
        PlantParameter::ThrustFactor => "thrust-factor",
        PlantParameter::DragFactor => "drag-factor",
        PlantParameter::RollMoment => "roll-moment",
        PlantParameter::PitchMoment => "pitch-moment",
        PlantParameter::YawMoment => "yaw-moment",
    })?;
    let is_moment =
        matches!(quantity, PlantParameter::RollMoment | PlantParameter::PitchMoment | PlantParameter::YawMoment);
    let factor = table.need_number(if is_moment { &MOMENT_FACTOR } else { &FACTOR })?;
    let [start_s, end_s] = interval(table)?;
    Ok(PlantParameterChange { quantity, factor, start_s, end_s })
}

pub(super) fn interval(table: &mut Table<'_>) -> Result<[f64; 2], FileError> {
    let start_s = table.need_number(&START)?;
    let length_s = table.number(&LENGTH)?.unwrap_or(f64::INFINITY);
    Ok([start_s, start_s + length_s])
}
