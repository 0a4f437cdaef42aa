//! Blocks of a log on their way to the storage.

/// Bytes in a block, equal to a block of an SD card.
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
    /// A block without content.
    pub const EMPTY: Self = LogBlock { bytes: [0; BLOCK_BYTES], length: 0, begins: false, ends: false };

    /// Returns the block's content. All blocks of a log are full, except the last.
    pub fn bytes(&self) -> &[u8] {
        self.bytes.get(..self.length).unwrap_or_default()
    }

    /// Returns true for the first block of a log.
    pub fn begins(&self) -> bool {
        self.begins
    }

    /// Returns true for the last block of a log. A log that its writer has given up has no last block.
    pub fn ends(&self) -> bool {
        self.ends
    }

    /// Removes the content, and marks the block as the first or last of its log.
    pub(crate) fn clear(&mut self, begins: bool, ends: bool) {
        (self.length, self.begins, self.ends) = (0, begins, ends);
    }

    /// Appends as many of the bytes as fit. Returns their number.
    pub(crate) fn append(&mut self, bytes: &[u8]) -> usize {
        let room = self.bytes.get_mut(self.length..).unwrap_or_default();
        let count = room.len().min(bytes.len());
        room.iter_mut().zip(bytes).for_each(|(place, byte)| *place = *byte);
        self.length += count;
        count
    }
}

/// A queue of blocks to the storage.
pub trait BlockSink {
    /// Returns the block to fill next, or none if the queue is full.
    fn free(&mut self) -> Option<&mut LogBlock>;

    /// Queues the block that [`free`](Self::free) returned.
    fn done(&mut self);
}
