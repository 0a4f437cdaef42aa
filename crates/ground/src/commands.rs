//! Commands and their answers. MAVLink's answer gives only the command's number, so one command per number is open at a
//! time.

use crate::retry::{RetriedRequest, RetryAction, RetryPolicy};
use afbc_mavlink::{CommandResult, MavCmd, VehicleCommand};
use std::collections::BTreeMap;

/// A command that no vehicle knows: it is answered at once and changes nothing.
pub const PING: VehicleCommand = VehicleCommand::Other(MavCmd::MAV_CMD_USER_5 as u16);

/// State of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CommandState {
    /// No final answer yet; the vehicle may be working on it.
    Waiting,
    /// The vehicle has answered.
    Answered {
        /// The final answer, never [`CommandResult::InProgress`].
        answer: CommandResult,
        /// Time since the last try, or since the last [`CommandResult::InProgress`] \[ms\].
        after_ms: u64,
    },
    /// The vehicle has not answered in time.
    Silent,
}

struct SentCommand {
    command: VehicleCommand,
    request: RetriedRequest,
    state: CommandState,
}

#[derive(Default)]
pub(crate) struct PendingCommands(BTreeMap<u16, SentCommand>);

impl PendingCommands {
    /// Stores a command. It replaces an earlier one of the same number, whose answer no longer counts.
    pub(crate) fn give(&mut self, command: VehicleCommand, retry_policy: RetryPolicy, now_ms: u64) {
        let request = RetriedRequest::new(retry_policy, now_ms);
        self.0.insert(command.id(), SentCommand { command, request, state: CommandState::Waiting });
    }

    pub(crate) fn state(&self, command: VehicleCommand) -> Option<CommandState> {
        self.0.get(&command.id()).map(|given| given.state)
    }

    pub(crate) fn hear(&mut self, id: u16, answer: CommandResult, now_ms: u64) {
        let Some(given) = self.0.get_mut(&id).filter(|given| given.state == CommandState::Waiting) else { return };
        if answer == CommandResult::InProgress {
            return given.request.goes_on(now_ms);
        }
        given.state = CommandState::Answered { answer, after_ms: given.request.waited_ms(now_ms) };
    }

    /// Passes to `say` the commands that are due to be repeated.
    pub(crate) fn update(&mut self, now_ms: u64, mut say: impl FnMut(VehicleCommand)) {
        for given in self.0.values_mut().filter(|given| given.state == CommandState::Waiting) {
            match given.request.due(now_ms) {
                RetryAction::Nothing => (),
                RetryAction::Again => say(given.command),
                RetryAction::GiveUp => given.state = CommandState::Silent,
            }
        }
    }
}
