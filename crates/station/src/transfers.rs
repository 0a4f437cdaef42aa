//! Files and logs of a vehicle with storage, on the link that telemetry and commands share.

use crate::services::ftp::{FileTerms, Ftp, changes};
use crate::services::log_stream::{LogStream, StreamEvent};
use crate::services::log_transfer::{LogMessage, LogTransfer};
use crate::services::storage::{FileStore, LogSource, LogStore};
use afbc_link::{Address, Command, ComponentMetadata, FilePacket, LogRequest, Question, Transfer, Uplink};
use heapless::Deque;

/// Requests for files that wait, and others: MAVProxy asks for twenty parts of a log at once. Further ones are dropped:
/// stations repeat them.
const FILES_MAX: usize = 4;
const OTHERS_MAX: usize = 24;
/// Part of the link that transfers get even when telemetry takes all of it: one in so many bytes. What telemetry
/// leaves, they get anyway.
const SHARE: i64 = 5;
/// Bytes of that part that may be saved up: less than a frame \[1e-3 bytes\].
const SAVED: i64 = 250_000;
/// Longest frames with a part of a log, and with one of a file or of a streamed log \[bytes\].
const LOG_FRAME: usize = 12 + 97;
const FILE_FRAME: usize = 12 + 255;
/// COMPONENT_INFORMATION and COMPONENT_METADATA.
const METADATA: [u32; 2] = [395, 397];

/// Takes requests for files and logs out of what stations send. `()` takes none: they are refused.
pub trait TransferRequests {
    /// True if the message is one.
    fn wants(&self, message: &Uplink) -> bool;

    /// Takes a message that it [wants](Self::wants); `may_change` is false if the station may not change anything.
    /// False if too many wait.
    fn take(&mut self, from: Address, message: &Uplink, payload: &[u8], may_change: bool) -> bool;
}

impl TransferRequests for () {
    fn wants(&self, _: &Uplink) -> bool {
        false
    }

    fn take(&mut self, _: Address, _: &Uplink, _: &[u8], _: bool) -> bool {
        false
    }
}

/// What of files and logs is asked for and sent; `F` is an open file.
pub struct Transfers<F> {
    files: Deque<FileRequest, FILES_MAX>,
    others: Deque<OtherRequest, OTHERS_MAX>,
    ftp: Ftp<F>,
    logs: LogTransfer,
    stream: LogStream,
    metadata: Option<ComponentMetadata>,
    /// What transfers may send of their own part \[1e-3 bytes\].
    saved: i64,
    /// True if the next packet is one of a log.
    logs_turn: bool,
}

struct FileRequest {
    from: Address,
    packet: FilePacket,
    may_change: bool,
}

enum OtherRequest {
    Log {
        from: Address,
        request: LogRequest,
        may_change: bool,
    },
    /// Begins to stream the log, or ends.
    Stream(Address, bool),
    /// The message numbered so.
    Metadata(u32),
}

/// What is to be sent or said.
#[allow(clippy::large_enum_variant, reason = "one at a time, on the stack of whoever sends it")]
pub(crate) enum Outcome {
    Send(Transfer),
    /// To everyone, as a warning if it is one.
    Say(&'static str, bool),
}

/// True of requests that change what is stored.
pub(crate) fn is_change(message: &Uplink) -> bool {
    match message {
        Uplink::Question(Question::Log(request)) => *request == LogRequest::Erase,
        Uplink::Question(Question::File(operation)) => changes(afbc_link::FileOpcode(operation.operation)),
        _ => false,
    }
}

impl<F: Copy> Transfers<F> {
    /// With the address of the vehicle's metadata, if there is some.
    pub fn new(metadata: Option<ComponentMetadata>) -> Self {
        Transfers {
            files: Deque::new(),
            others: Deque::new(),
            ftp: Ftp::default(),
            logs: LogTransfer::default(),
            stream: LogStream::default(),
            metadata,
            saved: SAVED,
            logs_turn: false,
        }
    }

    /// Begins a tick on a link of so many bytes per second.
    pub(crate) fn tick(&mut self, bytes_per_s: u32) {
        // Bytes per second are thousandths of bytes per millisecond.
        self.saved = (self.saved + i64::from(bytes_per_s) / SHARE).min(SAVED);
    }

    /// True if its own part of the link has room.
    pub(crate) fn has_room(&self) -> bool {
        self.saved > 0
    }

    /// Returns the longest frame that may be next \[bytes\].
    pub(crate) fn frame_max(&self) -> usize {
        let logs_alone =
            self.files.is_empty() && self.others.is_empty() && !self.ftp.is_busy() && !self.stream.is_active();
        if logs_alone { LOG_FRAME } else { FILE_FRAME }
    }

