//! Files and logs on the link that telemetry and commands share.

use crate::common::{Bench, STATION};
use crate::memory::{Memory, bytes};
use afbc_comms::services::streams::{DEFAULTS, id};
use afbc_comms::{Comms, REPORT_MAX, Setup, Transfers};
use afbc_mavlink::{
    Address, CommandResult, ComponentMetadata, Decoder, Downlink, Encoder, FRAME_MAX, FileOpcode, FilePacket,
    FrameFault, LogMessage, LogRequest, MessageFormat, MessageSet, ServiceRequest, Telemetry, Transfer, Uplink,
    VehicleCommand,
};
use afbc_onboard::{Configuration, Link, Readings, parameters::ParameterTable};
use afbc_types::State;

const OTHER: Address = Address { system: 245, component: 191 };
const URI: &str = "mftp://etc/general.json";

/// All messages that a vehicle with storage sends.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "a test")]
enum Sent {
    Usual(Downlink),
    Transfer(Transfer),
}

impl MessageSet for Sent {
    fn format(id: u32) -> Option<MessageFormat> {
        Transfer::format(id).or_else(|| Downlink::format(id))
    }

    fn read(id: u32, payload: &[u8], receiver: Address) -> Result<Self, FrameFault> {
        match Transfer::format(id) {
            Some(_) => Transfer::read(id, payload, receiver).map(Sent::Transfer),
            None => Downlink::read(id, payload, receiver).map(Sent::Usual),
        }
    }

    fn write(&self, _: &mut [u8; 255]) -> (u32, u8) {
        panic!("it is only read")
    }
}

struct Vehicle {
    bench: Bench,
    transfers: Transfers<usize>,
    store: Memory,
    decoder: Decoder<Sent>,
    /// Number of bytes sent so far, and number of those that belong to transfers.
    bytes: [usize; 2],
}

impl Vehicle {
    /// Creates a vehicle on a line of `baud`, with every stream at its default.
    fn on(baud: u32) -> Self {
        let mut bench = Bench::new();
        bench.table =
            ParameterTable::new(Configuration { link: Link { baud, ..Link::DEFAULT }, ..Configuration::default() });
        bench.comms = Comms::with(Setup::of(&bench.table.configuration().link));
        let mut store = Memory::with(&[("log/a.ulg", bytes(100_000, 4)), ("etc/general.json", b"{}".to_vec())]);
        store.logs = vec![bytes(100_000, 4), bytes(50, 5)];
        let transfers = Transfers::new(Some(ComponentMetadata::at(URI, 77)));
        Vehicle { bench, transfers, store, decoder: Decoder::new(STATION), bytes: [0; 2] }
    }

    fn fills_the_line(mut self) -> Self {
        for (message, _) in DEFAULTS {
            self.hear(STATION, &Uplink::Command(VehicleCommand::SetInterval { message, interval_us: 1_000 }));
            self.step();
        }
        (0..100).for_each(|_| drop(self.step()));
        self
    }

    fn hear(&mut self, from: Address, message: &impl MessageSet) {
        let mut buffer = [0; FRAME_MAX];
        let frame = Encoder::new(from).send(message, &mut buffer);
        let Bench { comms, uplink, .. } = &mut self.bench;
        let update = comms.receive_beside(uplink, frame, &mut self.transfers);
        self.bench.inputs.merge(&update);
    }

    fn file(&mut self, from: Address, packet: FilePacket) {
        self.hear(from, &Transfer::File { packet, to: Address { system: 1, component: 1 } });
    }

    fn log(&mut self, from: Address, request: LogRequest) {
        self.hear(from, &Uplink::ServiceRequest(ServiceRequest::Log(request)));
    }

    fn step(&mut self) -> Vec<Sent> {
        if self.bench.now_us.is_multiple_of(10_000) {
            self.bench.measure(&State::default());
        }
        self.bench.now_us += 1000;
        let Bench { flight, comms, table, inputs, taken, now_us, .. } = &mut self.bench;
        inputs.take_into(taken);
        let report = flight.tick(*now_us, taken, &Readings::NONE);
        let (mut sent, mut count, mut transferred) = (Vec::new(), 0, 0);
        let mut send = |frame: &[u8]| {
            count += frame.len();
            let id = u32::from_le_bytes([frame[7], frame[8], frame[9], 0]);
            transferred += if Transfer::format(id).is_some() { frame.len() } else { 0 };
            self.decoder.feed(frame, |_, message| sent.push(message));
        };
        comms.report(&report, 0.0, &mut send);
        comms.parameters(table, &mut send);
        comms.transfer(&mut self.transfers, &mut self.store, &mut send);
        assert!(count <= REPORT_MAX, "{count} bytes");
        self.bytes[0] += count;
        self.bytes[1] += transferred;
        sent
    }

