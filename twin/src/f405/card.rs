//! The slot of a memory card on SPI: the card is the models' own; how long it writes, stalls and is out is the slot's.

use rigless::chip::Timeline;
use rigless::chip::memory_card::MemoryCard;
use rigless::chip::spi::Peer;
use rigless::snapshot::{Error, Reader, Store, Writer};
use serde::{Deserialize, Serialize};
use std::io::{Cursor, Write};

/// Blocks of the card, as its registers can tell them, and the first one of its volume.
const BLOCKS: usize = 70 * 1024;
const VOLUME: usize = 63;
/// Bytes of a cluster: with one of a block, each block of a file takes seven writes of the table beside its own.
const CLUSTER: u32 = 8 * 1024;
/// Commands that write a block, as frames begin with them, and bytes of a frame (SD Physical Layer Simplified
/// Specification 6.00, 7.3.1.1).
const WRITE_BLOCK: u8 = 0x40 | 24;
const FRAME: usize = 6;
/// The byte before a block (7.3.3.2), and the bytes of a block with its checksum.
const START_BLOCK: u8 = 0xFE;
const BLOCK: usize = 512 + 2;
/// A line at rest, and that of a card that is busy.
const REST: u32 = 0xFF;
const BUSY: u32 = 0x00;
/// What a block takes usually [ns]: of an ordinary card.
const USUAL_NS: u64 = 800_000;

/// What goes wrong with a card. Times are since power-up [ms].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CardTrouble {
    /// The first block after this time takes so much longer.
    pub stall_ms: Option<[u64; 2]>,
    /// It is out between these times.
    pub out_ms: Option<[u64; 2]>,
}

/// Where the host is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
enum Heard {
    #[default]
    Nothing,
    /// So many bytes of a frame are to come; true if it writes a block.
    Frame(usize, bool),
    /// The answer, and the byte before the block.
    Waits,
    /// So many bytes of the block are to come.
    Block(usize),
    /// The card's verdict on it.
    Verdict,
}

/// A card in its slot.
#[derive(Debug)]
pub struct CardSlot {
    card: MemoryCard,
    trouble: CardTrouble,
    heard: Heard,
    busy_until_ns: u64,
    was_out: bool,
    written: u64,
}

/// Returns a card with an empty FAT16 in its first partition, or one with so many bytes of room. The models' own has no
/// partitions.
fn formatted(room: Option<u64>) -> MemoryCard {
    let mut bytes = vec![0; BLOCKS * 512];
    let options = fatfs::FormatVolumeOptions::new().fat_type(fatfs::FatType::Fat16).bytes_per_cluster(CLUSTER);
    let volume = &mut Cursor::new(&mut bytes[VOLUME * 512..]);
    fatfs::format_volume(volume, options).expect("it is large enough");
    if let Some(room) = room {
        fill(&mut bytes[VOLUME * 512..], room).expect("it has room");
    }
    // The master boot record: type (FAT16), first block and length of its one partition, and the mark at its end.
    bytes[450] = 0x06;
    bytes[454..458].copy_from_slice(&(VOLUME as u32).to_le_bytes());
    bytes[458..462].copy_from_slice(&((BLOCKS - VOLUME) as u32).to_le_bytes());
    bytes[510..512].copy_from_slice(&[0x55, 0xAA]);
    MemoryCard::holding(&bytes)
}

/// Fills a volume with a file, up to so many bytes.
fn fill(volume: &mut [u8], room: u64) -> std::io::Result<()> {
    let volume = fatfs::FileSystem::new(Cursor::new(volume), fatfs::FsOptions::new())?;
    let free = u64::from(volume.stats()?.free_clusters()) * u64::from(volume.cluster_size());
    let mut file = volume.root_dir().create_file("OTHER.BIN")?;
    file.write_all(&vec![0xA5; free.saturating_sub(room) as usize])
}

impl CardSlot {
    pub fn new() -> Self {
        CardSlot {
            card: formatted(None),
            trouble: CardTrouble::default(),
            heard: Heard::Nothing,
            busy_until_ns: 0,
            was_out: false,
            written: 0,
        }
    }

    pub fn trouble(&mut self, trouble: CardTrouble) {
        self.trouble = trouble;
    }

    /// Leaves so many bytes of room.
    pub fn fill(&mut self, room: u64) {
        self.card = formatted(Some(room));
    }

    pub fn card(&self) -> &MemoryCard {
        &self.card
    }

    /// Blocks that were written.
    pub fn written(&self) -> u64 {
        self.written
    }

    /// Follows the host's bytes to the end of each block that it writes.
    fn hear(&mut self, mosi: u8, answer: u32, now_ns: u64) {
        self.heard = match self.heard {
            Heard::Nothing if mosi & 0xC0 == 0x40 => Heard::Frame(FRAME - 1, mosi == WRITE_BLOCK),
            Heard::Nothing => Heard::Nothing,
            Heard::Frame(1, true) => Heard::Waits,
            Heard::Frame(1, false) => Heard::Nothing,
            Heard::Frame(left, writes) => Heard::Frame(left - 1, writes),
            Heard::Waits if mosi == START_BLOCK => Heard::Block(BLOCK),
            Heard::Waits => Heard::Waits,
            Heard::Block(1) => Heard::Verdict,
            Heard::Block(left) => Heard::Block(left - 1),
            Heard::Verdict if answer == REST => Heard::Verdict,
            Heard::Verdict => {
                self.written += 1;
                self.busy_until_ns = now_ns + USUAL_NS;
                if let Some([at_ms, ms]) = self.trouble.stall_ms.filter(|[at_ms, _]| now_ns >= at_ms * 1_000_000) {
                    self.busy_until_ns += ms * 1_000_000;
                    self.trouble.stall_ms = None;
                    println!("{:8.3} s  the card stalls for {ms} ms, from {at_ms} ms on", now_ns as f64 * 1e-9);
                }
                Heard::Nothing
            }
        };
    }
}

impl Peer for CardSlot {
    fn transfer(&mut self, mosi: u32, bits: u8, context: &mut Timeline<'_, '_>) -> u32 {
        let now_ns = context.now().0;
        let is_out = self.trouble.out_ms.is_some_and(|[from, to]| (from..to).contains(&(now_ns / 1_000_000)));
        if is_out != self.was_out {
            println!("{:8.3} s  the card is {}", now_ns as f64 * 1e-9, if is_out { "out" } else { "in" });
            self.was_out = is_out;
            (self.heard, self.busy_until_ns) = (Heard::Nothing, 0);
            self.card.power_cycle();
        }
        if is_out {
            return REST;
        }
        let answer = self.card.transfer(mosi, bits, context);
        // The model writes at once: how long a card takes is added here.
        if now_ns < self.busy_until_ns {
            return BUSY;
        }
        self.hear(mosi as u8, answer, now_ns);
        answer
    }

    fn select(&mut self, context: &mut Timeline<'_, '_>) {
        self.card.select(context);
    }

    fn deselect(&mut self, context: &mut Timeline<'_, '_>) {
        self.heard = Heard::Nothing;
        self.card.deselect(context);
    }
}

impl Store for CardSlot {
    fn store(&self, to: &mut Writer) -> Result<(), Error> {
        to.put(&(self.trouble, self.heard, self.busy_until_ns, self.was_out, self.written))?;
        self.card.store(to)
    }

    fn load(&mut self, from: &mut Reader) -> Result<(), Error> {
        (self.trouble, self.heard, self.busy_until_ns, self.was_out, self.written) = from.take()?;
        self.card.load(from)
    }
}
