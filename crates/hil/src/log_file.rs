//! A file for the log of a host.

use std::cell::RefCell;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::rc::Rc;

/// Bytes after which the file has all that was logged: about a second.
const FLUSH_BYTES: usize = 1 << 16;

/// A file with the log of one host after another: of a vehicle that may be restarted. After a failure nothing more is
/// written.
#[derive(Clone, Debug)]
pub struct LogFile(Rc<RefCell<Open>>);

#[derive(Debug)]
struct Open {
    out: BufWriter<File>,
    failed: Result<(), io::Error>,
    /// True once there is nothing more to write, and nobody has to be told.
    is_told: bool,
}

impl LogFile {
    /// Creates the file at `path`, overwriting an existing one.
    ///
    /// # Errors
    /// If it cannot be created.
    pub fn create(path: &Path) -> io::Result<Self> {
        Ok(Self::of(File::create(path)?))
    }

    /// Creates the file at `path`, where there must be none.
    ///
    /// # Errors
    /// If it cannot be created, or is there.
    pub fn create_new(path: &Path) -> io::Result<Self> {
        Ok(Self::of(File::create_new(path)?))
    }

    fn of(file: File) -> Self {
        let out = BufWriter::with_capacity(FLUSH_BYTES, file);
        LogFile(Rc::new(RefCell::new(Open { out, failed: Ok(()), is_told: false })))
    }

    /// Returns what takes the bytes of a host ([`Host::record`](crate::Host::record), [`Host::log`](crate::Host::log)).
    pub fn sink(&self) -> impl FnMut(&[u8]) + 'static {
        let open = Rc::clone(&self.0);
        move |bytes| {
            let mut open = open.borrow_mut();
            if open.failed.is_ok() {
                open.failed = open.out.write_all(bytes);
            }
        }
    }

    /// Returns why the log has ended early, once.
    pub fn take_failure(&self) -> Option<String> {
        let mut open = self.0.borrow_mut();
        let failure = open.failed.as_ref().err().filter(|_| !open.is_told).map(io::Error::to_string);
        open.is_told |= failure.is_some();
        failure
    }

    /// Writes what is left.
    ///
    /// # Errors
    /// If that, or anything before it, could not be written.
    pub fn finish(&self) -> io::Result<()> {
        let mut open = self.0.borrow_mut();
        open.is_told = true;
        std::mem::replace(&mut open.failed, Ok(())).and_then(|()| open.out.flush())
    }
}
