//! The `flight` image on an emulated board.

use crate::gdb::{self, Gdb};
use crate::qemu::Qemu;
use crate::{Error, clock_tree};
use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::Duration;

/// How long one [`Read::read`] of the link waits.
const READ_TIMEOUT: Duration = Duration::from_millis(100);

/// The `flight` image, booted and running freely. Reading and writing is its USART1: a read that finds nothing within
/// 0.1 s gives 0 bytes.
#[derive(Debug)]
pub struct Board {
    qemu: Qemu,
    gdb: Gdb,
    usart1: UnixStream,
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
        let qemu = Qemu::start(elf, Qemu::folder()?, &arguments)?;
        let mut gdb = Gdb::connect(&qemu.path("gdb"))?;
        let usart1 = gdb::connect(&qemu.path("usart1"))?;
        usart1.set_read_timeout(Some(READ_TIMEOUT))?;
        let clock_accesses = clock_tree::boot(&mut gdb)?;
        Ok(Board { qemu, gdb, usart1, clock_accesses })
    }

    /// How often the image touched the clock tree while it booted.
    pub fn clock_accesses(&self) -> usize {
        self.clock_accesses
    }

    /// The word at `address`, read while the processor is halted for a moment.
    ///
    /// # Errors
    /// If the board has ended, or nothing is there.
    pub fn word(&mut self, address: u32) -> Result<u32, Error> {
        self.qemu.check()?;
        self.gdb.halt()?;
        let word = self.gdb.memory(address)?;
        self.gdb.resume()?;
        Ok(u32::from_le_bytes(word))
    }
}

impl Read for Board {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        match self.usart1.read(bytes) {
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => Ok(0),
            result => result,
        }
    }
}

impl Write for Board {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.usart1.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.usart1.flush()
    }
}
