//! File transfer by MAVLink FTP: <https://mavlink.io/en/services/ftp.html>.
//!
//! A request is answered by one packet. A burst is answered by many packets, sent as the link has room. A checksum is
//! answered once the whole file has been read, a few blocks at a time. A request that is repeated because its answer
//! was lost gets the same answer again and is not carried out twice.

use super::storage::{FileAccess, FileChange, FilePath, FileStore};
use afbc_mavlink::{Address, FILE_DATA_MAX, FileOpcode, FilePacket, FtpError};

/// Number of files that can be open at the same time.
pub const SESSIONS: usize = 4;
/// Number of stations whose last answer is stored.
const STATIONS: usize = 4;
/// Time for which an answer is stored \[us\].
const KEPT_US: u64 = 10_000_000;
/// An unused session may be replaced after this time \[us\].
const IDLE_US: u64 = 60_000_000;
/// Number of packets in a burst. The station then asks for the next burst, so a lost station gets no more packets.
const BURST_PACKETS: u16 = 256;
/// Number of blocks of [`FILE_DATA_MAX`] bytes that are added to a checksum at once.
const CHECKSUM_BLOCKS: usize = 16;

/// Conditions under which a request is answered.
#[derive(Clone, Copy, Debug)]
pub struct FileTerms {
    /// Time since power-up \[us\].
    pub now_us: u64,
    /// True if the station may change files.
    pub may_write: bool,
}

/// Open files and stored answers.
pub struct Ftp<F> {
    sessions: [Option<Session<F>>; SESSIONS],
    answered: [Option<Answered>; STATIONS],
    checksum: Option<Checksum<F>>,
    /// Index of the session whose burst was served last.
    turn: usize,
}

struct Session<F> {
    owner: Address,
    /// Number of the session; each owner has numbers of its own.
    number: u8,
    file: F,
    writes: bool,
    used_us: u64,
    burst: Option<Burst>,
}

/// A burst in progress.
#[derive(Clone, Copy)]
struct Burst {
    /// Sequence number of the next packet.
    sequence: u16,
    offset: u32,
    size: u8,
    /// Number of packets left.
    left: u16,
}

struct Answered {
    from: Address,
    request: FilePacket,
    reply: FilePacket,
    at_us: u64,
}

/// A checksum in progress.
struct Checksum<F> {
    from: Address,
    request: FilePacket,
    file: F,
    offset: u32,
    crc: u32,
}

impl<F> Default for Ftp<F> {
    fn default() -> Self {
        Ftp { sessions: [const { None }; SESSIONS], answered: [const { None }; STATIONS], checksum: None, turn: 0 }
    }
}

impl<F: Copy> Ftp<F> {
    /// Answers a request. Returns none if the answer comes as [packets](Self::next_packet) or the request is itself an
    /// answer.
    pub fn answer(
        &mut self,
        from: Address,
        request: &FilePacket,
        store: &mut impl FileStore<File = F>,
        terms: FileTerms,
    ) -> Option<FilePacket> {
        if request.opcode.0 >= FileOpcode::ACK.0 {
            return None;
        }
        let is_again = |it: &&Answered| {
            it.from == from && it.request == *request && terms.now_us.saturating_sub(it.at_us) < KEPT_US
        };
        if let Some(again) = self.answered.iter().flatten().find(is_again) {
            return Some(again.reply);
        }
        // This checksum is being calculated. The answer to the first request also answers its repetition.
        if self.checksum.as_ref().is_some_and(|it| it.from == from && it.request == *request) {
            return None;
        }
        let reply = match self.carry_out(from, request, store, terms) {
            Ok(reply) => reply?,
            Err(error) => nak(request, error),
        };
        self.keep(from, *request, reply, terms.now_us);
        Some(reply)
    }

    /// Returns the next packet of a burst or a finished checksum, with its receiver.
    pub fn next_packet(&mut self, store: &mut impl FileStore<File = F>, now_us: u64) -> Option<(FilePacket, Address)> {
        if let Some(ready) = self.go_on_with_checksum(store, now_us) {
            return Some(ready);
        }
        for _ in 0..SESSIONS {
            self.turn = (self.turn + 1) % SESSIONS;
            if let Some(Some(session)) = self.sessions.get_mut(self.turn)
                && let Some(burst) = session.burst
            {
                session.used_us = now_us;
                let (packet, rest) = burst.next(session.number, session.file, store);
                session.burst = rest;
                return Some((packet, session.owner));
            }
        }
        None
    }