    /// Runs ticks until a wanted message is sent. Returns the message and the number of ticks.
    fn until<T>(&mut self, ticks: usize, wanted: impl Fn(&Sent) -> Option<T>) -> (T, usize) {
        for tick in 1..=ticks {
            if let Some(found) = self.step().iter().find_map(&wanted) {
                return (found, tick);
            }
        }
        panic!("not within {ticks} ticks")
    }
}

fn file(sent: &Sent) -> Option<(FilePacket, Address)> {
    match sent {
        Sent::Transfer(Transfer::File { packet, to }) => Some((*packet, *to)),
        _ => None,
    }
}

fn text(sent: &Sent) -> Option<String> {
    match sent {
        Sent::Usual(Downlink::Text { text, .. }) => text.to_str().ok().map(str::to_owned),
        _ => None,
    }
}

/// Requests are answered to the station that asks, on a full line as on an idle one.
#[test]
fn requests_are_answered_in_time() {
    for baud in [57_600, 921_600] {
        for full in [false, true] {
            let mut vehicle = Vehicle::on(baud);
            if full {
                vehicle = vehicle.fills_the_line();
            }
            for (from, sequence) in [(STATION, 3), (OTHER, 3)] {
                vehicle.file(from, FilePacket::request(sequence, FileOpcode::LIST_DIRECTORY, 0, 0, 0).with(b"/"));
                let ((packet, to), _) = vehicle.until(250, file);
                assert_eq!((packet.data(), to), (Some(&b"Detc\0Dlog\0"[..]), from));
                (0..100).for_each(|_| drop(vehicle.step()));
            }
            vehicle.log(STATION, LogRequest::List { first: 0, last: 0xFFFF });
            let entry = |sent: &Sent| match sent {
                Sent::Transfer(Transfer::Log(LogMessage::Entry(entry))) => Some(*entry),
                _ => None,
            };
            let (first, _) = vehicle.until(250, entry);
            assert_eq!((first.log, first.count, first.size), (0, 2, 100_000));
        }
    }
}

/// A download takes the bytes that telemetry leaves, and at least a fifth of the line. On a full line it takes no more
/// than that. It does not delay answers to commands.
#[test]
fn a_download_shares_the_line() {
    for baud in [57_600, 921_600] {
        for full in [false, true] {
            let mut vehicle = Vehicle::on(baud);
            if full {
                vehicle = vehicle.fills_the_line();
            }
            let measure = |vehicle: &mut Vehicle| {
                let [all_before, transferred_before] = vehicle.bytes;
                let mut waited = 0;
                for second in 0..5 {
                    let command = 30_000 + second;
                    vehicle.hear(STATION, &Uplink::Command(VehicleCommand::Other(command)));
                    let is_answer = |sent: &Sent| match sent {
                        Sent::Usual(Downlink::CommandAck { command: answered, .. }) => {
                            (*answered == command).then_some(())
                        }
                        _ => None,
                    };
                    let ((), ticks) = vehicle.until(1000, is_answer);
                    waited = waited.max(ticks);
                    (ticks..1000).for_each(|_| drop(vehicle.step()));
                }
                let transferred = vehicle.bytes[1] - transferred_before;
                (vehicle.bytes[0] - all_before - transferred, transferred, waited)
            };
            // Number of bytes that may be sent in five seconds.
            let budget = 5 * baud as usize / 10 * 9 / 10;
            let (before, none, _) = measure(&mut vehicle);
            vehicle.store.logs[0] = bytes(1_000_000, 4);
            vehicle.log(STATION, LogRequest::Data { log: 0, offset: 0, bytes: u32::MAX });
            let (during, transferred, waited) = measure(&mut vehicle);
            assert_eq!(none, 0);
            assert!(during + transferred <= budget + 700, "{during} and {transferred} of {budget} bytes");
            assert!(waited <= 2, "answered after {waited} ms");
            // The download takes at least a fifth and all that telemetry leaves. Telemetry keeps the rest.
            let spare = budget.saturating_sub(before).max(budget / 5);
            assert!(transferred * 100 >= spare * 90, "{transferred} of {spare} bytes");
            let kept = before.min(budget * 4 / 5);
            assert!(during * 100 >= kept * 97, "{during} of {kept} bytes");
        }
    }
}

