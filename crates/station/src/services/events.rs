//! Events, which the vehicle does not send: it reports in texts.

use afbc_link::{EventError, EventRequest};

/// `MAV_EVENT_ERROR_REASON`: not available.
const UNAVAILABLE: u8 = 0;

/// Returns the answer to a request.
pub fn answer(request: EventRequest) -> EventError {
    let [number, _] = request.numbers;
    EventError { number, oldest: 0, reason: UNAVAILABLE }
}