    /// Returns true if there may be a [packet](Self::next_packet).
    pub fn is_busy(&self) -> bool {
        self.checksum.is_some() || self.sessions.iter().flatten().any(|session| session.burst.is_some())
    }

    fn carry_out(
        &mut self,
        from: Address,
        request: &FilePacket,
        store: &mut impl FileStore<File = F>,
        terms: FileTerms,
    ) -> Result<Option<FilePacket>, FtpError> {
        let wanted = usize::from(request.size);
        if wanted > FILE_DATA_MAX {
            return Err(FtpError::INVALID_DATA_SIZE);
        }
        let data = request.data().unwrap_or_default();
        let path = || FilePath::of(data).ok_or(FtpError::FILE_NOT_FOUND);
        if changes(request.opcode) && !terms.may_write {
            return Err(FtpError::FILE_PROTECTED);
        }
        let done = ack(request);
        Ok(Some(match request.opcode {
            FileOpcode::NONE => done,
            FileOpcode::TERMINATE_SESSION => {
                let place = self.place_of(from, request.session).ok_or(FtpError::INVALID_SESSION)?;
                self.close(place, store);
                done
            }
            FileOpcode::RESET_SESSIONS => {
                for place in 0..SESSIONS {
                    if matches!(self.sessions.get(place), Some(Some(session)) if session.owner == from) {
                        self.close(place, store);
                    }
                }
                done
            }
            FileOpcode::LIST_DIRECTORY => list(request, &path()?, store)?,
            FileOpcode::OPEN_FILE_RO => self.open(from, request, (&path()?, FileAccess::Read), store, terms)?,
            FileOpcode::OPEN_FILE_WO => self.open(from, request, (&path()?, FileAccess::Write), store, terms)?,
            FileOpcode::CREATE_FILE => self.open(from, request, (&path()?, FileAccess::Create), store, terms)?,
            FileOpcode::READ_FILE => {
                let file = self.session(from, request.session, terms.now_us)?.file;
                let mut block = [0; FILE_DATA_MAX];
                let into = block.get_mut(..length(request.size)).unwrap_or_default();
                let count = store.read(file, request.offset, into)?;
                if count == 0 {
                    return Err(FtpError::EOF);
                }
                done.with(into.get(..count).unwrap_or_default())
            }
            FileOpcode::BURST_READ_FILE => {
                let sequence = request.sequence.wrapping_add(1);
                let (offset, size) = (request.offset, length(request.size) as u8);
                let session = self.session(from, request.session, terms.now_us)?;
                session.burst = Some(Burst { sequence, offset, size, left: BURST_PACKETS });
                return Ok(None);
            }
            FileOpcode::WRITE_FILE => {
                let session = self.session(from, request.session, terms.now_us)?;
                if !session.writes {
                    return Err(FtpError::FILE_PROTECTED);
                }
                if request.offset.checked_add(request.size.into()).is_none() {
                    return Err(FtpError::INVALID_DATA_SIZE);
                }
                store.write(session.file, request.offset, data)?;
                done.with(&u32::from(request.size).to_le_bytes())
            }
            FileOpcode::CALC_FILE_CRC32 => {
                if self.checksum.is_some() {
                    return Err(FtpError::FAIL);
                }
                let (file, _) = store.open(&path()?, FileAccess::Read)?;
                self.checksum = Some(Checksum { from, request: *request, file, offset: 0, crc: 0 });
                return Ok(None);
            }
            FileOpcode::REMOVE_FILE => store.change(FileChange::Remove(&path()?)).map(|()| done)?,
            FileOpcode::CREATE_DIRECTORY => store.change(FileChange::CreateDirectory(&path()?)).map(|()| done)?,
            FileOpcode::REMOVE_DIRECTORY => store.change(FileChange::RemoveDirectory(&path()?)).map(|()| done)?,
            FileOpcode::TRUNCATE_FILE => store.change(FileChange::Truncate(&path()?, request.offset)).map(|()| done)?,
            FileOpcode::RENAME => {
                let second = data.splitn(2, |byte| *byte == 0).nth(1).unwrap_or_default();
                let second = FilePath::of(second).ok_or(FtpError::FILE_NOT_FOUND)?;
                store.change(FileChange::Rename(&path()?, &second)).map(|()| done)?
            }
            _ => return Err(FtpError::UNKNOWN_COMMAND),
        }))
    }

