//! Runs the `flight` image on an emulated board.

use crate::Error;
use crate::clock_tree::{self, ClockTree, RTC_BKP0R};
use crate::gdb::{self, Gdb, Watchpoint};
use crate::qemu::{self, Qemu};
use object::{Object, ObjectSection};
use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::time::Duration;

/// Longest wait in [`EmulatedBoard::receive`].
const PATIENCE: Duration = Duration::from_millis(100);
/// A board that accepts no bytes for this long counts as stuck.
const WRITE_TIMEOUT: Duration = Duration::from_secs(5);

/// Status register of USART1. The driver clears "transmission complete" by a load and a store of the whole register. A
/// byte that arrives in between is lost with its flag. On silicon that needs an arrival within 3 cycles of 168 MHz. In
/// QEMU it happens whenever the store waits for the thread that delivers the byte. So the store is skipped in the
/// emulated image.
const USART1_SR: u32 = 0x4001_1000;
/// Interrupt control and state register, whose bit 31 raises a non-maskable interrupt.
const ICSR: u32 = 0xE000_ED04;

/// The booted `flight` image, running as fast as the host allows.
///
/// Its clock counts instructions, so a busy host does not make it late. Its idle loop spins instead of sleeping, so
/// that its time does not run ahead of the host.
#[derive(Debug)]
pub struct EmulatedBoard {
    qemu: Qemu,
    gdb: Gdb,
    clock_tree: ClockTree,
    usart1: UnixStream,
    received: Receiver<Vec<u8>>,
    clock_accesses: usize,
}

impl EmulatedBoard {
    /// Boots the image; returns when its clocks are set up and it runs.
    ///
    /// # Errors
    /// Fails if QEMU or the image is missing, or if the boot does not finish.
    pub fn boot(elf: &Path) -> Result<Self, Error> {
        EmulatedBoard::boot_with(elf, true)
    }

    /// Boots the image on a board whose crystal does not start.
    ///
    /// # Errors
    /// The same as for [`EmulatedBoard::boot`].
    pub fn boot_without_crystal(elf: &Path) -> Result<Self, Error> {
        EmulatedBoard::boot_with(elf, false)
    }

    /// Boots the image after a reset that left `word` in the first backup register. Returns the register's value when
    /// the image reads the boot loader's vector table at `vectors`; the boot loader itself is not emulated.
    ///
    /// # Errors
    /// Fails if QEMU or the image is missing, or if the image does not enter the boot loader.
    pub fn boot_to_loader(elf: &Path, word: u32, vectors: u32) -> Result<u32, Error> {
        let (_qemu, mut gdb) = start(elf)?;
        let mut clock_tree = ClockTree::new(&mut gdb, true)?;
        clock_tree.boot_system_memory(&mut gdb, word)?;
        gdb.watch(Watchpoint::Access, vectors)?;
        match gdb.run(WRITE_TIMEOUT)? {
            Some(address) if address == vectors => Ok(clock_tree.register(RTC_BKP0R)),
            other => Err(Error::Protocol(format!(
                "the image does not read the vector table at {vectors:#x}; the first access is {other:x?}"
            ))),
        }
    }

    fn boot_with(elf: &Path, crystal: bool) -> Result<Self, Error> {
        let (qemu, mut gdb) = start(elf)?;
        let usart1 = gdb::connect(&qemu.path("usart1"))?;
        usart1.set_write_timeout(Some(WRITE_TIMEOUT))?;
        let received = listen(usart1.try_clone()?);
        // NOP
        gdb.set_memory(idle(elf)?, &[0x00, 0xBF])?;
        let mut clock_tree = ClockTree::new(&mut gdb, crystal)?;
        let clock_accesses = clock_tree.boot(&mut gdb)?;
        clock_tree::skip_first_store(&mut gdb, USART1_SR)?;
        gdb.resume()?;
        Ok(EmulatedBoard { qemu, gdb, clock_tree, usart1, received, clock_accesses })
    }

    /// Returns how often the image accessed the clock tree while booting.
    pub fn clock_accesses(&self) -> usize {
        self.clock_accesses
    }

    /// Returns the value that the image last wrote to a register of the [clock tree](crate::clock_tree).
    pub fn clock_register(&self, register: u32) -> u32 {
        self.clock_tree.register(register)
    }

    /// Stops the crystal; returns when the image has switched to another clock.
    ///
    /// # Errors
    /// Fails if the image has not enabled the clock security system or does not switch.
    pub fn lose_crystal(&mut self) -> Result<(), Error> {
        self.gdb.halt()?;
        if !self.clock_tree.lose_crystal() {
            return Err(Error::Protocol("the clock security system is off".into()));
        }
        self.gdb.store(ICSR, 1 << 31)?;
        self.clock_tree.switch(&mut self.gdb)?;
        self.gdb.resume()
    }

    /// Halts the processor and returns the debugger; [`Gdb::resume`] lets the processor continue.
    ///
    /// # Errors
    /// Fails if the board has ended.
    pub fn halt(&mut self) -> Result<&mut Gdb, Error> {
        self.qemu.check()?;
        self.gdb.halt()?;
        Ok(&mut self.gdb)
    }

    /// Sends bytes to USART1.
    ///
    /// # Errors
    /// Fails if the board has ended or accepts no bytes.
    pub fn send(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.qemu.check()?;
        Ok(self.usart1.write_all(bytes)?)
    }

    /// Returns the bytes that USART1 has sent since the last call. Waits up to 0.1 s; returns no bytes if none come.
    ///
    /// # Errors
    /// Fails if the board has ended.
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

/// Starts the emulator, halted at reset.
fn start(elf: &Path) -> Result<(Qemu, Gdb), Error> {
    let serial = [
        "-S",
        "-serial",
        "unix:usart1,server=on,wait=off",
        "-chardev",
        "socket,path=gdb,server=on,wait=off,id=gdb",
        "-gdb",
        "chardev:gdb",
    ];
    let arguments = [qemu::count_instructions(qemu::SHIFT).as_slice(), &serial.map(String::from)].concat();
    let qemu = Qemu::start(elf, Qemu::folder()?, &[qemu::OLIMEX], &arguments)?;
    let gdb = Gdb::connect(&qemu.path("gdb"))?;
    Ok((qemu, gdb))
}

/// Returns the address of the idle loop's sleep instruction.
fn idle(elf: &Path) -> Result<u32, Error> {
    // The idle loop is WFI, then a branch back to it.
    const LOOP: [u8; 4] = [0x30, 0xBF, 0xFD, 0xE7];
    let bytes = std::fs::read(elf)?;
    let file = object::File::parse(bytes.as_slice()).map_err(|error| Error::Protocol(error.to_string()))?;
    let text = file.section_by_name(".text").ok_or_else(|| Error::Protocol("the image has no code".into()))?;
    let code = text.data().map_err(|error| Error::Protocol(error.to_string()))?;
    let offset = code.windows(4).position(|window| window == LOOP);
    let offset =
        offset.ok_or_else(|| Error::Protocol("the image has no idle loop with a wait-for-interrupt".into()))?;
    Ok(text.address() as u32 + offset as u32)
}

/// Reads the board's output in a thread. If nobody reads, QEMU blocks together with its debugger: it sends single
/// bytes, of which a socket buffers only some three hundred.
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
