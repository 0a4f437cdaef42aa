//! MAVLink FTP as <https://mavlink.io/en/services/ftp.html> describes it, with files in memory.

use crate::memory::{Memory, bytes};
use afbc_comms::services::ftp::{FileTerms, Ftp, SESSIONS, changes, crc32};
use afbc_mavlink::{Address, FILE_DATA_MAX, FileOpcode, FilePacket, FtpError};
use proptest::collection::vec;
use proptest::prelude::*;

const A: Address = Address { system: 255, component: 190 };
const B: Address = Address { system: 245, component: 191 };

/// A vehicle and stations that send requests to it.
struct Bench {
    ftp: Ftp<usize>,
    store: Memory,
    now_us: u64,
    may_write: bool,
    sequence: u16,
}

impl Bench {
    fn new(files: &[(&str, Vec<u8>)]) -> Self {
        Bench { ftp: Ftp::default(), store: Memory::with(files), now_us: 0, may_write: true, sequence: 7 }
    }

    /// Sends a packet. Returns its answer, if any. The answer to a burst request is its first packet.
    fn send(&mut self, from: Address, packet: &FilePacket) -> Option<FilePacket> {
        let terms = FileTerms { now_us: self.now_us, may_write: self.may_write };
        let answer = self.ftp.answer(from, packet, &mut self.store, terms);
        answer.or_else(|| {
            self.packet().map(|(packet, to)| {
                assert_eq!(to, from);
                packet
            })
        })
    }

    fn packet(&mut self) -> Option<(FilePacket, Address)> {
        while self.ftp.is_busy() {
            if let Some(packet) = self.ftp.next_packet(&mut self.store, self.now_us) {
                return Some(packet);
            }
        }
        None
    }

    /// Sends a request with the next sequence number. Returns the answer, checked against the protocol.
    fn ask(&mut self, from: Address, opcode: FileOpcode, data: &[u8]) -> Result<FilePacket, FtpError> {
        self.ask_at(from, opcode, 0, 0, data)
    }

    fn ask_at(
        &mut self,
        from: Address,
        opcode: FileOpcode,
        session: u8,
        offset: u32,
        data: &[u8],
    ) -> Result<FilePacket, FtpError> {
        self.sequence = self.sequence.wrapping_add(9);
        let request = FilePacket::request(self.sequence, opcode, session, offset, 0).with(data);
        let answer = self.send(from, &request).expect("an answer");
        result(&request, &answer)
    }

    fn open(&mut self, from: Address, path: &str) -> Result<(u8, u32), FtpError> {
        let answer = self.ask(from, FileOpcode::OPEN_FILE_RO, path.as_bytes())?;
        Ok((answer.session, number(&answer)))
    }

    fn read(&mut self, from: Address, session: u8, offset: u32, size: u8) -> Result<Vec<u8>, FtpError> {
        self.sequence += 1;
        let request = FilePacket::request(self.sequence, FileOpcode::READ_FILE, session, offset, size);
        let answer = self.send(from, &request).expect("an answer");
        result(&request, &answer).map(|answer| answer.data().expect("data").to_vec())
    }
}

/// Returns the acknowledged packet, or the error of a refusal.
fn result(request: &FilePacket, answer: &FilePacket) -> Result<FilePacket, FtpError> {
    assert_eq!((answer.sequence, answer.answered), (request.sequence.wrapping_add(1), request.opcode));
    match answer.opcode {
        FileOpcode::ACK => Ok(*answer),
        FileOpcode::NAK => match answer.data() {
            Some([error]) => Err(FtpError(*error)),
            other => panic!("{other:?}"),
        },
        other => panic!("{other:?}"),
    }
}

fn number(packet: &FilePacket) -> u32 {
    u32::from_le_bytes(packet.data().expect("data").try_into().expect("four bytes"))
}

