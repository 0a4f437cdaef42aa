//! A ground station's end of the link to a vehicle.

use crate::commands::{CommandState, PendingCommands};
use crate::parameters::VehicleParameters;
use crate::retry::RetryPolicy;
use crate::uploads::{UploadEnd, Uploads};
use crate::vehicle::{VehicleState, VehicleText};
use afbc_mavlink::{
    Address, CommandResult, Counters, Decoder, Downlink, Encoder, FRAME_MAX, MissionItem, MissionType,
    ParameterRequest, ReceivedFrame, Uplink, VehicleCommand,
};

/// A ground station or companion computer that talks to one vehicle.
///
/// The client has no socket, clock or thread: [`Client::hear`] takes received bytes, [`Client::update`] takes the time,
/// and [`Client::send`] hands out the frames to send.
pub struct Client {
    address: Address,
    sender: Encoder,
    decoder: Decoder<Downlink>,
    outgoing: Vec<Uplink>,
    now_ms: Option<u64>,
    heartbeat_ms: Option<u64>,
    vehicle: VehicleState,
    commands: PendingCommands,
    uploads: Uploads,
    parameters: VehicleParameters,
}

impl Client {
    /// Usual MAVLink address of a ground station.
    pub const STATION: Address = Address { system: 255, component: 190 };

    /// Creates a client with this address that sends no heartbeat.
    pub fn new(address: Address) -> Self {
        Client {
            address,
            sender: Encoder::new(address),
            decoder: Decoder::new(address),
            outgoing: Vec::new(),
            now_ms: None,
            heartbeat_ms: None,
            vehicle: VehicleState::default(),
            commands: PendingCommands::default(),
            uploads: Uploads::default(),
            parameters: VehicleParameters::default(),
        }
    }

    /// Sends a heartbeat at each multiple of this period \[ms\]; `None` sends none.
    pub fn set_heartbeat_period(&mut self, heartbeat_ms: Option<u64>) {
        self.heartbeat_ms = heartbeat_ms.filter(|period_ms| *period_ms > 0);
    }

    /// Returns the state that the vehicle has reported.
    pub fn vehicle(&self) -> &VehicleState {
        &self.vehicle
    }

    /// Returns the status texts since the last call.
    pub fn take_texts(&mut self) -> Vec<VehicleText> {
        std::mem::take(&mut self.vehicle.texts)
    }

    /// Returns the vehicle's parameters.
    pub fn parameters(&self) -> &VehicleParameters {
        &self.parameters
    }

    /// Returns the reception counts.
    pub fn counters(&self) -> &Counters {
        self.decoder.counters()
    }

    /// Queues a message.
    pub fn say(&mut self, message: Uplink) {
        self.outgoing.push(message);
    }

    /// Sends a command, and repeats it until it is answered or `retry_policy` ends.
    pub fn command(&mut self, command: VehicleCommand, retry_policy: RetryPolicy) {
        self.commands.give(command, retry_policy, self.now_ms());
        self.say(Uplink::Command(command));
    }

    /// Returns the state of the last command with the same number as `command`.
    pub fn state(&self, command: VehicleCommand) -> Option<CommandState> {
        self.commands.state(command)
    }

    /// Returns the answer to `command`, once there is one.
    pub fn answer(&self, command: VehicleCommand) -> Option<CommandResult> {
        match self.commands.state(command) {
            Some(CommandState::Answered { answer, .. }) => Some(answer),
            _ => None,
        }
    }

    /// Uploads plans one after the other. They replace the plans that have not been uploaded yet.
    pub fn upload(
        &mut self,
        plans: impl IntoIterator<Item = (MissionType, Vec<MissionItem>)>,
        retry_policy: RetryPolicy,
    ) {
        let offer = self.uploads.begin(plans, retry_policy, self.now_ms());
        self.outgoing.extend(offer.map(Uplink::Mission));
    }

