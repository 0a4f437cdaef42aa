//! Passes each received message to its service.

mod calibration;
mod commands;
mod fence;
mod parameters;
mod targets;

use crate::parameters::Service;
use crate::services::calibration::CalibrationState;
use crate::services::commands::{BUSY, Commands};
use crate::services::control::{ControlClaim, OperatorControl};
use crate::services::fence::FenceWatch;
use crate::services::mission::Missions;
use crate::services::status::VehicleStatus;
use crate::services::streams::{Requested, Streams, id};
use crate::services::texts::{Texts, Words};
use crate::services::unanswered::Unanswered;
use crate::services::{events, extended, files, logs, serial, timesync};
use crate::setup::Setup;
use crate::transferring::TransferRequests;
use crate::transfers::is_change;
use afbc_guidance::fence::Braking;
use afbc_guidance::{FenceView, Item, Leg, Limits, Order};
use afbc_mavlink::telemetry::OrbitStatus;
use afbc_mavlink::{
    Address, Answer, ChannelsOverride, Clock, Command, ControlAnswer, DataStream, Downlink, Interval, MavSeverity,
    Mission, ParameterError, ParameterRequest, Question, QuestionRefusal, Reboot, Telemetry, Uplink,
};
use afbc_onboard::ControlInputs;
use afbc_rc::StickCurves;
use afbc_types::Setpoint;
use heapless::Deque;
use nalgebra::{Vector2, Vector3};

/// Most queued replies, besides answers to commands. Further replies are dropped, since stations repeat requests.
const REPLIES_MAX: usize = 16;
/// Most parameter requests queued until the end of the tick. Further ones are dropped, since stations repeat them.
const WISHES_MAX: usize = 32;
/// Shortest time between two reports to the guidance that the station in control was heard \[us\].
const HEARD_EVERY_US: u64 = 50_000;

/// A reply to a message other than a command.
#[derive(Clone, Copy, Debug)]
enum Reply {
    Clock(Clock),
    Control(ControlAnswer),
    Interval(Interval),
    Stream(DataStream),
    Reached(u16),
    ParameterError(ParameterError, Address),
    Refusal(QuestionRefusal, Address),
}

/// A queued request about parameters.
#[derive(Clone, Copy, Debug)]
enum ParameterTask {
    Ask(ParameterRequest, Address),
    Restore,
}

/// All services, and the state that they share.
pub(crate) struct Dispatcher {
    pub(crate) me: Address,
    /// Start of the last tick \[us\]. Messages that arrive before the next tick get this time stamp.
    pub(crate) now_us: u64,
    pub(crate) status: VehicleStatus,
    pub(crate) commands: Commands,
    pub(crate) control: OperatorControl,
    pub(crate) missions: Missions,
    /// State of the geofence. `braking` has the limits with which stopping paths are computed.
    fence: FenceWatch,
    pub(crate) braking: Braking,
    /// Radius and height of the cylindrical geofence around home \[m\]; 0 for none.
    pub(crate) cylinder_m: [f32; 2],
    /// Response curves of a station's joystick, and whether a joystick is accepted.
    pub(crate) curves: StickCurves,
    pub(crate) takes_joystick: bool,
    /// Channels of RC_CHANNELS_OVERRIDE, until radio control takes them.
    pub(crate) overrides: Option<ChannelsOverride>,
    fence_given: FenceView,
    /// Nearest safe place for a return \[m\], the one that the guidance knows, and the time of the last search \[us\].
    safe_m: Option<Vector2<f32>>,
    safe_given_m: Option<Vector2<f32>>,
    safe_us: u64,
    /// Centre and radius of the orbit ordered last \[m\].
    orbit_m: Option<(Vector3<f32>, f32)>,
    pub(crate) streams: Streams,
    pub(crate) texts: Texts,
    unanswered: Unanswered,
    replies: Deque<Reply, REPLIES_MAX>,
    /// Queued parameter requests.
    wishes: Deque<ParameterTask, WISHES_MAX>,
    pub(crate) parameters: Service,
    pub(crate) calibration: CalibrationState,
    /// True if the shell supports calibration.
    calibrates: bool,
    /// True if a station has asked for the sensors' self-tests.
    pub(crate) tests: bool,
    /// Item and upload number of the mission item last given to the guidance.
    given: Option<(u16, u16)>,
    /// Mission item reached last.
    reached: Option<u16>,
    /// Last time at which the guidance was told that the station in control was heard \[us\].
    heard_us: Option<u64>,
    /// Time of the last stick input from the radio receiver \[us\].
    pub(crate) radio_us: Option<u64>,
    /// Set if a station has requested the arming checks. True if one of these stations may arm.
    checks: Option<bool>,
    /// Kinds of reboot that the shell supports.
    reboots: &'static [Reboot],
    /// Kind of reboot that a station has requested.
    pub(crate) reboot: Option<Reboot>,
}

