//! Control of the vehicle: CHANGE_OPERATOR_CONTROL and its answer.

use crate::message::{FrameFault, MessageFormat, PAYLOAD_MAX};
use crate::wire::MessageLayout;
use mavlink::MessageData;
use mavlink::dialects::common::{CHANGE_OPERATOR_CONTROL_ACK_DATA, CHANGE_OPERATOR_CONTROL_DATA};

/// A ground station's request by CHANGE_OPERATOR_CONTROL (5). Version and passkey are ignored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ControlRequest {
    /// Take control.
    Take,
    /// Release control.
    Release,
}

/// CHANGE_OPERATOR_CONTROL_ACK (6).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ControlAnswer {
    /// System id of the requesting station.
    pub station: u8,
    /// The request.
    pub control: ControlRequest,
    /// False if another station is in control.
    pub granted: bool,
}

/// Fields: system, request, version, passkey.
const CHANGE: MessageLayout<CHANGE_OPERATOR_CONTROL_DATA, (u8, u8, u8, [u8; 25])> = MessageLayout::NEW;
const ANSWER: MessageLayout<CHANGE_OPERATOR_CONTROL_ACK_DATA, (u8, u8, u8)> = MessageLayout::NEW;
/// Answer "already under control".
const REFUSED: u8 = 3;

impl ControlRequest {
    pub(crate) fn format() -> MessageFormat {
        CHANGE.format()
    }

    /// Returns the request and the id of its target system.
    pub(crate) fn read(payload: &[u8]) -> Result<(Self, u8), FrameFault> {
        let (system, control, ..) = CHANGE.read(payload);
        Ok((Self::of(control)?, system))
    }

    pub(crate) fn write(self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        CHANGE.write(&(0, self as u8, 0, [0; 25]), payload)
    }

    fn of(control: u8) -> Result<Self, FrameFault> {
        match control {
            0 => Ok(ControlRequest::Take),
            1 => Ok(ControlRequest::Release),
            _ => Err(FrameFault::Malformed),
        }
    }
}

impl ControlAnswer {
    pub(crate) fn format() -> MessageFormat {
        ANSWER.format()
    }

    pub(crate) fn read(payload: &[u8]) -> Result<Self, FrameFault> {
        let (station, control, answer) = ANSWER.read(payload);
        Ok(ControlAnswer { station, control: ControlRequest::of(control)?, granted: answer == 0 })
    }

    pub(crate) fn write(self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        let answer = if self.granted { 0 } else { REFUSED };
        ANSWER.write(&(self.station, self.control as u8, answer), payload)
    }
}

/// Id of CHANGE_OPERATOR_CONTROL.
pub(crate) const CHANGE_ID: u32 = CHANGE_OPERATOR_CONTROL_DATA::ID;
/// Id of CHANGE_OPERATOR_CONTROL_ACK.
pub(crate) const ANSWER_ID: u32 = CHANGE_OPERATOR_CONTROL_ACK_DATA::ID;
