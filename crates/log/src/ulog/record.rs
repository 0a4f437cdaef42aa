//! Writes the content of a log record.

/// Takes the bytes of a record. There may be more bytes than there is room for.
pub(crate) struct Content<'a>(&'a mut dyn FnMut(u8));

impl<'a> Content<'a> {
    pub(crate) fn new(take: &'a mut dyn FnMut(u8)) -> Self {
        Content(take)
    }

    /// Appends bytes. Not inlined, because hundreds of fields call it.
    #[inline(never)]
    pub(crate) fn put(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|byte| (self.0)(*byte));
    }

    /// Appends a number in decimal digits. The standard formatting would take 10 kB of flash.
    pub(crate) fn number(&mut self, number: usize) {
        if number > 9 {
            self.number(number / 10);
        }
        self.put(&[b'0' + (number % 10) as u8]);
    }
}
