//! CSV log of a flight in the loop.

use super::Error;
use afbc_sim::columns::MOTION;
use afbc_sim::flight::Sample;
use csv::Writer;
use std::fs::File;
use std::path::Path;

/// Steps per row: 100 Hz.
const EVERY: u64 = 10;

/// Writes a row every 10 ms with the vehicle's true motion, the reference, and the rotor speeds from the link.
pub struct Log {
    rows: Writer<File>,
    steps: u64,
    rotors: usize,
}

impl Log {
    /// Creates the file at `path` for a vehicle with this number of rotors, overwriting an existing one.
    ///
    /// # Errors
    /// [`Error::Log`].
    pub fn create(path: &Path, rotors: usize) -> Result<Self, Error> {
        let mut rows = Writer::from_path(path)?;
        let names = MOTION.iter().map(|(name, _)| (*name).to_owned());
        rows.write_record(names.chain((1..=rotors).map(|rotor| format!("omega{rotor}_rad_s"))))?;
        Ok(Log { rows, steps: 0, rotors })
    }

    /// Records one step.
    ///
    /// # Errors
    /// [`Error::Log`].
    pub fn add(&mut self, sample: &Sample) -> Result<(), Error> {
        let due = self.steps.is_multiple_of(EVERY);
        self.steps += 1;
        if !due {
            return Ok(());
        }
        let numbers = MOTION.iter().map(|(_, value)| value(sample).to_string());
        self.rows.write_record(numbers.chain(sample.action.speeds.0.iter().take(self.rotors).map(f32::to_string)))?;
        Ok(())
    }

    /// Completes the file.
    ///
    /// # Errors
    /// [`Error::Log`].
    pub fn finish(mut self) -> Result<(), Error> {
        self.rows.flush().map_err(|error| Error::Log(error.into()))
    }
}
