//! Serial ports and shells (SERIAL_CONTROL), to which stations have no access.

use afbc_mavlink::SerialControl;

/// Returns the response: no bytes for a port, a refusal in words for a shell.
pub fn answer(asked: SerialControl) -> SerialControl {
    let bytes = if asked.device == SerialControl::SHELL { SerialControl::NO_SHELL.len() as u8 } else { 0 };
    SerialControl { bytes, ..asked }
}
