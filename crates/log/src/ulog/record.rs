//! Content of a record.

/// Takes the bytes of a record, of which there may be more than there is room for.
pub(crate) struct Content<'a>(&'a mut dyn FnMut(u8));

impl<'a> Content<'a> {
    pub(crate) fn new(take: &'a mut dyn FnMut(u8)) -> Self {
        Content(take)
    }

    /// Appends bytes. Out of line: there are hundreds of fields.
    #[inline(never)]
    pub(crate) fn put(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|byte| (self.0)(*byte));
    }

    /// Appends a number in decimal digits. Without the library's formatting, which takes 10 kB of flash.
    pub(crate) fn number(&mut self, number: usize) {
        if number > 9 {
            self.number(number / 10);
        }
        self.put(&[b'0' + (number % 10) as u8]);
    }
}
