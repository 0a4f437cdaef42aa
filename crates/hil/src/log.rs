//! Writes the CSV log of a flight in the loop.

use super::Error;
use afbc_files::BackgroundWriter;
use afbc_sim::columns::MOTION;
use afbc_sim::flight::Sample;
use csv::Writer;
use std::fs::File;

/// Steps per row: 100 Hz.
const EVERY: u64 = 10;
/// Largest number of bytes that wait for a slow disk: minutes of a flight.
const ROOM: usize = 1 << 22;

/// Writes a row every 10 ms with the vehicle's true motion, the reference, and the rotor speeds from the link. No step
/// waits for the disk.
pub struct Log {
    rows: Writer<BackgroundWriter>,
    steps: u64,
    rotors: usize,
}

impl Log {
    /// Begins the log of a vehicle with this number of rotors in an empty file.
    ///
    /// # Errors
    /// [`Error::Log`].
    pub fn new(file: File, rotors: usize) -> Result<Self, Error> {
        let file = BackgroundWriter::new(file, ROOM).map_err(csv::Error::from)?;
        let mut rows = Writer::from_writer(file);
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
    pub fn finish(self) -> Result<(), Error> {
        let file = self.rows.into_inner().map_err(|error| error.into_error());
        file.and_then(|file| file.finish(None)).map_err(|error| Error::Log(error.into()))
    }
}
