//! The `flight` image on an emulated board.

use crate::gdb::{self, Gdb};
use crate::qemu::{self, Qemu};
use crate::{Error, clock_tree};
use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::time::Duration;

/// How long [`Board::receive`] waits.
const PATIENCE: Duration = Duration::from_millis(100);
/// A board that takes no bytes for this long is stuck.
const WRITE_TIMEOUT: Duration = Duration::from_secs(5);

/// The `flight` image, booted, running freely and in real time.
#[derive(Debug)]
pub struct Board {
    qemu: Qemu,
    gdb: Gdb,
    usart1: UnixStream,
    received: Receiver<Vec<u8>>,
    clock_accesses: usize,
}

impl Board {
    /// Boots the image: returns when its clocks are up and it runs.
    ///
    /// # Errors
    /// If QEMU or the image is missing, or the boot does not come to an end.
    pub fn boot(elf: &Path) -> Result<Self, Error> {
        let arguments = [
            "-S",
            "-serial",
            "unix:usart1,server=on,wait=off",
            "-chardev",
            "socket,path=gdb,server=on,wait=off,id=gdb",
            "-gdb",
            "chardev:gdb",
        ];
        let qemu = Qemu::start(elf, Qemu::folder()?, &[qemu::OLIMEX], &arguments)?;
        let mut gdb = Gdb::connect(&qemu.path("gdb"))?;
        let usart1 = gdb::connect(&qemu.path("usart1"))?;
        usart1.set_write_timeout(Some(WRITE_TIMEOUT))?;
        let received = listen(usart1.try_clone()?);
        let clock_accesses = clock_tree::boot(&mut gdb)?;
        Ok(Board { qemu, gdb, usart1, received, clock_accesses })
    }

    /// How often the image touched the clock tree while it booted.
    pub fn clock_accesses(&self) -> usize {
        self.clock_accesses
    }

    /// The debugger, with the processor halted; [`Gdb::resume`] lets it run on.
    ///
    /// # Errors
    /// If the board has ended.
    pub fn halt(&mut self) -> Result<&mut Gdb, Error> {
        self.qemu.check()?;
        self.gdb.halt()?;
        Ok(&mut self.gdb)
    }

    /// Sends to USART1.
    ///
    /// # Errors
    /// If the board has ended, or takes nothing.
    pub fn send(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.qemu.check()?;
        Ok(self.usart1.write_all(bytes)?)
    }

    /// What USART1 sent since the last time; waits 0.1 s for something, and gives nothing if nothing comes.
    ///
    /// # Errors
    /// If the board has ended.
    pub fn receive(&mut self) -> Result<Vec<u8>, Error> {
        match self.received.recv_timeout(PATIENCE) {
            Ok(mut bytes) => {
                bytes.extend(self.received.try_iter().flatten());
                Ok(bytes)
            }
            Err(RecvTimeoutError::Timeout) => Ok(Vec::new()),
            Err(RecvTimeoutError::Disconnected) => Err(Error::Protocol("USART1 was closed".into())),
        }
    }
}

/// Reads for as long as there is something. QEMU stands still, its debugger too, while nobody takes what it sends; and
/// it sends bytes one by one, of which a socket holds no more than some three hundred.
fn listen(mut usart1: UnixStream) -> Receiver<Vec<u8>> {
    let (sender, received) = mpsc::channel();
    std::thread::spawn(move || {
        let mut buffer = [0; 4096];
        while let Ok(length @ 1..) = usart1.read(&mut buffer) {
            if sender.send(buffer.iter().take(length).copied().collect()).is_err() {
                return;
            }
        }
    });
    received
}
