//! A vehicle with logs but no other files: logs are listed, downloaded and erased while other messages are sent too.

use crate::common::{Bench, STATION};
use crate::memory::{Memory, bytes};
use afbc_comms::LogServer;
use afbc_flight_core::Mode;
use afbc_mavlink::{
    Address, Decoder, Downlink, Encoder, FRAME_MAX, FrameFault, LogMessage, LogRequest, MessageFormat, MessageSet,
    ServiceRequest, Uplink,
};
use afbc_onboard::Report;

/// A message of the log service, or any other message of the vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "a test")]
enum Sent {
    Log(LogMessage),
    Usual(Downlink),
}

impl MessageSet for Sent {
    fn format(id: u32) -> Option<MessageFormat> {
        LogMessage::format(id).or_else(|| Downlink::format(id))
    }

    fn read(id: u32, payload: &[u8], receiver: Address) -> Result<Self, FrameFault> {
        match LogMessage::format(id) {
            Some(_) => LogMessage::read(id, payload, receiver).map(Sent::Log),
            None => Downlink::read(id, payload, receiver).map(Sent::Usual),
        }
    }

    fn write(&self, _: &mut [u8; 255]) -> (u32, u8) {
        panic!("it is only read")
    }
}

struct Vehicle {
    bench: Bench,
    server: LogServer,
    store: Memory,
    report: Report,
    decoder: Decoder<Sent>,
}

impl Vehicle {
    fn new() -> Self {
        let mut bench = Bench::new();
        let (report, _) = bench.step();
        let store = Memory { logs: vec![bytes(1000, 4), bytes(50, 5)], slow: 2, ..Memory::default() };
        Vehicle { bench, server: LogServer::default(), store, report, decoder: Decoder::new(STATION) }
    }

    fn hear(&mut self, message: &impl MessageSet) {
        let mut buffer = [0; FRAME_MAX];
        let frame = Encoder::new(STATION).send(message, &mut buffer);
        let Bench { comms, uplink, .. } = &mut self.bench;
        comms.receive_with_logs(uplink, frame, &mut self.server);
    }

    fn ask(&mut self, request: LogRequest) -> Vec<Sent> {
        self.hear(&Uplink::ServiceRequest(ServiceRequest::Log(request)));
        self.pass(300)
    }

    fn pass(&mut self, ticks: u32) -> Vec<Sent> {
        let mut sent = Vec::new();
        for _ in 0..ticks {
            self.bench.now_us += 1000;
            self.report.time_us = self.bench.now_us;
            let mut send = |frame: &[u8]| self.decoder.feed(frame, |_, message| sent.push(message));
            self.bench.comms.report(&self.report, 0.0, &mut send);
            self.bench.comms.transfer_logs(&mut self.server, &mut self.store, &mut send);
        }
        sent
    }
}

fn texts(sent: &[Sent]) -> Vec<String> {
    let text = |sent: &Sent| match sent {
        Sent::Usual(Downlink::Text { text, .. }) => Some(text.to_str().expect("words").to_owned()),
        _ => None,
    };
    sent.iter().filter_map(text).collect()
}

#[test]
fn logs_are_listed_and_downloaded() {
    let mut vehicle = Vehicle::new();
    assert!(!vehicle.server.is_busy());
    let listed = vehicle.ask(LogRequest::List { first: 0, last: 0xFFFF });
    let sizes: Vec<_> = listed
        .iter()
        .filter_map(|sent| match sent {
            Sent::Log(LogMessage::Entry(entry)) => Some((entry.log, entry.count, entry.size)),
            _ => None,
        })
        .collect();
    assert_eq!(sizes, [(0, 2, 1000), (1, 2, 50)]);
    let sent = vehicle.ask(LogRequest::Data { log: 0, offset: 0, bytes: u32::MAX });
    let mut read = Vec::new();
    for sent in &sent {
        if let Sent::Log(LogMessage::Data(part)) = sent {
            assert_eq!(part.offset as usize, read.len());
            read.extend_from_slice(&part.data[..usize::from(part.count)]);
        }
    }
    assert!(read == vehicle.store.logs[0] && !vehicle.server.is_busy(), "{} bytes", read.len());
}

/// Logs are erased only while the vehicle is disarmed. The result is announced once.
#[test]
fn logs_are_erased() {
    let mut vehicle = Vehicle::new();
    vehicle.report.mode = Mode::Flying;
    vehicle.pass(1);
    assert_eq!(texts(&vehicle.ask(LogRequest::Erase)), ["logs not erased: disarm the vehicle first"]);
    assert_eq!(vehicle.store.logs.len(), 2);
    vehicle.report.mode = Mode::Disarmed;
    vehicle.pass(1);
    assert_eq!(texts(&vehicle.ask(LogRequest::Erase)), ["logs erased"]);
    assert!(vehicle.store.logs.is_empty());
}
