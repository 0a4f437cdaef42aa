//! Files and logs on the wire, compared with the `mavlink` crate's decoding.

use afbc_mavlink::{
    Address, ComponentMetadata, Decoder, Encoder, FRAME_MAX, FileOpcode, FilePacket, LogData, LogEntry, LogMessage,
    LogRequest, ReceivedFrame, ServiceRequest, Transfer, Uplink,
};
use mavlink::dialects::common::{MavCmd, MavMessage};
use mavlink::{MavlinkVersion, Message as _};
use proptest::collection::vec;
use proptest::prelude::*;

const VEHICLE: Address = Address { system: 1, component: 1 };
const STATION: Address = Address { system: 255, component: 190 };

/// Checks that this crate decodes the message it wrote; returns the message as the `mavlink` crate decodes it.
fn as_others_read(message: &Transfer) -> MavMessage {
    let mut buffer = [0; FRAME_MAX];
    let frame = Encoder::new(VEHICLE).send(message, &mut buffer);
    let mut decoder = Decoder::<Transfer>::new(STATION);
    let mut back = None;
    decoder.feed(frame, |from, read| back = Some((from, read)));
    assert_eq!(back, Some((VEHICLE, *message)));
    let id = u32::from_le_bytes([frame[7], frame[8], frame[9], 0]);
    MavMessage::parse(MavlinkVersion::V2, id, &frame[10..frame.len() - 2]).expect("a message")
}

#[test]
fn files_have_the_protocols_payload() {
    let data: Vec<u8> = (1..=239).collect();
    let packet = FilePacket {
        answered: FileOpcode::BURST_READ_FILE,
        burst_complete: true,
        ..FilePacket::request(0x1234, FileOpcode::ACK, 7, 0x89AB_CDEF, 0).with(&data)
    };
    let MavMessage::FILE_TRANSFER_PROTOCOL(read) = as_others_read(&Transfer::File { packet, to: STATION }) else {
        panic!("another")
    };
    assert_eq!((read.target_network, read.target_system, read.target_component), (0, 255, 190));
    // Sequence number, session, opcode, size, requested opcode, "burst complete", padding, offset, data.
    let head = [0x34, 0x12, 7, 128, 239, 15, 1, 0, 0xEF, 0xCD, 0xAB, 0x89];
    assert_eq!(read.payload[..12], head);
    assert_eq!(read.payload[12..], data);
}

#[test]
fn logs_have_their_fields() {
    let entry = LogEntry { log: 3, count: 5, last: 4, utc_s: 1_700_000_000, size: 123_456 };
    let MavMessage::LOG_ENTRY(read) = as_others_read(&Transfer::Log(LogMessage::Entry(entry))) else {
        panic!("another")
    };
    assert_eq!((read.id, read.num_logs, read.last_log_num), (3, 5, 4));
    assert_eq!((read.time_utc, read.size), (1_700_000_000, 123_456));
    let data = core::array::from_fn(|place| place as u8 + 1);
    let part = LogData { log: 3, offset: 90_000, count: 90, data };
    let MavMessage::LOG_DATA(read) = as_others_read(&Transfer::Log(LogMessage::Data(part))) else { panic!("another") };
    assert_eq!((read.id, read.ofs, read.count, read.data), (3, 90_000, 90, data));
}

#[test]
fn metadata_has_its_address() {
    let uri = "mftp://etc/general.json";
    let metadata = ComponentMetadata { time_ms: 9, ..ComponentMetadata::at(uri, 0xDEAD_BEEF) };
    let MavMessage::COMPONENT_METADATA(read) = as_others_read(&Transfer::Metadata(metadata)) else { panic!("another") };
    assert_eq!((read.time_boot_ms, read.file_crc, read.uri.to_str().expect("text")), (9, 0xDEAD_BEEF, uri));
    let MavMessage::COMPONENT_INFORMATION(read) = as_others_read(&Transfer::Information(metadata)) else {
        panic!("another")
    };
    assert_eq!((read.time_boot_ms, read.general_metadata_file_crc), (9, 0xDEAD_BEEF));
    assert_eq!(read.general_metadata_uri.to_str().expect("text"), uri);
    assert_eq!(read.peripherals_metadata_file_crc, 0);
    // A longer URI is cut off.
    assert!(ComponentMetadata::at(&"x".repeat(200), 0).uri.iter().all(|byte| *byte == b'x'));
}

/// The vehicle also reads requests without an answer: LOG_ERASE (121) and LOG_REQUEST_END (122).
#[test]
fn logs_are_erased_and_ended_by_request() {
    for (request, id) in [(LogRequest::Erase, 121), (LogRequest::End, 122)] {
        let message = Uplink::ServiceRequest(ServiceRequest::Log(request));
        let mut buffer = [0; FRAME_MAX];
        let frame = Encoder::new(STATION).send(&message, &mut buffer);
        assert_eq!(frame[7], id);
        let mut heard = None;
        Decoder::<Uplink>::new(VEHICLE).feed(frame, |_, message| heard = Some(message));
        assert_eq!(heard, Some(message));
    }
    assert_eq!(MavCmd::MAV_CMD_REQUEST_MESSAGE as u32, 512);
}

proptest! {
    /// Each message is delivered with its own payload, however the stream is split and whatever noise is in it.
    #[test]
    fn payloads_come_with_their_messages(data in vec(any::<u8>(), 0..239), noise in vec(any::<u8>(), 0..40), cut: u8) {
        let packet = FilePacket::request(5, FileOpcode::WRITE_FILE, 1, 77, 0).with(&data);
        let mut stream = Vec::new();
        let mut buffer = [0; FRAME_MAX];
        let mut sender = Encoder::new(STATION);
        for _ in 0..2 {
            // Removes start bytes from the noise, since they would delay the following frames.
            stream.extend(noise.iter().filter(|byte| **byte != 0xFD));
            stream.extend_from_slice(sender.send(&Transfer::File { packet, to: VEHICLE }, &mut buffer));
            stream.extend_from_slice(sender.send(&Uplink::Heartbeat, &mut buffer));
        }
        let mut decoder = Decoder::<Uplink>::new(VEHICLE);
        let mut heard = Vec::new();
        for piece in stream.chunks(usize::from(cut).max(1)) {
            let accepts = |_: &ReceivedFrame<'_>| true;
            let handle = |_, message, payload: &[u8]| heard.push((message, payload.to_vec()));
            decoder.feed_to(&mut (accepts, handle), piece);
        }
        prop_assert_eq!(heard.len(), 4);
        for (message, payload) in &heard {
            match message {
                Uplink::Heartbeat => prop_assert_eq!(payload.len(), 9),
                _ => prop_assert_eq!(FilePacket::read(payload), (packet, VEHICLE)),
            }
        }
    }
}
