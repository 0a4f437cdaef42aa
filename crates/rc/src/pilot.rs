//! The pilot's commands from sticks and switches.
//!
//! * The arming switch arms when it is switched on with the throttle at or below its centre, and disarms when it is
//!   switched off. A switch that is already on when the link comes up arms nothing.
//! * The kill switch stops the motors while it is on, with priority over everything else.
//! * On arming, the mode is that of the switches. It changes when one of them is moved. In an autonomous mode, it also
//!   changes when a stick is moved. A regained link alone changes no mode.

use crate::channels::Channels;
use crate::link::RadioLink;
use crate::settings::{RadioFunctions, RadioSettings};
use crate::switches::{Debounced, is_on};
use afbc_flight_core::Request;
use afbc_guidance::{FlightMode, Order, Sticks};

/// Throttle above which arming is refused \[-1 to 1\]: in manual modes, the vehicle would take off.
const THROTTLE_UP: f32 = 0.1;

/// Vehicle state that the pilot's commands depend on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PilotInputs {
    /// Time since power-up \[us\].
    pub now_us: u64,
    /// True if the vehicle is armed.
    pub armed: bool,
    /// Current flight mode.
    pub mode: FlightMode,
}

/// The pilot's commands of one step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PilotOutput {
    /// Stick positions, if the receiver's sticks are in use.
    pub sticks: Option<Sticks>,
    /// Request to the flight core.
    pub request: Option<Request>,
    /// Order to the guidance.
    pub order: Option<Order>,
    /// Message to the pilot.
    pub notice: Option<PilotNotice>,
}

/// Messages to the pilot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PilotNotice {
    /// The radio link is up.
    Heard,
    /// The radio link is lost.
    Lost,
    /// The vehicle was not armed, because the throttle is up.
    ThrottleUp,
    /// The vehicle was not armed, because the kill switch is on.
    KillSwitchOn,
    /// The vehicle was not armed, because the radio link has only just come back.
    JustHeard,
}

impl PilotNotice {
    /// Returns the text for a ground station or transmitter.
    pub const fn text(self) -> &'static str {
        match self {
            PilotNotice::Heard => "radio: heard",
            PilotNotice::Lost => "radio: lost",
            PilotNotice::ThrottleUp => "radio: not armed, lower the throttle",
            PilotNotice::KillSwitchOn => "radio: not armed, kill switch is on",
            PilotNotice::JustHeard => "radio: not armed, link only just restored",
        }
    }
}

/// State of the pilot's sticks and switches.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RadioPilot {
    /// Arrival time of the last processed frame; none while the link is down \[us\].
    seen_us: Option<u64>,
    arm: Debounced<bool>,
    kill: Debounced<bool>,
    return_home: Debounced<bool>,
    hold: Debounced<bool>,
    mode: Debounced<FlightMode>,
    /// The current autonomous mode, and the stick positions when it began.
    by_itself: Option<(FlightMode, Sticks)>,
}

