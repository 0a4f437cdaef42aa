//! Requests for services that not every vehicle has, and their refusals; one file per service. Only the fields that a
//! refusal needs are read and written.

mod event;
mod extended;
mod file;
mod log;
mod serial;
mod terrain;
mod unanswered;

use crate::address::Address;
use crate::message::{Fault, MessageFormat, PAYLOAD_MAX};
use crate::wire::{Layout, Unused};
pub use event::{EventError, EventRequest};
pub use extended::{ExtendedAnswer, ExtendedName, ExtendedRequest};
pub use file::{FileOperation, FileRefusal, FtpError};
pub use log::{LogAnswer, LogRequest};
use mavlink::MessageData;
use mavlink::dialects::common::SET_GPS_GLOBAL_ORIGIN_DATA;
pub use serial::Serial;
pub use terrain::Terrain;
pub use unanswered::UnansweredWish;

/// A request for an optional service.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Question {
    /// LOG_REQUEST_LIST (117), LOG_REQUEST_DATA (119), LOG_ERASE (121), LOG_REQUEST_END (122), LOGGING_ACK (268).
    Log(LogRequest),
    /// FILE_TRANSFER_PROTOCOL (110).
    File(FileOperation),
    /// PARAM_EXT_REQUEST_READ (320), PARAM_EXT_REQUEST_LIST (321), PARAM_EXT_SET (323).
    Extended(ExtendedRequest),
    /// REQUEST_EVENT (412).
    Event(EventRequest),
    /// SERIAL_CONTROL (126) that requires a response.
    Serial(Serial),
    /// TERRAIN_CHECK (135).
    Terrain(Terrain),
    /// SET_GPS_GLOBAL_ORIGIN (48), without the position. It is answered with GPS_GLOBAL_ORIGIN.
    Origin,
    /// GPS_RTCM_DATA, PLAY_TUNE, FOLLOW_TARGET and similar messages, which have no answer.
    Unanswered(UnansweredWish),
}

/// The refusal of a [`Question`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum QuestionRefusal {
    /// LOG_ENTRY (118) or LOG_DATA (120), which name no receiver.
    Log(LogAnswer),
    /// FILE_TRANSFER_PROTOCOL (110).
    File(FileRefusal),
    /// PARAM_EXT_VALUE (322) or PARAM_EXT_ACK (324), which name no receiver.
    Extended(ExtendedAnswer),
    /// RESPONSE_EVENT_ERROR (413).
    Event(EventError),
    /// SERIAL_CONTROL (126).
    Serial(Serial),
    /// TERRAIN_REPORT (136), which names no receiver.
    Terrain(Terrain),
}

const ORIGIN_ID: u32 = SET_GPS_GLOBAL_ORIGIN_DATA::ID;
/// Fields: position, system; time. Position and time are ignored.
const ORIGIN: Layout<SET_GPS_GLOBAL_ORIGIN_DATA, (Unused<12>, u8, Unused<8>)> = Layout::NEW;

impl Question {
    pub(crate) fn format(id: u32) -> Option<MessageFormat> {
        Some(match id {
            log::LIST_ID | log::DATA_REQUEST_ID | log::ERASE_ID | log::END_ID | log::RECEIVED_ID => {
                return LogRequest::format(id);
            }
            file::ID => file::format(),
            extended::READ_ID | extended::LIST_ID | extended::SET_ID => return ExtendedRequest::format(id),
            event::REQUEST_ID => EventRequest::format(),
            serial::ID => serial::format(),
            terrain::CHECK_ID => terrain::check_format(),
            ORIGIN_ID => ORIGIN.format(),
            _ => return UnansweredWish::format(id),
        })
    }

