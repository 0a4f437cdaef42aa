//! Receiving: each message is passed to its service.

mod calibration;
mod commands;
mod fence;
mod parameters;
mod targets;

use super::queued::{ParameterTask, Reply};
use super::{Comms, KEY_OVER_WIRE};
use crate::log_server::LogServer;
use crate::services::commands::BUSY;
use crate::services::control::ControlClaim;
use crate::services::streams::{Requested, id};
use crate::services::texts::Words;
use crate::services::{events, extended, files, logs, serial, timesync};
use crate::transferring::TransferRequests;
use crate::transfers::is_change;
use afbc_flight_core::Stamped;
use afbc_flight_core::supervisor::COAST_US;
use afbc_flight_core::tracker::{POSE_AGE_MAX_US, Sighting};
use afbc_guidance::{Item, Order, RequestedItem};
use afbc_mavlink::telemetry::OrbitStatus;
use afbc_mavlink::{
    Address, CommandResult, Decoder, Downlink, FrameHandler, MavSeverity, MissionMessage, ReceivedFrame,
    ServiceRefusal, ServiceRequest, SetupSigning, Telemetry, Uplink, VehicleCommand,
};
use afbc_onboard::ControlInputs;
use afbc_types::{Pose, PoseSigmas, Setpoint, State};

/// Shortest time between two reports to the guidance that the station in control was heard \[us\].
const HEARD_EVERY_US: u64 = 50_000;

/// Handler of the frames in received bytes.
struct FrameDispatcher<'a, R> {
    comms: &'a mut Comms,
    requests: &'a mut R,
    /// True if the bytes came over a wire.
    wired: bool,
    /// New inputs for the control tick.
    inputs: ControlInputs,
    /// Request for a signing key.
    setup: Option<SetupSigning>,
}

impl<R: TransferRequests> FrameHandler<Uplink> for FrameDispatcher<'_, R> {
    fn accepts(&mut self, frame: &ReceivedFrame<'_>) -> bool {
        self.comms.signing.accepts(self.comms.now_us, frame, self.wired)
    }

    fn handle(&mut self, from: Address, message: Uplink, payload: &[u8]) {
        let FrameDispatcher { comms, requests, inputs, setup, .. } = self;
        match message {
            Uplink::State { sent_us, state, sigmas } => comms.take_state(from, sent_us, state, sigmas, inputs),
            Uplink::Pose { sent_us, pose } if comms.status.senses => comms.take_pose(from, sent_us, pose, inputs),
            Uplink::Signing(wanted) => *setup = Some(wanted),
            other if requests.wants(&other) => comms.hand_to(*requests, (from, &other, payload), inputs),
            other => comms.hear(from, other, inputs),
        }
    }
}

impl Comms {
    /// Processes the next bytes of a stream, whose [decoder](Self::decoder) holds the beginning of an unfinished frame.
    /// Returns new inputs for the control tick, to be [merged](ControlInputs::merge).
    ///
    /// A vehicle that has no estimator ignores poses, because the control law needs velocities and rates too.
    pub fn receive(&mut self, decoder: &mut Decoder<Uplink>, bytes: &[u8]) -> ControlInputs {
        self.receive_beside(decoder, bytes, &mut ())
    }

    /// Does the same as [`receive`](Self::receive) for a vehicle that stores logs but no other files.
    #[inline(never)]
    pub fn receive_with_logs(
        &mut self,
        decoder: &mut Decoder<Uplink>,
        bytes: &[u8],
        server: &mut LogServer,
    ) -> ControlInputs {
        self.receive_beside(decoder, bytes, server)
    }

    /// Does the same as [`receive`](Self::receive); `requests` takes the stations' requests for files and logs.
    pub fn receive_beside(
        &mut self,
        decoder: &mut Decoder<Uplink>,
        bytes: &[u8],
        requests: &mut impl TransferRequests,
    ) -> ControlInputs {
        let before = *decoder.counters();
        let wired = decoder.is_wired();
        let mut frames = FrameDispatcher { comms: self, requests, wired, inputs: ControlInputs::EMPTY, setup: None };
        decoder.feed_to(&mut frames, bytes);
        let FrameDispatcher { mut inputs, setup, .. } = frames;
        self.frames.add_since(&before, decoder.counters());
        // The new key is set after all bytes: the frames beside SETUP_SIGNING are checked with the old key.
        if let Some(setup) = setup {
            self.set_key(&setup);
        }
        if self.signing.has_refused() {
            self.texts.put(MavSeverity::MAV_SEVERITY_WARNING, KEY_OVER_WIRE);
        }
        self.hand_over(&mut inputs);
        inputs.battery = self.battery();
        inputs
    }

