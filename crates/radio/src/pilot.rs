//! What the pilot wants.
//!
//! * The arming switch arms when it is switched on, with the throttle not above its centre, and disarms when it is
//!   switched off. That it is on when the pilot is first heard, or is heard again, arms nothing.
//! * The kill switch stops the motors as long as it is on, before anything else.
//! * The mode is that of the switches when it arms, and changes when one of them is moved, or, in a mode that flies by
//!   itself, when a stick is moved. A pilot who is heard again takes nothing over by that alone.

use crate::channels::Channels;
use crate::link::RadioLink;
use crate::settings::{RadioFunctions, RadioSettings};
use crate::switches::{Debounced, is_on};
use afbc_flight_core::Request;
use afbc_guidance::{FlightMode, Order, Sticks};

/// Throttle above which a vehicle is not armed: in the modes that sticks fly it would take off.
const THROTTLE_UP: f32 = 0.1;

/// What the pilot's orders depend on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PilotInputs {
    /// Time since power-up \[us\].
    pub now_us: u64,
    /// True if the vehicle is armed.
    pub armed: bool,
    /// The flight mode.
    pub mode: FlightMode,
}

/// What the pilot wants now.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PilotOutput {
    /// The sticks, if they count.
    pub sticks: Option<Sticks>,
    /// A request to the flight core.
    pub request: Option<Request>,
    /// An order to the guidance.
    pub order: Option<Order>,
    /// What the pilot should know.
    pub notice: Option<PilotNotice>,
}

/// What the pilot should know.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PilotNotice {
    /// The pilot is heard.
    Heard,
    /// The pilot is not heard any more.
    Lost,
    /// Not armed: the throttle is up.
    ThrottleUp,
    /// Not armed: the kill switch is on.
    KillSwitchOn,
    /// Not armed: the pilot has only just been heard again.
    JustHeard,
}

impl PilotNotice {
    /// Returns what a station or a transmitter shows.
    pub const fn text(self) -> &'static str {
        match self {
            PilotNotice::Heard => "radio: heard",
            PilotNotice::Lost => "radio: lost",
            PilotNotice::ThrottleUp => "radio: not armed, lower the throttle",
            PilotNotice::KillSwitchOn => "radio: not armed, kill switch is on",
            PilotNotice::JustHeard => "radio: not armed, link has just come back",
        }
    }
}

/// Follows sticks and switches.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RadioPilot {
    /// Time of the last frame that was looked at; none while the pilot is not heard \[us\].
    seen_us: Option<u64>,
    arm: Debounced<bool>,
    kill: Debounced<bool>,
    return_home: Debounced<bool>,
    hold: Debounced<bool>,
    mode: Debounced<FlightMode>,
    /// A mode that flies by itself, and where the sticks were when it began.
    by_itself: Option<(FlightMode, Sticks)>,
}

impl RadioPilot {
    /// Looks at a receiver, after each frame and every 20 ms at least.
    // Out of line: called in five places, it would take a kilobyte of flash in each.
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
        // Seen twice, one frame would move a switch, which takes two.
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
            // Without a throttle it holds its height.
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
        // Sticks and modes wait for a steady link; stopping the motors, above, does not.
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

    /// Returns an order if a switch or a stick was moved that changes the mode, or if it arms.
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
        // A vehicle that arms flies as the switches say.
        let mode = match (is_moved || is_selected || arms, self.return_home.get(), self.hold.get()) {
            (false, ..) => self.taken_over(settings, inputs, sticks),
            (true, Some(true), _) => Some(FlightMode::Return),
            (true, _, Some(true)) => Some(FlightMode::Hold),
            (true, ..) => self.mode.get(),
        };
        mode.map(Order::Select)
    }

    /// Returns the mode in which the sticks take over from one that flies by itself.
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
            // Once: refused, it is not asked for in every frame.
            self.by_itself = Some((inputs.mode, *sticks));
        }
        is_moved.then_some(FlightMode::Position)
    }
}
