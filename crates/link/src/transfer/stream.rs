//! A log while it is made: LOGGING_DATA and LOGGING_DATA_ACKED.

use crate::address::Address;
use crate::message::PAYLOAD_MAX;
use crate::wire::Layout;
use mavlink::dialects::common::{LOGGING_DATA_ACKED_DATA, LOGGING_DATA_DATA};

/// Most bytes in one part of a streamed log.
pub const STREAM_DATA_MAX: usize = 249;
/// What stands for "no record begins here".
const NONE: u8 = u8::MAX;

/// LOGGING_DATA (266) or LOGGING_DATA_ACKED (267): a part of a log that is made while it is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StreamedLog {
    /// Who gets it.
    pub to: Address,
    /// Its number; both messages are counted together.
    pub sequence: u16,
    /// Number of bytes.
    pub length: u8,
    /// Where in it the first record begins, if one does.
    pub first_record: Option<u8>,
    /// The bytes.
    pub data: [u8; STREAM_DATA_MAX],
    /// True of LOGGING_DATA_ACKED, which LOGGING_ACK answers.
    pub to_be_acknowledged: bool,
}

/// Number; receiver, length, first record, bytes.
type Fields = (u16, Address, u8, u8, [u8; STREAM_DATA_MAX]);
pub(super) const SENT: Layout<LOGGING_DATA_DATA, Fields> = Layout::NEW;
pub(super) const ACKED: Layout<LOGGING_DATA_ACKED_DATA, Fields> = Layout::NEW;

impl StreamedLog {
    pub(super) fn read(payload: &[u8], to_be_acknowledged: bool) -> Self {
        let (sequence, to, length, first, data) = SENT.read(payload);
        let first_record = (first != NONE).then_some(first);
        StreamedLog { to, sequence, length, first_record, data, to_be_acknowledged }
    }

    pub(super) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        let StreamedLog { to, sequence, length, first_record, data, to_be_acknowledged } = *self;
        let fields = (sequence, to, length, first_record.unwrap_or(NONE), data);
        if to_be_acknowledged { ACKED.write(&fields, payload) } else { SENT.write(&fields, payload) }
    }
}
