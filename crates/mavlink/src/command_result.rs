//! Answers to commands: COMMAND_ACK.

use crate::address::Address;
use crate::message::{FrameFault, MessageFormat, PAYLOAD_MAX};
use crate::wire::MessageLayout;
use mavlink::dialects::common::{COMMAND_ACK_DATA, MavResult};

/// An answer to a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum CommandResult {
    /// The command was carried out.
    Accepted,
    /// Refused for now; `result_param2` holds the number of the reason.
    Refused(i32),
    /// The command has invalid parameters.
    Denied,
    /// The command is unknown.
    Unsupported,
    /// The command failed, or its outcome is unknown.
    Failed,
    /// The command is still running; another answer will follow.
    InProgress,
}

/// Fields: command, result, progress, `result_param2`, receiver.
const ACK: MessageLayout<COMMAND_ACK_DATA, (u16, u8, u8, i32, Address)> = MessageLayout::NEW;

const ACCEPTED: u8 = MavResult::MAV_RESULT_ACCEPTED as u8;
const REFUSED: u8 = MavResult::MAV_RESULT_TEMPORARILY_REJECTED as u8;
const DENIED: u8 = MavResult::MAV_RESULT_DENIED as u8;
const UNSUPPORTED: u8 = MavResult::MAV_RESULT_UNSUPPORTED as u8;
const FAILED: u8 = MavResult::MAV_RESULT_FAILED as u8;
const IN_PROGRESS: u8 = MavResult::MAV_RESULT_IN_PROGRESS as u8;
/// Value for unknown progress.
const SOME: u8 = u8::MAX;

pub(crate) fn format() -> MessageFormat {
    ACK.format()
}

/// Returns command, answer and receiver. Accepts any command of any dialect.
pub(crate) fn read(payload: &[u8]) -> Result<(u16, CommandResult, Address), FrameFault> {
    let (command, result, _, reason, to) = ACK.read(payload);
    let answer = match result {
        ACCEPTED => CommandResult::Accepted,
        REFUSED => CommandResult::Refused(reason),
        DENIED => CommandResult::Denied,
        UNSUPPORTED => CommandResult::Unsupported,
        FAILED => CommandResult::Failed,
        IN_PROGRESS => CommandResult::InProgress,
        _ => return Err(FrameFault::Unsupported),
    };
    Ok((command, answer, to))
}

pub(crate) fn write(command: u16, answer: CommandResult, to: Address, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
    let (result, progress, reason) = match answer {
        CommandResult::Accepted => (ACCEPTED, 0, 0),
        CommandResult::Refused(reason) => (REFUSED, 0, reason),
        CommandResult::Denied => (DENIED, 0, 0),
        CommandResult::Unsupported => (UNSUPPORTED, 0, 0),
        CommandResult::Failed => (FAILED, 0, 0),
        CommandResult::InProgress => (IN_PROGRESS, SOME, 0),
    };
    ACK.write(&(command, result, progress, reason, to), payload)
}
