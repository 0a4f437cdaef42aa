//! Splits a file into the frames of an exact log.

use afbc_log::exact::{FRAME_MAX, FrameError, Record, StartRecord, VERSION, decode};

/// Result of looking for the start record of a file.
pub(super) enum StartSearch {
    /// The first start record.
    Start(StartRecord),
    /// No start record: the reason and the cure.
    Refused(String),
}

/// A frame without the zero byte that ends it.
pub(super) struct FileFrame<'b> {
    /// Offset of the frame in the file \[bytes\].
    pub(super) at: usize,
    pub(super) bytes: &'b mut [u8],
    /// False for the rest at the end of the file that no zero byte ends.
    pub(super) is_whole: bool,
}

/// Returns every non-empty frame of a file.
pub(super) fn each(bytes: &mut [u8]) -> impl Iterator<Item = FileFrame<'_>> {
    let length = bytes.len();
    let mut at = 0;
    bytes.split_mut(|byte| *byte == 0).filter_map(move |bytes| {
        let frame = FileFrame { at, is_whole: at + bytes.len() < length, bytes };
        at += frame.bytes.len() + 1;
        (!frame.bytes.is_empty()).then_some(frame)
    })
}

/// Decodes a copy of a frame. A frame longer than [`FRAME_MAX`] counts as damaged.
fn read(frame: &[u8]) -> Result<Record, FrameError> {
    // Decoding overwrites a frame, and the replay still needs the original.
    let mut copy = [0; FRAME_MAX];
    let copy = copy.get_mut(..frame.len()).ok_or(FrameError::Damaged)?;
    copy.copy_from_slice(frame);
    decode(copy)
}

/// Looks for the first start record in a file.
pub(super) fn look(bytes: &[u8]) -> StartSearch {
    let refused = |problem: &str| StartSearch::Refused(problem.into());
    if bytes.is_empty() {
        return refused("the log is empty; check that LOG_PORT names the recorded link, and check its baud rate");
    }
    let mut records = 0_u64;
    for frame in bytes.split(|byte| *byte == 0).filter(|frame| !frame.is_empty()) {
        match read(frame) {
            Ok(Record::Start(start)) => return StartSearch::Start(start),
            Ok(_) => records += 1,
            Err(FrameError::Foreign(Some(version))) => {
                return StartSearch::Refused(format!(
                    "the exact log has version {version}, but this program reads version {VERSION}; replay the log \
                     with the program version that flew it"
                ));
            }
            Err(_) => {}
        }
    }
    match records {
        0 => refused("the file is not an exact log; give a log recorded by LOG_PORT or --exact-log"),
        _ => refused("the log has no start record; begin recording before the vehicle is powered up"),
    }
}

/// Returns true if the first whole frame is one of an exact log.
pub(super) fn begins(bytes: &[u8]) -> bool {
    let first = bytes.split(|byte| *byte == 0).find(|frame| !frame.is_empty());
    first.is_some_and(|frame| frame.len() < bytes.len() && !matches!(read(frame), Err(FrameError::Damaged)))
}
