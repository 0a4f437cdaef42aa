//! Logs of a vehicle on the link that telemetry and commands share: listed, downloaded and erased.

use crate::services::log_transfer::LogTransfer;
use crate::services::storage::LogStore;
use crate::transferring::{Outcome, TransferRequests, Transferring};
use afbc_link::{Address, LogMessage, LogRequest, Question, Uplink};
use core::task::Poll;

/// Text to stations that want logs erased while the vehicle is armed.
const WHILE_ARMED: &str = "logs are erased while disarmed only";
/// Longest frame with a part of a log \[bytes\].
pub(crate) const LOG_FRAME: usize = 12 + 97;

/// What of logs is asked for and sent.
#[derive(Clone, Debug, Default)]
pub struct LogServer {
    transfer: LogTransfer,
    /// True while they are to be erased.
    erases: bool,
}

impl LogServer {
    /// True while there is something to be done.
    pub fn is_busy(&self) -> bool {
        self.erases || self.transfer.is_busy()
    }

    /// Returns what is to be done next; none also while the logs have to be waited for.
    pub(crate) fn next(&mut self, store: &mut (impl LogStore + ?Sized), armed: bool) -> Option<Outcome<LogMessage>> {
        if self.erases {
            if armed {
                self.erases = false;
                return Some(Outcome::Say(WHILE_ARMED, true));
            }
            let Poll::Ready(erased) = store.erase_logs() else { return None };
            self.erases = false;
            // Logs have other places now: a part that waits would be of another one.
            self.transfer.hear(LogRequest::Erase);
            return Some(Outcome::Say(if erased { "logs erased" } else { "logs cannot be erased" }, !erased));
        }
        self.transfer.next(store).map(Outcome::Send)
    }
}

impl TransferRequests for LogServer {
    fn wants(&self, message: &Uplink) -> bool {
        // What a streamed log's station has received is no request.
        matches!(message, Uplink::Question(Question::Log(request)) if !matches!(request, LogRequest::Received(_)))
    }

    fn take(&mut self, _: Address, message: &Uplink, _: &[u8], may_change: bool) -> bool {
        match message {
            // Whoever is not in control has been told.
            Uplink::Question(Question::Log(LogRequest::Erase)) => self.erases |= may_change,
            Uplink::Question(Question::Log(request)) => self.transfer.hear(*request),
            _ => return false,
        }
        true
    }
}

impl Transferring for (&mut LogServer, &mut dyn LogStore) {
    type Sent = LogMessage;

    fn frame_max(&self) -> usize {
        LOG_FRAME
    }

    fn next(&mut self, _: u64, armed: bool) -> Option<Outcome<LogMessage>> {
        let (server, store) = self;
        server.next(*store, armed)
    }
}
