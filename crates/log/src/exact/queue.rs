//! Queues frames for a link that may refuse them at times.

use crate::exact::recorder::Recorder;
use afbc_onboard::parameters::{ParameterTable, RecordChange};
use afbc_onboard::{ControlInputs, TickRecord};
use heapless::Vec;

/// Largest number of bytes that wait for the link.
const BYTES: usize = 1024;
/// Consecutive refusals after which the oldest frame is dropped; the frame may be longer than the link ever takes.
const PATIENCE: u16 = 1_000;

/// Queues frames for a link, at most one kilobyte.
///
/// If a frame does not fit, all frames up to the end of the next tick are dropped. So a log lacks whole ticks, and the
/// tick numbers show the gap. A recorded tick never lacks its inputs.
#[derive(Clone, Debug, Default)]
pub struct RecordQueue {
    recorder: Recorder,
    waiting: Waiting,
    /// Number of consecutive refusals by the link.
    refused: u16,
}

/// Bytes of the queued frames.
#[derive(Clone, Debug, Default)]
struct Waiting {
    bytes: Vec<u8, BYTES>,
    /// Number of bytes at the beginning that are already sent.
    sent: usize,
    /// True if a frame was dropped but the next tick is not dropped yet.
    lacks: bool,
}

impl RecordQueue {
    /// Records the start ([`Recorder::start`]).
    pub fn start(&mut self, names: [&str; 2], table: &ParameterTable) {
        let RecordQueue { recorder, waiting, .. } = self;
        recorder.start(names, table, &mut |frame| waiting.append(frame));
    }

    /// Records a change of the parameter table ([`Recorder::change`]). Returns the number of the new configuration.
    pub fn change(&mut self, table: &ParameterTable, change: RecordChange) -> u16 {
        let RecordQueue { recorder, waiting, .. } = self;
        recorder.change(table, change, &mut |frame| waiting.append(frame))
    }

    /// Records the inputs that messages brought for a tick ([`Recorder::inputs`]).
    pub fn inputs(&mut self, tick: u32, inputs: &ControlInputs) {
        let RecordQueue { recorder, waiting, .. } = self;
        recorder.inputs(tick, inputs, &mut |frame| waiting.append(frame));
    }

    /// Records a tick, or drops it if one of the frames before it was dropped.
    pub fn tick(&mut self, tick: &TickRecord<'_>) {
        let RecordQueue { recorder, waiting, .. } = self;
        if !core::mem::take(&mut waiting.lacks) {
            recorder.tick(&tick.details.inputs, tick.report, &mut |frame| waiting.append(frame));
            // A tick that does not fit is itself the gap: no further tick need be dropped.
            waiting.lacks = false;
        }
    }

    /// Sends frames through `send` until it refuses one. `send` returns true if the link has taken the frame. Call this
    /// in every tick.
    #[inline(never)]
    pub fn send(&mut self, send: &mut dyn FnMut(&[u8]) -> bool) {
        let RecordQueue { waiting, refused, .. } = self;
        while let Some(frame) = waiting.front() {
            let length = frame.len();
            if send(frame) {
                *refused = 0;
            } else if *refused < PATIENCE {
                *refused += 1;
                return;
            } else {
                (*refused, waiting.lacks) = (0, true);
            }
            waiting.sent += length;
        }
        waiting.bytes.clear();
        waiting.sent = 0;
    }
}

impl Waiting {
    /// Returns the oldest frame.
    fn front(&self) -> Option<&[u8]> {
        let waiting = self.bytes.get(self.sent..)?;
        let end = waiting.iter().position(|byte| *byte == 0)?;
        waiting.get(..=end)
    }

    #[inline(never)]
    fn append(&mut self, frame: &[u8]) {
        let Waiting { bytes, sent, lacks } = self;
        if bytes.extend_from_slice(frame).is_err() {
            // Removes the bytes that are sent, to make room.
            let left = bytes.len().saturating_sub(*sent);
            for place in 0..left {
                let byte = bytes.get(*sent + place).copied().unwrap_or_default();
                bytes.get_mut(place).into_iter().for_each(|to| *to = byte);
            }
            bytes.truncate(left);
            *sent = 0;
            *lacks |= bytes.extend_from_slice(frame).is_err();
        }
    }
}