    /// Returns the request and its receiver.
    pub(crate) fn read(id: u32, payload: &[u8]) -> Result<(Self, Address), Fault> {
        Ok(match id {
            log::LIST_ID | log::DATA_REQUEST_ID | log::ERASE_ID | log::END_ID | log::RECEIVED_ID => {
                let (request, to) = LogRequest::read(id, payload);
                (Question::Log(request), to)
            }
            file::ID => {
                let (operation, to) = FileOperation::read(payload)?;
                (Question::File(operation), to)
            }
            extended::READ_ID | extended::LIST_ID | extended::SET_ID => {
                let (request, to) = ExtendedRequest::read(id, payload);
                (Question::Extended(request), to)
            }
            event::REQUEST_ID => {
                let (request, to) = EventRequest::read(payload);
                (Question::Event(request), to)
            }
            serial::ID => match Serial::read_line(payload) {
                Some(to) => (Question::Unanswered(UnansweredWish::Shell), to),
                None => {
                    let (serial, to) = Serial::read(payload, serial::RESPOND)?;
                    (Question::Serial(serial), to)
                }
            },
            terrain::CHECK_ID => (Question::Terrain(Terrain::read_check(payload)), Address::default()),
            ORIGIN_ID => {
                let (_, system, _) = ORIGIN.read(payload);
                (Question::Origin, Address { system, component: 0 })
            }
            _ if UnansweredWish::format(id).is_some() => {
                let (wish, to) = UnansweredWish::read(id, payload);
                (Question::Unanswered(wish), to)
            }
            _ => return Err(Fault::Unknown),
        })
    }

    pub(crate) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        match self {
            Question::Log(request) => request.write(payload),
            Question::File(operation) => operation.write(payload),
            Question::Extended(request) => request.write(payload),
            Question::Event(request) => request.write(payload),
            Question::Serial(serial) => serial.write(serial::RESPOND, Address::default(), payload),
            Question::Terrain(terrain) => terrain.write_check(payload),
            Question::Origin => ORIGIN.write(&(Unused, 0, Unused), payload),
            Question::Unanswered(wish) => wish.write(payload),
        }
    }
}

impl QuestionRefusal {
    pub(crate) fn format(id: u32) -> Option<MessageFormat> {
        Some(match id {
            log::ENTRY_ID | log::DATA_ID => return LogAnswer::format(id),
            file::ID => file::format(),
            extended::VALUE_ID | extended::ACK_ID => return ExtendedAnswer::format(id),
            event::ERROR_ID => EventError::format(),
            serial::ID => serial::format(),
            terrain::REPORT_ID => terrain::report_format(),
            _ => return None,
        })
    }

    /// Returns the refusal and its receiver.
    pub(crate) fn read(id: u32, payload: &[u8]) -> Result<(Self, Address), Fault> {
        Ok(match id {
            log::ENTRY_ID | log::DATA_ID => (QuestionRefusal::Log(LogAnswer::read(id, payload)), Address::default()),
            file::ID => {
                let (refusal, to) = FileRefusal::read(payload)?;
                (QuestionRefusal::File(refusal), to)
            }
            extended::VALUE_ID | extended::ACK_ID => {
                (QuestionRefusal::Extended(ExtendedAnswer::read(id, payload)), Address::default())
            }
            event::ERROR_ID => {
                let (error, to) = EventError::read(payload);
                (QuestionRefusal::Event(error), to)
            }
            serial::ID => {
                let (serial, to) = Serial::read(payload, serial::REPLY)?;
                (QuestionRefusal::Serial(serial), to)
            }
            terrain::REPORT_ID => (QuestionRefusal::Terrain(Terrain::read_report(payload)), Address::default()),
            _ => return Err(Fault::Unknown),
        })
    }

    pub(crate) fn write(&self, to: Address, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        match self {
            QuestionRefusal::Log(answer) => answer.write(payload),
            QuestionRefusal::File(refusal) => refusal.write(to, payload),
            QuestionRefusal::Extended(answer) => answer.write(payload),
            QuestionRefusal::Event(error) => error.write(to, payload),
            QuestionRefusal::Serial(serial) => serial.write(serial::REPLY, to, payload),
            QuestionRefusal::Terrain(terrain) => terrain.write_report(payload),
        }
    }
}
