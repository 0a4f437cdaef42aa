//! Lists, downloads and erases logs over the link that telemetry and commands share.

use crate::services::log_transfer::LogTransfer;
use crate::services::storage::LogStore;
use crate::transferring::{Outcome, TransferRequests, Transferring};
use afbc_mavlink::{Address, LogMessage, LogRequest, ServiceRequest, Uplink};
use core::task::Poll;

/// Text to a station that wants to erase logs while the vehicle is armed.
const WHILE_ARMED: &str = "logs not erased: disarm the vehicle first";
/// Longest LOG_DATA frame \[bytes\].
pub(crate) const LOG_FRAME: usize = 12 + 97;

/// Pending log requests, and the download in progress.
#[derive(Clone, Debug, Default)]
pub struct LogServer {
    transfer: LogTransfer,
    /// True if the logs are to be erased.
    erases: bool,
}

impl LogServer {
    /// Returns true while a request or a download is pending.
    pub fn is_busy(&self) -> bool {
        self.erases || self.transfer.is_busy()
    }

    /// Returns the next message or text to send. Returns none also while the storage is busy.
    pub(crate) fn next(&mut self, store: &mut (impl LogStore + ?Sized), armed: bool) -> Option<Outcome<LogMessage>> {
        if self.erases {
            if armed {
                self.erases = false;
                return Some(Outcome::Say(WHILE_ARMED, true));
            }
            let Poll::Ready(erased) = store.erase_logs() else { return None };
            self.erases = false;
            // Erasing renumbers the logs, so a pending download would continue with another log.
            self.transfer.hear(LogRequest::Erase);
            return Some(Outcome::Say(if erased { "logs erased" } else { "logs cannot be erased" }, !erased));
        }
        self.transfer.next(store).map(Outcome::Send)
    }
}

impl TransferRequests for LogServer {
    fn wants(&self, message: &Uplink) -> bool {
        // A log stream's acknowledgement is no request to this service.
        matches!(
            message,
            Uplink::ServiceRequest(ServiceRequest::Log(request)) if !matches!(request, LogRequest::Received(_))
        )
    }

    fn take(&mut self, _: Address, message: &Uplink, _: &[u8], may_change: bool) -> bool {
        match message {
            // A station that is not in control has already been warned.
            Uplink::ServiceRequest(ServiceRequest::Log(LogRequest::Erase)) => self.erases |= may_change,
            Uplink::ServiceRequest(ServiceRequest::Log(request)) => self.transfer.hear(*request),
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
