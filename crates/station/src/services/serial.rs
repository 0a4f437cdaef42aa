//! Serial ports and shells, which stations have no access to.

use afbc_link::Serial;

/// Returns the response: nothing comes back from a port, and from a shell that there is none.
pub fn answer(asked: Serial) -> Serial {
    let bytes = if asked.device == Serial::SHELL { Serial::NO_SHELL.len() as u8 } else { 0 };
    Serial { bytes, ..asked }
}
