//! Serial ports and shells (SERIAL_CONTROL), to which stations have no access.

use afbc_mavlink::Serial;

/// Returns the response: no bytes for a port, a refusal in words for a shell.
pub fn answer(asked: Serial) -> Serial {
    let bytes = if asked.device == Serial::SHELL { Serial::NO_SHELL.len() as u8 } else { 0 };
    Serial { bytes, ..asked }
}