#[test]
fn directories_are_listed_from_any_entry_on() {
    let files: Vec<_> = (0..40).map(|place| (format!("log/flight-{place:02}.ulg"), bytes(place, 1))).collect();
    let mut all: Vec<_> = files.iter().map(|(path, bytes)| (path.as_str(), bytes.clone())).collect();
    all.push(("log/older/x", vec![1]));
    let mut bench = Bench::new(&all);
    let root = bench.ask(A, FileOpcode::LIST_DIRECTORY, b"/").expect("listed");
    assert_eq!(root.data(), Some(&b"Dlog\0"[..]));
    let mut listed = Vec::new();
    let end = loop {
        let answer = bench.ask_at(A, FileOpcode::LIST_DIRECTORY, 0, listed.len() as u32, b"/log\0");
        let Ok(answer) = answer else { break answer };
        let text = String::from_utf8(answer.data().expect("data").to_vec()).expect("text");
        assert!(text.ends_with('\0') && text.len() > FILE_DATA_MAX / 2 || listed.len() > 30, "{text:?}");
        listed.extend(text.trim_end_matches('\0').split('\0').map(str::to_owned));
    };
    assert_eq!(end.err(), Some(FtpError::EOF));
    let expected = (0..40).map(|place| format!("Fflight-{place:02}.ulg\t{place}"));
    assert_eq!(listed, std::iter::once("Dolder".to_owned()).chain(expected).collect::<Vec<_>>());
    for path in ["/none", "/log/flight-00.ulg"] {
        assert_eq!(bench.ask(A, FileOpcode::LIST_DIRECTORY, path.as_bytes()).err(), Some(FtpError::FILE_NOT_FOUND));
    }
}

#[test]
fn files_are_read_by_blocks() {
    let content = bytes(1000, 3);
    let mut bench = Bench::new(&[("etc/a.json", content.clone())]);
    let (session, size) = bench.open(A, "/etc/a.json").expect("open");
    assert_eq!(size, 1000);
    for size in [1, 80, 239] {
        let mut read = Vec::new();
        while let Ok(block) = bench.read(A, session, read.len() as u32, size) {
            assert!(block.len() == usize::from(size) || read.len() + block.len() == 1000);
            read.extend(block);
        }
        assert_eq!(read, content);
    }
    assert_eq!(bench.read(A, session, 1000, 239), Err(FtpError::EOF));
    assert_eq!(bench.read(A, session, u32::MAX, 239), Err(FtpError::EOF));
    assert_eq!(bench.read(A, session, 0, 240), Err(FtpError::INVALID_DATA_SIZE));
    // Neither another station's session nor a missing one can be read.
    assert_eq!(bench.read(B, session, 0, 239), Err(FtpError::INVALID_SESSION));
    assert_eq!(bench.read(A, 200, 0, 239), Err(FtpError::INVALID_SESSION));
    bench.ask_at(A, FileOpcode::TERMINATE_SESSION, session, 0, &[]).expect("closed");
    assert_eq!(bench.read(A, session, 0, 239), Err(FtpError::INVALID_SESSION));
    assert_eq!(bench.store.open_count(), 0);
    for (path, error) in [("/etc/b", FtpError::FILE_NOT_FOUND), ("/etc/../etc/a.json", FtpError::FILE_NOT_FOUND)] {
        assert_eq!(bench.open(A, path), Err(error));
    }
}

#[test]
fn sessions_are_bounded_and_those_of_their_station() {
    let mut bench = Bench::new(&[("a", bytes(9, 1))]);
    let own: Vec<_> = (0..SESSIONS - 1).map(|_| bench.open(A, "a").expect("open").0).collect();
    assert!(own.iter().map(|number| usize::from(*number)).eq(0..SESSIONS - 1), "{own:?}");
    let (other, _) = bench.open(B, "a").expect("open");
    assert_eq!(bench.open(A, "a"), Err(FtpError::NO_SESSIONS_AVAILABLE));
    // A reset ends the sessions of the station that requests it.
    bench.ask(A, FileOpcode::RESET_SESSIONS, &[]).expect("reset");
    assert_eq!(bench.store.open_count(), 1);
    assert_eq!(bench.read(B, other, 0, 9).expect("read").len(), 9);
    // A session that is unused for more than a minute is given to another request.
    (1..SESSIONS).for_each(|_| assert!(bench.open(A, "a").is_ok()));
    bench.now_us += 60_000_000;
    assert_eq!(bench.open(A, "a"), Err(FtpError::NO_SESSIONS_AVAILABLE));
    bench.now_us += 1;
    // A request for a missing file closes no idle session.
    assert!(bench.open(B, "b").is_err());
    assert_eq!((bench.store.open_count(), bench.read(B, other, 0, 9).expect("read").len()), (SESSIONS, 9));
    bench.now_us += 60_000_001;
    bench.open(A, "a").expect("open");
    assert_eq!(bench.store.open_count(), SESSIONS);
}

