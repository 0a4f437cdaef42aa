//! Writes the logs that a board has stored to files of this machine.

use crate::card::LogStorage;
use std::error::Error;
use std::fs;
use std::path::Path;

/// Log found on a board's storage.
#[derive(Debug)]
pub struct StorageLog {
    pub name: String,
    pub bytes: usize,
    /// Total duration of the log's dropout records [ms].
    pub missing_ms: u64,
    /// Bytes after the last whole record.
    pub rest: usize,
}

/// Walks through the records of a log (PX4 User Guide, "ULog File Format"): length, kind, content.
fn walk(name: String, log: &[u8]) -> StorageLog {
    // A file's header has 16 bytes.
    let (mut rest, mut missing_ms) = (log.get(16..).unwrap_or_default(), 0);
    while let Some(([low, high, kind], behind)) = rest.split_first_chunk() {
        let Some((content, behind)) = behind.split_at_checked(u16::from_le_bytes([*low, *high]).into()) else { break };
        if let (b'O', [low, high]) = (kind, content) {
            missing_ms += u64::from(u16::from_le_bytes([*low, *high]));
        }
        rest = behind;
    }
    StorageLog { name, bytes: log.len(), missing_ms, rest: rest.len() }
}

/// Writes the stored logs into a folder, and returns their descriptions.
pub fn save(storage: &dyn LogStorage, folder: &Path) -> Result<Vec<StorageLog>, Box<dyn Error>> {
    fs::create_dir_all(folder)?;
    let mut saved = Vec::new();
    for (name, bytes) in storage.logs()? {
        fs::write(folder.join(&name), &bytes)?;
        saved.push(walk(name, &bytes));
    }
    Ok(saved)
}
