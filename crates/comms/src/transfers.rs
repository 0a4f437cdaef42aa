//! Transfers files and logs of a vehicle with storage, over the link that telemetry and commands share.

use crate::log_server::{LOG_FRAME, LogServer};
use crate::services::ftp::{FileTerms, Ftp, changes};
use crate::services::log_stream::{LogStream, StreamEvent};
use crate::services::storage::{FileStore, LogSource, LogStore};
use crate::transferring::{Outcome, TransferRequests, Transferring};
use afbc_mavlink::{
    Address, ComponentMetadata, FilePacket, LogRequest, ServiceRequest, Transfer, Uplink, VehicleCommand,
};
use heapless::Deque;

/// Largest number of queued requests for files, and of other kinds. Further requests are dropped, since stations repeat
/// them.
const FILES_MAX: usize = 4;
const OTHERS_MAX: usize = 24;
/// Longest frame with a part of a file or of a log stream \[bytes\].
const FILE_FRAME: usize = 12 + 255;
/// COMPONENT_INFORMATION and COMPONENT_METADATA.
const METADATA: [u32; 2] = [395, 397];

/// Queued requests and transfers in progress. `F` is an open file.
pub struct Transfers<F> {
    files: Deque<FileRequest, FILES_MAX>,
    others: Deque<OtherRequest, OTHERS_MAX>,
    ftp: Ftp<F>,
    logs: LogServer,
    stream: LogStream,
    metadata: Option<ComponentMetadata>,
    /// True if the next packet may belong to a log download.
    logs_turn: bool,
}

struct FileRequest {
    from: Address,
    packet: FilePacket,
    may_change: bool,
}

enum OtherRequest {
    /// Acknowledgement of a part of the log stream, by its sequence number.
    Received(Address, u16),
    /// Begins (true) or ends (false) a log stream to a station.
    Stream(Address, bool),
    /// Requests a metadata message by its number.
    Metadata(u32),
}

impl<F: Copy, S: FileStore<File = F> + LogStore + LogSource> Transferring for (&mut Transfers<F>, &mut S) {
    type Sent = Transfer;

    fn frame_max(&self) -> usize {
        self.0.frame_max()
    }

    fn next(&mut self, now_us: u64, armed: bool) -> Option<Outcome<Transfer>> {
        let (transfers, store) = self;
        transfers.next(*store, now_us, armed)
    }
}

/// Returns true if a request changes stored files or logs.
pub(crate) fn is_change(message: &Uplink) -> bool {
    match message {
        Uplink::ServiceRequest(ServiceRequest::Log(request)) => *request == LogRequest::Erase,
        Uplink::ServiceRequest(ServiceRequest::File(operation)) => {
            changes(afbc_mavlink::FileOpcode(operation.operation))
        }
        _ => false,
    }
}

impl<F: Copy> Transfers<F> {
    /// Creates the service. `metadata` tells where the vehicle's component metadata is, if there is any.
    pub fn new(metadata: Option<ComponentMetadata>) -> Self {
        Transfers {
            files: Deque::new(),
            others: Deque::new(),
            ftp: Ftp::default(),
            logs: LogServer::default(),
            stream: LogStream::default(),
            metadata,
            logs_turn: false,
        }
    }

    /// Returns the length of the longest frame that may be next \[bytes\].
    pub(crate) fn frame_max(&self) -> usize {
        let logs_alone =
            self.files.is_empty() && self.others.is_empty() && !self.ftp.is_busy() && !self.stream.is_active();
        if logs_alone { LOG_FRAME } else { FILE_FRAME }
    }

    /// Returns the next message or text to send.
    pub(crate) fn next<S: FileStore<File = F> + LogStore + LogSource>(
        &mut self,
        store: &mut S,
        now_us: u64,
        armed: bool,
    ) -> Option<Outcome<Transfer>> {
        while let Some(request) = self.others.pop_front() {
            if let Some(outcome) = self.begin(request, store, now_us) {
                return Some(outcome);
            }
        }
        while let Some(FileRequest { from, packet, may_change }) = self.files.pop_front() {
            // The present armed state counts. The request may be older.
            let terms = FileTerms { now_us, may_write: may_change && !armed };
            if let Some(packet) = self.ftp.answer(from, &packet, store, terms) {
                return Some(Outcome::Send(Transfer::File { packet, to: from }));
            }
        }
        // Log download and FTP take turns if both are in progress.
        self.logs_turn = !self.logs_turn;
        if (self.logs_turn || !self.ftp.is_busy())
            && let Some(outcome) = self.logs.next(store, armed)
        {
            return Some(match outcome {
                Outcome::Send(message) => Outcome::Send(Transfer::Log(message)),
                Outcome::Say(text, is_warning) => Outcome::Say(text, is_warning),
            });
        }
        if let Some((packet, to)) = self.ftp.next_packet(store, now_us) {
            return Some(Outcome::Send(Transfer::File { packet, to }));
        }
        Some(match self.stream.next(store, now_us)? {
            StreamEvent::Part(part) => Outcome::Send(Transfer::LogPart(part)),
            StreamEvent::Unheard => Outcome::Say("log stream ended: station does not acknowledge", true),
        })
    }
}

impl<F: Copy> Transfers<F> {
    /// Handles or begins a request that is not about files.
    fn begin<S: LogSource>(&mut self, request: OtherRequest, store: &mut S, now_us: u64) -> Option<Outcome<Transfer>> {
        match request {
            OtherRequest::Received(from, sequence) => {
                self.stream.acknowledge(from, sequence);
                None
            }
            OtherRequest::Stream(to, true) => {
                let starts = self.stream.start(to, store);
                (!starts).then_some(Outcome::Say("no log to stream", true))
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
            Uplink::ServiceRequest(ServiceRequest::File(_) | ServiceRequest::Log(_)) => true,
            Uplink::Command(VehicleCommand::RequestMessage { message, .. }) => {
                self.metadata.is_some() && METADATA.contains(message)
            }
            Uplink::Command(VehicleCommand::StartLogStream | VehicleCommand::StopLogStream) => true,
            _ => false,
        }
    }

    fn take(&mut self, from: Address, message: &Uplink, payload: &[u8], may_change: bool) -> bool {
        let other = match message {
            Uplink::ServiceRequest(ServiceRequest::File(_)) => {
                let packet = FilePacket::read(payload).0;
                return self.files.push_back(FileRequest { from, packet, may_change }).is_ok();
            }
            Uplink::ServiceRequest(ServiceRequest::Log(LogRequest::Received(sequence))) => {
                OtherRequest::Received(from, *sequence)
            }
            Uplink::ServiceRequest(ServiceRequest::Log(_)) => {
                return self.logs.take(from, message, payload, may_change);
            }
            Uplink::Command(VehicleCommand::RequestMessage { message, .. }) => OtherRequest::Metadata(*message),
            Uplink::Command(VehicleCommand::StartLogStream) => OtherRequest::Stream(from, true),
            Uplink::Command(VehicleCommand::StopLogStream) => OtherRequest::Stream(from, false),
            _ => return false,
        };
        self.others.push_back(other).is_ok()
    }
}
