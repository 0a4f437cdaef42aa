//! Frames on their way to a link that takes some of them now and some later.

use crate::exact::recorder::Recorder;
use afbc_onboard::parameters::{ParameterTable, RecordChange};
use afbc_onboard::{ControlInputs, TickRecord};
use heapless::Vec;

/// Bytes that wait for the link, at most.
const BYTES: usize = 1024;
/// Times after which a link that takes nothing has the next frame dropped, which may be longer than it ever takes.
const PATIENCE: u16 = 1_000;

/// Frames that wait for a link, at most a kilobyte of them.
///
/// Without room for a frame, it and all up to the end of the next tick are missing: a log lacks whole ticks, whose
/// numbers say so, and never only what a tick has taken.
#[derive(Clone, Debug, Default)]
pub struct RecordQueue {
    recorder: Recorder,
    waiting: Waiting,
    /// Times in a row that the link has taken nothing.
    refused: u16,
}

/// The bytes.
#[derive(Clone, Debug, Default)]
struct Waiting {
    bytes: Vec<u8, BYTES>,
    /// Of them, those at the beginning that have left.
    sent: usize,
    /// True if a frame is missing whose tick is not.
    lacks: bool,
}

impl RecordQueue {
    /// Records the start ([`Recorder::start`]).
    pub fn start<const N: usize>(&mut self, names: [&str; 2], table: &ParameterTable<N>) {
        let RecordQueue { recorder, waiting, .. } = self;
        recorder.start(names, table, &mut |frame| waiting.append(frame));
    }

    /// Records a change of the table ([`Recorder::change`]), and returns the number of the configuration.
    pub fn change<const N: usize>(&mut self, table: &ParameterTable<N>, change: RecordChange) -> u16 {
        let RecordQueue { recorder, waiting, .. } = self;
        recorder.change(table, change, &mut |frame| waiting.append(frame))
    }

    /// Records what messages have brought for a tick ([`Recorder::inputs`]).
    pub fn inputs(&mut self, tick: u32, inputs: &ControlInputs) {
        let RecordQueue { recorder, waiting, .. } = self;
        recorder.inputs(tick, inputs, &mut |frame| waiting.append(frame));
    }

    /// Records a tick.
    pub fn tick<const N: usize>(&mut self, tick: &TickRecord<'_, N>) {
        let RecordQueue { recorder, waiting, .. } = self;
        if !core::mem::take(&mut waiting.lacks) {
            recorder.tick(&tick.details.inputs, tick.report, &mut |frame| waiting.append(frame));
            // One that does not fit is itself the gap.
            waiting.lacks = false;
        }
    }

    /// Sends frame by frame through `send`, which says whether the link has taken it, until it takes no more; to be
    /// called in every tick.
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
            // What has left makes room.
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
