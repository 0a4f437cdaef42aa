//! `[sensors]`: measurement of the state for the controllers.

use afbc_plant::{Deviations, Dropouts, Sensing};
use afbc_reader::{FileError, Table};
use afbc_types::Range;

/// Accepted single number for all coordinates: the range that every coordinate accepts.
const NOISE: Range = Range::new("noise", 0.0, Deviations::ATT.range.max);
const BIAS: Range = Range::new("bias", 0.0, Deviations::ATT.range.max);

/// Reads the sensors of `table`; perfect ones without it.
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

/// Reads one number for all coordinates, or a table with one for each group.
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

fn dropouts(mut table: Table<'_>) -> Result<Dropouts, FileError> {
    let mut dropouts = Dropouts::DEFAULT;
    table.declared(&mut dropouts)?;
    table.require(&Dropouts::RATE.range)?;
    table.require(&Dropouts::MEAN.range)?;
    table.finish()?;
    Ok(dropouts)
}
