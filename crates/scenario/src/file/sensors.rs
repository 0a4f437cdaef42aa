//! Reads `[sensors]` and `[[sensor_fault]]`, the measurement of the state for the controllers.

use super::environment::interval;
use afbc_files::read::{FileError, Table};
use afbc_plant::{Deviations, MeasurementDropouts, Sensing, SensorFault, SensorFaultKind};
use afbc_types::{Axis, Range};

/// Accepted noise and bias, if given as one number for all coordinates.
const NOISE: Range = Range::new("noise", 0.0, Deviations::ATT.range.max);
const BIAS: Range = Range::new("bias", 0.0, Deviations::ATT.range.max);

/// Accepted factor on a measured coordinate and its rate.
const FACTOR: Range = Range::new("factor", -1000.0, 1000.0);
/// Accepted offsets of a position and of an angle.
const OFFSET: Range = Range::new("offset_m", -10_000.0, 10_000.0);
const TURN: Range = Range::new("offset_rad", -10.0, 10.0);

/// Reads the sensors of `table`; without a table they are perfect.
pub(super) fn read(table: Option<Table<'_>>) -> Result<Sensing, FileError> {
    let Some(mut table) = table else { return Ok(Sensing::default()) };
    let mut sensing = Sensing::DEFAULT;
    table.declared(&mut sensing)?;
    sensing.noise = spread(&mut table, &NOISE)?;
    sensing.bias = spread(&mut table, &BIAS)?;
    sensing.dropouts = table.table("dropouts")?.map(dropouts).transpose()?;
    table.finish()?;
    Ok(sensing)
}

/// Reads one number for all coordinates, or a table with a number for each group.
fn spread(table: &mut Table<'_>, all: &Range) -> Result<Deviations, FileError> {
    if !table.holds_table(all.name) {
        return Ok(table.number(all)?.map_or(Deviations::default(), Deviations::all));
    }
    let Some(mut table) = table.table(all.name)? else { return Ok(Deviations::default()) };
    let mut spread = Deviations::DEFAULT;
    table.declared(&mut spread)?;
    table.finish()?;
    Ok(spread)
}

fn dropouts(mut table: Table<'_>) -> Result<MeasurementDropouts, FileError> {
    let mut dropouts = MeasurementDropouts::DEFAULT;
    table.declared(&mut dropouts)?;
    table.require(&MeasurementDropouts::RATE.range)?;
    table.require(&MeasurementDropouts::MEAN.range)?;
    table.finish()?;
    Ok(dropouts)
}

/// Reads the faults of the measurement.
pub(super) fn faults(root: &mut Table<'_>) -> Result<Vec<SensorFault>, FileError> {
    root.few_tables("sensor_fault")?.into_iter().map(fault).collect()
}

fn fault(mut table: Table<'_>) -> Result<SensorFault, FileError> {
    let axis = table.choice("axis", &Axis::ALL, Axis::name)?;
    let offset = match axis {
        Some(Axis::Roll | Axis::Pitch | Axis::Yaw) => TURN,
        _ => OFFSET,
    };
    let frozen = table.boolean("frozen")?.unwrap_or(false).then_some(SensorFaultKind::Frozen);
    let factor = table.number(&FACTOR)?.map(SensorFaultKind::Factor);
    let offset_by = table.number(&offset)?.map(SensorFaultKind::Offset);
    let [start_s, end_s] = interval(&mut table)?;
    table.finish()?;
    let mut misreadings = [factor, offset_by, frozen].into_iter().flatten();
    let (first, second) = (misreadings.next(), misreadings.next());
    if first.is_none() || second.is_some() {
        let known = format!("a sensor fault needs exactly one of factor, {} and frozen = true", offset.name);
        table.clash(FACTOR.name, &[], known)?;
    }
    let misreading = first.unwrap_or(SensorFaultKind::Frozen);
    if axis.is_none() && misreading != SensorFaultKind::Frozen {
        table.clash("axis", &[], "missing; name the axis; only a frozen fault may affect the whole state")?;
    }
    Ok(SensorFault { axis, misreading, start_s, end_s })
}