    /// Takes a state that a tracker measured.
    fn take_state(
        &mut self,
        from: Address,
        sent_us: u64,
        value: State,
        sigmas: PoseSigmas,
        inputs: &mut ControlInputs,
    ) {
        let estimates = self.status.senses;
        let age_max_us = if estimates { POSE_AGE_MAX_US } else { COAST_US.into() };
        let sighting = Sighting::State(value);
        if let Some(at_us) = self.tracker.sight(number(from), sent_us, self.now_us, sighting, age_max_us) {
            // A control law needs a fresh state. An estimator fuses an old pose at the time of the pose.
            if self.now_us - at_us <= COAST_US.into() {
                inputs.inbox.put_state(Stamped { value, at_us });
            }
            if estimates {
                inputs.inbox.put_pose(Stamped { value: Pose::of(&value, sigmas), at_us });
            }
            (self.status.state, self.state_is_news) = (Some(value), true);
        }
    }

    /// Takes a pose that a tracker measured, for the vehicle's estimator.
    fn take_pose(&mut self, from: Address, sent_us: u64, value: Pose, inputs: &mut ControlInputs) {
        let sighting = Sighting::Pose(value);
        if let Some(at_us) = self.tracker.sight(number(from), sent_us, self.now_us, sighting, POSE_AGE_MAX_US) {
            inputs.inbox.put_pose(Stamped { value, at_us });
        }
    }

    /// Handles a message, except states, poses and SETUP_SIGNING.
    pub(super) fn hear(&mut self, from: Address, message: Uplink, inputs: &mut ControlInputs) {
        if from == self.me {
            // The vehicle's own message was sent back.
            return;
        }
        if self.control.hear(from, self.now_us) {
            self.report_heard(inputs);
        }
        let replies =
            matches!(message, Uplink::Stream(_) | Uplink::ServiceRequest(_) | Uplink::Time(_) | Uplink::Control(_));
        if replies && self.replies.is_full() {
            // The message is ignored as if lost: no request is carried out that cannot be answered.
            return;
        }
        match message {
            Uplink::Command(command) => self.command(command, from, inputs),
            Uplink::Setpoint(setpoint) => self.setpoint(setpoint, from, inputs),
            Uplink::Target(target) => self.target(target, from, inputs),
            Uplink::Mission(message) => self.mission(message, from, inputs),
            Uplink::Parameter(request) => self.parameter(request, from, inputs),
            Uplink::Stream(request) => {
                let stream = self.streams.set_group(request, self.now_us);
                self.reply(Reply::Stream(stream));
            }
            Uplink::ServiceRequest(request) => self.refuse_service(request, from),
            Uplink::Time(clock) => {
                let answer = timesync::answer(clock, from, self.me, self.now_us);
                answer.into_iter().for_each(|answer| self.reply(Reply::Clock(answer)));
            }
            Uplink::Control(request) => {
                let (answer, claim) = self.control.change(request, from, self.now_us);
                self.reply(Reply::Control(answer));
                self.warn_not_in_control(from, claim);
            }
            Uplink::Heartbeat | Uplink::State { .. } | Uplink::Pose { .. } | Uplink::Signing(_) => (),
        }
    }

    /// Passes a message to `requests`, which handles requests for files and logs.
    pub(super) fn hand_to(
        &mut self,
        requests: &mut impl TransferRequests,
        (from, message, payload): (Address, &Uplink, &[u8]),
        inputs: &mut ControlInputs,
    ) {
        if self.control.hear(from, self.now_us) {
            self.report_heard(inputs);
        }
        if let Uplink::Command(command) = message {
            let answer = match command {
                _ if !self.commands.has_room() => CommandResult::Refused(BUSY),
                // There is only one instance of each of these messages.
                VehicleCommand::RequestMessage { index: 1.., .. } => CommandResult::Denied,
                _ if requests.take(from, message, payload, true) => CommandResult::Accepted,
                _ => CommandResult::Refused(BUSY),
            };
            return self.commands.answer(command.id(), answer, from);
        }
        // Calling `may` would take control if nobody has it. Requests that only read must not do so.
        let may_change = !is_change(message) || self.may(from, inputs);
        requests.take(from, message, payload, may_change);
    }

