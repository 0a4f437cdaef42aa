//! Frames among the bytes that a vehicle has sent.

/// Bytes of a MAVLink 2 frame besides its payload: header and checksum.
const OVERHEAD: usize = 12;
/// Length of the header \[bytes\].
const HEADER: usize = 10;
/// Number of HEARTBEAT.
const HEARTBEAT: u32 = 0;
/// Number of STATUSTEXT, and the longest text.
const STATUSTEXT: u32 = 253;
const TEXT_MAX: usize = 50;

/// A frame as sent.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame<'a>(&'a [u8]);

/// Returns the frames of `bytes`, which are whole unsigned frames one after the other.
pub(crate) fn frames(mut bytes: &[u8]) -> impl Iterator<Item = Frame<'_>> {
    core::iter::from_fn(move || {
        let length = OVERHEAD + usize::from(*bytes.get(1)?);
        let (frame, rest) = bytes.split_at_checked(length)?;
        bytes = rest;
        Some(Frame(frame))
    })
}

impl<'a> Frame<'a> {
    pub(crate) fn bytes(self) -> &'a [u8] {
        self.0
    }

    fn id(self) -> u32 {
        match self.0 {
            [_, _, _, _, _, _, _, low, middle, high, ..] => u32::from_le_bytes([*low, *middle, *high, 0]),
            _ => u32::MAX,
        }
    }

    pub(crate) fn is_heartbeat(self) -> bool {
        self.id() == HEARTBEAT
    }

    /// Returns the text of a STATUSTEXT.
    pub(crate) fn text(self) -> Option<String> {
        let payload = self.0.get(HEADER..self.0.len() - 2).filter(|_| self.id() == STATUSTEXT)?;
        let text = payload.get(1..)?;
        let end = text.iter().take(TEXT_MAX).take_while(|&&byte| byte != 0).count();
        Some(String::from_utf8_lossy(text.get(..end)?).into_owned())
    }
}
