//! Reads `[instruments]`, `[told]` and `[[instrument_fault]]`: the sensors of a real vehicle for its estimator, and the
//! sensor properties that its software is told.

use super::environment::interval;
use crate::told::{AssumedInstruments, stated};
use afbc_files::read::{FileError, Table};
use afbc_plant::InstrumentSuite;
use afbc_plant::instruments::{
    BarometerModel, FailureKind, GnssModel, ImuModel, InstrumentFault, MagnetometerModel, TrackerModel, limits,
};
use afbc_vehicles::{Vehicle, parts};

/// Reads the instruments of `table`; without a table there are none.
pub(super) fn read(table: Option<Table<'_>>) -> Result<InstrumentSuite, FileError> {
    let Some(mut table) = table else { return Ok(InstrumentSuite::default()) };
    let suite = suite(&mut table, &InstrumentSuite::default())?;
    // Unknown keys are reported first, since an unknown key may be a misspelt `imu`.
    table.finish()?;
    if suite.imu.is_none() {
        table.clash("imu", &[], "missing; add an imu, since the other instruments have no effect without one")?;
    }
    Ok(suite)
}

/// Reads the instruments in `table`. Keys that an instrument's own table leaves out are taken from `base`, or are
/// perfect.
fn suite(table: &mut Table<'_>, base: &InstrumentSuite) -> Result<InstrumentSuite, FileError> {
    let InstrumentSuite { imu, tracker, gnss, barometer, magnetometer } = *base;
    Ok(InstrumentSuite {
        imu: parts::instrument(table, "imu", imu, &ImuModel::PRESETS, &parts::TRIADS)?,
        tracker: parts::instrument(table, "tracker", tracker, &TrackerModel::PRESETS, &["loss", "freeze"])?,
        gnss: parts::instrument(table, "gnss", gnss, &GnssModel::PRESETS, &["loss"])?,
        barometer: parts::instrument(table, "barometer", barometer, &BarometerModel::PRESETS, &[])?,
        magnetometer: parts::instrument(table, "magnetometer", magnetometer, &MagnetometerModel::PRESETS, &[])?,
    })
}

/// Reads the properties of `instruments` that the vehicle is told: a table with the differences, or a word.
pub(super) fn told(
    root: &mut Table<'_>,
    instruments: &InstrumentSuite,
    vehicle: Option<&Vehicle>,
) -> Result<AssumedInstruments, FileError> {
    const KEY: &str = "told";
    if root.has(KEY) && instruments.imu.is_none() {
        root.clash(
            KEY,
            &["instruments"],
            "the scenario has no instruments that [told] could describe; add [instruments], or leave [told] out",
        )?;
    }
    if !root.holds_table(KEY) {
        return Ok(root
            .choice(KEY, &[()], |()| "drawn")?
            .map_or(AssumedInstruments::Stated, |()| AssumedInstruments::Drawn));
    }
    let Some(mut table) = root.table(KEY)? else { return Ok(AssumedInstruments::Stated) };
    let there = [
        ("tracker", instruments.tracker.is_some()),
        ("gnss", instruments.gnss.is_some()),
        ("barometer", instruments.barometer.is_some()),
        ("magnetometer", instruments.magnetometer.is_some()),
    ];
    for (key, _) in there.into_iter().filter(|(_, there)| !there) {
        table.forbid(
            key,
            &format!(
                "the scenario has no {key} that [told] could describe; add it to [instruments], or leave it out of \
                 [told]"
            ),
        )?;
    }
    let base = stated(instruments, vehicle);
    let told = suite(&mut table, &base)?;
    table.finish()?;
    Ok(AssumedInstruments::Suite(Box::new(InstrumentSuite {
        imu: told.imu.or(base.imu),
        tracker: told.tracker.or(base.tracker),
        gnss: told.gnss.or(base.gnss),
        barometer: told.barometer.or(base.barometer),
        magnetometer: told.magnetometer.or(base.magnetometer),
    })))
}

/// Reads the failures of the instruments.
pub(super) fn faults(root: &mut Table<'_>, suite: &InstrumentSuite) -> Result<Vec<InstrumentFault>, FileError> {
    root.few_tables("instrument_fault")?.into_iter().map(|table| fault(table, suite)).collect()
}

fn fault(mut table: Table<'_>, suite: &InstrumentSuite) -> Result<InstrumentFault, FileError> {
    let kind = table.need_choice("failure", &FailureKind::ALL, FailureKind::name)?;
    let failure = match kind {
        FailureKind::ImuNoisy { .. } => FailureKind::ImuNoisy {
            rates_rad_s: table.need_number(&limits::RATES)?,
            specific_force_m_s2: table.need_number(&limits::FORCE)?,
        },
        FailureKind::ImuClipped { .. } => FailureKind::ImuClipped {
            rates_rad_s: table.need_number(&limits::RATES)?,
            specific_force_m_s2: table.need_number(&limits::FORCE)?,
        },
        FailureKind::ImuBiased { .. } => FailureKind::ImuBiased {
            rates_bias_rad_s: table.need_vector(limits::RATES_BIAS.name, &limits::RATES_BIAS)?,
            force_bias_m_s2: table.need_vector(limits::FORCE_BIAS.name, &limits::FORCE_BIAS)?,
        },
        FailureKind::TrackerJumped { .. } => FailureKind::TrackerJumped {
            by_m: table.need_vector(limits::JUMP.name, &limits::JUMP)?,
            yaw_rad: table.number(&limits::YAW)?.unwrap_or(0.0),
        },
        FailureKind::GnssJumped { .. } => {
            FailureKind::GnssJumped { by_m: table.need_vector(limits::JUMP.name, &limits::JUMP)? }
        }
        FailureKind::GnssMultipath { .. } => FailureKind::GnssMultipath {
            deviation_m: table.need_number(&limits::DEVIATION)?,
            correlation_time_s: table.need_number(&limits::CORRELATION)?,
        },
        FailureKind::MagnetometerDisturbed { .. } => {
            FailureKind::MagnetometerDisturbed { field_ut: table.need_vector(limits::FIELD.name, &limits::FIELD)? }
        }
        plain => plain,
    };
    let [start_s, end_s] = interval(&mut table)?;
    let rise_s = table.number(&limits::RISE)?.unwrap_or(0.0);
    if rise_s > 0.0 && failure.scaled(1.0).is_none() {
        let problem = format!("the failure {} has no size that could grow; leave rise_s out", failure.name());
        table.clash(limits::RISE.name, &["failure"], problem)?;
    }
    table.finish()?;
    let (instrument, _) = failure.name().split_once('-').unwrap_or_default();
    let there = match instrument {
        "imu" => suite.imu.is_some(),
        "tracker" => suite.tracker.is_some(),
        "gnss" => suite.gnss.is_some(),
        "barometer" => suite.barometer.is_some(),
        _ => suite.magnetometer.is_some(),
    };
    if !there {
        let problem = format!("the scenario has no {instrument} that could fail; add it to [instruments]");
        table.clash("failure", &["instruments"], problem)?;
    }
    Ok(InstrumentFault { failure, start_s, end_s, rise_s })
}
