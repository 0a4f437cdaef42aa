//! A vehicle that follows the protocols strictly, and a line to it that loses, repeats and delays frames.

use afbc_ground::Client;
use afbc_mavlink::{
    Address, CommandResult, Decoder, Downlink, Encoder, FRAME_MAX, MissionItem, MissionMessage, MissionResult,
    MissionType, ParameterError, ParameterRequest, ParameterValue, Uplink, VehicleCommand,
};

pub(crate) const VEHICLE: Address = Address { system: 1, component: 1 };
pub(crate) const OTHER_VEHICLE: Address = Address { system: 2, component: 1 };
pub(crate) const COMPANION: Address = Address { system: 245, component: 191 };
/// Time after which the vehicle requests an item again \[ms\].
const AGAIN_MS: u64 = 250;
const STEP_MS: usize = 5;

/// Test vehicle that answers commands, plans and parameters as the protocols say.
pub(crate) struct Vehicle {
    sender: Encoder,
    decoder: Decoder<Uplink>,
    pub(crate) commands: Vec<VehicleCommand>,
    parameters: Vec<ParameterValue>,
    plans: [Vec<MissionItem>; 3],
    /// Upload in progress: plan, number of items, items received, and time of the last request \[ms\].
    upload: Option<(MissionType, usize, Vec<MissionItem>, u64)>,
    /// Plan of the last finished upload, and the number of its last item.
    done: Option<(MissionType, u16)>,
}

impl Vehicle {
    fn new() -> Self {
        let name = |place: u16| {
            let mut name = [0; 16];
            name[..3].copy_from_slice(format!("P{place:02}").as_bytes());
            name
        };
        let value = |place: u16| ParameterValue {
            name: name(place),
            value: f32::from(place).to_le_bytes(),
            kind: 9,
            count: 25,
            index: place,
        };
        Vehicle {
            sender: Encoder::new(VEHICLE),
            decoder: Decoder::new(VEHICLE),
            commands: Vec::new(),
            parameters: (0..25).map(value).collect(),
            plans: [const { Vec::new() }; 3],
            upload: None,
            done: None,
        }
    }

    pub(crate) fn parameters(&self) -> Vec<ParameterValue> {
        self.parameters.clone()
    }

    pub(crate) fn plan(&self, plan: MissionType) -> &[MissionItem] {
        &self.plans[usize::from(plan.0)]
    }

    /// Handles a frame; returns the answers.
    fn hear(&mut self, frame: &[u8], now_ms: u64) -> Vec<Downlink> {
        let mut heard = Vec::new();
        self.decoder.feed(frame, |from, message| heard.push((from, message)));
        heard.into_iter().flat_map(|(to, message)| self.answer(to, message, now_ms)).collect()
    }

    fn answer(&mut self, to: Address, message: Uplink, now_ms: u64) -> Vec<Downlink> {
        match message {
            Uplink::Command(command) => {
                self.commands.push(command);
                vec![Downlink::CommandAck { command: command.id(), answer: CommandResult::Accepted, to }]
            }
            Uplink::Mission(message) => self
                .plan_message(message, now_ms)
                .map(|message| Downlink::Mission { message, to })
                .into_iter()
                .collect(),
            Uplink::Parameter(ParameterRequest::List) => {
                self.parameters.iter().copied().map(Downlink::Parameter).collect()
            }
            Uplink::Parameter(ParameterRequest::ReadIndex(place)) => {
                vec![Downlink::Parameter(self.parameters[usize::from(place)])]
            }
            Uplink::Parameter(ParameterRequest::Set { name, value, .. }) => {
                let Some(known) = self.parameters.iter_mut().find(|known| known.name == name) else {
                    let error = ParameterError { name, index: -1, error: ParameterError::DOES_NOT_EXIST };
                    return vec![Downlink::ParameterError { error, to }];
                };
                known.value = value;
                vec![Downlink::Parameter(*known)]
            }
            _ => Vec::new(),
        }
    }

    fn plan_message(&mut self, message: MissionMessage, now_ms: u64) -> Option<MissionMessage> {
        match message {
            MissionMessage::Count(0, plan) => {
                self.plans[usize::from(plan.0)].clear();
                Some(MissionMessage::Ack(MissionResult::ACCEPTED, plan))
            }
            MissionMessage::Count(count, plan) => {
                self.upload = Some((plan, count.into(), Vec::new(), now_ms));
                self.done = None;
                Some(MissionMessage::Request(0, plan))
            }
            MissionMessage::Item(item, plan) => {
                let Some((_, count, held, asked_ms)) = self.upload.as_mut().filter(|(of, ..)| *of == plan) else {
                    // The acknowledgement of the last item was lost: send it again.
                    let is_done = self.done == Some((plan, item.number));
                    return is_done.then_some(MissionMessage::Ack(MissionResult::ACCEPTED, plan));
                };
                if usize::from(item.number) != held.len() {
                    return None;
                }
                held.push(item);
                if held.len() < *count {
                    *asked_ms = now_ms;
                    return Some(MissionMessage::Request(held.len() as u16, plan));
                }
                self.plans[usize::from(plan.0)] = std::mem::take(held);
                (self.upload, self.done) = (None, Some((plan, item.number)));
                Some(MissionMessage::Ack(MissionResult::ACCEPTED, plan))
            }
            _ => None,
        }
    }

