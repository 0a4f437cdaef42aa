//! Bytes of the log that wait to be kept.

use crate::ulog::record::Content;
use heapless::Deque;
use heapless::deque::DequeView;

/// A ring of the log's bytes, between who writes it and who keeps it: at most `R` of them wait.
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

    /// Returns the number of bytes that wait.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// True if none wait.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns the oldest bytes that lie side by side: all of them, or those up to the end of the memory.
    pub fn front(&self) -> &[u8] {
        let (front, back) = self.0.as_slices();
        if front.is_empty() { back } else { front }
    }

    /// Removes as many of the oldest bytes, all if there are fewer: they are kept now.
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

/// Length of a record before its content: length of the content, kind.
const HEAD: usize = 3;

impl RingView<'_> {
    /// Appends bytes; false, and nothing is appended, if they do not fit.
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

    /// Appends a record of this kind; false, and nothing is appended, if it does not fit.
    #[inline(never)]
    pub(crate) fn record(&mut self, kind: u8, write: &mut dyn FnMut(&mut Content<'_>)) -> bool {
        let start = self.0.storage_len();
        // A place for the length, which is known once the content is written.
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
