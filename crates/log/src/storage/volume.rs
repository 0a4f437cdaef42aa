//! Checks a card's volume before it is opened, and limits the blocks that one call may touch.

use crate::storage::card::{CardError, LogCard};
use core::cell::{Cell, RefCell};
use embedded_sdmmc::{Block, BlockCount, BlockDevice, BlockIdx, TimeSource, Timestamp};

/// Largest number of blocks that one call may touch: more than the allocation table of the largest FAT32 volume on SD
/// cards (2^26 clusters, 128 in a block).
const TOUCHED_MAX: u32 = 1 << 20;
/// Partition types: three of FAT16 and two of FAT32.
const TYPES: [u8; 5] = [0x04, 0x06, 0x0E, 0x0B, 0x0C];
/// Fewest clusters of a FAT16 and of a FAT32 volume.
const CLUSTERS: [u64; 2] = [4_085, 65_525];

/// A card as `embedded-sdmmc` uses it.
pub(crate) struct CardBlocks<'a> {
    card: RefCell<&'a mut dyn LogCard>,
    /// Number of blocks, 0 until the card has started.
    blocks: Cell<u32>,
    /// Number of blocks that the present call may still touch.
    left: Cell<u32>,
    /// The card's failure in the present call. `embedded-sdmmc` may report it as a full disk.
    failure: Cell<Option<CardError>>,
}

impl<'a> CardBlocks<'a> {
    pub(crate) fn new(card: &'a mut dyn LogCard) -> Self {
        CardBlocks { card: RefCell::new(card), blocks: Cell::new(0), left: Cell::new(0), failure: Cell::new(None) }
    }

    /// Begins a call: resets its block limit and its failure.
    pub(crate) fn begin(&self) {
        self.left.set(TOUCHED_MAX);
        self.failure.set(None);
    }

    /// Returns the card's failure in the present call, if any.
    pub(crate) fn failure(&self) -> Option<CardError> {
        self.failure.get()
    }

    /// Starts the card. Returns true if its first partition holds an intact FAT volume.
    pub(crate) fn start(&self) -> Result<bool, CardError> {
        self.begin();
        let blocks = self.touch(|card| card.start())?;
        self.blocks.set(blocks);
        let mut block = [Block::new()];
        self.read(&mut block, BlockIdx(0))?;
        let Some(start) = first_partition(&block[0].contents) else { return Ok(false) };
        if start >= blocks {
            return Ok(false);
        }
        self.read(&mut block, BlockIdx(start))?;
        Ok(is_sound(&block[0].contents, u64::from(blocks - start)))
    }

    fn touch<T>(&self, call: impl FnOnce(&mut dyn LogCard) -> Result<T, CardError>) -> Result<T, CardError> {
        // `try_borrow_mut` cannot panic, in whatever order the library calls.
        let done = match (self.left.get().checked_sub(1), self.card.try_borrow_mut()) {
            (Some(left), Ok(mut card)) => {
                self.left.set(left);
                call(&mut **card)
            }
            _ => Err(CardError::Endless),
        };
        if let Err(error) = done {
            self.failure.set(Some(error));
        }
        done
    }
}

impl BlockDevice for CardBlocks<'_> {
    type Error = CardError;

    fn read(&self, blocks: &mut [Block], start: BlockIdx) -> Result<(), CardError> {
        (start.0..).zip(blocks).try_for_each(|(number, block)| {
            let is_there = number < self.blocks.get();
            self.touch(|card| if is_there { card.read(number, block) } else { Err(CardError::Endless) })
        })
    }

    fn write(&self, blocks: &[Block], start: BlockIdx) -> Result<(), CardError> {
        (start.0..).zip(blocks).try_for_each(|(number, block)| {
            // Block 0 holds the partition table and is never written.
            let is_there = number > 0 && number < self.blocks.get();
            self.touch(|card| if is_there { card.write(number, block) } else { Err(CardError::Endless) })
        })
    }

    fn num_blocks(&self) -> Result<BlockCount, CardError> {
        Ok(BlockCount(self.blocks.get()))
    }
}

/// Stamps all files with the first day that FAT can express, 1 January 1980, because there is no clock.
pub(crate) struct NoClock;

impl TimeSource for NoClock {
    fn get_timestamp(&self) -> Timestamp {
        Timestamp { year_since_1970: 10, zero_indexed_month: 0, zero_indexed_day: 0, hours: 0, minutes: 0, seconds: 0 }
    }
}

fn byte(block: &[u8; 512], at: usize) -> u8 {
    block.get(at).copied().unwrap_or_default()
}

fn word(block: &[u8; 512], at: usize) -> u64 {
    u64::from(u16::from_le_bytes([byte(block, at), byte(block, at + 1)]))
}

fn long(block: &[u8; 512], at: usize) -> u64 {
    word(block, at) | word(block, at + 2) << 16
}

fn is_signed(block: &[u8; 512]) -> bool {
    word(block, 510) == 0xAA55
}

/// Returns the first block of the first partition, if its type is FAT.
fn first_partition(block: &[u8; 512]) -> Option<u32> {
    let is_fat = is_signed(block) && byte(block, 446) & 0x7F == 0 && TYPES.contains(&byte(block, 450));
    let start = u32::try_from(long(block, 454)).ok()?;
    (is_fat && start > 0).then_some(start)
}

/// Returns true if this first block describes a consistent FAT volume that fits into `room` blocks.
fn is_sound(block: &[u8; 512], room: u64) -> bool {
    // A count too large for its 16-bit field is 0 there and stands in the 32-bit field.
    let either = |short, long: u64| if short == 0 { long } else { short };
    let per_cluster = u64::from(byte(block, 13));
    let (reserved, tables, entries) = (word(block, 14), u64::from(byte(block, 16)), word(block, 17));
    let (total, table) = (either(word(block, 19), long(block, 32)), either(word(block, 22), long(block, 36)));
    let before = reserved + tables * table + (32 * entries).div_ceil(512);
    let shape = is_signed(block)
        && word(block, 11) == 512
        && per_cluster.is_power_of_two()
        && reserved > 0
        && (1..=2).contains(&tables)
        && before < total
        && total <= room;
    if !shape {
        return false;
    }
    // `shape` ensures that the next line neither divides by zero nor underflows.
    let clusters = (total - before) / per_cluster;
    let [fat16, fat32] = CLUSTERS;
    // Clusters are numbered from 2 on. The table must have room for all, or the library would read beyond it.
    let ends = clusters + 2;
    if clusters < fat32 {
        return clusters >= fat16 && entries > 0 && table * 256 >= ends;
    }
    let (root, info) = (long(block, 44), word(block, 48));
    // Both this check and the library tell FAT16 from FAT32 by the number of clusters alone.
    clusters < 1 << 28
        && entries == 0
        && word(block, 42) == 0
        && table * 128 >= ends
        && (2..ends).contains(&root)
        && (1..reserved).contains(&info)
}
