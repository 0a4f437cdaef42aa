//! Files, of which a vehicle without storage has none: each operation is refused as an unknown one, so that clients
//! stop at once.

use afbc_link::{FileOperation, FileRefusal, FtpError};

/// Returns the answer to an operation.
pub fn answer(asked: FileOperation) -> FileRefusal {
    let FileOperation { sequence, session, operation, offset } = asked;
    FileRefusal { sequence: sequence.wrapping_add(1), session, operation, offset, error: FtpError::UNKNOWN_COMMAND }
}