#[test]
fn a_file_is_downloaded_in_bursts() {
    let mut vehicle = Vehicle::on(921_600);
    vehicle.file(STATION, FilePacket::request(1, FileOpcode::OPEN_FILE_RO, 0, 0, 0).with(b"/log/a.ulg"));
    let ((opened, _), _) = vehicle.until(250, file);
    assert_eq!(opened.opcode, FileOpcode::ACK);
    let mut read: Vec<u8> = Vec::new();
    let mut sequence = 100;
    'file: loop {
        sequence += 1000;
        let offset = read.len() as u32;
        vehicle.file(STATION, FilePacket::request(sequence, FileOpcode::BURST_READ_FILE, opened.session, offset, 239));
        let mut complete = false;
        while !complete {
            for (packet, to) in vehicle.step().iter().filter_map(file) {
                assert_eq!(to, STATION);
                if packet.opcode == FileOpcode::NAK {
                    break 'file;
                }
                read.extend(packet.data().expect("data"));
                complete = packet.burst_complete;
            }
        }
    }
    assert!(read == vehicle.store.files["log/a.ulg"]);
}

/// Transfers take spare bytes only if that does not delay telemetry.
#[test]
fn a_transfer_keeps_nothing_back() {
    let streamed = id::ATTITUDE_QUATERNION;
    let by_file = |vehicle: &mut Vehicle| {
        vehicle.file(STATION, FilePacket::request(1, FileOpcode::OPEN_FILE_RO, 0, 0, 0).with(b"/log/a.ulg"));
        let ((opened, _), _) = vehicle.until(500, file);
        vehicle.file(STATION, FilePacket::request(3, FileOpcode::BURST_READ_FILE, opened.session, 0, 239));
    };
    let by_log = |vehicle: &mut Vehicle| vehicle.log(STATION, LogRequest::Data { log: 0, offset: 0, bytes: u32::MAX });
    for begin in [by_file, by_log] as [fn(&mut Vehicle); 2] {
        let mut vehicle = Vehicle::on(57_600);
        for (message, _) in DEFAULTS {
            let interval_us = if message == streamed { 100_000 } else { -1 };
            vehicle.hear(STATION, &Uplink::Command(VehicleCommand::SetInterval { message, interval_us }));
            vehicle.step();
        }
        begin(&mut vehicle);
        // The saved-up budgets of the line and of the transfers are spent within half a second.
        (0..500).for_each(|_| drop(vehicle.step()));
        let before = vehicle.bytes[1];
        let is_it = |sent: &Sent| matches!(sent, Sent::Usual(Downlink::Telemetry(Telemetry::Attitude(_))));
        let sent: Vec<_> = (0..5000).filter(|_| vehicle.step().iter().any(is_it)).collect();
        assert!(vehicle.bytes[1] - before > 20_000, "{} bytes", vehicle.bytes[1] - before);
        // A heartbeat can delay the stream by 5 ms.
        assert!(sent.len() >= 49 && sent.windows(2).all(|two| (94..=106).contains(&(two[1] - two[0]))), "{sent:?}");
    }
}

/// MAVProxy requests twenty gaps of a log at once.
#[test]
fn many_requests_at_once_are_kept() {
    let mut vehicle = Vehicle::on(921_600);
    let gaps: Vec<u32> = (0..20).map(|gap| 450 * gap).collect();
    for offset in &gaps {
        vehicle.log(STATION, LogRequest::Data { log: 0, offset: *offset, bytes: 90 });
    }
    let sent: Vec<_> = (0..250).flat_map(|_| vehicle.step()).collect();
    let filled = sent.iter().filter_map(|sent| match sent {
        Sent::Transfer(Transfer::Log(LogMessage::Data(part))) => Some(part.offset),
        _ => None,
    });
    assert_eq!(filled.collect::<Vec<_>>(), gaps);
}

#[test]
fn metadata_is_told_on_request() {
    let mut vehicle = Vehicle::on(57_600).fills_the_line();
    for message in [397, 395] {
        vehicle.hear(STATION, &Uplink::Command(VehicleCommand::RequestMessage { message, index: 0 }));
        let (mut answered, mut told) = (None, None);
        for _ in 0..250 {
            for sent in vehicle.step() {
                match sent {
                    Sent::Usual(Downlink::CommandAck { command: 512, answer, to }) => answered = Some((answer, to)),
                    Sent::Transfer(Transfer::Metadata(metadata)) => told = Some((397, metadata)),
                    Sent::Transfer(Transfer::Information(metadata)) => told = Some((395, metadata)),
                    _ => (),
                }
            }
        }
        assert_eq!(answered, Some((CommandResult::Accepted, STATION)));
        let (kind, metadata) = told.expect("told");
        assert_eq!((kind, metadata.crc, metadata.time_ms > 0), (message, 77, true));
        assert!(metadata.uri.starts_with(URI.as_bytes()) && metadata.uri[URI.len()] == 0);
    }
    // Other messages can still be requested. The capabilities show that there is file transfer.
    vehicle
        .hear(STATION, &Uplink::Command(VehicleCommand::RequestMessage { message: id::AUTOPILOT_VERSION, index: 0 }));
    let (capabilities, _) = vehicle.until(250, |sent| match sent {
        Sent::Usual(Downlink::Telemetry(Telemetry::Version(version))) => Some(version.capabilities),
        _ => None,
    });
    assert_eq!(capabilities & 32, 32);
}

