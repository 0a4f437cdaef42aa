//! Sends very many random frames of several stations, some nested or damaged, through all services. `FRAMES` sets their
//! number, and `scripts/flood` runs more. Nothing panics, every command is answered exactly once to its sender, and no
//! station that is not in control gives an order. The test stands in for flight core and guidance, which answer at
//! random. A second test does the same with a signing key that no sender has.

use afbc_comms::services::control::{SILENT_US, is_needed_for};
use afbc_comms::services::origin::EarthOrigin;
use afbc_comms::{AuxSensors, Comms, REPORT_MAX};
use afbc_flight_core::inbox::QUEUE_MAX;
use afbc_flight_core::{Refusal, Request, Ticketed};
use afbc_guidance::{FlightMode, GuidanceOutputs, Order, OrderRefusal};
use afbc_mavlink::{
    Address, CommandResult, ControlRequest, Counters, Decoder, Downlink, Encoder, ExternalTarget, FRAME_MAX,
    MessageSet, MissionMessage, ParameterRequest, SIGNED_FRAME_MAX, SetupSigning, SigningKey, Stamp, Uplink,
    VehicleCommand,
};
use afbc_onboard::parameters::ParameterTable;
use afbc_onboard::{Configuration, ControlInputs, Flight, Readings, Report};
use afbc_types::State;
use std::collections::{BTreeMap, VecDeque};

const STATIONS: [Address; 4] = [
    Address { system: 255, component: 190 },
    Address { system: 245, component: 190 },
    Address { system: 42, component: 1 },
    Address { system: 1, component: 191 },
];
const VEHICLE: Address = Address { system: 1, component: 1 };
/// Messages that may contain other frames, with their checksum seeds: TUNNEL and FILE_TRANSFER_PROTOCOL.
const CARRIERS: [(u32, u8); 2] = [(385, 147), (110, 84)];
/// Number of frames in a usual run.
const FRAMES: u64 = 200_000;

/// SplitMix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    fn below(&mut self, count: usize) -> usize {
        (self.next() % count as u64) as usize
    }

    fn of<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.below(choices.len())]
    }

    fn word(&mut self) -> [u8; 4] {
        match self.below(4) {
            0 => (self.next() as u32).to_le_bytes(),
            1 => self.of(&[0.0_f32, 1.0, 2.0, 3.0, 4.0, 6.0, -1.0, 21196.0, 511.0, f32::NAN]).to_le_bytes(),
            2 => (self.below(500) as f32).to_le_bytes(),
            _ => (self.below(4) as u32).to_le_bytes(),
        }
    }
}

/// CRC-16/MCRF4XX.
fn crc(bytes: &[u8], extra: u8) -> u16 {
    bytes.iter().chain([&extra]).fold(0xFFFF, |crc: u16, byte| {
        let low = byte ^ crc as u8;
        let low = low ^ (low << 4);
        let wide = u16::from(low);
        (crc >> 8) ^ (wide << 8) ^ (wide << 3) ^ (wide >> 4)
    })
}

fn frame(from: Address, sequence: u8, id: u32, payload: &[u8], seed: u8) -> Vec<u8> {
    let [a, b, c, _] = id.to_le_bytes();
    let mut frame = vec![0xFD, payload.len() as u8, 0, 0, sequence, from.system, from.component, a, b, c];
    frame.extend_from_slice(payload);
    let sum = crc(&frame[1..], seed);
    frame.extend_from_slice(&sum.to_le_bytes());
    frame
}

/// The station that should be in control.
#[derive(Default)]
struct Model(Option<(Address, u64)>);

impl Model {
    fn holder(&self, now_us: u64) -> Option<Address> {
        self.0.filter(|(_, heard_us)| now_us - heard_us <= SILENT_US).map(|(holder, _)| holder)
    }