    /// Returns how the upload ended; only the first call returns it.
    pub fn take_upload_end(&mut self) -> Option<UploadEnd> {
        self.uploads.take_end()
    }

    /// Reads all parameters, and requests missing ones again.
    pub fn read_parameters(&mut self) {
        let request = self.parameters.read(self.now_ms());
        self.say(Uplink::Parameter(request));
    }

    /// Sets a parameter. At most 16 letters of the name count. The vehicle answers with its value, or with an error.
    pub fn set_parameter(&mut self, name: &str, value: f32) {
        self.say(Uplink::Parameter(ParameterRequest::set(name, value)));
    }

    /// Sets the time: queues due repetitions and the heartbeat.
    pub fn update(&mut self, now_ms: u64) {
        let before_ms = self.now_ms.replace(now_ms);
        let Client { outgoing, commands, uploads, parameters, .. } = self;
        commands.update(now_ms, |command| outgoing.push(Uplink::Command(command)));
        outgoing.extend(uploads.update(now_ms).map(Uplink::Mission));
        parameters.update(now_ms, |request| outgoing.push(Uplink::Parameter(request)));
        let beats = self.heartbeat_ms.is_some_and(|period_ms| match before_ms {
            Some(before_ms) => now_ms / period_ms > before_ms / period_ms,
            None => now_ms.is_multiple_of(period_ms),
        });
        if beats {
            self.say(Uplink::Heartbeat);
        }
    }

    /// Passes each queued message and its frame to `send`, in order.
    pub fn send(&mut self, mut send: impl FnMut(&Uplink, &[u8])) {
        for message in self.outgoing.drain(..) {
            send(&message, self.sender.send(&message, &mut [0; FRAME_MAX]));
        }
    }

    /// Returns the frames of all queued messages.
    pub fn take(&mut self) -> Vec<u8> {
        let mut bytes = Vec::new();
        self.send(|_, frame| bytes.extend_from_slice(frame));
        bytes
    }

    /// Decodes received bytes, in pieces of any size. Passes to `see` each message of the vehicle that is addressed to
    /// this station or to all. Signed frames are ignored.
    pub fn hear(&mut self, bytes: &[u8], see: impl FnMut(Address, &Downlink)) {
        self.hear_accepted(bytes, |frame| frame.stamp().is_none(), see);
    }

    /// As [`Client::hear`], for the frames that `accept` accepts.
    pub fn hear_accepted(
        &mut self,
        bytes: &[u8],
        accept: impl FnMut(&ReceivedFrame<'_>) -> bool,
        mut see: impl FnMut(Address, &Downlink),
    ) {
        let mut messages = Vec::new();
        self.decoder.feed_accepted(bytes, accept, |from, message| messages.push((from, message)));
        for (from, message) in &messages {
            if self.receive(*from, message) {
                see(*from, message);
            }
        }
    }

    /// Handles a message that was decoded elsewhere. Returns false if another vehicle sent it, or it is for another
    /// station.
    pub fn receive(&mut self, from: Address, message: &Downlink) -> bool {
        let now_ms = self.now_ms();
        let to = match message {
            Downlink::CommandAck { to, .. }
            | Downlink::Mission { to, .. }
            | Downlink::ParameterError { to, .. }
            | Downlink::Refusal { to, .. } => *to,
            _ => Address::default(),
        };
        if !self.address.is_meant_by(to) || !self.vehicle.hear(from, message, now_ms) {
            return false;
        }
        match message {
            Downlink::CommandAck { command, answer, .. } => self.commands.hear(*command, *answer, now_ms),
            Downlink::Mission { message, .. } => {
                let answer = self.uploads.hear(message, now_ms);
                self.outgoing.extend(answer.map(Uplink::Mission));
            }
            Downlink::Parameter(value) => self.parameters.hear(value, now_ms),
            _ => (),
        }
        true
    }

    fn now_ms(&self) -> u64 {
        self.now_ms.unwrap_or_default()
    }
}
