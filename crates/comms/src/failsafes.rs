//! Reports of failsafes. Each one is announced once as a text, and shown in the heartbeat even if it was short.

use afbc_flight_core::{EndReason, Mode};
use afbc_mavlink::MavSeverity;
use afbc_onboard::Report;

/// Severity and text of a report.
pub(crate) type Notice = (MavSeverity, &'static str);

const COASTING: Notice = (MavSeverity::MAV_SEVERITY_WARNING, "no fresh state for 20 ms: coasting");
const DESCENDING: Notice = (MavSeverity::MAV_SEVERITY_CRITICAL, "no state for 0.25 s: descending");
const STATE_LOST: Notice = (MavSeverity::MAV_SEVERITY_EMERGENCY, "no state for 2.25 s: motors stopped");
const TUMBLED: Notice = (MavSeverity::MAV_SEVERITY_EMERGENCY, "tumbled: motors stopped");
const SHAKEN: Notice = (MavSeverity::MAV_SEVERITY_WARNING, "vibration above 4.9 m/s2: check rotors and mounts");
const OBSERVED: Notice = (MavSeverity::MAV_SEVERITY_CRITICAL, "IMU failed: flying on the tracker's poses alone");

/// Failsafes that were active in the last tick.
#[derive(Default)]
pub(crate) struct Failsafes {
    mode: Mode,
    observed: bool,
    shaken: bool,
    /// Number of the last tick in which a failsafe was active.
    last: Option<u64>,
}

impl Failsafes {
    /// Returns the notices of failsafes that begin in the tick numbered `tick`.
    pub(crate) fn watch(&mut self, report: &Report, tick: u64) -> impl Iterator<Item = Notice> + use<> {
        let Report { mode, ended, health, .. } = report;
        let entered = (*mode != self.mode).then_some(*mode);
        let given_up = matches!(ended, Some(EndReason::StateLost | EndReason::Tumbled));
        let notices = [
            (entered == Some(Mode::Coasting)).then_some(COASTING),
            (entered == Some(Mode::Descending)).then_some(DESCENDING),
            (health.observed && !self.observed).then_some(OBSERVED),
            // Vibration is no failsafe: it is only announced.
            (report.shaken && !self.shaken).then_some(SHAKEN),
            (*ended == Some(EndReason::StateLost)).then_some(STATE_LOST),
            (*ended == Some(EndReason::Tumbled)).then_some(TUMBLED),
        ];
        let failsafe = given_up || health.observed || report.guided.failsafe.is_some();
        if matches!(mode, Mode::Coasting | Mode::Descending) || failsafe {
            self.last = Some(tick);
        }
        (self.mode, self.observed, self.shaken) = (*mode, health.observed, report.shaken);
        notices.into_iter().flatten()
    }

    /// Returns true if a failsafe was active within the last `ticks` ticks.
    pub(crate) fn within(&self, ticks: u64, tick: u64) -> bool {
        self.last.is_some_and(|last| tick.saturating_sub(last) < ticks)
    }
}