/// A station may choose its session numbers, as MAVProxy does. A number that it already has is not given again.
#[test]
fn a_session_has_the_number_that_its_station_wants() {
    let mut bench = Bench::new(&[("a", bytes(9, 1)), ("b", bytes(5, 1))]);
    let mut open = |from, session, path: &[u8]| {
        bench.ask_at(from, FileOpcode::OPEN_FILE_RO, session, 0, path).expect("open").session
    };
    assert_eq!([open(A, 140, b"a"), open(A, 140, b"b"), open(B, 140, b"b")], [140, 0, 140]);
    let mut read = |from, session| bench.read(from, session, 0, 239).expect("read").len();
    assert_eq!([read(A, 140), read(A, 0), read(B, 140)], [9, 5, 5]);
    bench.ask_at(A, FileOpcode::TERMINATE_SESSION, 140, 0, &[]).expect("closed");
    assert_eq!(bench.read(A, 140, 0, 239), Err(FtpError::INVALID_SESSION));
    assert_eq!(bench.read(B, 140, 0, 239).expect("read").len(), 5);
}

/// A burst loses packets, and the missing blocks are read afterwards. Then the checksum matches the file.
#[test]
fn a_burst_with_losses_is_mended() {
    for size in [0, 1, 238, 239, 240, 239 * 256, 239 * 256 + 1, 200_000] {
        let content = bytes(size, 5);
        let mut bench = Bench::new(&[("log/a.ulg", content.clone())]);
        let (session, length) = bench.open(A, "log/a.ulg").expect("open");
        let mut read = vec![None; length as usize];
        let (mut offset, mut count) = (0, 0_usize);
        'file: loop {
            bench.sequence = bench.sequence.wrapping_add(1_000);
            let request = FilePacket::request(bench.sequence, FileOpcode::BURST_READ_FILE, session, offset, 239);
            let mut packet = bench.send(A, &request).expect("a packet");
            let mut expected = request.sequence;
            loop {
                expected = expected.wrapping_add(1);
                assert_eq!((packet.sequence, packet.answered), (expected, FileOpcode::BURST_READ_FILE));
                if packet.opcode == FileOpcode::NAK {
                    assert_eq!((packet.data(), offset), (Some(&[FtpError::EOF.0][..]), length));
                    break 'file;
                }
                let data = packet.data().expect("data");
                assert_eq!(packet.offset, offset);
                count += 1;
                if !count.is_multiple_of(7) {
                    for (place, byte) in (offset as usize..).zip(data) {
                        read[place] = Some(*byte);
                    }
                }
                offset += data.len() as u32;
                if packet.burst_complete {
                    break;
                }
                packet = bench.packet().expect("more").0;
            }
        }
        assert!(!bench.ftp.is_busy());
        for place in 0..read.len() {
            if read[place].is_none() {
                let block = bench.read(A, session, place as u32, 100).expect("there");
                block.iter().zip(&mut read[place..]).for_each(|(byte, to)| *to = Some(*byte));
            }
        }
        let read: Vec<_> = read.into_iter().flatten().collect();
        assert!(read == content);
        let answer = bench.ask(A, FileOpcode::CALC_FILE_CRC32, b"log/a.ulg").expect("calculated");
        assert_eq!(number(&answer), crc32(0, &read));
        assert_eq!(bench.store.open_count(), 1, "the checksum's own file is closed");
    }
}

/// zlib.crc32(b"123456789", 0xffffffff) ^ 0xffffffff: CRC-32 without its inversions.
#[test]
fn the_checksum_is_the_protocols() {
    assert_eq!(crc32(0, b"123456789"), 0x2DFD_2D88);
    assert_eq!(crc32(crc32(0, b"1234"), b"56789"), 0x2DFD_2D88);
}

/// A repeated checksum request during the calculation shares its one answer. Other requests are answered at once.
#[test]
fn a_checksum_is_calculated_once() {
    let mut bench = Bench::new(&[("a", bytes(50_000, 1))]);
    let terms = FileTerms { now_us: 0, may_write: true };
    let calculate = FilePacket::request(3, FileOpcode::CALC_FILE_CRC32, 0, 0, 0).with(b"a");
    let list = FilePacket::request(5, FileOpcode::LIST_DIRECTORY, 0, 0, 0).with(b"/");
    assert_eq!(bench.ftp.answer(A, &calculate, &mut bench.store, terms), None);
    for _ in 0..5 {
        assert_eq!(bench.ftp.next_packet(&mut bench.store, 0), None, "so much is not read at once");
        assert_eq!(bench.ftp.answer(A, &calculate, &mut bench.store, terms), None);
        let listed = bench.ftp.answer(A, &list, &mut bench.store, terms).expect("answered");
        assert!(result(&list, &listed).is_ok());
    }
    let (answer, to) = bench.packet().expect("ready");
    assert_eq!((result(&calculate, &answer).map(|it| number(&it)), to), (Ok(crc32(0, &bench.store.files["a"])), A));
    assert_eq!((bench.packet(), bench.store.open_count()), (None, 0));
}

