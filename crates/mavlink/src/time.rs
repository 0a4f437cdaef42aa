//! Clocks and round-trip times: TIMESYNC, PING and SYSTEM_TIME, in both directions.

use crate::address::Address;
use crate::message::{FrameFault, MessageFormat, PAYLOAD_MAX};
use crate::wire::MessageLayout;
use mavlink::MessageData;
use mavlink::dialects::common::{PING_DATA, SYSTEM_TIME_DATA, TIMESYNC_DATA};

/// A message about time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimeMessage {
    /// TIMESYNC (111).
    Sync {
        /// Time of the answering clock; 0 in a request \[ns\].
        answered_ns: i64,
        /// Time of the requesting clock \[ns\].
        asked_ns: i64,
        /// Receiver; zeros if the sender names none.
        to: Address,
    },
    /// PING (4).
    Ping {
        /// Time of the sender's clock \[us\].
        time_us: u64,
        /// Number of the ping.
        number: u32,
        /// Zeros in a request; in an answer, the address of the requester.
        to: Address,
    },
    /// SYSTEM_TIME (2).
    Time {
        /// Time since 1970, 0 if unknown \[us\].
        unix_us: u64,
        /// Time since power-up \[ms\].
        boot_ms: u32,
    },
}

const SYNC: MessageLayout<TIMESYNC_DATA, (i64, i64, Address)> = MessageLayout::NEW;
const PING: MessageLayout<PING_DATA, (u64, u32, Address)> = MessageLayout::NEW;
const TIME: MessageLayout<SYSTEM_TIME_DATA, (u64, u32)> = MessageLayout::NEW;

impl TimeMessage {
    pub(crate) fn format(id: u32) -> Option<MessageFormat> {
        Some(match id {
            TIMESYNC_DATA::ID => SYNC.format(),
            PING_DATA::ID => PING.format(),
            SYSTEM_TIME_DATA::ID => TIME.format(),
            _ => return None,
        })
    }

    pub(crate) fn read(id: u32, payload: &[u8]) -> Result<Self, FrameFault> {
        Ok(match id {
            TIMESYNC_DATA::ID => {
                let (answered_ns, asked_ns, to) = SYNC.read(payload);
                TimeMessage::Sync { answered_ns, asked_ns, to }
            }
            PING_DATA::ID => {
                let (time_us, number, to) = PING.read(payload);
                TimeMessage::Ping { time_us, number, to }
            }
            SYSTEM_TIME_DATA::ID => {
                let (unix_us, boot_ms) = TIME.read(payload);
                TimeMessage::Time { unix_us, boot_ms }
            }
            _ => return Err(FrameFault::Unknown),
        })
    }

    pub(crate) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        match *self {
            TimeMessage::Sync { answered_ns, asked_ns, to } => SYNC.write(&(answered_ns, asked_ns, to), payload),
            TimeMessage::Ping { time_us, number, to } => PING.write(&(time_us, number, to), payload),
            TimeMessage::Time { unix_us, boot_ms } => TIME.write(&(unix_us, boot_ms), payload),
        }
    }
}
