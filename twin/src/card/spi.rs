//! Memory card on SPI.

use super::CardSlot;
use rigless::chip::Timeline;
use rigless::chip::spi::Peer;
use rigless::snapshot::{Error, Reader, Store, Writer};
use serde::{Deserialize, Serialize};

/// First byte of the command that writes a block, and bytes of a command frame (SD Physical Layer Simplified
/// Specification 6.00, 7.3.1.1).
const WRITE_BLOCK: u8 = 0x40 | 24;
const FRAME: usize = 6;
/// Token before a block (7.3.3.2), and bytes of a block with its checksum.
const START_BLOCK: u8 = 0xFE;
const BLOCK: usize = 512 + 2;
/// Levels of an idle line and of a busy card.
const REST: u32 = 0xFF;
const BUSY: u32 = 0x00;

/// State of the host's transfer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
enum SpiTransfer {
    #[default]
    Nothing,
    /// Bytes left of a command frame; true if the command writes a block.
    Frame(usize, bool),
    /// Waiting for the token before the block.
    Waits,
    /// Bytes left of the block.
    Block(usize),
    /// Waiting for the card's response to the block.
    Verdict,
}

/// Card slot on SPI.
#[derive(Debug)]
pub struct SpiSlot {
    pub slot: CardSlot,
    heard: SpiTransfer,
}

impl SpiSlot {
    pub fn new() -> Self {
        SpiSlot { slot: CardSlot::new(), heard: SpiTransfer::Nothing }
    }

    /// Follows the host's bytes, and counts each block that it writes.
    fn hear(&mut self, mosi: u8, answer: u32, now_ns: u64) {
        self.heard = match self.heard {
            SpiTransfer::Nothing if mosi & 0xC0 == 0x40 => SpiTransfer::Frame(FRAME - 1, mosi == WRITE_BLOCK),
            SpiTransfer::Nothing => SpiTransfer::Nothing,
            SpiTransfer::Frame(1, true) => SpiTransfer::Waits,
            SpiTransfer::Frame(1, false) => SpiTransfer::Nothing,
            SpiTransfer::Frame(left, writes) => SpiTransfer::Frame(left - 1, writes),
            SpiTransfer::Waits if mosi == START_BLOCK => SpiTransfer::Block(BLOCK),
            SpiTransfer::Waits => SpiTransfer::Waits,
            SpiTransfer::Block(1) => SpiTransfer::Verdict,
            SpiTransfer::Block(left) => SpiTransfer::Block(left - 1),
            SpiTransfer::Verdict if answer == REST => SpiTransfer::Verdict,
            SpiTransfer::Verdict => {
                self.slot.write(now_ns);
                SpiTransfer::Nothing
            }
        };
    }
}

impl Peer for SpiSlot {
    fn transfer(&mut self, mosi: u32, bits: u8, context: &mut Timeline<'_, '_>) -> u32 {
        let now_ns = context.now().0;
        let (is_out, is_new) = self.slot.is_out(now_ns);
        if is_new {
            self.heard = SpiTransfer::Nothing;
        }
        if is_out {
            return REST;
        }
        let answer = self.slot.card.transfer(mosi, bits, context);
        // The model writes at once; the busy time is added here.
        if now_ns < self.slot.busy_until_ns {
            return BUSY;
        }
        self.hear(mosi as u8, answer, now_ns);
        answer
    }

    fn select(&mut self, context: &mut Timeline<'_, '_>) {
        self.slot.card.select(context);
    }

    fn deselect(&mut self, context: &mut Timeline<'_, '_>) {
        self.heard = SpiTransfer::Nothing;
        self.slot.card.deselect(context);
    }
}

impl Store for SpiSlot {
    fn store(&self, to: &mut Writer) -> Result<(), Error> {
        to.put(&self.heard)?;
        self.slot.store(to)
    }

    fn load(&mut self, from: &mut Reader) -> Result<(), Error> {
        self.heard = from.take()?;
        self.slot.load(from)
    }
}