#[test]
fn logs_are_erased_while_disarmed_and_by_the_station_in_control() {
    let mut vehicle = Vehicle::on(921_600);
    vehicle.bench = Bench::flying();
    vehicle.log(STATION, LogRequest::Erase);
    let (refused, _) = vehicle.until(50, text);
    assert_eq!((refused.as_str(), vehicle.store.logs.len()), ("logs not erased: disarm the vehicle first", 2));
    let remove = FilePacket::request(1, FileOpcode::REMOVE_FILE, 0, 0, 0).with(b"/log/a.ulg");
    vehicle.file(STATION, remove);
    let ((packet, _), _) = vehicle.until(50, file);
    assert_eq!((packet.opcode, packet.data()), (FileOpcode::NAK, Some(&[9][..])));

    let mut vehicle = Vehicle::on(921_600);
    vehicle.step();
    // A station that gives an order takes control. Other stations may read but not erase.
    vehicle.hear(STATION, &Uplink::Command(VehicleCommand::Speed(1.0)));
    vehicle.log(OTHER, LogRequest::Erase);
    vehicle.file(OTHER, remove);
    let ((packet, to), _) = vehicle.until(50, file);
    assert_eq!((packet.opcode, packet.data(), to), (FileOpcode::NAK, Some(&[9][..]), OTHER));
    assert_eq!((vehicle.store.logs.len(), vehicle.store.changes), (2, 0));
    vehicle.log(STATION, LogRequest::Erase);
    vehicle.until(50, |sent| text(sent).filter(|text| text == "logs erased"));
    assert!(vehicle.store.logs.is_empty());
    vehicle.file(STATION, FilePacket { sequence: 2, ..remove });
    let ((packet, _), _) = vehicle.until(50, file);
    assert_eq!((packet.opcode, vehicle.store.changes), (FileOpcode::ACK, 1));
}

/// A log stream is started and stopped by commands while other messages are sent. A vehicle without a log refuses it.
#[test]
fn the_log_is_streamed() {
    let part = |sent: &Sent| match sent {
        Sent::Transfer(Transfer::LogPart(part)) => Some(*part),
        _ => None,
    };
    let mut vehicle = Vehicle::on(921_600).fills_the_line();
    vehicle.hear(OTHER, &Uplink::Command(VehicleCommand::StartLogStream));
    let (said, _) = vehicle.until(100, text);
    assert_eq!(said, "no log to stream");

    // The log has definitions of 1 kB and a large amount of data.
    let mut log = vec![0; 16];
    for (kind, length, count) in [(b'P', 97_u16, 10), (b'D', 247, 4000)] {
        for _ in 0..count {
            log.extend_from_slice(&length.to_le_bytes());
            log.push(kind);
            log.extend(bytes(length.into(), 9));
        }
    }
    vehicle.store.made = Some(log.clone());
    vehicle.hear(OTHER, &Uplink::Command(VehicleCommand::StartLogStream));
    let answer = |sent: &Sent| match sent {
        Sent::Usual(Downlink::CommandAck { command: 2510, answer, .. }) => Some(*answer),
        _ => None,
    };
    let mut read: Vec<u8> = Vec::new();
    let mut answers = Vec::new();
    for _ in 0..3000 {
        for sent in vehicle.step() {
            answers.extend(answer(&sent));
            let Some(part) = part(&sent) else { continue };
            assert_eq!(part.to, OTHER);
            assert_eq!(part.to_be_acknowledged, read.len() < 16 + 1000);
            read.extend_from_slice(&part.data[..part.length.into()]);
            if part.to_be_acknowledged {
                vehicle.log(OTHER, LogRequest::Received(part.sequence));
            }
        }
    }
    assert_eq!(answers, [CommandResult::Accepted]);
    assert_eq!(read, log[..read.len()]);
    // Telemetry leaves the log stream a fifth of the line, for 3 s at 92 kB/s.
    assert!((40_000..80_000).contains(&read.len()), "{}", read.len());
    // Another station's file request goes first and is answered in time.
    vehicle.file(STATION, FilePacket::request(1, FileOpcode::LIST_DIRECTORY, 0, 0, 0).with(b"log"));
    vehicle.until(100, file);

    vehicle.hear(OTHER, &Uplink::Command(VehicleCommand::StopLogStream));
    vehicle.step();
    assert!((0..200).all(|_| vehicle.step().iter().all(|sent| part(sent).is_none())));
    assert!(!vehicle.store.makes);
}