impl RadioPilot {
    /// Processes the receiver's channels. To be called after each frame and at least every 20 ms.
    // This function is not inlined: with five callers, each copy would cost a kilobyte of flash.
    #[inline(never)]
    pub fn step(&mut self, settings: &RadioSettings, link: &mut RadioLink, inputs: &PilotInputs) -> PilotOutput {
        let now_us = inputs.now_us;
        if link.heard(now_us).is_some_and(|channels| settings.has_failed(channels)) {
            link.lose();
        }
        let Some(channels) = link.heard(now_us) else {
            let notice = self.seen_us.map(|_| PilotNotice::Lost);
            *self = RadioPilot::default();
            return PilotOutput { notice, ..PilotOutput::default() };
        };
        // Skips a frame that was processed already: a switch needs two frames, and the same one must not count twice.
        if self.seen_us == link.at_us() {
            return PilotOutput::default();
        }
        let mut output = PilotOutput::default();
        if self.seen_us.is_none() {
            output.notice = Some(PilotNotice::Heard);
        }
        self.seen_us = link.at_us();

        let RadioFunctions { roll, pitch, throttle, yaw, arm, kill, return_home, hold, .. } = settings.functions;
        let stick = |number| settings.channel(channels, number).map_or(0.0, |(calibration, us)| calibration.stick(us));
        let sticks = Sticks {
            roll: stick(roll),
            pitch: stick(pitch),
            // A missing throttle channel counts as centred, which holds the height.
            throttle: settings.channel(channels, throttle).map_or(0.0, |(calibration, us)| calibration.centred(us)),
            yaw: stick(yaw),
        };
        let is_steady = link.is_steady(now_us);
        let on = |number, share| is_on(settings, channels, number, share).unwrap_or(false);

        self.kill.put(on(kill, settings.functions.kill_share));
        let killing = self.kill.get() == Some(true);
        match self.arm.put(on(arm, settings.functions.arm_share)) {
            Some((Some(false), true)) if !inputs.armed => match () {
                () if killing => output.notice = Some(PilotNotice::KillSwitchOn),
                () if !is_steady => output.notice = Some(PilotNotice::JustHeard),
                () if sticks.throttle > THROTTLE_UP => output.notice = Some(PilotNotice::ThrottleUp),
                () => output.request = Some(Request::Arm),
            },
            Some((Some(true), false)) if inputs.armed => output.request = Some(Request::Disarm),
            _ => {}
        }
        if killing && inputs.armed {
            output.request = Some(Request::Kill);
        }
        // Sticks and modes wait for a steady link; the commands above that stop the motors do not.
        if !is_steady {
            return output;
        }
        output.sticks = settings.receiver.takes_receiver().then_some(sticks);
        output.order = self.select(
            settings,
            channels,
            inputs,
            &sticks,
            [on(return_home, settings.functions.return_share), on(hold, settings.functions.hold_share)],
            output.request == Some(Request::Arm),
        );
        output
    }

    /// Returns an order if a switch or stick that changes the mode was moved, or if the vehicle is being armed.
    fn select(
        &mut self,
        settings: &RadioSettings,
        channels: &Channels,
        inputs: &PilotInputs,
        sticks: &Sticks,
        [return_home, hold]: [bool; 2],
        arms: bool,
    ) -> Option<Order> {
        let position = settings.channel(channels, settings.functions.mode);
        let mode = position.and_then(|(calibration, us)| settings.modes.mode(calibration.centred(us)));
        let changes = [self.return_home.put(return_home), self.hold.put(hold)];
        let is_moved = changes.iter().any(|change| matches!(change, Some((Some(_), _))));
        let is_selected = matches!(mode.and_then(|mode| self.mode.put(mode)), Some((Some(_), _)));
        // On arming, the switches decide the mode.
        let mode = match (is_moved || is_selected || arms, self.return_home.get(), self.hold.get()) {
            (false, ..) => self.taken_over(settings, inputs, sticks),
            (true, Some(true), _) => Some(FlightMode::Return),
            (true, _, Some(true)) => Some(FlightMode::Hold),
            (true, ..) => self.mode.get(),
        };
        mode.map(Order::Select)
    }

    /// Returns position mode if a moved stick ends an autonomous mode.
    fn taken_over(&mut self, settings: &RadioSettings, inputs: &PilotInputs, sticks: &Sticks) -> Option<FlightMode> {
        if inputs.mode.is_manual() || !inputs.armed || !settings.overrides() {
            self.by_itself = None;
            return None;
        }
        let (_, began) = *match &mut self.by_itself {
            Some(by_itself) if by_itself.0 == inputs.mode => by_itself,
            by_itself => by_itself.insert((inputs.mode, *sticks)),
        };
        let off = [
            sticks.roll - began.roll,
            sticks.pitch - began.pitch,
            sticks.throttle - began.throttle,
            sticks.yaw - began.yaw,
        ];
        let is_moved = off.iter().any(|off| off.abs() > settings.modes.override_share);
        if is_moved {
            // Restarts from the new position, so that a refused order is not repeated in every frame.
            self.by_itself = Some((inputs.mode, *sticks));
        }
        is_moved.then_some(FlightMode::Position)
    }
}
