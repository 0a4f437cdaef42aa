//! Handling of parameter requests, and who may change parameters.

use super::{Comms, ParameterTask, Reply};
use crate::services::commands::BUSY;
use crate::services::texts::Words;
use afbc_flight_core::Refusal;
use afbc_mavlink::{Address, CommandResult, MavSeverity, ParameterRequest, Storage};
use afbc_onboard::ControlInputs;
use afbc_onboard::parameters::{ParameterTable, RecordChange};

impl Comms {
    /// Queues a parameter request. For a station that is not in control, setting becomes reading: it is sent the old
    /// value.
    pub(super) fn parameter(&mut self, request: ParameterRequest, from: Address, inputs: &mut ControlInputs) {
        let request = match request {
            ParameterRequest::Set { name, .. } if !self.may(from, inputs) => ParameterRequest::ReadName(name),
            request => request,
        };
        self.parameter_tasks.push_back(ParameterTask::Ask(request, from)).ok();
    }

    /// Answers MAV_CMD_PREFLIGHT_STORAGE. Loading and saving do nothing, since each change is stored and adopted at
    /// once.
    pub(super) fn storage(&mut self, storage: Storage) -> CommandResult {
        match storage {
            Storage::Load | Storage::Save => CommandResult::Accepted,
            Storage::Reset if self.status.mode.armed() => CommandResult::Refused(Refusal::AlreadyArmed as i32),
            Storage::Reset if self.parameter_tasks.push_back(ParameterTask::Restore).is_err() => {
                CommandResult::Refused(BUSY)
            }
            Storage::Reset => CommandResult::Accepted,
        }
    }

    /// Handles queued parameter requests until one changes `table`. Returns that change.
    pub(crate) fn grant(&mut self, table: &mut ParameterTable) -> Option<RecordChange> {
        let disarmed = !self.status.mode.armed();
        while let Some(task) = self.parameter_tasks.pop_front() {
            let (change, refused) = match task {
                ParameterTask::Ask(request, from) => {
                    let heard = self.parameters.hear(request, table, disarmed);
                    if let Some(error) = heard.error {
                        self.reply(Reply::ParameterError(error, from));
                    }
                    (heard.change, heard.refused)
                }
                ParameterTask::Restore => match self.parameters.restore(table, disarmed) {
                    Ok(change) => (Some(change), None),
                    Err(reason) => (None, Some(reason)),
                },
            };
            if let Some(reason) = refused {
                self.texts.say(MavSeverity::MAV_SEVERITY_WARNING, &Words::of(reason.as_str()));
            }
            if change.is_some() {
                return change;
            }
        }
        None
    }
}
