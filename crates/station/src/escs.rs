//! Motor controllers that answer, beside the stations: who is asked, and what follows from what they tell.

use crate::comms::Comms;
use crate::services::texts::Words;
use afbc_drivers::esc_telemetry::{EscLine, EscReading, rotor_rad_s};
use afbc_estimator::{OutputFilter, VelocityNotch};
use afbc_flight_core::{Stamped, Ticketed};
use afbc_guidance::{FlightMode, Order};
use afbc_link::MavSeverity;
use afbc_onboard::{
    Configuration, ControlInputs, EscSettings, NotchFollower, Report, RotorFailure, RotorMonitor, RotorNews, give,
};
use afbc_types::ROTORS_MAX;

/// Ticket of the orders after a rotor's failure: nobody waits for an answer.
const FAILURE: u8 = 253;

/// The line of the motor controllers, and who watches what they tell.
#[derive(Clone, Debug)]
pub struct EscReports {
    line: EscLine,
    monitor: RotorMonitor,
    follower: NotchFollower,
    settings: EscSettings,
}

/// What motor controllers have told since the last tick.
#[derive(Clone, Copy, Debug, Default)]
pub struct EscsHeard<'a> {
    /// What has come over their line.
    pub bytes: &'a [u8],
    /// Electrical speed \[rev/min\] with which each has answered the last frame, by bidirectional DSHOT.
    pub speeds_rev_min: [Option<u32>; ROTORS_MAX],
}

/// What is to be done after a tick.
#[derive(Clone, Debug, Default)]
pub struct EscAction {
    /// Rotor, from 0, whose motor controller is to be asked in the next frame.
    pub ask: Option<u8>,
    /// Where the notch stands from the next tick on, if it moves.
    pub notch: Option<VelocityNotch>,
    /// What the vehicle is to do about a rotor's failure, to be [merged](ControlInputs::merge).
    pub inputs: Option<ControlInputs>,
}

impl EscReports {
    /// Creates it for a vehicle with this configuration, whose parameters are in their ranges.
    #[must_use]
    pub fn new<const N: usize>(configuration: &Configuration<N>) -> Self {
        let Configuration { airframe, response, curve, escs, .. } = configuration;
        EscReports {
            line: EscLine::new(u8::try_from(N).unwrap_or(u8::MAX)),
            monitor: RotorMonitor::new(response, curve),
            follower: NotchFollower::new(OutputFilter::of(&airframe.parameters, N).notch().copied()),
            settings: *escs,
        }
    }

    /// Goes on with another configuration, of a disarmed vehicle.
    pub fn adopt<const N: usize>(&mut self, configuration: &Configuration<N>) {
        let Configuration { airframe, response, curve, escs, .. } = configuration;
        (self.monitor, self.settings) = (RotorMonitor::new(response, curve), *escs);
        self.follower.adopt(OutputFilter::of(&airframe.parameters, N).notch().copied());
    }

    /// Returns the line, with its counts.
    #[must_use]
    pub fn line(&self) -> &EscLine {
        &self.line
    }
}

/// A speed that was measured.
struct Turning {
    /// From 0.
    rotor: u8,
    rad_s: Stamped<f32>,
}

/// What a tick has come to.
struct EscTick<'a> {
    now_us: u64,
    armed: bool,
    airborne: bool,
    /// Commanded speeds \[rad/s\].
    speeds: &'a [f32],
}

impl Comms {
    /// Takes what motor controllers have told since the last tick, to be called after each [`report`](Self::report),
    /// also if that is nothing.
    pub fn escs<const N: usize>(
        &mut self,
        reports: &mut EscReports,
        heard: &EscsHeard<'_>,
        report: &Report<N>,
    ) -> EscAction {
        let (armed, airborne) = (report.mode.armed(), report.guided.airborne);
        let tick = EscTick { now_us: report.time_us, armed, airborne, speeds: report.motors.0.as_slice() };
        self.listen(reports, heard, &tick)
    }

