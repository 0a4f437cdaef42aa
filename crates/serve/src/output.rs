//! Output of a run's lines.

use afbc_files::BackgroundWriter;
use std::io::{self, Write};
use std::sync::Arc;
use std::time::Duration;

/// Largest number of bytes that wait to be read: some ten thousand lines.
const ROOM: usize = 1 << 20;
/// Longest wait for the last lines to be read, at the end.
const END_MAX: Duration = Duration::from_secs(2);

/// Output lines for a person or a program. A slow reader blocks nobody: when too many lines wait, further ones are
/// dropped, and a later line gives their number.
#[derive(Clone, Debug)]
pub struct LineOutput {
    out: Arc<BackgroundWriter>,
    lost: u64,
}

impl LineOutput {
    /// Creates an output that writes its lines to `out`.
    ///
    /// # Errors
    /// Fails if the system cannot start a thread.
    pub fn to(out: impl Write + Send + 'static) -> io::Result<Self> {
        Ok(LineOutput { out: Arc::new(BackgroundWriter::new(out, ROOM)?), lost: 0 })
    }

    /// Writes a line; never blocks.
    pub fn line(&mut self, line: &str) {
        let lost = match self.lost {
            0 => String::new(),
            lost => format!("lost {lost} lines, since nobody read the output\n"),
        };
        self.lost = if self.out.offer(format!("{lost}{line}\n").as_bytes()) { 0 } else { self.lost + 1 };
    }

    /// Waits until half of the buffer is free, or the reader is gone.
    pub fn wait_for_room(&self) {
        self.out.wait_for_room(ROOM / 2);
    }

    /// Waits a short time until the last lines are read.
    pub fn finish(self) {
        // A reader who has closed the pipe, or is too slow, does not get the last lines.
        let _ = self.out.finish(Some(END_MAX));
    }
}