/// If an answer was lost, the repeated request gets the same bytes again and is not carried out twice.
#[test]
fn a_repeated_request_gets_the_same_answer() {
    let mut bench = Bench::new(&[("a", bytes(9, 1)), ("b", bytes(9, 2))]);
    let remove = FilePacket::request(3, FileOpcode::REMOVE_FILE, 0, 0, 0).with(b"a");
    let open = FilePacket::request(9, FileOpcode::OPEN_FILE_RO, 0, 0, 0).with(b"b");
    let first = bench.send(A, &remove);
    let opened = bench.send(B, &open);
    for _ in 0..5 {
        bench.now_us += 1_000_000;
        assert_eq!((bench.send(A, &remove), bench.send(B, &open)), (first, opened));
    }
    assert_eq!((bench.store.changes, bench.store.open_count()), (1, 1));
    assert!(result(&remove, &first.expect("answered")).is_ok());
    // Another station with the same sequence number gets its own answer, and so does another request.
    assert!(result(&remove, &bench.send(B, &remove).expect("answered")).is_err());
    let other = FilePacket::request(3, FileOpcode::REMOVE_FILE, 0, 0, 0).with(b"b");
    assert!(result(&other, &bench.send(A, &other).expect("answered")).is_ok());
    // After ten seconds the same request counts as new.
    bench.now_us += 11_000_000;
    assert_eq!(result(&other, &bench.send(A, &other).expect("answered")), Err(FtpError::FILE_NOT_FOUND));
}

#[test]
fn files_are_written_where_that_is_allowed() {
    let mut bench = Bench::new(&[("log/a", bytes(9, 1))]);
    let content = bytes(1000, 8);
    let created = bench.ask(A, FileOpcode::CREATE_FILE, b"log/new").expect("created");
    for (place, block) in content.chunks(200).enumerate() {
        let offset = 200 * place as u32;
        let written = bench.ask_at(A, FileOpcode::WRITE_FILE, created.session, offset, block).expect("written");
        assert_eq!(number(&written), block.len() as u32);
    }
    assert_eq!(bench.store.files["log/new"], content);
    assert_eq!(bench.ask(A, FileOpcode::CREATE_FILE, b"log/new").err(), Some(FtpError::FILE_EXISTS));
    bench.ask_at(A, FileOpcode::TRUNCATE_FILE, 0, 500, b"log/new").expect("cut");
    bench.ask(A, FileOpcode::CREATE_DIRECTORY, b"log/x").expect("made");
    bench.ask(A, FileOpcode::RENAME, b"log/new\0log/x/old").expect("renamed");
    assert_eq!(bench.store.files["log/x/old"], content[..500]);
    assert_eq!(bench.ask(A, FileOpcode::REMOVE_DIRECTORY, b"log/x").err(), Some(FtpError::FAIL));
    bench.ask(A, FileOpcode::REMOVE_FILE, b"/log/x/old").expect("removed");
    bench.ask(A, FileOpcode::REMOVE_DIRECTORY, b"log/x").expect("removed");
    let opened = bench.ask(A, FileOpcode::OPEN_FILE_WO, b"log/a").expect("open");
    bench.ask_at(A, FileOpcode::WRITE_FILE, opened.session, 9, b"more").expect("written");
    assert_eq!(bench.store.files["log/a"].len(), 13);
    // A file opened for reading cannot be written, nor can offsets beyond 32 bits.
    let (session, _) = bench.open(A, "log/a").expect("open");
    let refused = bench.ask_at(A, FileOpcode::WRITE_FILE, session, 0, b"x").err();
    assert_eq!(refused, Some(FtpError::FILE_PROTECTED));
    let refused = bench.ask_at(A, FileOpcode::WRITE_FILE, opened.session, u32::MAX, b"xy").err();
    assert_eq!(refused, Some(FtpError::INVALID_DATA_SIZE));
    // No change is possible while changes are not allowed.
    bench.may_write = false;
    let changes_before = bench.store.changes;
    for opcode in (0..128).map(FileOpcode).filter(|opcode| changes(*opcode)) {
        let refused = bench.ask_at(A, opcode, opened.session, 0, b"log/a\0b").err();
        assert_eq!(refused, Some(FtpError::FILE_PROTECTED), "{opcode:?}");
    }
    assert_eq!(bench.store.changes, changes_before);
    assert_eq!((0..=255).filter(|opcode| changes(FileOpcode(*opcode))).count(), 8);
}

