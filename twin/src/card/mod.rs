//! Storage of a board's logs: a memory card in its slot, which the emulator's models provide, or a flash chip. This
//! module adds write times and stalls.

mod files;
mod flash;
mod sd;
mod spi;

use rigless::chip::memory_card::MemoryCard;
use rigless::snapshot::{Error, Reader, Store, Writer};
use serde::{Deserialize, Serialize};
use std::error::Error as AnyError;
use std::io::{Cursor, Write};

pub use flash::FlashChip;
pub use sd::SdSlot;
pub use spi::SpiSlot;

/// Number of blocks of the card, a size that its registers can express, and first block of its volume.
const BLOCKS: usize = 70 * 1024;
const VOLUME: usize = 63;
/// Bytes of a cluster. With one block per cluster, each block of a file would take seven further writes, to the
/// allocation table.
const CLUSTER: u32 = 8 * 1024;
/// Usual time to write a block on an ordinary card [ns].
const USUAL_NS: u64 = 800_000;

/// Faults of a card. Times count from power-up [ms].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CardFaults {
    /// Time and duration of a stall: the first block after the time takes longer by the duration.
    pub stall_ms: Option<[u64; 2]>,
    /// Times at which the card is removed and inserted again.
    pub out_ms: Option<[u64; 2]>,
}

/// Storage of logs.
pub trait LogStorage {
    /// Sets the faults of the storage, replacing earlier ones.
    fn set_faults(&mut self, faults: CardFaults);

    /// Removes the card; does nothing to a flash chip.
    fn remove(&mut self) {}

    /// Fills the storage up to this many free bytes.
    fn fill(&mut self, room: u64);

    /// Returns the names and contents of the stored logs.
    fn logs(&self) -> Result<Vec<(String, Vec<u8>)>, Box<dyn AnyError>>;

    /// Returns the number of blocks, or pages, written so far.
    fn written(&self) -> u64;
}

/// Card in its slot.
#[derive(Debug)]
pub struct CardSlot {
    card: MemoryCard,
    faults: CardFaults,
    busy_until_ns: u64,
    was_out: bool,
    written: u64,
}

/// Returns a card whose first partition has an empty FAT16, or one filled up to `room` free bytes. The emulator's own
/// card has no partitions.
fn formatted(room: Option<u64>) -> MemoryCard {
    let mut bytes = vec![0; BLOCKS * 512];
    let options = fatfs::FormatVolumeOptions::new().fat_type(fatfs::FatType::Fat16).bytes_per_cluster(CLUSTER);
    let volume = &mut Cursor::new(&mut bytes[VOLUME * 512..]);
    fatfs::format_volume(volume, options).expect("the card is large enough");
    if let Some(room) = room {
        fill(&mut bytes[VOLUME * 512..], room).expect("it has room");
    }
    // Master boot record: type (FAT16), first block and length of its one partition, and the signature at its end.
    bytes[450] = 0x06;
    bytes[454..458].copy_from_slice(&(VOLUME as u32).to_le_bytes());
    bytes[458..462].copy_from_slice(&((BLOCKS - VOLUME) as u32).to_le_bytes());
    bytes[510..512].copy_from_slice(&[0x55, 0xAA]);
    MemoryCard::holding(&bytes)
}

/// Fills a volume with one file, up to `room` free bytes.
fn fill(volume: &mut [u8], room: u64) -> std::io::Result<()> {
    let volume = fatfs::FileSystem::new(Cursor::new(volume), fatfs::FsOptions::new())?;
    let free = u64::from(volume.stats()?.free_clusters()) * u64::from(volume.cluster_size());
    let mut file = volume.root_dir().create_file("OTHER.BIN")?;
    file.write_all(&vec![0xA5; free.saturating_sub(room) as usize])
}

impl CardSlot {
    fn new() -> Self {
        CardSlot { card: formatted(None), faults: CardFaults::default(), busy_until_ns: 0, was_out: false, written: 0 }
    }

    /// Returns whether the card is out, and whether it has just been removed or inserted. Either makes it lose its
    /// supply.
    fn is_out(&mut self, now_ns: u64) -> (bool, bool) {
        let is_out = self.faults.out_ms.is_some_and(|[from, to]| (from..to).contains(&(now_ns / 1_000_000)));
        let is_new = is_out != self.was_out;
        if is_new {
            println!("{:8.3} s  the card is {}", now_ns as f64 * 1e-9, if is_out { "out" } else { "in" });
            (self.was_out, self.busy_until_ns) = (is_out, 0);
            self.card.power_cycle();
        }
        (is_out, is_new)
    }

    /// Counts a written block and starts its programming time. The emulator's card stores the block at once.
    fn write(&mut self, now_ns: u64) {
        self.written += 1;
        self.busy_until_ns = now_ns + USUAL_NS;
        if let Some([at_ms, ms]) = self.faults.stall_ms.filter(|[at_ms, _]| now_ns >= at_ms * 1_000_000) {
            self.busy_until_ns += ms * 1_000_000;
            self.faults.stall_ms = None;
            println!("{:8.3} s  the card stalls for {ms} ms, from {at_ms} ms on", now_ns as f64 * 1e-9);
        }
    }
}

impl LogStorage for CardSlot {
    fn set_faults(&mut self, faults: CardFaults) {
        self.faults = faults;
    }

    fn remove(&mut self) {
        self.faults = CardFaults { out_ms: Some([0, u64::MAX]), ..CardFaults::default() };
    }

    fn fill(&mut self, room: u64) {
        self.card = formatted(Some(room));
    }

    fn logs(&self) -> Result<Vec<(String, Vec<u8>)>, Box<dyn AnyError>> {
        files::logs(&self.card)
    }

    fn written(&self) -> u64 {
        self.written
    }
}

impl Store for CardSlot {
    fn store(&self, to: &mut Writer) -> Result<(), Error> {
        to.put(&(self.faults, self.busy_until_ns, self.was_out, self.written))?;
        self.card.store(to)
    }

    fn load(&mut self, from: &mut Reader) -> Result<(), Error> {
        (self.faults, self.busy_until_ns, self.was_out, self.written) = from.take()?;
        self.card.load(from)
    }
}
