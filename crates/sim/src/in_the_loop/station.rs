//! The other end of the link.

use super::Extremes;
use afbc_flight_core::Refusal;
use afbc_link::{
    Address, Answer, Command, Counters, Decoder, Downlink, FRAME_MAX, Health, MavCmd, Sender, Text, Uplink,
};
use afbc_onboard::BUSY;
use afbc_types::{RotorSpeeds, Setpoint, State};
use std::time::Instant;

/// A ground station, by the usual numbers.
const ADDRESS: Address = Address { system: 255, component: 190 };
/// A command that the vehicle does not know, and says so: that shows how long an answer takes.
const PING: u16 = MavCmd::MAV_CMD_REQUEST_MESSAGE as u16;

/// Tracker, commander and listener in one.
pub struct Station {
    sender: Sender,
    uplink: Vec<u8>,
    decoder: Decoder<Downlink>,
    heard: Heard,
    pinged: Option<Instant>,
    pings: u64,
    round_trip_ms: Extremes,
}

/// What the vehicle has said.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Heard {
    /// What the rotors were last told.
    pub speeds: RotorSpeeds,
    /// True if the motors may turn, by the last rotor command.
    pub armed: bool,
    /// Rotor commands so far.
    pub rotor_commands: u64,
    /// Its last report.
    pub health: Option<Health>,
    /// Oldest state that it has reported to fly on, while armed \[us\].
    pub state_age_max_us: f32,
    /// The answer to the last request to arm or disarm.
    pub answer: Option<Answer>,
    /// Its last words.
    pub text: Option<Text>,
}

impl Default for Station {
    fn default() -> Self {
        Self::new()
    }
}

impl Station {
    /// Nothing said, nothing heard.
    pub fn new() -> Self {
        Station {
            sender: Sender::new(ADDRESS),
            uplink: Vec::new(),
            decoder: Decoder::new(ADDRESS),
            heard: Heard::default(),
            pinged: None,
            pings: 0,
            round_trip_ms: Extremes::default(),
        }
    }

    /// Adds a message to what is said next.
    pub fn say(&mut self, message: &Uplink) {
        self.uplink.extend_from_slice(self.sender.send(message, &mut [0; FRAME_MAX]));
    }

    /// Adds a measured state, `sent_us` on this side's clock, which must rise from state to state.
    pub fn track(&mut self, sent_us: u64, state: State) {
        self.say(&Uplink::State { sent_us, state });
    }

    /// Adds a setpoint.
    pub fn lead(&mut self, setpoint: Setpoint) {
        self.say(&Uplink::Setpoint(setpoint));
    }

    /// Adds a command. The answer to the last one no longer counts.
    pub fn command(&mut self, command: Command) {
        self.heard.answer = None;
        self.say(&Uplink::Command(command));
    }

    /// Adds a question whose answer is timed from now on.
    pub fn ping(&mut self) {
        self.say(&Uplink::Command(Command::Other(PING)));
        self.pings += 1;
        self.pinged = Some(Instant::now());
    }

    /// All that was said since the last time.
    pub fn take(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.uplink)
    }

    /// Takes the next bytes from the vehicle.
    pub fn hear(&mut self, bytes: &[u8]) {
        let Station { decoder, heard, pinged, round_trip_ms, .. } = self;
        decoder.feed(bytes, |_, message| match message {
            Downlink::Rotors { armed, speeds, .. } => {
                (heard.armed, heard.speeds) = (armed, speeds);
                heard.rotor_commands += 1;
            }
            Downlink::Answer { command: PING, .. } => {
                if let Some(pinged) = pinged.take() {
                    round_trip_ms.add(pinged.elapsed().as_secs_f64() * 1e3);
                }
            }
            Downlink::Answer { answer, .. } => heard.answer = Some(answer),
            Downlink::Health(health) => {
                if heard.armed {
                    heard.state_age_max_us = heard.state_age_max_us.max(health.state_age_us);
                }
                heard.health = Some(health);
            }
            Downlink::Text { text, .. } => heard.text = Some(text),
            // Heartbeats, attitudes, positions.
            _ => {}
        });
    }

    /// What the vehicle has said.
    pub fn heard(&self) -> &Heard {
        &self.heard
    }

    /// What came in, and what was dropped and why.
    pub fn counters(&self) -> &Counters {
        self.decoder.counters()
    }

    /// Time from a question handed over to its answer \[ms\].
    pub fn round_trip_ms(&self) -> &Extremes {
        &self.round_trip_ms
    }

    /// Questions without an answer.
    pub fn unanswered(&self) -> u64 {
        self.pings - self.round_trip_ms.count()
    }
}

impl Heard {
    /// Why the vehicle would not arm, in words.
    pub fn refusal(&self) -> Option<&'static str> {
        let Some(Answer::Refused(number)) = self.answer else { return None };
        let known = Refusal::ALL.into_iter().find(|refusal| *refusal as i32 == number).map(Refusal::reason);
        let busy = (number == BUSY).then_some("refused: too many requests wait");
        Some(known.or(busy).unwrap_or("arming refused: reason unknown"))
    }
}
