//! Streaming of a log while it is recorded: LOGGING_DATA and LOGGING_DATA_ACKED.

use crate::address::Address;
use crate::message::PAYLOAD_MAX;
use crate::wire::MessageLayout;
use mavlink::dialects::common::{LOGGING_DATA_ACKED_DATA, LOGGING_DATA_DATA};

/// Largest number of bytes in one part of a streamed log.
pub const STREAM_DATA_MAX: usize = 249;
/// Value for "no record begins in this part".
const NONE: u8 = u8::MAX;

/// LOGGING_DATA (266) or LOGGING_DATA_ACKED (267): a part of a log that is streamed while it is recorded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StreamedLog {
    /// Receiver.
    pub to: Address,
    /// Sequence number, which both messages share.
    pub sequence: u16,
    /// Number of bytes.
    pub length: u8,
    /// Offset at which the first record begins, if one does.
    pub first_record: Option<u8>,
    /// Data; bytes beyond `length` have no meaning.
    pub data: [u8; STREAM_DATA_MAX],
    /// True for LOGGING_DATA_ACKED, which the receiver must acknowledge by LOGGING_ACK.
    pub to_be_acknowledged: bool,
}

/// Fields: sequence number; receiver, length, first record, data.
type StreamedLogFields = (u16, Address, u8, u8, [u8; STREAM_DATA_MAX]);
pub(super) const SENT: MessageLayout<LOGGING_DATA_DATA, StreamedLogFields> = MessageLayout::NEW;
pub(super) const ACKED: MessageLayout<LOGGING_DATA_ACKED_DATA, StreamedLogFields> = MessageLayout::NEW;

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
