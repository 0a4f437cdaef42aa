//! `[sensors]`: what reaches the controllers of the true motion.

use crate::reader::{FileError, Table};
use afbc_plant::sensors::limits::{ATTITUDE, DROPOUT_MEAN, DROPOUT_RATE, POSITION, RATES, VELOCITY};
use afbc_plant::{DELAY, Dropouts, Sensing, Spread};
use afbc_types::Range;

/// Accepted size of one number for all of the state: what every part of it accepts.
const NOISE: Range = Range::new("noise", 0.0, ATTITUDE.max);
const BIAS: Range = Range::new("bias", 0.0, ATTITUDE.max);

/// The sensors of `table`; without one, perfect ones.
pub(super) fn read(table: Option<Table<'_>>) -> Result<Sensing, FileError> {
    let Some(mut table) = table else { return Ok(Sensing::default()) };
    let sensing = Sensing {
        noise: spread(&mut table, &NOISE)?,
        bias: spread(&mut table, &BIAS)?,
        delay_s: table.number(&DELAY)?.unwrap_or(0.0),
        dropouts: table.table("dropouts")?.map(dropouts).transpose()?,
    };
    table.finish()?;
    Ok(sensing)
}

/// One number for all of the state, or a table with one for each part of it.
fn spread(table: &mut Table<'_>, all: &Range) -> Result<Spread, FileError> {
    if !table.holds_table(all.name) {
        return Ok(table.number(all)?.map_or(Spread::default(), Spread::all));
    }
    let Some(mut table) = table.table(all.name)? else { return Ok(Spread::default()) };
    let spread = Spread {
        position_m: table.number(&POSITION)?.unwrap_or(0.0),
        velocity_m_s: table.number(&VELOCITY)?.unwrap_or(0.0),
        attitude_rad: table.number(&ATTITUDE)?.unwrap_or(0.0),
        rates_rad_s: table.number(&RATES)?.unwrap_or(0.0),
    };
    table.finish()?;
    Ok(spread)
}

fn dropouts(mut table: Table<'_>) -> Result<Dropouts, FileError> {
    let dropouts = Dropouts { rate_hz: table.need_number(&DROPOUT_RATE)?, mean_s: table.need_number(&DROPOUT_MEAN)? };
    table.finish()?;
    Ok(dropouts)
}
