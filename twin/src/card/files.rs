//! Reads the files on a card with a FAT implementation other than the firmware's.

use rigless::chip::memory_card::MemoryCard;
use std::error::Error;
use std::io::{self, Read, Seek, SeekFrom, Write};

const BLOCK: usize = 512;
/// Offset in the partition table of the first partition's first block.
const FIRST: usize = 446 + 8;

/// First partition of a card, read-only.
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

/// Returns the logs on a card.
pub fn logs(card: &MemoryCard) -> Result<Vec<(String, Vec<u8>)>, Box<dyn Error>> {
    let first = card.stored(0);
    let start = u32::from_le_bytes(first[FIRST..FIRST + 4].try_into()?).into();
    let options = fatfs::FsOptions::new().update_accessed_date(false);
    let volume = fatfs::FileSystem::new(CardVolume { card, start, at: 0 }, options)?;
    let mut logs = Vec::new();
    for entry in volume.root_dir().iter() {
        let entry = entry?;
        let name = entry.file_name().to_lowercase();
        if name.ends_with(".ulg") {
            let mut bytes = Vec::new();
            entry.to_file().read_to_end(&mut bytes)?;
            logs.push((name, bytes));
        }
    }
    Ok(logs)
}
