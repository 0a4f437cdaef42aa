//! The exact log of a flight: everything that a control tick takes, and enough of what it gives to see whether the same
//! tick, run again, gives the same.
//!
//! A [`Recorder`] makes frames of it beside the control tick, from power-up on; a [`Replayer`] runs the flight's own
//! code over them, and finds the first tick that differs. Emulator, board and host have the same arithmetic, so that
//! any difference is a defect.
//!
//! A frame is a [`Record`] in [postcard](https://postcard.jamesmunns.com)'s format, its CRC-32 (ISO-HDLC), both
//! COBS-encoded, and a zero: a reader finds the next frame whatever was lost. The format is that of one version of this
//! software ([`StartRecord::version`]).

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
