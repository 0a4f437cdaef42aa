//! Records a flight exactly: every input of every control tick, and enough of its outputs to check a replay.
//!
//! A [`Recorder`] writes the log beside the control tick, from power-up on. A [`Replayer`] runs the flight's own code
//! on the recorded inputs and finds the first tick whose outputs differ. Emulator, board and host have the same
//! arithmetic, so any difference is a defect.
//!
//! A frame is a [`Record`] in [postcard](https://postcard.jamesmunns.com)'s format and its CRC-32 (ISO-HDLC), both
//! COBS-encoded, then a zero. After a loss, a reader resumes at the next zero. Only software of the same format version
//! can read a log ([`StartRecord::version`]).

mod frame;
mod queue;
mod record;
mod recorder;
mod replayer;

pub use frame::{FRAME_MAX, FrameError, Frames, decode, write};
pub use queue::RecordQueue;
pub use record::{Given, Record, StartRecord, VERSION, WORD_MAX};
pub use recorder::Recorder;
pub use replayer::{ReplayDifference, ReplayStep, Replayer};
