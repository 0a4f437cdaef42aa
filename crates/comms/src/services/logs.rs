//! Log download of a vehicle without storage: answers that there are no logs, so that downloads end at once.

use afbc_mavlink::{LogAnswer, LogRequest};

/// Returns the answer to a request that expects one: no log, or no data.
pub fn answer(request: LogRequest) -> Option<LogAnswer> {
    Some(match request {
        LogRequest::List { .. } => LogAnswer::Entry { log: 0, logs: [0; 2] },
        LogRequest::Data { log, offset, .. } => LogAnswer::Data { log, offset, bytes: 0 },
        LogRequest::Erase | LogRequest::End | LogRequest::Received(_) => return None,
    })
}
