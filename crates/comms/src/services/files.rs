//! File transfer of a vehicle without storage: refuses each operation as unknown, so that clients stop at once.

use afbc_mavlink::{FileOperation, FileRefusal, FtpError};

/// Returns the refusal of an operation.
pub fn answer(asked: FileOperation) -> FileRefusal {
    let FileOperation { sequence, session, operation, offset } = asked;
    FileRefusal { sequence: sequence.wrapping_add(1), session, operation, offset, error: FtpError::UNKNOWN_COMMAND }
}