#[test]
fn unknown_operations_are_refused_and_answers_are_not_answered() {
    let mut bench = Bench::new(&[]);
    bench.ask(A, FileOpcode::NONE, &[]).expect("always acknowledged");
    for opcode in (16..128).map(FileOpcode) {
        assert_eq!(bench.ask(A, opcode, &[]).err(), Some(FtpError::UNKNOWN_COMMAND));
    }
    for opcode in (128..=255).map(FileOpcode) {
        assert_eq!(bench.send(A, &FilePacket::request(1, opcode, 0, 0, 0)), None);
    }
}

/// Generates packets, most of them like those of a station.
fn packet() -> impl Strategy<Value = (bool, FilePacket)> {
    let path = prop_oneof![
        Just(b"/log/a".to_vec()),
        Just(b"/log".to_vec()),
        Just(b"log/../../etc/passwd".to_vec()),
        Just(b"..\0..".to_vec()),
        Just(b"log/a\0log/b".to_vec()),
        "[./a-c\\\\]{0,30}".prop_map(String::into_bytes),
        vec(any::<u8>(), 0..FILE_DATA_MAX),
    ];
    let numbers = (0..6_u16, prop_oneof![0..17_u8, any::<u8>()], prop_oneof![0..5_u8, any::<u8>()]);
    let sizes = (prop_oneof![0..3000_u32, any::<u32>()], proptest::option::of(any::<u8>()));
    (any::<bool>(), numbers, sizes, path).prop_map(|(who, (sequence, opcode, session), (offset, size), path)| {
        let packet = FilePacket::request(sequence, FileOpcode(opcode), session, offset, 0).with(&path);
        (who, FilePacket { size: size.unwrap_or(packet.size), ..packet })
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Each request has one matching answer or a burst. Paths never lead above the root, as the store checks. There is
    /// at most one open file per session, and one for a checksum.
    #[test]
    fn any_packets_are_answered_in_order(packets in vec(packet(), 1..60), may_write: bool) {
        let mut bench = Bench::new(&[("log/a", bytes(2500, 1)), ("log/c", bytes(3, 2)), ("etc/passwd", bytes(9, 3))]);
        bench.may_write = may_write;
        for (who, packet) in &packets {
            let from = if *who { A } else { B };
            bench.now_us += 300_000;
            let terms = FileTerms { now_us: bench.now_us, may_write };
            let answer = bench.ftp.answer(from, packet, &mut bench.store, terms);
            if let Some(answer) = answer {
                prop_assert_eq!(answer.sequence, packet.sequence.wrapping_add(1));
                prop_assert_eq!(answer.answered, packet.opcode);
                prop_assert!(answer.data().is_some());
                prop_assert!([FileOpcode::ACK, FileOpcode::NAK].contains(&answer.opcode));
                prop_assert!(answer.opcode == FileOpcode::ACK || answer.size == 1);
                // The same request gets the same answer again.
                prop_assert_eq!(bench.ftp.answer(from, packet, &mut bench.store, terms), Some(answer));
            } else {
                let is_long = [FileOpcode::BURST_READ_FILE, FileOpcode::CALC_FILE_CRC32].contains(&packet.opcode);
                prop_assert!(is_long || packet.opcode.0 >= 128, "{:?}", packet);
            }
            prop_assert!(bench.store.open_count() <= SESSIONS + 1);
            if let Some((packet, _)) = bench.ftp.next_packet(&mut bench.store, bench.now_us) {
                prop_assert!(packet.data().is_some());
            }
            if !may_write {
                prop_assert_eq!(bench.store.changes, 0);
            }
        }
        // A burst ends by itself.
        let left = std::iter::from_fn(|| bench.packet()).count();
        prop_assert!(left <= 256 * SESSIONS + 1, "{}", left);
        for station in [A, B] {
            bench.ask(station, FileOpcode::RESET_SESSIONS, &[]).expect("reset");
        }
        prop_assert_eq!(bench.store.open_count(), 0);
    }
}