    /// Gives the guidance the mission item that it asks for, unless it has it already, and news of geofence and safe
    /// place.
    pub(super) fn hand_over(&mut self, inputs: &mut ControlInputs) {
        if let Some(leg) = self.wanted_leg() {
            self.given = Some((self.status.guided.wanted, leg.upload));
            inputs.order().leg = Some(leg);
        }
        if self.has_fence_news() {
            self.fence_given = self.fence.view();
            inputs.order().fence = Some(self.fence_given);
        }
        if self.safe_m != self.safe_given_m {
            self.safe_given_m = self.safe_m;
            inputs.order().safe_m = self.safe_m;
        }
    }

    /// Returns the mission item that the guidance asks for, if it does not have it yet. If a new mission is too short
    /// for the item, returns the first item. If the mission was cleared, returns an empty item, to tell the guidance
    /// so.
    pub(super) fn wanted_leg(&self) -> Option<RequestedItem> {
        let (wanted, upload) = (self.status.guided.wanted, self.missions.number());
        // The upload's number is compared too: after another upload the same number means another item.
        if self.given == Some((wanted, upload)) {
            return None;
        }
        let items = self.missions.items().len();
        if items == 0 {
            let none = RequestedItem { number: wanted, upload, item: Item::None, is_last: true };
            return Some(none).filter(|_| self.given.is_some());
        }
        let number = if usize::from(wanted) < items { wanted } else { 0 };
        let home_m = self.status.guided.home_m.map_or(0.0, |home| home.z);
        self.missions.leg(number, self.status.aux.origin.as_ref(), home_m).map(|leg| self.fenced(leg))
    }

    /// Does the work that is due after each tick.
    pub(super) fn tick(&mut self) {
        self.streams.tick();
        self.report_checks();
        self.watch_fence();
        self.find_safe_place();
        if !self.status.mode.armed() {
            self.missions.restart();
        }
        if let Some(words) = self.missions.tick(self.now_us) {
            self.texts.say(MavSeverity::MAV_SEVERITY_WARNING, &words);
        }
        if let Some(reached) = self.status.guided.reached {
            self.reached = Some(reached);
            self.missions.reached(reached);
            self.reply(Reply::Reached(reached));
        }
    }

    /// Returns the next queued reply.
    pub(super) fn next_reply(&mut self) -> Option<Downlink> {
        let everyone = Address::default();
        Some(match self.replies.pop_front() {
            Some(Reply::Clock(clock)) => Downlink::Time(clock),
            Some(Reply::Control(answer)) => Downlink::Control(answer),
            Some(Reply::Interval(interval)) => Downlink::Interval(interval),
            Some(Reply::Stream(stream)) => Downlink::Stream(stream),
            Some(Reply::ParameterError(error, to)) => Downlink::ParameterError { error, to },
            Some(Reply::Refusal(refusal, to)) => Downlink::Refusal { refusal, to },
            Some(Reply::Reached(number)) => {
                Downlink::Mission { message: MissionMessage::Reached(number), to: everyone }
            }
            None => {
                let (message, to) = self.missions.next_message()?;
                Downlink::Mission { message, to }
            }
        })
    }

    /// Returns the setpoint that the vehicle follows, if it is armed.
    pub(super) fn followed(&self) -> Option<&Setpoint> {
        self.status.guided.setpoint.as_ref().filter(|_| self.status.mode.armed())
    }

    /// Returns MISSION_CURRENT.
    pub(super) fn mission_current(&self) -> Downlink {
        let guided = &self.status.guided;
        let flies = guided.mode == afbc_guidance::FlightMode::Mission && self.status.mode.armed();
        let current = self.missions.current(Some(guided.wanted), self.reached, flies);
        Downlink::Mission { message: MissionMessage::Current(current), to: Address::default() }
    }

    /// Returns ORBIT_EXECUTION_STATUS while the vehicle flies an ordered orbit.
    pub(super) fn orbit_status(&self) -> Option<Downlink> {
        let ((centre_m, radius_m), origin) =
            (self.orbit_m.filter(|_| self.status.guided.orbits)?, self.status.aux.origin?);
        let centre = origin.global(&centre_m);
        let (time_us, place_e7, altitude_m) = (self.status.time_us, centre.e7(), centre.altitude_m as f32);
        // MAVLink's positive radius is clockwise, the local frame's counterclockwise.
        let status = OrbitStatus { time_us, radius_m: -radius_m, place_e7, altitude_m };
        Some(Downlink::Telemetry(Telemetry::Orbit(status)))
    }