    /// Notes that so many bytes were sent.
    pub(crate) fn spend(&mut self, bytes: usize) {
        self.saved = self.saved.saturating_sub(1000 * bytes as i64).max(-SAVED);
    }

    /// Returns what is to be done next.
    pub(crate) fn next<S: FileStore<File = F> + LogStore + LogSource>(
        &mut self,
        store: &mut S,
        now_us: u64,
        armed: bool,
    ) -> Option<Outcome> {
        while let Some(request) = self.others.pop_front() {
            if let Some(outcome) = self.begin(request, store, now_us, armed) {
                return Some(outcome);
            }
        }
        while let Some(FileRequest { from, packet, may_change }) = self.files.pop_front() {
            let terms = FileTerms { now_us, may_write: may_change && !armed };
            if let Some(packet) = self.ftp.answer(from, &packet, store, terms) {
                return Some(Outcome::Send(Transfer::File { packet, to: from }));
            }
        }
        // In turn, if both are under way.
        self.logs_turn = !self.logs_turn;
        if (self.logs_turn || !self.ftp.is_busy())
            && let Some(message) = self.logs.next(store)
        {
            return Some(Outcome::Send(match message {
                LogMessage::Entry(entry) => Transfer::LogEntry(entry),
                LogMessage::Data(data) => Transfer::LogData(data),
            }));
        }
        if let Some((packet, to)) = self.ftp.next_packet(store, now_us) {
            return Some(Outcome::Send(Transfer::File { packet, to }));
        }
        Some(match self.stream.next(store, now_us)? {
            StreamEvent::Part(part) => Outcome::Send(Transfer::LogPart(part)),
            StreamEvent::Unheard => Outcome::Say("log stream ended: not acknowledged", true),
        })
    }
}

impl<F: Copy> Transfers<F> {
    /// Does what a request asks for that is not about files, or begins it.
    fn begin<S: LogStore + LogSource>(
        &mut self,
        request: OtherRequest,
        store: &mut S,
        now_us: u64,
        armed: bool,
    ) -> Option<Outcome> {
        match request {
            OtherRequest::Log { request: LogRequest::Erase, .. } if armed => {
                Some(Outcome::Say("logs are erased while disarmed only", true))
            }
            // Whoever is not in control has been told.
            OtherRequest::Log { request: LogRequest::Erase, may_change: false, .. } => None,
            OtherRequest::Log { request: LogRequest::Erase, .. } => {
                self.logs.hear(LogRequest::Erase, store);
                let erased = store.erase_logs();
                Some(Outcome::Say(if erased { "logs erased" } else { "logs cannot be erased" }, !erased))
            }
            OtherRequest::Log { from, request: LogRequest::Received(sequence), .. } => {
                self.stream.acknowledge(from, sequence);
                None
            }
            OtherRequest::Log { request, .. } => {
                self.logs.hear(request, store);
                None
            }
            OtherRequest::Stream(to, true) => {
                let starts = self.stream.start(to, store);
                (!starts).then_some(Outcome::Say("there is no log to stream", true))
            }
            OtherRequest::Stream(_, false) => {
                self.stream.stop(store);
                None
            }
            OtherRequest::Metadata(message) => {
                let metadata = ComponentMetadata { time_ms: (now_us / 1000) as u32, ..self.metadata? };
                let [information, _] = METADATA;
                let is_old = message == information;
                Some(Outcome::Send(if is_old { Transfer::Information(metadata) } else { Transfer::Metadata(metadata) }))
            }
        }
    }
}

impl<F: Copy> TransferRequests for Transfers<F> {
    fn wants(&self, message: &Uplink) -> bool {
        match message {
            Uplink::Question(Question::File(_) | Question::Log(_)) => true,
            Uplink::Command(Command::RequestMessage { message, .. }) => {
                self.metadata.is_some() && METADATA.contains(message)
            }
            Uplink::Command(Command::StartLogStream | Command::StopLogStream) => true,
            _ => false,
        }
    }

    fn take(&mut self, from: Address, message: &Uplink, payload: &[u8], may_change: bool) -> bool {
        let other = match message {
            Uplink::Question(Question::File(_)) => {
                let packet = FilePacket::read(payload).0;
                return self.files.push_back(FileRequest { from, packet, may_change }).is_ok();
            }
            Uplink::Question(Question::Log(request)) => OtherRequest::Log { from, request: *request, may_change },
            Uplink::Command(Command::RequestMessage { message, .. }) => OtherRequest::Metadata(*message),
            Uplink::Command(Command::StartLogStream) => OtherRequest::Stream(from, true),
            Uplink::Command(Command::StopLogStream) => OtherRequest::Stream(from, false),
            _ => return false,
        };
        self.others.push_back(other).is_ok()
    }
}
