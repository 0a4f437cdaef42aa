//! Flash whose power is cut after a number of bits.
#![allow(dead_code, clippy::indexing_slicing, reason = "tests; each uses a part of it")]

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};

/// Error of a flash without power.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PowerCut;

impl NorFlashError for PowerCut {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

/// State in which an interrupted erase leaves a sector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Erasing {
    /// Bits become 1 from the first to the last.
    Forwards,
    /// Bits become 1 from the last to the first.
    Backwards,
    /// Bits become 1 in random order.
    Scattered,
    /// All bits become 0 first, as in chips that program a sector before they erase it, and then 1 in random order.
    Zeroed,
}

impl Erasing {
    pub(crate) const ALL: [Self; 4] = [Self::Forwards, Self::Backwards, Self::Scattered, Self::Zeroed];
}

/// Number of steps of an erase between which the power can be cut.
const ERASE_STEPS: u64 = 16;

/// Two sectors of `SECTOR` bytes, in words of 4. A write clears the bits of a word in a random order, one word after
/// the other. The power is cut after `left` bits.
#[derive(Clone, Debug)]
pub(crate) struct Cuttable<const SECTOR: usize> {
    pub(crate) bytes: Vec<u8>,
    /// Bits that can still be written, `None` without a power cut.
    pub(crate) left: Option<u64>,
    pub(crate) erasing: Erasing,
    /// Bits written, plus steps of erases.
    pub(crate) done: u64,
    /// Number of erases of each sector.
    pub(crate) erases: [u32; 2],
    pub(crate) off: bool,
    pub(crate) seed: u64,
}

impl<const SECTOR: usize> Cuttable<SECTOR> {
    pub(crate) fn new(seed: u64, erasing: Erasing) -> Self {
        let bytes = vec![0xFF; 2 * SECTOR];
        Cuttable { bytes, left: None, erasing, done: 0, erases: [0; 2], off: false, seed: seed | 1 }
    }

    /// Restores the power for good.
    pub(crate) fn power_up(&mut self) {
        (self.left, self.off) = (None, false);
    }

    fn draw(&mut self) -> u64 {
        self.seed ^= self.seed << 13;
        self.seed ^= self.seed >> 7;
        self.seed ^= self.seed << 17;
        self.seed
    }

    /// Spends one bit; returns false if the power is off.
    fn step(&mut self) -> bool {
        self.off |= self.left == Some(0);
        if !self.off {
            self.left = self.left.map(|left| left - 1);
            self.done += 1;
        }
        !self.off
    }
}

impl<const SECTOR: usize> ErrorType for Cuttable<SECTOR> {
    type Error = PowerCut;
}

impl<const SECTOR: usize> ReadNorFlash for Cuttable<SECTOR> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), PowerCut> {
        if self.off {
            return Err(PowerCut);
        }
        bytes.copy_from_slice(&self.bytes[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        2 * SECTOR
    }
}

impl<const SECTOR: usize> NorFlash for Cuttable<SECTOR> {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), PowerCut> {
        assert!((to - from) as usize == SECTOR && (from as usize).is_multiple_of(SECTOR));
        let range = from as usize..to as usize;
        for done in 1..=ERASE_STEPS {
            if !self.step() {
                return Err(PowerCut);
            }
            let share = done * SECTOR as u64 / ERASE_STEPS;
            for at in range.clone() {
                let (nth, draw) = ((at - range.start) as u64, self.draw());
                match self.erasing {
                    Erasing::Forwards if nth < share => self.bytes[at] = 0xFF,
                    Erasing::Backwards if nth >= SECTOR as u64 - share => self.bytes[at] = 0xFF,
                    Erasing::Zeroed if done == 1 => self.bytes[at] = 0,
                    Erasing::Scattered | Erasing::Zeroed if draw.is_multiple_of(8) => {
                        self.bytes[at] |= (draw >> 8) as u8
                    }
                    _ => (),
                }
            }
        }
        self.bytes[range].fill(0xFF);
        self.erases[from as usize / SECTOR] += 1;
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), PowerCut> {
        assert!(offset.is_multiple_of(4) && bytes.len().is_multiple_of(4));
        for (word, bytes) in bytes.chunks(4).enumerate() {
            let at = offset as usize + 4 * word;
            let mut order: Vec<usize> = (0..32).collect();
            (1..32).for_each(|last| order.swap(last, (self.draw() % (last as u64 + 1)) as usize));
            for bit in order {
                let (byte, mask) = (bit / 8, 1 << (bit % 8));
                if bytes[byte] & mask == 0 {
                    if !self.step() {
                        return Err(PowerCut);
                    }
                    self.bytes[at + byte] &= !mask;
                }
            }
        }
        Ok(())
    }
}
