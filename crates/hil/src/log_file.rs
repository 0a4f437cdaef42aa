//! A file for the log of a host.

use afbc_files::{BackgroundWriter, Error, Output};
use std::cell::RefCell;
use std::fs::File;
use std::io;
use std::rc::Rc;
use std::time::Duration;

/// Bytes after which the file has all that was logged: about a second.
const FLUSH_BYTES: usize = 1 << 16;
/// Most bytes that wait for a slow disk: some minutes of a flight in real time.
const ROOM: usize = 1 << 23;
/// Time in which a live log must be on the disk after its end.
const END_MAX: Duration = Duration::from_secs(10);

/// A file with the log of one host after another: of a vehicle that may be restarted. After a failure nothing more is
/// written.
#[derive(Clone, Debug)]
pub struct LogFile(Rc<RefCell<Open>>);

#[derive(Debug)]
struct Open {
    out: BackgroundWriter,
    /// Bytes that are yet to be handed over.
    gathered: Vec<u8>,
    /// True if the log ends rather than wait for the disk.
    is_live: bool,
    /// True once the disk was too slow.
    is_overrun: bool,
    /// True once there is nothing more to write, and nobody has to be told.
    is_told: bool,
}

impl LogFile {
    /// Creates the file, where there must be none.
    ///
    /// # Errors
    /// If it cannot be created, or is there.
    pub fn create(output: &Output) -> Result<Self, Error> {
        Self::to(output.create()?).map_err(|error| output.unwritten(&error))
    }

    /// Writes to a file that is open.
    ///
    /// # Errors
    /// If the system has no thread for it.
    pub fn to(file: File) -> io::Result<Self> {
        let out = BackgroundWriter::new(file, ROOM)?;
        let open = Open { out, gathered: Vec::new(), is_live: false, is_overrun: false, is_told: false };
        Ok(LogFile(Rc::new(RefCell::new(open))))
    }

    /// The same of a flight that goes on by itself: it waits for no disk, and the log ends where one is too slow.
    #[must_use]
    pub fn live(self) -> Self {
        self.0.borrow_mut().is_live = true;
        self
    }

    /// Returns what takes the bytes of a host ([`Host::record`](crate::Host::record), [`Host::log`](crate::Host::log)).
    pub fn sink(&self) -> impl FnMut(&[u8]) + 'static {
        let open = Rc::clone(&self.0);
        move |bytes| {
            let mut open = open.borrow_mut();
            open.gathered.extend_from_slice(bytes);
            if open.gathered.len() >= FLUSH_BYTES {
                open.hand_over();
            }
        }
    }

    /// Returns why the log has ended early, once.
    pub fn take_failure(&self) -> Option<String> {
        let mut open = self.0.borrow_mut();
        let failure = open.failure().filter(|_| !open.is_told);
        open.is_told |= failure.is_some();
        failure.map(|error| error.to_string())
    }

    /// Lets what is left be written, without waiting for it.
    pub(crate) fn close(&self) {
        let mut open = self.0.borrow_mut();
        open.hand_over();
        open.out.close();
    }

    /// True once nothing is left to be written of a log that was [closed](Self::close).
    pub(crate) fn is_over(&self) -> bool {
        self.0.borrow().out.is_over()
    }

    /// Writes what is left.
    ///
    /// # Errors
    /// If that, or anything before it, could not be written.
    pub fn finish(&self) -> io::Result<()> {
        let mut open = self.0.borrow_mut();
        open.hand_over();
        open.is_told = true;
        let written = open.out.finish(open.is_live.then_some(END_MAX));
        open.failure().map_or(written, Err)
    }
}

impl Drop for Open {
    fn drop(&mut self) {
        self.hand_over();
    }
}

impl Open {
    fn hand_over(&mut self) {
        // After a gap nothing more: what follows could not be read.
        if !self.is_overrun && !self.gathered.is_empty() {
            if !self.is_live {
                self.out.wait_for_room(self.gathered.len());
            }
            self.is_overrun = !self.out.offer(&self.gathered);
        }
        self.gathered.clear();
    }

    fn failure(&self) -> Option<io::Error> {
        let too_slow = || self.is_overrun.then(|| io::Error::other("the disk is too slow"));
        self.out.failure().or_else(too_slow)
    }
}
