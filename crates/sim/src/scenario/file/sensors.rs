//! `[sensors]`: what reaches the controllers of the true motion.

use crate::reader::{FileError, Table};
use afbc_plant::{Deviations, Dropouts, Sensing};
use afbc_types::Range;

/// Accepted size of one number for all of the state: what every part of it accepts.
const NOISE: Range = Range::new("noise", 0.0, Deviations::ATT.range.max);
const BIAS: Range = Range::new("bias", 0.0, Deviations::ATT.range.max);

/// The sensors of `table`; without one, perfect ones.
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

/// One number for all of the state, or a table with one for each part of it.
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
