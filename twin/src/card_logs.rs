//! The logs on a card, read by a FAT that is not the firmware's.

use rigless::chip::memory_card::MemoryCard;
use std::error::Error;
use std::fs;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;

const BLOCK: usize = 512;
/// Where the card's table of partitions has the first block of the first one.
const FIRST: usize = 446 + 8;

/// The first partition of a card. It cannot be written.
struct CardVolume<'a> {
    card: &'a MemoryCard,
    start: u64,
    at: u64,
}

impl Read for CardVolume<'_> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let (block, offset) = (self.start + self.at / BLOCK as u64, (self.at % BLOCK as u64) as usize);
        let stored = self.card.stored(block as usize);
        let count = into.len().min(BLOCK - offset);
        into[..count].copy_from_slice(&stored[offset..offset + count]);
        self.at += count as u64;
        Ok(count)
    }
}

impl Write for CardVolume<'_> {
    fn write(&mut self, _: &[u8]) -> io::Result<usize> {
        Err(io::ErrorKind::ReadOnlyFilesystem.into())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for CardVolume<'_> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.at = match to {
            SeekFrom::Start(at) => at,
            SeekFrom::Current(by) => self.at.saturating_add_signed(by),
            SeekFrom::End(_) => return Err(io::ErrorKind::Unsupported.into()),
        };
        Ok(self.at)
    }
}

/// A log that was on a card.
#[derive(Debug)]
pub struct CardLog {
    pub name: String,
    pub bytes: usize,
    /// What its dropouts say [ms].
    pub missing_ms: u64,
    /// Bytes behind the last whole record.
    pub rest: usize,
}

/// Walks over the records of a log (PX4 User Guide, "ULog File Format"): length, kind, content.
fn walk(name: String, log: &[u8]) -> CardLog {
    // A file's header has 16 bytes.
    let (mut rest, mut missing_ms) = (log.get(16..).unwrap_or_default(), 0);
    while let Some(([low, high, kind], behind)) = rest.split_first_chunk() {
        let Some((content, behind)) = behind.split_at_checked(u16::from_le_bytes([*low, *high]).into()) else { break };
        if let (b'O', [low, high]) = (kind, content) {
            missing_ms += u64::from(u16::from_le_bytes([*low, *high]));
        }
        rest = behind;
    }
    CardLog { name, bytes: log.len(), missing_ms, rest: rest.len() }
}

/// Writes the logs of a card into a folder, and returns them.
pub fn save(card: &MemoryCard, folder: &Path) -> Result<Vec<CardLog>, Box<dyn Error>> {
    let first = card.stored(0);
    let start = u32::from_le_bytes(first[FIRST..FIRST + 4].try_into()?).into();
    let options = fatfs::FsOptions::new().update_accessed_date(false);
    let volume = fatfs::FileSystem::new(CardVolume { card, start, at: 0 }, options)?;
    fs::create_dir_all(folder)?;
    let mut saved = Vec::new();
    for entry in volume.root_dir().iter() {
        let entry = entry?;
        let name = entry.file_name().to_lowercase();
        if name.ends_with(".ulg") {
            let mut bytes = Vec::new();
            entry.to_file().read_to_end(&mut bytes)?;
            fs::write(folder.join(&name), &bytes)?;
            saved.push(walk(name, &bytes));
        }
    }
    Ok(saved)
}
