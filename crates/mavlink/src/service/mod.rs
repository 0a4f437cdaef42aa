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
use crate::message::{FrameFault, MessageFormat, PAYLOAD_MAX};
use crate::wire::{MessageLayout, Unused};
pub use event::{EventError, EventRequest};
pub use extended::{ExtendedAnswer, ExtendedName, ExtendedRequest};
pub use file::{FileOperation, FileRefusal, FtpError};
pub use log::{LogAnswer, LogRequest};
use mavlink::MessageData;
use mavlink::dialects::common::SET_GPS_GLOBAL_ORIGIN_DATA;
pub use serial::SerialControl;
pub use terrain::Terrain;
pub use unanswered::UnansweredRequest;

/// A request for an optional service.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ServiceRequest {
    /// LOG_REQUEST_LIST (117), LOG_REQUEST_DATA (119), LOG_ERASE (121), LOG_REQUEST_END (122), LOGGING_ACK (268).
    Log(LogRequest),
    /// FILE_TRANSFER_PROTOCOL (110).
    File(FileOperation),
    /// PARAM_EXT_REQUEST_READ (320), PARAM_EXT_REQUEST_LIST (321), PARAM_EXT_SET (323).
    Extended(ExtendedRequest),
    /// REQUEST_EVENT (412).
    Event(EventRequest),
    /// SERIAL_CONTROL (126) that requires a response.
    Serial(SerialControl),
    /// TERRAIN_CHECK (135).
    Terrain(Terrain),
    /// SET_GPS_GLOBAL_ORIGIN (48), without the position. It is answered with GPS_GLOBAL_ORIGIN.
    Origin,
    /// GPS_RTCM_DATA, PLAY_TUNE, FOLLOW_TARGET and similar messages, which have no answer.
    Unanswered(UnansweredRequest),
}

/// The refusal of a [`ServiceRequest`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ServiceRefusal {
    /// LOG_ENTRY (118) or LOG_DATA (120), which name no receiver.
    Log(LogAnswer),
    /// FILE_TRANSFER_PROTOCOL (110).
    File(FileRefusal),
    /// PARAM_EXT_VALUE (322) or PARAM_EXT_ACK (324), which name no receiver.
    Extended(ExtendedAnswer),
    /// RESPONSE_EVENT_ERROR (413).
    Event(EventError),
    /// SERIAL_CONTROL (126).
    Serial(SerialControl),
    /// TERRAIN_REPORT (136), which names no receiver.
    Terrain(Terrain),
}

const ORIGIN_ID: u32 = SET_GPS_GLOBAL_ORIGIN_DATA::ID;
/// Fields: position, system; time. Position and time are ignored.
const ORIGIN: MessageLayout<SET_GPS_GLOBAL_ORIGIN_DATA, (Unused<12>, u8, Unused<8>)> = MessageLayout::NEW;

impl ServiceRequest {
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
            _ => return UnansweredRequest::format(id),
        })
    }

    /// Returns the request and its receiver.
    pub(crate) fn read(id: u32, payload: &[u8]) -> Result<(Self, Address), FrameFault> {
        Ok(match id {
            log::LIST_ID | log::DATA_REQUEST_ID | log::ERASE_ID | log::END_ID | log::RECEIVED_ID => {
                let (request, to) = LogRequest::read(id, payload);
                (ServiceRequest::Log(request), to)
            }
            file::ID => {
                let (operation, to) = FileOperation::read(payload)?;
                (ServiceRequest::File(operation), to)
            }
            extended::READ_ID | extended::LIST_ID | extended::SET_ID => {
                let (request, to) = ExtendedRequest::read(id, payload);
                (ServiceRequest::Extended(request), to)
            }
            event::REQUEST_ID => {
                let (request, to) = EventRequest::read(payload);
                (ServiceRequest::Event(request), to)
            }
            serial::ID => match SerialControl::read_line(payload) {
                Some(to) => (ServiceRequest::Unanswered(UnansweredRequest::Shell), to),
                None => {
                    let (serial, to) = SerialControl::read(payload, serial::RESPOND)?;
                    (ServiceRequest::Serial(serial), to)
                }
            },
            terrain::CHECK_ID => (ServiceRequest::Terrain(Terrain::read_check(payload)), Address::default()),
            ORIGIN_ID => {
                let (_, system, _) = ORIGIN.read(payload);
                (ServiceRequest::Origin, Address { system, component: 0 })
            }
            _ if UnansweredRequest::format(id).is_some() => {
                let (request, to) = UnansweredRequest::read(id, payload);
                (ServiceRequest::Unanswered(request), to)
            }
            _ => return Err(FrameFault::Unknown),
        })
    }

    pub(crate) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        match self {
            ServiceRequest::Log(request) => request.write(payload),
            ServiceRequest::File(operation) => operation.write(payload),
            ServiceRequest::Extended(request) => request.write(payload),
            ServiceRequest::Event(request) => request.write(payload),
            ServiceRequest::Serial(serial) => serial.write(serial::RESPOND, Address::default(), payload),
            ServiceRequest::Terrain(terrain) => terrain.write_check(payload),
            ServiceRequest::Origin => ORIGIN.write(&(Unused, 0, Unused), payload),
            ServiceRequest::Unanswered(request) => request.write(payload),
        }
    }
}

impl ServiceRefusal {
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
    pub(crate) fn read(id: u32, payload: &[u8]) -> Result<(Self, Address), FrameFault> {
        Ok(match id {
            log::ENTRY_ID | log::DATA_ID => (ServiceRefusal::Log(LogAnswer::read(id, payload)), Address::default()),
            file::ID => {
                let (refusal, to) = FileRefusal::read(payload)?;
                (ServiceRefusal::File(refusal), to)
            }
            extended::VALUE_ID | extended::ACK_ID => {
                (ServiceRefusal::Extended(ExtendedAnswer::read(id, payload)), Address::default())
            }
            event::ERROR_ID => {
                let (error, to) = EventError::read(payload);
                (ServiceRefusal::Event(error), to)
            }
            serial::ID => {
                let (serial, to) = SerialControl::read(payload, serial::REPLY)?;
                (ServiceRefusal::Serial(serial), to)
            }
            terrain::REPORT_ID => (ServiceRefusal::Terrain(Terrain::read_report(payload)), Address::default()),
            _ => return Err(FrameFault::Unknown),
        })
    }

    pub(crate) fn write(&self, to: Address, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        match self {
            ServiceRefusal::Log(answer) => answer.write(payload),
            ServiceRefusal::File(refusal) => refusal.write(to, payload),
            ServiceRefusal::Extended(answer) => answer.write(payload),
            ServiceRefusal::Event(error) => error.write(to, payload),
            ServiceRefusal::Serial(serial) => serial.write(serial::REPLY, to, payload),
            ServiceRefusal::Terrain(terrain) => terrain.write_report(payload),
        }
    }
}