impl Dispatcher {
    pub(crate) fn new(me: Address, setup: &Setup) -> Self {
        Dispatcher {
            me,
            now_us: 0,
            status: VehicleStatus::default(),
            commands: Commands::default(),
            control: OperatorControl::default(),
            missions: Missions::default(),
            fence: FenceWatch::default(),
            braking: Limits::DEFAULT.braking(),
            cylinder_m: [0.0; 2],
            curves: StickCurves::DEFAULT,
            takes_joystick: true,
            overrides: None,
            fence_given: FenceView::default(),
            safe_m: None,
            safe_given_m: None,
            safe_us: 0,
            orbit_m: None,
            streams: Streams::new(setup.bytes_per_s),
            texts: Texts::default(),
            unanswered: Unanswered::default(),
            replies: Deque::new(),
            wishes: Deque::new(),
            parameters: Service::default(),
            calibration: CalibrationState::default(),
            calibrates: setup.calibrates,
            tests: false,
            given: None,
            reached: None,
            heard_us: None,
            radio_us: None,
            checks: None,
            reboots: setup.reboots,
            reboot: None,
        }
    }

    /// Handles a message, except states, poses and SETUP_SIGNING.
    pub(crate) fn hear(&mut self, from: Address, message: Uplink, inputs: &mut ControlInputs) {
        if from == self.me {
            // The vehicle's own message was sent back.
            return;
        }
        if self.control.hear(from, self.now_us) {
            self.report_heard(inputs);
        }
        let replies =
            matches!(message, Uplink::Stream(_) | Uplink::Question(_) | Uplink::Clock(_) | Uplink::Control(_));
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
            Uplink::Question(question) => self.question(question, from),
            Uplink::Clock(clock) => {
                let answer = timesync::answer(clock, from, self.me, self.now_us);
                answer.into_iter().for_each(|answer| self.reply(Reply::Clock(answer)));
            }
            Uplink::Control(wish) => {
                let (answer, claim) = self.control.change(wish, from, self.now_us);
                self.reply(Reply::Control(answer));
                self.warn_not_in_control(from, claim);
            }
            Uplink::Heartbeat | Uplink::State { .. } | Uplink::Pose { .. } | Uplink::Signing(_) => (),
        }
    }

    /// Passes a message to `requests`, which handles requests for files and logs.
    pub(crate) fn hand_to(
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
                _ if !self.commands.has_room() => Answer::Refused(BUSY),
                // There is only one instance of each of these messages.
                Command::RequestMessage { index: 1.., .. } => Answer::Denied,
                _ if requests.take(from, message, payload, true) => Answer::Accepted,
                _ => Answer::Refused(BUSY),
            };
            return self.commands.answer(command.id(), answer, from);
        }
        // Calling `may` would take control if nobody has it. Requests that only read must not do so.
        let may_change = !is_change(message) || self.may(from, inputs);
        requests.take(from, message, payload, may_change);
    }

    /// Gives the guidance the mission item that it asks for, unless it has it already, and news of geofence and safe
    /// place.
    pub(crate) fn hand_over(&mut self, inputs: &mut ControlInputs) {
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
    pub(crate) fn wanted_leg(&self) -> Option<Leg> {
        let (wanted, upload) = (self.status.guided.wanted, self.missions.number());
        // The upload's number is compared too: after another upload the same number means another item.
        if self.given == Some((wanted, upload)) {
            return None;
        }
        let items = self.missions.items().len();
        if items == 0 {
            let none = Leg { number: wanted, upload, item: Item::None, is_last: true };
            return Some(none).filter(|_| self.given.is_some());
        }
        let number = if usize::from(wanted) < items { wanted } else { 0 };
        let home_m = self.status.guided.home_m.map_or(0.0, |home| home.z);
        self.missions.leg(number, self.status.aux.origin.as_ref(), home_m).map(|leg| self.fenced(leg))
    }

    /// Does the work that is due after each tick.
    pub(crate) fn tick(&mut self) {
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
    pub(crate) fn next_reply(&mut self) -> Option<Downlink> {
        let everyone = Address::default();
        Some(match self.replies.pop_front() {
            Some(Reply::Clock(clock)) => Downlink::Clock(clock),
            Some(Reply::Control(answer)) => Downlink::Control(answer),
            Some(Reply::Interval(interval)) => Downlink::Interval(interval),
            Some(Reply::Stream(stream)) => Downlink::Stream(stream),
            Some(Reply::ParameterError(error, to)) => Downlink::ParameterError { error, to },
            Some(Reply::Refusal(refusal, to)) => Downlink::Refusal { refusal, to },
            Some(Reply::Reached(number)) => Downlink::Mission { message: Mission::Reached(number), to: everyone },
            None => {
                let (message, to) = self.missions.next_message()?;
                Downlink::Mission { message, to }
            }
        })
    }

    /// Returns the setpoint that the vehicle follows, if it is armed.
    pub(crate) fn followed(&self) -> Option<&Setpoint> {
        self.status.guided.setpoint.as_ref().filter(|_| self.status.mode.armed())
    }

    /// Returns MISSION_CURRENT.
    pub(crate) fn mission_current(&self) -> Downlink {
        let guided = &self.status.guided;
        let flies = guided.mode == afbc_guidance::FlightMode::Mission && self.status.mode.armed();
        let current = self.missions.current(Some(guided.wanted), self.reached, flies);
        Downlink::Mission { message: Mission::Current(current), to: Address::default() }
    }

    /// Returns ORBIT_EXECUTION_STATUS while the vehicle flies an ordered orbit.
    pub(crate) fn orbit_status(&self) -> Option<Downlink> {
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
    fn question(&mut self, question: Question, from: Address) {
        let refusal = match question {
            Question::Log(request) => {
                let Some(answer) = logs::answer(request) else { return };
                QuestionRefusal::Log(answer)
            }
            Question::File(operation) => QuestionRefusal::File(files::answer(operation)),
            Question::Extended(request) => QuestionRefusal::Extended(extended::answer(request)),
            Question::Event(request) => QuestionRefusal::Event(events::answer(request)),
            Question::Serial(asked) => QuestionRefusal::Serial(serial::answer(asked)),
            // The answer repeats the place without terrain data.
            Question::Terrain(place) => QuestionRefusal::Terrain(place),
            Question::Unanswered(wish) => {
                if let Some(text) = self.unanswered.text(wish, self.now_us) {
                    self.texts.put(MavSeverity::MAV_SEVERITY_WARNING, text);
                }
                return;
            }
            Question::Origin => {
                // Stations cannot move the origin: the shell sets it, or there is none.
                self.texts.put(MavSeverity::MAV_SEVERITY_WARNING, "the origin is not set by stations");
                self.streams.request(Requested { message: id::GPS_GLOBAL_ORIGIN, index: 0 });
                return;
            }
        };
        self.reply(Reply::Refusal(refusal, from));
    }

    fn mission(&mut self, message: Mission, from: Address, inputs: &mut ControlInputs) {
        let changes = matches!(message, Mission::Count(..) | Mission::Clear(_) | Mission::SetCurrent(_));
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
        if matches!(message, Mission::SetCurrent(_)) {
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
