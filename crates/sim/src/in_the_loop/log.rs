//! A flight as a CSV file.

use super::Error;
use crate::flight::Sample;
use csv::Writer;
use std::fs::File;
use std::path::Path;

/// Steps from row to row: 100 Hz.
const EVERY: u64 = 10;

const HEADER: [&str; 21] = [
    "time_s",
    "x_m",
    "y_m",
    "z_m",
    "vx_m_s",
    "vy_m_s",
    "vz_m_s",
    "roll_rad",
    "pitch_rad",
    "yaw_rad",
    "p_rad_s",
    "q_rad_s",
    "r_rad_s",
    "x_d_m",
    "y_d_m",
    "z_d_m",
    "yaw_d_rad",
    "omega1_rad_s",
    "omega2_rad_s",
    "omega3_rad_s",
    "omega4_rad_s",
];

/// Writes a row every 10 ms: the vehicle's true motion, the reference, the rotor speeds that came over the link.
pub struct Log {
    rows: Writer<File>,
    steps: u64,
}

impl Log {
    /// Begins the file at `path`, over what was there.
    ///
    /// # Errors
    /// [`Error::Log`].
    pub fn create(path: &Path) -> Result<Self, Error> {
        let mut rows = Writer::from_path(path)?;
        rows.write_record(HEADER)?;
        Ok(Log { rows, steps: 0 })
    }

    /// Takes one step into account.
    ///
    /// # Errors
    /// [`Error::Log`].
    pub fn add(&mut self, sample: &Sample) -> Result<(), Error> {
        let due = self.steps.is_multiple_of(EVERY);
        self.steps += 1;
        if !due {
            return Ok(());
        }
        let Sample { time_s, motion, reference, action, .. } = sample;
        let vectors =
            [motion.position_m, motion.velocity_m_s, motion.attitude_rad, motion.rates_rad_s, reference.position_m];
        let numbers = vectors.iter().flatten().chain([&reference.yaw_rad]);
        let numbers = core::iter::once(time_s).chain(numbers).map(f64::to_string);
        self.rows.write_record(numbers.chain(action.speeds.0.iter().map(f32::to_string)))?;
        Ok(())
    }

    /// Ends the file.
    ///
    /// # Errors
    /// [`Error::Log`].
    pub fn finish(mut self) -> Result<(), Error> {
        self.rows.flush().map_err(|error| Error::Log(error.into()))
    }
}