    /// Returns true if `from` is in control. Takes control if nobody has it. Warns a station that is refused.
    fn may(&mut self, from: Address, inputs: &mut ControlInputs) -> bool {
        let claim = self.control.claim(from, self.now_us);
        self.warn_not_in_control(from, claim);
        let granted = claim == ControlClaim::Granted;
        if granted {
            self.report_heard(inputs);
        }
        granted
    }

    /// Warns a station once that another station is in control.
    fn warn_not_in_control(&mut self, from: Address, claim: ControlClaim) {
        if let ControlClaim::Refused { holder, first_time: true } = claim {
            let words = Words::default().station(from).and(" ignored: ").station(holder).and(" is in control");
            self.texts.say(MavSeverity::MAV_SEVERITY_WARNING, &words);
        }
    }

    /// Tells the guidance that the station in control was heard.
    fn report_heard(&mut self, inputs: &mut ControlInputs) {
        if self.heard_us.is_none_or(|heard_us| self.now_us.saturating_sub(heard_us) >= HEARD_EVERY_US) {
            self.heard_us = Some(self.now_us);
            inputs.order().heard_us = Some(self.now_us);
        }
    }

    fn reply(&mut self, reply: Reply) {
        self.replies.push_back(reply).ok();
    }

    /// Refuses a request that the vehicle does not support.
    fn refuse_service(&mut self, request: ServiceRequest, from: Address) {
        let refusal = match request {
            ServiceRequest::Log(request) => {
                let Some(answer) = logs::answer(request) else { return };
                ServiceRefusal::Log(answer)
            }
            ServiceRequest::File(operation) => ServiceRefusal::File(files::answer(operation)),
            ServiceRequest::Extended(request) => ServiceRefusal::Extended(extended::answer(request)),
            ServiceRequest::Event(request) => ServiceRefusal::Event(events::answer(request)),
            ServiceRequest::Serial(asked) => ServiceRefusal::Serial(serial::answer(asked)),
            // The answer repeats the place without terrain data.
            ServiceRequest::Terrain(place) => ServiceRefusal::Terrain(place),
            ServiceRequest::Unanswered(request) => {
                if let Some(text) = self.unanswered.text(request, self.now_us) {
                    self.texts.put(MavSeverity::MAV_SEVERITY_WARNING, text);
                }
                return;
            }
            ServiceRequest::Origin => {
                // Stations cannot move the origin: the shell sets it, or there is none.
                self.texts.put(MavSeverity::MAV_SEVERITY_WARNING, "stations cannot set the origin");
                self.streams.request(Requested { message: id::GPS_GLOBAL_ORIGIN, index: 0 });
                return;
            }
        };
        self.reply(Reply::Refusal(refusal, from));
    }

    fn mission(&mut self, message: MissionMessage, from: Address, inputs: &mut ControlInputs) {
        let changes =
            matches!(message, MissionMessage::Count(..) | MissionMessage::Clear(_) | MissionMessage::SetCurrent(_));
        // Only requests that change something claim control. Items count only from the station that began the upload.
        let in_control = changes && self.may(from, inputs);
        let (around, number) = (self.surroundings(), self.missions.number());
        let heard = self.missions.hear(message, from, in_control, self.now_us, &around);
        if self.missions.number() != number {
            // The item reached last belongs to the previous mission.
            self.reached = None;
        }
        if heard.fence {
            self.fence.renew();
        }
        if matches!(message, MissionMessage::SetCurrent(_)) {
            // MISSION_CURRENT is sent after the tick in which the guidance takes the new item.
            self.streams.request(Requested { message: id::MISSION_CURRENT, index: 0 });
        }
        if let Some(words) = heard.text {
            self.texts.say(MavSeverity::MAV_SEVERITY_WARNING, &words);
        }
        if let Some(number) = heard.resume {
            self.order(Order::Resume(number), None, from, inputs);
        }
    }
}

/// Returns the number by which the [`Tracker`] tells senders apart.
fn number(from: Address) -> u16 {
    u16::from_be_bytes([from.system, from.component])
}
