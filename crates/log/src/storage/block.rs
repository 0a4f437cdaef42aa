//! Blocks of a log on their way to where they are kept.

/// Bytes of a block: as many as a card writes at once.
pub const BLOCK_BYTES: usize = 512;

/// A part of a log.
#[derive(Clone, Debug)]
pub struct LogBlock {
    bytes: [u8; BLOCK_BYTES],
    length: usize,
    begins: bool,
    ends: bool,
}

impl Default for LogBlock {
    fn default() -> Self {
        LogBlock::EMPTY
    }
}

impl LogBlock {
    /// Without content.
    pub const EMPTY: Self = LogBlock { bytes: [0; BLOCK_BYTES], length: 0, begins: false, ends: false };

    /// Returns its content: all but the last block of a log are full.
    pub fn bytes(&self) -> &[u8] {
        self.bytes.get(..self.length).unwrap_or_default()
    }

    /// True of the first block of a log.
    pub fn begins(&self) -> bool {
        self.begins
    }

    /// True of the last one. A log whose writer has given up has none.
    pub fn ends(&self) -> bool {
        self.ends
    }

    /// Makes it a block without content.
    pub(crate) fn clear(&mut self, begins: bool, ends: bool) {
        (self.length, self.begins, self.ends) = (0, begins, ends);
    }

    /// Appends as many of the bytes as there is room for; returns how many.
    pub(crate) fn append(&mut self, bytes: &[u8]) -> usize {
        let room = self.bytes.get_mut(self.length..).unwrap_or_default();
        let count = room.len().min(bytes.len());
        room.iter_mut().zip(bytes).for_each(|(place, byte)| *place = *byte);
        self.length += count;
        count
    }
}

/// Where blocks go: a queue.
pub trait BlockSink {
    /// Returns the block to be filled next; none if the queue is full.
    fn free(&mut self) -> Option<&mut LogBlock>;

    /// Queues that block.
    fn done(&mut self);
}
