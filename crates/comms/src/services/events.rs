//! Events interface. The vehicle sends texts, not events, so requests are refused.

use afbc_mavlink::{EventError, EventRequest};

/// `MAV_EVENT_ERROR_REASON_UNAVAILABLE`.
const UNAVAILABLE: u8 = 0;

/// Returns the refusal of a request.
pub fn answer(request: EventRequest) -> EventError {
    let [number, _] = request.numbers;
    EventError { number, oldest: 0, reason: UNAVAILABLE }
}
