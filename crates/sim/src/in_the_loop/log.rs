//! A flight as a CSV file.

use super::Error;
use crate::columns::MOTION;
use crate::flight::Sample;
use csv::Writer;
use std::fs::File;
use std::path::Path;

/// Steps from row to row: 100 Hz.
const EVERY: u64 = 10;

/// Rotors of the vehicle in the loop.
const ROTORS: usize = 4;

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
        let names = MOTION.iter().map(|(name, _)| (*name).to_owned());
        rows.write_record(names.chain((1..=ROTORS).map(|rotor| format!("omega{rotor}_rad_s"))))?;
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
        let numbers = MOTION.iter().map(|(_, value)| value(sample).to_string());
        self.rows.write_record(numbers.chain(sample.action.speeds.0.iter().take(ROTORS).map(f32::to_string)))?;
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
