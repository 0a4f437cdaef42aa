//! A file for the log of a host.

use afbc_files::{BackgroundWriter, Error, OutputFile};
use std::cell::RefCell;
use std::fs::File;
use std::io;
use std::rc::Rc;
use std::time::Duration;

/// Number of bytes gathered before they go to the file: about a second of a log.
const FLUSH_BYTES: usize = 1 << 16;
/// Largest number of bytes that wait for a slow disk: some minutes of a flight in real time.
const ROOM: usize = 1 << 23;
/// Longest time for writing the rest of a live log at its end.
const END_MAX: Duration = Duration::from_secs(10);

/// A file with the logs of consecutive hosts, as of a vehicle that is restarted. After a failure, nothing more is
/// written.
#[derive(Clone, Debug)]
pub struct LogFile(Rc<RefCell<Open>>);

#[derive(Debug)]
struct Open {
    out: BackgroundWriter,
    /// Bytes not yet handed to the writer.
    gathered: Vec<u8>,
    /// True if a slow disk ends the log, instead of delaying the flight.
    is_live: bool,
    /// True once the disk was too slow.
    is_overrun: bool,
    /// True once the failure was reported, or the log was finished.
    is_told: bool,
}

impl LogFile {
    /// Creates the file. The file must not exist yet.
    ///
    /// # Errors
    /// If the file exists or cannot be created.
    pub fn create(output: &OutputFile) -> Result<Self, Error> {
        Self::to(output.create()?).map_err(|error| output.unwritten(&error))
    }

    /// Writes to an open file.
    ///
    /// # Errors
    /// If the system cannot start a thread for it.
    pub fn to(file: File) -> io::Result<Self> {
        let out = BackgroundWriter::new(file, ROOM)?;
        let open = Open { out, gathered: Vec::new(), is_live: false, is_overrun: false, is_told: false };
        Ok(LogFile(Rc::new(RefCell::new(open))))
    }

    /// Makes the log live, for a flight in real time: it never waits for the disk, and ends if the disk is too slow.
    #[must_use]
    pub fn live(self) -> Self {
        self.0.borrow_mut().is_live = true;
        self
    }

    /// Returns a receiver for a host's log bytes ([`Host::record`](crate::Host::record),
    /// [`Host::log`](crate::Host::log)).
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

    /// Returns the reason why the log ended early. Reports it only once.
    pub fn take_failure(&self) -> Option<String> {
        let mut open = self.0.borrow_mut();
        let failure = open.failure().filter(|_| !open.is_told);
        open.is_told |= failure.is_some();
        failure.map(|error| error.to_string())
    }

    /// Hands the rest to the writer, without waiting for it.
    pub(crate) fn close(&self) {
        let mut open = self.0.borrow_mut();
        open.hand_over();
        open.out.close();
    }

    /// Returns true once a [closed](Self::close) log is written completely.
    pub(crate) fn is_over(&self) -> bool {
        self.0.borrow().out.is_over()
    }

    /// Writes the rest.
    ///
    /// # Errors
    /// If the rest, or anything before, could not be written.
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
        // Writes nothing after a gap: it could not be read.
        if !self.is_overrun && !self.gathered.is_empty() {
            if !self.is_live {
                self.out.wait_for_room(self.gathered.len());
            }
            self.is_overrun = !self.out.offer(&self.gathered);
        }
        self.gathered.clear();
    }

    fn failure(&self) -> Option<io::Error> {
        let too_slow = || self.is_overrun.then(|| io::Error::other("the disk is too slow for the log"));
        self.out.failure().or_else(too_slow)
    }
}
