//! Where a run's lines go.

use afbc_files::BackgroundWriter;
use std::io::{self, Write};
use std::sync::Arc;
use std::time::Duration;

/// Most bytes that wait for whoever reads them: some ten thousand lines.
const ROOM: usize = 1 << 20;
/// Time that is left at the end for lines that wait.
const END_MAX: Duration = Duration::from_secs(2);

/// Lines for a person or a program. Whoever does not read them stops nobody: when too many wait, further ones are lost,
/// and a line says how many.
#[derive(Clone, Debug)]
pub struct LineOutput {
    out: Arc<BackgroundWriter>,
    lost: u64,
}

impl LineOutput {
    /// Writes the lines to `out`.
    ///
    /// # Errors
    /// If the system has no thread for it.
    pub fn to(out: impl Write + Send + 'static) -> io::Result<Self> {
        Ok(LineOutput { out: Arc::new(BackgroundWriter::new(out, ROOM)?), lost: 0 })
    }

    /// Takes a line; never waits.
    pub fn line(&mut self, line: &str) {
        let lost = match self.lost {
            0 => String::new(),
            lost => format!("lost {lost} lines that nobody has read\n"),
        };
        self.lost = if self.out.offer(format!("{lost}{line}\n").as_bytes()) { 0 } else { self.lost + 1 };
    }

    /// Waits until half of the room is free, or whoever reads is gone.
    pub fn wait_for_room(&self) {
        self.out.wait_for_room(ROOM / 2);
    }

    /// Gives whoever reads a little time for the last lines.
    pub fn finish(self) {
        // Whoever has closed the pipe, or does not read in time, does not want them.
        let _ = self.out.finish(Some(END_MAX));
    }
}