    /// Follows a message. Returns true if its sender may change something with it.
    fn hear(&mut self, from: Address, message: &Uplink, now_us: u64) -> bool {
        if matches!(message, Uplink::State { .. } | Uplink::Pose { .. }) {
            return false;
        }
        // A holder that was silent is in control again, unless another station has taken over.
        if self.0.is_some_and(|(holder, _)| holder == from) {
            self.0 = Some((from, now_us));
        }
        let holder = self.holder(now_us);
        let needs = match message {
            Uplink::Command(command) => is_needed_for(*command),
            Uplink::Setpoint(_) | Uplink::Target(_) | Uplink::Control(ControlRequest::Take) => true,
            Uplink::Mission(message) => {
                matches!(message, MissionMessage::Count(..) | MissionMessage::Clear(_) | MissionMessage::SetCurrent(_))
            }
            Uplink::Parameter(message) => matches!(message, ParameterRequest::Set { .. }),
            _ => false,
        };
        match (message, holder) {
            (Uplink::Control(ControlRequest::Release), Some(holder)) if holder == from => self.0 = None,
            (_, None) if needs => self.0 = Some((from, now_us)),
            _ => (),
        }
        holder == Some(from) || (needs && holder.is_none())
    }
}

#[test]
fn every_command_is_answered_once_to_its_sender() {
    let frames = std::env::var("FRAMES").map_or(FRAMES, |number| number.parse().expect("FRAMES: a number"));
    let seed = std::env::var("SEED").map_or(7, |number| number.parse().expect("SEED: a number"));
    let mut random = Random(seed);
    let ids: Vec<(u32, u8, usize)> =
        (0..500).filter_map(|id| Uplink::format(id).map(|format| (id, format.extra_crc, format.length_max))).collect();
    let (mut inputs, mut taken) = (ControlInputs::EMPTY, ControlInputs::EMPTY);
    let mut flight: Flight = Flight::new(&Configuration::default()).expect("valid");
    let mut idle = flight.tick(1_000, &mut taken, &Readings::NONE);
    let mut comms = Comms::new();
    let mut decoder = comms.decoder();
    let mut table: ParameterTable = ParameterTable::new(Configuration::default());
    comms.set_aux_sensors(AuxSensors { origin: EarthOrigin::new(EarthOrigin::SIMULATED), ..AuxSensors::default() });
    let mut orders: VecDeque<Ticketed<Order>> = VecDeque::new();
    let mut model = Model::default();
    // Number of expected answers less those received, per command and station.
    let mut due: BTreeMap<(u16, (u8, u8)), i64> = BTreeMap::new();
    let mut listener = Decoder::<Uplink>::new(VEHICLE);
    let mut station = Decoder::<Downlink>::new(STATIONS[0]);
    let (mut commands, mut answers, mut given, mut sent) = (0_u64, 0_u64, 0_u64, 0);

    while sent < frames || due.values().any(|count| *count != 0) {
        assert!(sent < frames + 1_000_000, "unanswered: {:?}", due.iter().find(|(_, count)| **count != 0));
        // Messages that arrive before a tick have the time of the previous tick.
        let before_us = if idle.time_us == 1_000 { 0 } else { idle.time_us };
        idle.time_us += 1000;
        // Sometimes all stations are silent for longer than allowed.
        let burst = if sent >= frames { 0 } else { random.below(3) };
        if random.below(5_000) == 0 {
            idle.time_us += 2 * SILENT_US;
        }
        let mut stream = Vec::new();
        for _ in 0..burst {
            let from = random.of(&STATIONS);
            let is_command = random.below(2) == 0;
            let (id, seed, length) = if is_command { (76 - random.below(2) as u32, 0, 33) } else { random.of(&ids) };
            let seed = if is_command { Uplink::format(id).expect("known").extra_crc } else { seed };
            let mut payload: Vec<u8> = (0..length.div_ceil(4)).flat_map(|_| random.word()).collect();
            payload.truncate(length);
            if is_command {
                let number =
                    if random.below(8) == 0 { random.next() as u16 } else { random.of(&VehicleCommand::KNOWN) };
                payload[28..30].copy_from_slice(&number.to_le_bytes());
                payload[30..32].copy_from_slice(&random.of(&[[1, 1], [1, 0], [0, 0], [2, 1]]));
            }
            let whole = frame(from, random.next() as u8, id, &payload, seed);
            match random.below(12) {
                0 => {
                    let (carrier, seed) = random.of(&CARRIERS);
                    stream.extend(frame(from, 0, carrier, &whole[..whole.len().min(200)], seed));
                }
                1 => stream.extend(&whole[..random.below(whole.len())]),
                2 => {
                    let mut damaged = whole;
                    let place = random.below(damaged.len());
                    damaged[place] ^= 1 << random.below(8);
                    stream.extend(damaged);
                }
                _ => stream.extend(whole),
            }
            sent += 1;
        }
        // The vehicle's decoder, which has its own tests, finds the messages in the stream.
        let mut may = false;
        listener.feed(&stream, |from, message| {
            may |= model.hear(from, &message, before_us);
            if let Uplink::Command(command) = message {
                commands += 1;
                *due.entry((command.id(), (from.system, from.component))).or_default() += 1;
            }
            // Sticks that reach the guidance are within their range.
            if let Uplink::Target(ExternalTarget::Sticks(sticks)) = message {
                assert!([sticks.roll, sticks.pitch, sticks.throttle, sticks.yaw].iter().all(|it| it.abs() <= 1.0));
            }
        });
        let update = comms.receive(&mut decoder, &stream);
        if !may {
            let heard_only = afbc_guidance::Orders { heard_us: update.orders.heard_us, ..Default::default() };
            assert_eq!(update.orders, heard_only, "after {sent} frames");
            assert_eq!(update.inbox.setpoint(), None);
            let stops = |request| matches!(request, Request::Disarm | Request::Kill);
            assert!(update.inbox.asked().is_none_or(|asked| stops(asked.value)), "after {sent} frames");
        }
        inputs.merge(&update);
        inputs.take_into(&mut taken);
        orders.extend(core::iter::from_fn(|| taken.orders.given.pop_front()));
        assert!(orders.len() <= QUEUE_MAX);

        // Random answers of flight core and guidance.
        let answer = taken.inbox.asked().map(|asked| {
            let result = if random.below(2) == 0 { Ok(()) } else { Err(random.of(&Refusal::ALL)) };
            afbc_flight_core::RequestAnswer { ticket: asked.ticket, request: asked.value, result }
        });
        let ordered = orders.pop_front().map(|order| {
            given += 1;
            let declined = random.of(&[OrderRefusal::NotArmed, OrderRefusal::NoTargets, OrderRefusal::OutOfRange]);
            (order.ticket, if random.below(2) == 0 { Ok(()) } else { Err(declined) })
        });
        let guided = GuidanceOutputs {
            mode: random.of(&FlightMode::ALL),
            answer: ordered,
            wanted: random.below(4) as u16,
            reached: (random.below(50) == 0).then(|| random.below(4) as u16),
            ..GuidanceOutputs::default()
        };
        let estimate = (random.below(2) == 0).then(State::default);
        let report = Report { answer, guided, estimate, ..idle };
        let mut bytes = 0;
        let mut send = |frame: &[u8]| {
            bytes += frame.len();
            station.feed(frame, |_, message| match message {
                Downlink::CommandAck { answer: CommandResult::InProgress, .. } => (),
                Downlink::CommandAck { command, to, .. } => {
                    answers += 1;
                    let count = due.entry((command, (to.system, to.component))).or_default();
                    *count -= 1;
                    assert!(*count >= 0, "command {command} answered more often than it was given");
                }
                Downlink::Health(health) => assert_eq!(health.unanswered, 0),
                _ => (),
            });
        };
        comms.report(&report, 0.0, &mut send);
        let change = comms.parameters(&mut table, &mut send);
        assert!(change.is_none() || !report.mode.armed());
        assert!(bytes <= REPORT_MAX, "{bytes} bytes");
    }
    println!("{sent} frames: {commands} commands, {answers} answers, {given} orders");
    assert_eq!(commands, answers);
    let counters = *station.counters();
    assert_eq!(counters, Counters { received: counters.received, ..Counters::default() }, "all can be read");
    assert!(given > 0 && commands > frames / 8);
}

