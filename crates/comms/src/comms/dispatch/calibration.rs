//! Handling of calibration commands.

use super::{Comms, ParameterTask};
use crate::services::calibration::{Calibrator, Step, name};
use crate::services::commands::BUSY;
use crate::services::texts::Words;
use afbc_calibration::RawSample;
use afbc_flight_core::Refusal;
use afbc_mavlink::{Address, CalibrationRequest, CommandResult, MavSeverity, ParameterRequest};
use afbc_onboard::parameters::{Kind, ParameterTable};

/// Beginnings of the texts that tell stations the state of a calibration.
const STARTED: &str = "[cal] calibration started: 2 ";
const DONE: &str = "[cal] calibration done: ";
const FAILED: &str = "[cal] calibration failed: ";
const CANCELLED: &str = "[cal] calibration cancelled";

impl Comms {
    /// Answers MAV_CMD_PREFLIGHT_CALIBRATION.
    pub(super) fn ask_calibration(&mut self, what: CalibrationRequest) -> CommandResult {
        let info = MavSeverity::MAV_SEVERITY_INFO;
        if !self.calibrates {
            return CommandResult::Unsupported;
        }
        if what == CalibrationRequest::Cancel {
            if self.calibration.active.take().is_some() {
                self.texts.put(info, CANCELLED);
            }
            return CommandResult::Accepted;
        }
        if self.status.mode.armed() {
            return CommandResult::Refused(Refusal::AlreadyArmed as i32);
        }
        if self.calibration.active.is_some() {
            return CommandResult::Refused(BUSY);
        }
        self.calibration.number = self.calibration.number.wrapping_add(1);
        self.calibration.active = Some(what);
        self.texts.say(info, &Words::of(STARTED).and(name(what)));
        CommandResult::Accepted
    }

    /// Advances the calibration that a station has asked for.
    pub(in crate::comms) fn advance_calibration(
        &mut self,
        calibrator: &mut Calibrator,
        sample: Option<RawSample>,
        table: &ParameterTable,
    ) {
        let Some(what) = self.calibration.active else { return calibrator.stop() };
        if self.status.mode.armed() {
            return self.end_calibration(calibrator, Err("armed"));
        }
        let (info, texts) = (MavSeverity::MAV_SEVERITY_INFO, &mut self.texts);
        let now = (table.configuration(), self.now_us);
        match calibrator.step((self.calibration.number, what), sample, now, |words| texts.say(info, words)) {
            Step::Continue => (),
            Step::Set(name, value) => {
                // The value is set as if by a station: it is checked, stored, adopted and sent to all stations.
                let kind = Kind::Real32.number();
                let request = ParameterRequest::Set { name: name.to_bytes(), value: value.to_le_bytes(), kind };
                self.parameter_tasks.push_back(ParameterTask::Ask(request, Address::default())).ok();
            }
            Step::Finished => {
                // The parameter service may have refused a value, so the table is checked.
                let is_set = |(name, value)| table.get(name).is_some_and(|parameter| parameter.value == value);
                let all_set = calibrator.found().all(is_set);
                self.end_calibration(calibrator, all_set.then_some(what).ok_or("values not accepted"));
            }
            Step::Failed(reason) => self.end_calibration(calibrator, Err(reason)),
        }
    }

    fn end_calibration(&mut self, calibrator: &mut Calibrator, result: Result<CalibrationRequest, &'static str>) {
        calibrator.stop();
        self.calibration.active = None;
        match result {
            Ok(what) => self.texts.say(MavSeverity::MAV_SEVERITY_INFO, &Words::of(DONE).and(name(what))),
            Err(reason) => self.texts.say(MavSeverity::MAV_SEVERITY_WARNING, &Words::of(FAILED).and(reason)),
        }
    }
}
