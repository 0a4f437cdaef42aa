//! The simulator's end of the link.

use super::Extremes;
use afbc_comms::services::modes;
use afbc_comms::{BUSY, CALIBRATES};
use afbc_flight_core::Refusal;
use afbc_ground::{Client, PING, RetryPolicy};
use afbc_guidance::FlightMode;
use afbc_mavlink::{CommandResult, Counters, Downlink, HealthArray, Uplink, VehicleCommand};
use afbc_types::{PoseSigmas, ROTORS_MAX, RotorSpeeds, Setpoint, State};
use nalgebra::Vector3;
use std::time::Instant;

/// Requests HIL_ACTUATOR_CONTROLS at an interval of one tick.
const ROTORS: VehicleCommand = VehicleCommand::SetInterval { message: 93, interval_us: 1_000 };

/// Tracker, commander and ground station.
pub struct Station {
    client: Client,
    heard: ReceivedMessages,
    pinged: Option<Instant>,
    pings: u64,
    round_trip_ms: Extremes,
}

/// Messages received from the vehicle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReceivedMessages {
    /// Last commanded rotor speeds.
    pub speeds: RotorSpeeds<ROTORS_MAX>,
    /// True if the motors may turn, by the last rotor command.
    pub armed: bool,
    /// Number of rotor commands.
    pub rotor_commands: u64,
    /// Last position in the vehicle's local frame \[m\].
    pub position_m: Option<Vector3<f32>>,
    /// Last health message.
    pub health: Option<HealthArray>,
    /// Largest age of the state that the vehicle has reported while armed \[us\].
    pub state_age_max_us: f32,
    /// Answer to the last request to arm or disarm.
    pub answer: Option<CommandResult>,
}

impl Default for Station {
    fn default() -> Self {
        Self::new()
    }
}

impl Station {
    /// Creates a station that has received nothing, and requests rotor commands.
    pub fn new() -> Self {
        let mut station = Station {
            client: Client::new(Client::STATION),
            heard: ReceivedMessages::default(),
            pinged: None,
            pings: 0,
            round_trip_ms: Extremes::default(),
        };
        station.ask_for_rotors();
        station
    }

    /// Queues the request for a rotor command after each tick, which the vehicle does not send by default.
    pub fn ask_for_rotors(&mut self) {
        self.client.say(Uplink::Command(ROTORS));
    }

    /// Queues a message.
    pub fn say(&mut self, message: &Uplink) {
        self.client.say(*message);
    }

    /// Queues a measured state with the time `sent_us` on this side's clock, which must increase.
    pub fn track(&mut self, sent_us: u64, state: State) {
        self.say(&Uplink::State { sent_us, state, sigmas: PoseSigmas::UNKNOWN });
    }

    /// Queues a setpoint.
    pub fn lead(&mut self, setpoint: Setpoint) {
        self.say(&Uplink::Setpoint(setpoint));
    }

    /// Queues a heartbeat, which shows the vehicle that the station is there.
    pub fn beat(&mut self) {
        self.say(&Uplink::Heartbeat);
    }

    /// Queues the switch to offboard mode, in which the vehicle follows setpoints.
    pub fn follow(&mut self) {
        self.say(&Uplink::Command(VehicleCommand::SelectMode(modes::custom(FlightMode::Offboard))));
    }

    /// Queues a command, and forgets the previous answer.
    pub fn command(&mut self, command: VehicleCommand) {
        self.heard.answer = None;
        self.client.command(command, RetryPolicy::ONCE);
    }

    /// Queues a ping, and starts timing its answer.
    pub fn ping(&mut self) {
        self.client.command(PING, RetryPolicy::ONCE);
        self.pings += 1;
        self.pinged = Some(Instant::now());
    }

    /// Returns all bytes queued since the last call.
    pub fn take(&mut self) -> Vec<u8> {
        self.client.take()
    }

    /// Processes bytes from the vehicle.
    pub fn hear(&mut self, bytes: &[u8]) {
        let Station { client, heard, pinged, round_trip_ms, .. } = self;
        client.hear(bytes, |_, message| match message {
            Downlink::Rotors { armed, speeds, .. } => {
                (heard.armed, heard.speeds) = (*armed, *speeds);
                heard.rotor_commands += 1;
            }
            Downlink::CommandAck { command, .. } if *command == PING.id() => {
                if let Some(pinged) = pinged.take() {
                    round_trip_ms.add(pinged.elapsed().as_secs_f64() * 1e3);
                }
            }
            Downlink::Position { position_m, .. } => heard.position_m = Some(*position_m),
            Downlink::Health(health) => {
                if heard.armed {
                    heard.state_age_max_us = heard.state_age_max_us.max(health.state_age_us);
                }
                heard.health = Some(*health);
            }
            // Heartbeats and attitudes are not used.
            _ => {}
        });
        heard.answer = client.answer(VehicleCommand::Arm);
        // The texts of a long flight would fill memory, and nobody reads them here.
        drop(client.take_texts());
    }

    /// Returns the data received from the vehicle.
    pub fn heard(&self) -> &ReceivedMessages {
        &self.heard
    }

    /// Returns the reception counts.
    pub fn counters(&self) -> &Counters {
        self.client.counters()
    }

    /// Returns the round-trip times of the pings \[ms\].
    pub fn round_trip_ms(&self) -> &Extremes {
        &self.round_trip_ms
    }

    /// Returns the number of pings without an answer.
    pub fn unanswered(&self) -> u64 {
        self.pings - self.round_trip_ms.count()
    }
}

impl ReceivedMessages {
    /// Returns the reason why the vehicle refused to arm.
    pub fn refusal(&self) -> Option<&'static str> {
        let Some(CommandResult::Refused(number)) = self.answer else { return None };
        let known = Refusal::ALL.into_iter().find(|refusal| *refusal as i32 == number).map(Refusal::reason);
        let others = [(BUSY, "refused: too many requests are queued"), (CALIBRATES, "arming refused: calibrating")];
        let other = others.into_iter().find(|(known, _)| *known == number).map(|(_, reason)| reason);
        Some(known.or(other).unwrap_or("arming refused: reason unknown"))
    }
}