/// Builds a frame with the signature flag, followed by these bytes.
fn flagged(from: Address, id: u32, payload: &[u8], seed: u8, signature: &[u8]) -> Vec<u8> {
    let mut signed = frame(from, 0, id, payload, seed);
    signed[2] = 1;
    let end = signed.len() - 2;
    let sum = crc(&signed[1..end], seed);
    signed[end..].copy_from_slice(&sum.to_le_bytes());
    signed.extend_from_slice(signature);
    signed
}

/// Frames are unsigned, signed at random, signed with another key, or replayed. None reaches the control tick, no
/// command is answered, and no parameter is sent.
#[test]
fn nothing_commands_without_the_key() {
    let frames = std::env::var("FRAMES").map_or(FRAMES, |number| number.parse().expect("FRAMES: a number"));
    let seed = std::env::var("SEED").map_or(7, |number| number.parse().expect("SEED: a number"));
    let mut random = Random(seed);
    let ids: Vec<(u32, u8, usize)> = (0..500)
        .filter_map(|id| Uplink::format(id).map(|format| (id, format.extra_crc, format.length_max)))
        // SETUP_SIGNING over a radio link is refused with a text.
        .filter(|(id, ..)| *id != SetupSigning::ID)
        .collect();
    let (key, other, mut time_10us) = (SigningKey([1; 32]), SigningKey([2; 32]), 37_000_000_000_000);
    let mut comms = Comms::new();
    let (mut wired, mut decoder) = (comms.decoder().wired(), comms.decoder());
    let setup = Uplink::Signing(SetupSigning { key: Some(key), time_10us });
    let _ = comms.receive(&mut wired, Encoder::new(STATIONS[0]).send(&setup, &mut [0; FRAME_MAX]));
    let mut table: ParameterTable = ParameterTable::new(Configuration::default());
    let mut flight: Flight = Flight::new(&Configuration::default()).expect("valid");
    let mut taken = ControlInputs::EMPTY;
    let mut report = flight.tick(1_000, &mut taken, &Readings::NONE);
    let mut listener = Decoder::<Downlink>::new(STATIONS[0]);
    // These frames are genuine heartbeats, each received once.
    let mut captured = Vec::new();
    for from in STATIONS {
        for _ in 0..50 {
            time_10us += 1;
            let stamp = Stamp { link: 0, time_10us };
            let mut buffer = [0; SIGNED_FRAME_MAX];
            let frame = Encoder::new(from).send_signed(&Uplink::Heartbeat, Some((&key, stamp)), &mut buffer).to_vec();
            let _ = comms.receive(&mut decoder, &frame);
            captured.push(frame);
        }
    }
    for sent in 0..frames {
        let from = random.of(&STATIONS);
        let (id, seed, length) = random.of(&ids);
        let mut payload: Vec<u8> = (0..length.div_ceil(4)).flat_map(|_| random.word()).collect();
        payload.truncate(length);
        time_10us += random.below(3) as u64;
        let bytes = match random.below(4) {
            0 => frame(from, 0, id, &payload, seed),
            1 => {
                let mut signature = [0; 13];
                signature[1..7].copy_from_slice(&time_10us.to_le_bytes()[..6]);
                signature[7..].copy_from_slice(&random.next().to_le_bytes()[..6]);
                flagged(from, id, &payload, seed, &signature)
            }
            2 => {
                let Ok(message) = Uplink::read(id, &payload, VEHICLE) else { continue };
                let (stamp, mut buffer) = (Stamp { link: 0, time_10us }, [0; SIGNED_FRAME_MAX]);
                Encoder::new(from).send_signed(&message, Some((&other, stamp)), &mut buffer).to_vec()
            }
            _ => captured[random.below(captured.len())].clone(),
        };
        let update = comms.receive(&mut decoder, &bytes);
        assert_eq!(update.orders, afbc_guidance::Orders::default(), "frame {sent}");
        assert!(update.inbox.setpoint().is_none() && update.inbox.asked().is_none(), "frame {sent}");
        assert!(update.inbox.pose().is_none(), "frame {sent}");
        if sent % 100 == 0 {
            report.time_us += 1000;
            let mut send = |frame: &[u8]| {
                listener.feed_accepted(
                    frame,
                    |frame| frame.is_signed_by(&key),
                    |_, message| {
                        let asked = matches!(message, Downlink::CommandAck { .. } | Downlink::Parameter(_));
                        assert!(!asked, "frame {sent}: {message:?}");
                    },
                );
            };
            comms.report(&report, 0.0, &mut send);
            assert_eq!(comms.parameters(&mut table, &mut send), None, "frame {sent}");
        }
    }
    assert_eq!(listener.counters().unsupported, 0, "all that is sent is signed");
    assert!(listener.counters().received > 10);
}