    /// Returns the index of a station's session.
    fn place_of(&self, from: Address, number: u8) -> Option<usize> {
        let is_it = |it: &Option<Session<F>>| it.as_ref().is_some_and(|it| it.owner == from && it.number == number);
        self.sessions.iter().position(is_it)
    }

    /// Returns a station's session.
    fn session(&mut self, from: Address, number: u8, now_us: u64) -> Result<&mut Session<F>, FtpError> {
        let place = self.place_of(from, number);
        let session = place.and_then(|place| self.sessions.get_mut(place)?.as_mut());
        let session = session.ok_or(FtpError::INVALID_SESSION)?;
        session.used_us = now_us;
        // Any other request of the session ends its burst.
        session.burst = None;
        Ok(session)
    }

    fn close(&mut self, place: usize, store: &mut impl FileStore<File = F>) {
        if let Some(session) = self.sessions.get_mut(place).and_then(Option::take) {
            store.close(session.file);
        }
    }

    fn open(
        &mut self,
        from: Address,
        request: &FilePacket,
        (path, access): (&FilePath, FileAccess),
        store: &mut impl FileStore<File = F>,
        FileTerms { now_us, .. }: FileTerms,
    ) -> Result<FilePacket, FtpError> {
        let place = match self.sessions.iter().position(Option::is_none) {
            Some(free) => free,
            None => {
                let idle =
                    |it: &Option<Session<F>>| it.as_ref().is_some_and(|it| now_us.saturating_sub(it.used_us) > IDLE_US);
                self.sessions.iter().position(idle).ok_or(FtpError::NO_SESSIONS_AVAILABLE)?
            }
        };
        let (file, size) = store.open(path, access)?;
        // An idle session is closed only now: a file that cannot be opened costs none.
        self.close(place, store);
        // ArduPilot's clients choose session numbers. Other clients send 0 and take the number in the answer.
        let mut wanted = [request.session].into_iter().chain(0..=u8::MAX);
        // A number is free: a station has at most four sessions and there are 256 numbers.
        let number = wanted.find(|number| self.place_of(from, *number).is_none()).unwrap_or_default();
        if let Some(session) = self.sessions.get_mut(place) {
            let writes = access != FileAccess::Read;
            *session = Some(Session { owner: from, number, file, writes, used_us: now_us, burst: None });
        }
        let reply = ack(request).with(&size.to_le_bytes());
        Ok(FilePacket { session: number, ..reply })
    }

    fn keep(&mut self, from: Address, request: FilePacket, reply: FilePacket, now_us: u64) {
        let own = self.answered.iter().position(|it| it.as_ref().is_some_and(|it| it.from == from));
        let oldest = || {
            // An empty entry counts as older than any answer.
            let ages = self.answered.iter().map(|it| it.as_ref().map_or(0, |it| it.at_us + 1));
            ages.enumerate().min_by_key(|(_, age)| *age).map(|(place, _)| place)
        };
        if let Some(place) = own.or_else(oldest)
            && let Some(answered) = self.answered.get_mut(place)
        {
            *answered = Some(Answered { from, request, reply, at_us: now_us });
        }
    }

