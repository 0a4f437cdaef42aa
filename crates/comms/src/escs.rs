//! Telemetry of motor controllers (ESCs): which one to ask next, and what follows from the answers.

use crate::comms::Comms;
use crate::services::texts::Words;
use afbc_drivers::esc_telemetry::{EscLine, EscReading, rotor_rad_s};
use afbc_estimator::{OutputFilter, VelocityNotch};
use afbc_flight_core::{Stamped, Ticketed};
use afbc_guidance::{FlightMode, Order};
use afbc_mavlink::MavSeverity;
use afbc_onboard::{
    Configuration, ControlInputs, EscSettings, NotchFollower, Report, RotorFailure, RotorMonitor, RotorNews, give,
};
use afbc_types::ROTORS_MAX;

/// Ticket of orders after a rotor failure. Nobody waits for the answer.
const FAILURE: u8 = 253;

/// Receives and evaluates the telemetry of the motor controllers.
#[derive(Clone, Debug)]
pub struct EscReports {
    line: EscLine,
    monitor: RotorMonitor,
    follower: NotchFollower,
    settings: EscSettings,
}

/// Telemetry that the motor controllers have sent since the last tick.
#[derive(Clone, Copy, Debug, Default)]
pub struct EscsHeard<'a> {
    /// Bytes received on the ESCs' serial telemetry line.
    pub bytes: &'a [u8],
    /// Electrical speed of each rotor \[rev/min\] from bidirectional DSHOT's answer to the last frame.
    pub speeds_rev_min: [Option<u32>; ROTORS_MAX],
}

/// Actions to be taken after a tick.
#[derive(Clone, Debug, Default)]
pub struct EscAction {
    /// Rotor, from 0, whose ESC is to be asked for telemetry in the next frame.
    pub ask: Option<u8>,
    /// New notch filter for the next tick, if its frequency changes.
    pub notch: Option<VelocityNotch>,
    /// Reaction to a rotor's failure, to be [merged](ControlInputs::merge).
    pub inputs: Option<ControlInputs>,
}

impl EscReports {
    /// Creates the receiver of ESC telemetry for a vehicle with this configuration. All parameters must be in range.
    #[must_use]
    pub fn new(configuration: &Configuration) -> Self {
        let Configuration { parameters, rotors, response, curve, escs, .. } = configuration;
        EscReports {
            line: EscLine::new(rotors.count() as u8),
            monitor: RotorMonitor::new(response, curve),
            follower: NotchFollower::new(OutputFilter::of(parameters, rotors.count()).notch().copied()),
            settings: *escs,
        }
    }

    /// Adopts another configuration. The vehicle must be disarmed.
    pub fn adopt(&mut self, configuration: &Configuration) {
        let Configuration { parameters, rotors, response, curve, escs, .. } = configuration;
        (self.monitor, self.settings) = (RotorMonitor::new(response, curve), *escs);
        self.follower.adopt(OutputFilter::of(parameters, rotors.count()).notch().copied());
    }

    /// Returns the serial telemetry line with its counters.
    #[must_use]
    pub fn line(&self) -> &EscLine {
        &self.line
    }
}

/// A measured rotor speed.
struct Turning {
    /// Rotor number, from 0.
    rotor: u8,
    rad_s: Stamped<f32>,
}

impl Comms {
    /// Processes the ESC telemetry since the last tick. To be called after each [`report`](Self::report), even if there
    /// is no telemetry.
    #[inline(never)]
    pub fn escs(&mut self, reports: &mut EscReports, heard: &EscsHeard<'_>, report: &Report) -> EscAction {
        let (now_us, armed, airborne) = (report.time_us, report.mode.armed(), report.guided.airborne);
        let speeds = report.motors.0.as_slice().get(..report.rotors.into()).unwrap_or_default();
        let EscSettings { serial, answers, poles, follows, detects, .. } = reports.settings;
        let hears = serial || answers;
        let mut action = EscAction::default();
        self.status.escs.poles = u16::try_from(poles).unwrap_or(u16::MAX);
        // Without telemetry there is nothing to compare, so the monitor is told that the vehicle is disarmed.
        reports.monitor.commanded(now_us, armed && hears, speeds);
        // If serial telemetry is off, no ESC has been asked, and the line drops all bytes.
        for byte in heard.bytes {
            if let Some((rotor, value)) = reports.line.take(now_us, *byte) {
                let rad_s = Stamped { value: value.speed_rad_s(poles), at_us: now_us };
                self.take_reading(reports, Turning { rotor, rad_s }, value, airborne, &mut action);
            }
        }
        let rotors = if answers { speeds.len() } else { 0 };
        for (rotor, speed) in (0_u8..).zip(heard.speeds_rev_min).take(rotors) {
            let Some(speed) = speed else { continue };
            let last = self.status.escs.readings.get(usize::from(rotor)).copied().flatten();
            let erpm_hundreds = u16::try_from(speed / 100).unwrap_or(u16::MAX);
            // The other values of the reading come over the serial line, if it is connected.
            let value = EscReading { erpm_hundreds, ..last.map_or_else(EscReading::default, |last| last.value) };
            let rad_s = Stamped { value: rotor_rad_s(speed, poles), at_us: now_us };
            self.take_reading(reports, Turning { rotor, rad_s }, value, airborne, &mut action);
        }
        let escs = &mut self.status.escs;
        escs.failures = if detects { reports.monitor.failures() } else { Default::default() };
        action.notch = reports.follower.look(now_us, armed && hears && follows, escs.speeds().take(speeds.len()));
        action.ask = if serial { reports.line.ask(now_us) } else { None };
        action
    }

    /// Takes the reading of one ESC.
    fn take_reading(
        &mut self,
        EscReports { monitor, settings, .. }: &mut EscReports,
        Turning { rotor, rad_s }: Turning,
        value: EscReading,
        airborne: bool,
        action: &mut EscAction,
    ) {
        let escs = &mut self.status.escs;
        if let Some(place) = escs.readings.get_mut(usize::from(rotor)) {
            *place = Some(Stamped { value, at_us: rad_s.at_us });
        }
        escs.counter = escs.counter.wrapping_add(1);
        let Some(news) = monitor.measured(rotor, rad_s).filter(|_| settings.detects) else { return };
        let (severity, words) = words(news);
        self.texts.say(severity, &words);
        if let Some(mode) = mode_after(settings.action).filter(|_| news.failure.is_some() && airborne) {
            let update = action.inputs.get_or_insert(ControlInputs::EMPTY);
            give(update.order(), Ticketed { value: Order::Select(mode), ticket: FAILURE });
        }
    }
}

/// Returns the flight mode for a value of `COM_ACT_FAIL_ACT`. Returns none if the value means a warning only.
fn mode_after(action: u32) -> Option<FlightMode> {
    match action {
        1 => Some(FlightMode::Hold),
        2 => Some(FlightMode::Land),
        3 => Some(FlightMode::Return),
        _ => None,
    }
}

/// Returns severity and text of a change of a rotor's state. The text counts rotors from 1.
fn words(news: RotorNews) -> (MavSeverity, Words) {
    let (severity, what) = match news.failure {
        Some(RotorFailure::Stopped) => (MavSeverity::MAV_SEVERITY_CRITICAL, " has stopped"),
        Some(RotorFailure::Desynchronised) => (MavSeverity::MAV_SEVERITY_CRITICAL, " does not turn as commanded"),
        None => (MavSeverity::MAV_SEVERITY_NOTICE, " turns as commanded again"),
    };
    (severity, Words::of("rotor ").number(u32::from(news.rotor) + 1).and(what))
}