    /// Not generic, so that it is compiled for size.
    #[inline(never)]
    fn listen(&mut self, reports: &mut EscReports, heard: &EscsHeard<'_>, tick: &EscTick<'_>) -> EscAction {
        let EscTick { now_us, armed, airborne, speeds } = *tick;
        let EscSettings { serial, answers, poles, follows, detects, .. } = reports.settings;
        let hears = serial || answers;
        let mut action = EscAction::default();
        self.dispatcher.status.escs.poles = u16::try_from(poles).unwrap_or(u16::MAX);
        // Without what they tell it is as while disarmed: there is nothing to compare.
        reports.monitor.commanded(now_us, armed && hears, speeds);
        // Nobody is asked while they are not wanted, so that all bytes are dropped.
        for byte in heard.bytes {
            if let Some((rotor, value)) = reports.line.take(now_us, *byte) {
                let rad_s = Stamped { value: value.speed_rad_s(poles), at_us: now_us };
                self.take_reading(reports, Turning { rotor, rad_s }, value, airborne, &mut action);
            }
        }
        let rotors = if answers { speeds.len() } else { 0 };
        for (rotor, speed) in (0_u8..).zip(heard.speeds_rev_min).take(rotors) {
            let Some(speed) = speed else { continue };
            let last = self.dispatcher.status.escs.readings.get(usize::from(rotor)).copied().flatten();
            let erpm_hundreds = u16::try_from(speed / 100).unwrap_or(u16::MAX);
            // The rest comes over the line, if it does.
            let value = EscReading { erpm_hundreds, ..last.map_or_else(EscReading::default, |last| last.value) };
            let rad_s = Stamped { value: rotor_rad_s(speed, poles), at_us: now_us };
            self.take_reading(reports, Turning { rotor, rad_s }, value, airborne, &mut action);
        }
        let escs = &mut self.dispatcher.status.escs;
        escs.failures = if detects { reports.monitor.failures() } else { Default::default() };
        action.notch = reports.follower.look(now_us, armed && hears && follows, escs.speeds().take(speeds.len()));
        action.ask = if serial { reports.line.ask(now_us) } else { None };
        action
    }

    /// Takes what one has told.
    fn take_reading(
        &mut self,
        EscReports { monitor, settings, .. }: &mut EscReports,
        Turning { rotor, rad_s }: Turning,
        value: EscReading,
        airborne: bool,
        action: &mut EscAction,
    ) {
        let dispatcher = &mut self.dispatcher;
        let escs = &mut dispatcher.status.escs;
        if let Some(place) = escs.readings.get_mut(usize::from(rotor)) {
            *place = Some(Stamped { value, at_us: rad_s.at_us });
        }
        escs.counter = escs.counter.wrapping_add(1);
        let Some(news) = monitor.measured(rotor, rad_s).filter(|_| settings.detects) else { return };
        let (severity, words) = words(news);
        dispatcher.texts.say(severity, &words);
        if let Some(mode) = mode_after(settings.action).filter(|_| news.failure.is_some() && airborne) {
            let update = action.inputs.get_or_insert(ControlInputs::EMPTY);
            give(update.order(), Ticketed { value: Order::Select(mode), ticket: FAILURE });
        }
    }
}

/// Returns the mode that `COM_ACT_FAIL_ACT` stands for; none for a warning alone.
fn mode_after(action: u32) -> Option<FlightMode> {
    match action {
        1 => Some(FlightMode::Hold),
        2 => Some(FlightMode::Land),
        3 => Some(FlightMode::Return),
        _ => None,
    }
}

/// Returns how a change of a rotor is announced, which people count from 1.
fn words(news: RotorNews) -> (MavSeverity, Words) {
    let (severity, what) = match news.failure {
        Some(RotorFailure::Stopped) => (MavSeverity::MAV_SEVERITY_CRITICAL, " has stopped"),
        Some(RotorFailure::Desynchronised) => (MavSeverity::MAV_SEVERITY_CRITICAL, " does not turn as commanded"),
        None => (MavSeverity::MAV_SEVERITY_NOTICE, " turns as commanded again"),
    };
    (severity, Words::of("rotor ").number(u32::from(news.rotor) + 1).and(what))
}