    fn go_on_with_checksum(
        &mut self,
        store: &mut impl FileStore<File = F>,
        now_us: u64,
    ) -> Option<(FilePacket, Address)> {
        let checksum = self.checksum.as_mut()?;
        let mut block = [0; FILE_DATA_MAX];
        for _ in 0..CHECKSUM_BLOCKS {
            let reply = match store.read(checksum.file, checksum.offset, &mut block) {
                Ok(0) => ack(&checksum.request).with(&checksum.crc.to_le_bytes()),
                Err(error) => nak(&checksum.request, error),
                Ok(count) => {
                    checksum.crc = crc32(checksum.crc, block.get(..count).unwrap_or_default());
                    checksum.offset = checksum.offset.saturating_add(count as u32);
                    continue;
                }
            };
            let (from, request, file) = (checksum.from, checksum.request, checksum.file);
            self.checksum = None;
            store.close(file);
            self.keep(from, request, reply, now_us);
            return Some((reply, from));
        }
        None
    }
}

impl Burst {
    /// Returns the next packet and the rest of the burst.
    fn next<F: Copy>(self, session: u8, file: F, store: &mut impl FileStore<File = F>) -> (FilePacket, Option<Self>) {
        let Burst { sequence, offset, size, left } = self;
        // `ack` and `nak` add one to the sequence number.
        let request = FilePacket::request(sequence.wrapping_sub(1), FileOpcode::BURST_READ_FILE, session, offset, size);
        let mut block = [0; FILE_DATA_MAX];
        let into = block.get_mut(..size.into()).unwrap_or_default();
        let count = match store.read(file, offset, into) {
            Ok(0) => return (FilePacket { burst_complete: true, ..nak(&request, FtpError::EOF) }, None),
            Ok(count) => count,
            Err(error) => return (nak(&request, error), None),
        };
        let burst_complete = left <= 1;
        let packet = ack(&request).with(into.get(..count).unwrap_or_default());
        let offset = offset.saturating_add(count as u32);
        let rest = Burst { sequence: sequence.wrapping_add(1), offset, size, left: left.saturating_sub(1) };
        (FilePacket { burst_complete, ..packet }, (!burst_complete).then_some(rest))
    }
}

/// Returns true if an operation changes files.
pub fn changes(opcode: FileOpcode) -> bool {
    matches!(
        opcode,
        FileOpcode::CREATE_FILE
            | FileOpcode::WRITE_FILE
            | FileOpcode::REMOVE_FILE
            | FileOpcode::CREATE_DIRECTORY
            | FileOpcode::REMOVE_DIRECTORY
            | FileOpcode::OPEN_FILE_WO
            | FileOpcode::TRUNCATE_FILE
            | FileOpcode::RENAME
    )
}

/// Continues a checksum, which begins with 0: CRC-32 without its initial and final inversions.
pub fn crc32(crc: u32, bytes: &[u8]) -> u32 {
    bytes.iter().fold(crc, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| if crc & 1 == 1 { (crc >> 1) ^ 0xEDB8_8320 } else { crc >> 1 })
    })
}

/// Returns the number of bytes to read. Older stations send 0 for as many as possible.
fn length(size: u8) -> usize {
    if size == 0 { FILE_DATA_MAX } else { usize::from(size).min(FILE_DATA_MAX) }
}

fn ack(request: &FilePacket) -> FilePacket {
    let sequence = request.sequence.wrapping_add(1);
    let reply = FilePacket::request(sequence, FileOpcode::ACK, request.session, request.offset, 0);
    FilePacket { answered: request.opcode, ..reply }
}

fn nak(request: &FilePacket, FtpError(error): FtpError) -> FilePacket {
    FilePacket { opcode: FileOpcode::NAK, ..ack(request) }.with(&[error])
}

/// Returns as many directory entries as fit: "F", name, tab, size; or "D", name. A zero ends each entry.
fn list(request: &FilePacket, path: &FilePath, store: &mut impl FileStore) -> Result<FilePacket, FtpError> {
    use core::fmt::Write;
    let mut text = heapless::String::<FILE_DATA_MAX>::new();
    let mut place = request.offset;
    while let Some(entry) = store.entry(path, place)? {
        let length = text.len();
        let written = match entry.size {
            Some(size) => write!(text, "F{}\t{size}\0", entry.name),
            None => write!(text, "D{}\0", entry.name),
        };
        if written.is_err() {
            // An entry is not split: the next packet begins with it.
            text.truncate(length);
            break;
        }
        place = place.saturating_add(1);
    }
    if place == request.offset { Err(FtpError::EOF) } else { Ok(ack(request).with(text.as_bytes())) }
}
