//! Messages that have no answer and that the vehicle cannot use. They are read so that the vehicle can say so.

use super::serial;
use crate::address::Address;
use crate::message::{MessageFormat, PAYLOAD_MAX, put};
use crate::wire::{MessageLayout, Unused};
use mavlink::MessageData;
use mavlink::dialects::common::{FOLLOW_TARGET_DATA, GPS_INJECT_DATA_DATA, GPS_RTCM_DATA_DATA, PLAY_TUNE_DATA};
use mavlink::dialects::common::{PLAY_TUNE_V2_DATA, TuneFormat};

/// Content of an unusable message without an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnansweredRequest {
    /// GNSS corrections: GPS_RTCM_DATA (233), GPS_INJECT_DATA (123).
    Corrections,
    /// A tune: PLAY_TUNE (258), PLAY_TUNE_V2 (400).
    Tune,
    /// Following a target: FOLLOW_TARGET (144).
    Follow,
    /// A shell line without the flag that requires a reply: SERIAL_CONTROL (126).
    Shell,
}

const INJECT: MessageLayout<GPS_INJECT_DATA_DATA, (Address, Unused<111>)> = MessageLayout::NEW;
/// Fields: receiver, tune; more of the tune in an extension field.
const TUNE: MessageLayout<PLAY_TUNE_DATA, (Address, Unused<30>, Unused<200>)> = MessageLayout::NEW;
/// Fields: format of the tune, receiver, tune.
const TUNE_V2: MessageLayout<PLAY_TUNE_V2_DATA, (u32, Address, Unused<248>)> = MessageLayout::NEW;

impl UnansweredRequest {
    pub(super) fn format(id: u32) -> Option<MessageFormat> {
        Some(match id {
            GPS_RTCM_DATA_DATA::ID => MessageFormat::of::<GPS_RTCM_DATA_DATA>(0),
            GPS_INJECT_DATA_DATA::ID => INJECT.format(),
            FOLLOW_TARGET_DATA::ID => MessageFormat::of::<FOLLOW_TARGET_DATA>(0),
            PLAY_TUNE_DATA::ID => TUNE.format(),
            PLAY_TUNE_V2_DATA::ID => TUNE_V2.format(),
            _ => return None,
        })
    }

    /// Returns the kind of message and its receiver.
    pub(super) fn read(id: u32, payload: &[u8]) -> (Self, Address) {
        match id {
            GPS_INJECT_DATA_DATA::ID => (UnansweredRequest::Corrections, INJECT.read(payload).0),
            FOLLOW_TARGET_DATA::ID => (UnansweredRequest::Follow, Address::default()),
            PLAY_TUNE_DATA::ID => (UnansweredRequest::Tune, TUNE.read(payload).0),
            PLAY_TUNE_V2_DATA::ID => (UnansweredRequest::Tune, TUNE_V2.read(payload).1),
            _ => (UnansweredRequest::Corrections, Address::default()),
        }
    }

    pub(super) fn write(self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        match self {
            UnansweredRequest::Corrections => put(&GPS_RTCM_DATA_DATA::DEFAULT, payload),
            UnansweredRequest::Tune => {
                let kind = TuneFormat::TUNE_FORMAT_QBASIC1_1 as u32;
                TUNE_V2.write(&(kind, Address::default(), Unused), payload)
            }
            UnansweredRequest::Follow => put(&FOLLOW_TARGET_DATA::DEFAULT, payload),
            UnansweredRequest::Shell => serial::write_line(payload),
        }
    }
}
