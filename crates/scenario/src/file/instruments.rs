//! `[instruments]` and `[[instrument_fault]]`: the sensors of a real vehicle, for its estimator.

use super::environment::interval;
use afbc_plant::InstrumentSuite;
use afbc_plant::instruments::{Barometer, Failure, Gnss, Imu, InstrumentFault, Magnetometer, TrackerModel, limits};
use afbc_reader::{FileError, Table};
use afbc_vehicles::parts;

/// Reads the instruments of `table`; none without it.
pub(super) fn read(table: Option<Table<'_>>) -> Result<InstrumentSuite, FileError> {
    let Some(mut table) = table else { return Ok(InstrumentSuite::default()) };
    let suite = InstrumentSuite {
        imu: parts::instrument(&mut table, "imu", &Imu::PRESETS, &parts::TRIADS)?,
        tracker: parts::instrument(&mut table, "tracker", &TrackerModel::PRESETS, &["loss", "freeze"])?,
        gnss: parts::instrument(&mut table, "gnss", &Gnss::PRESETS, &["loss"])?,
        barometer: parts::instrument(&mut table, "barometer", &Barometer::PRESETS, &[])?,
        magnetometer: parts::instrument(&mut table, "magnetometer", &Magnetometer::PRESETS, &[])?,
    };
    // Made before the table is finished, which takes it, and returned after: an unknown key may be a misspelt imu.
    let blind = table.fault("imu", "missing; add it, since the other instruments have no effect without it");
    table.finish()?;
    if suite.imu.is_some() { Ok(suite) } else { Err(blind) }
}

/// Reads the failures of the instruments.
pub(super) fn faults(root: &mut Table<'_>, suite: &InstrumentSuite) -> Result<Vec<InstrumentFault>, FileError> {
    root.few_tables("instrument_fault")?.into_iter().map(|table| fault(table, suite)).collect()
}

fn fault(mut table: Table<'_>, suite: &InstrumentSuite) -> Result<InstrumentFault, FileError> {
    let kind = table.need_choice("failure", &Failure::ALL, Failure::name)?;
    let failure = match kind {
        Failure::ImuNoisy { .. } => Failure::ImuNoisy {
            rates_rad_s: table.need_number(&limits::RATES)?,
            specific_force_m_s2: table.need_number(&limits::FORCE)?,
        },
        Failure::ImuClipped { .. } => Failure::ImuClipped {
            rates_rad_s: table.need_number(&limits::RATES)?,
            specific_force_m_s2: table.need_number(&limits::FORCE)?,
        },
        Failure::ImuBiased { .. } => Failure::ImuBiased {
            rates_bias_rad_s: table.need_vector(limits::RATES_BIAS.name, &limits::RATES_BIAS)?,
            force_bias_m_s2: table.need_vector(limits::FORCE_BIAS.name, &limits::FORCE_BIAS)?,
        },
        Failure::TrackerJumped { .. } => Failure::TrackerJumped {
            by_m: table.need_vector(limits::JUMP.name, &limits::JUMP)?,
            yaw_rad: table.number(&limits::YAW)?.unwrap_or(0.0),
        },
        Failure::GnssJumped { .. } => {
            Failure::GnssJumped { by_m: table.need_vector(limits::JUMP.name, &limits::JUMP)? }
        }
        Failure::MagnetometerDisturbed { .. } => {
            Failure::MagnetometerDisturbed { field_ut: table.need_vector(limits::FIELD.name, &limits::FIELD)? }
        }
        plain => plain,
    };
    let (instrument, _) = failure.name().split_once('-').unwrap_or_default();
    let there = match instrument {
        "imu" => suite.imu.is_some(),
        "tracker" => suite.tracker.is_some(),
        "gnss" => suite.gnss.is_some(),
        "barometer" => suite.barometer.is_some(),
        _ => suite.magnetometer.is_some(),
    };
    if !there {
        let problem = format!("there is no {instrument} to fail; add it to [instruments]");
        return Err(table.fault_at("failure", problem));
    }
    let [start_s, end_s] = interval(&mut table)?;
    table.finish()?;
    Ok(InstrumentFault { failure, start_s, end_s })
}
