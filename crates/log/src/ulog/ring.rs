//! Buffers the log's bytes until they are stored.

use crate::ulog::record::Content;
use heapless::Deque;
use heapless::deque::DequeView;

/// A ring buffer of at most `R` log bytes, between the log's writer and the storage.
#[derive(Clone, Debug)]
pub struct LogRing<const R: usize>(Deque<u8, R>);

impl<const R: usize> Default for LogRing<R> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const R: usize> LogRing<R> {
    /// Creates an empty ring.
    pub const fn new() -> Self {
        LogRing(Deque::new())
    }

    /// Returns the number of waiting bytes.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Returns true if no bytes wait.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns the oldest contiguous bytes: all bytes, or those up to the end of the memory.
    pub fn front(&self) -> &[u8] {
        let (front, back) = self.0.as_slices();
        if front.is_empty() { back } else { front }
    }

    /// Removes this many of the oldest bytes, or all if there are fewer. Call it once they are stored.
    pub fn consume(&mut self, bytes: usize) {
        for _ in 0..bytes.min(self.0.len()) {
            let _ = self.0.pop_front();
        }
    }

    pub(crate) fn view(&mut self) -> RingView<'_> {
        RingView(self.0.as_mut_view())
    }
}

/// A ring of any size.
pub(crate) struct RingView<'a>(&'a mut DequeView<u8>);

/// Bytes of a record before its content: two for the content's length and one for the kind.
const HEAD: usize = 3;

impl RingView<'_> {
    /// Appends bytes. If they do not all fit, appends none and returns false.
    #[inline(never)]
    pub(crate) fn bytes(&mut self, write: &mut dyn FnMut(&mut Content<'_>)) -> bool {
        let start = self.0.storage_len();
        let mut overflows = false;
        write(&mut Content::new(&mut |byte| overflows |= self.0.push_back(byte).is_err()));
        if overflows {
            self.0.truncate(start);
        }
        !overflows
    }

    /// Appends a record of this kind. If it does not fit, appends nothing and returns false.
    #[inline(never)]
    pub(crate) fn record(&mut self, kind: u8, write: &mut dyn FnMut(&mut Content<'_>)) -> bool {
        let start = self.0.storage_len();
        // Reserves the length's bytes: the length is known only after the content is written.
        let whole = self.bytes(&mut |content| {
            content.put(&[0, 0, kind]);
            write(content);
        });
        let length = self.0.storage_len().saturating_sub(start + HEAD);
        match u16::try_from(length) {
            Ok(length) if whole => {
                for (index, byte) in (start..).zip(length.to_le_bytes()) {
                    self.0.get_mut(index).into_iter().for_each(|place| *place = byte);
                }
                true
            }
            _ => {
                self.0.truncate(start);
                false
            }
        }
    }
}
