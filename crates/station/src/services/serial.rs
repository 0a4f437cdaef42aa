//! Serial ports and shells, which stations have no access to.

use afbc_link::Serial;

/// Returns the response: nothing comes back from the port.
pub fn answer(asked: Serial) -> Serial {
    Serial { bytes: 0, ..asked }
}