    /// Returns the repeated request for an item, if it is due.
    fn update(&mut self, now_ms: u64) -> Option<Downlink> {
        let (plan, _, held, asked_ms) = self.upload.as_mut().filter(|(.., asked_ms)| now_ms > *asked_ms + AGAIN_MS)?;
        *asked_ms = now_ms;
        let message = MissionMessage::Request(held.len() as u16, *plan);
        Some(Downlink::Mission { message, to: Client::STATION })
    }
}

/// A client and a vehicle with a faulty line between them.
pub(crate) struct Line {
    pub(crate) client: Client,
    pub(crate) vehicle: Vehicle,
    strangers: [Encoder; 2],
    /// Share of frames that are lost, and share that come twice \[%\]; longest delay \[ms\].
    faults: [u64; 3],
    random: u64,
    now_ms: u64,
    /// Frames on the line: time of arrival, whether they go to the vehicle, and bytes.
    frames: Vec<(u64, bool, Vec<u8>)>,
}

impl Line {
    pub(crate) fn new(seed: u64, faults: [u64; 3]) -> Self {
        let mut client = Client::new(Client::STATION);
        // The client knows its vehicle from the start.
        client.receive(VEHICLE, &Downlink::Heartbeat { armed: false, failsafe: false, mode: 0 });
        Line {
            client,
            vehicle: Vehicle::new(),
            strangers: [Encoder::new(OTHER_VEHICLE), Encoder::new(COMPANION)],
            faults,
            random: seed | 1,
            now_ms: 0,
            frames: Vec::new(),
        }
    }

    /// Runs for `limit_ms`, or until `done` is true.
    pub(crate) fn run_until(&mut self, limit_ms: u64, mut done: impl FnMut(&mut Client) -> bool) {
        for now_ms in (self.now_ms..self.now_ms + limit_ms).step_by(STEP_MS) {
            self.now_ms = now_ms;
            self.step();
            if done(&mut self.client) {
                return;
            }
        }
    }

    fn step(&mut self) {
        let (now_ms, mut sent, mut answers) = (self.now_ms, Vec::new(), Vec::new());
        self.client.update(now_ms);
        self.client.send(|_, frame| sent.push(frame.to_vec()));
        sent.into_iter().for_each(|frame| self.put(true, frame));
        let arrived: Vec<_> = self.frames.extract_if(.., |(due_ms, ..)| *due_ms <= now_ms).collect();
        for (_, at_vehicle, frame) in arrived {
            if at_vehicle {
                answers.extend(self.vehicle.hear(&frame, now_ms));
            } else {
                self.client.hear(&frame, |_, _| ());
            }
        }
        answers.extend(self.vehicle.update(now_ms));
        if now_ms.is_multiple_of(1_000) {
            answers.push(Downlink::Heartbeat { armed: false, failsafe: false, mode: 0 });
        }
        for answer in answers {
            let frame = self.vehicle.sender.send(&answer, &mut [0; FRAME_MAX]).to_vec();
            self.put(false, frame);
        }
        if self.next().is_multiple_of(10) {
            self.disturb();
        }
    }

    /// Adds frames of others: answers by another vehicle to this station, and answers to another station.
    fn disturb(&mut self) {
        let plan = MissionType((self.next() % 3) as u8);
        let refused = |to| {
            let command = VehicleCommand::Arm.id();
            let ack = Downlink::Mission { message: MissionMessage::Ack(MissionResult::ERROR, plan), to };
            let request = Downlink::Mission { message: MissionMessage::Request(0, plan), to };
            [Downlink::CommandAck { command, answer: CommandResult::Denied, to }, ack, request]
        };
        for message in refused(Client::STATION) {
            let frame = self.strangers[0].send(&message, &mut [0; FRAME_MAX]).to_vec();
            self.put(false, frame);
        }
        for message in refused(COMPANION) {
            let frame = self.vehicle.sender.send(&message, &mut [0; FRAME_MAX]).to_vec();
            self.put(false, frame);
        }
        let frame = self.strangers[1].send(&Uplink::Heartbeat, &mut [0; FRAME_MAX]).to_vec();
        self.put(false, frame);
    }

    fn put(&mut self, at_vehicle: bool, frame: Vec<u8>) {
        let [lost, again, late_ms] = self.faults;
        for copy in 0..2 {
            let (arrives, late) = (self.next() % 100, self.next() % (late_ms + 1));
            if if copy == 0 { arrives >= lost } else { arrives < again } {
                self.frames.push((self.now_ms + late, at_vehicle, frame.clone()));
            }
        }
    }

    /// Returns a random number by xorshift.
    fn next(&mut self) -> u64 {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 7;
        self.random ^= self.random << 17;
        self.random >> 11
    }
}
