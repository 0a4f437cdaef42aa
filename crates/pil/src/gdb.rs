//! The subset of GDB's remote protocol needed here: registers, memory, watchpoints, run, step.

use crate::Error;
use std::io::{BufRead, BufReader, ErrorKind, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::{Duration, Instant};

/// Register number of the stack pointer.
pub const SP: u32 = 13;
/// Register number of the program status register, whose lowest 9 bits are the active exception.
pub const XPSR: u32 = 25;
/// Register number of the link register.
const LR: u32 = 14;
/// Register number of the program counter.
pub const PC: u32 = 15;

/// Longest wait for the stub's answer.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(5);

/// Kinds of accesses to watch; their values are the protocol's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Watchpoint {
    /// Stores only.
    Write = 2,
    /// Loads and stores.
    Access = 4,
}

/// A connection to the debug stub of an emulated processor.
#[derive(Debug)]
pub struct Gdb {
    stream: BufReader<UnixStream>,
}

impl Gdb {
    /// Connects to the stub's socket, once it exists, and leaves the processor halted.
    ///
    /// # Errors
    /// Fails if there is no socket after 5 s.
    pub fn connect(socket: &Path) -> Result<Self, Error> {
        let stream = connect(socket)?;
        stream.set_read_timeout(Some(ANSWER_TIMEOUT))?;
        let mut gdb = Gdb { stream: BufReader::new(stream) };
        // QEMU allows access to registers only after their list was requested.
        gdb.ask("qXfer:features:read:target.xml:0,ffb")?;
        gdb.ask("?")?;
        Ok(gdb)
    }

    /// Reads a core register.
    ///
    /// # Errors
    /// Fails if the stub refuses.
    pub fn register(&mut self, number: u32) -> Result<u32, Error> {
        let answer = self.ask(&format!("p{number:x}"))?;
        let bytes = from_hex(&answer)?;
        Ok(u32::from_le_bytes(bytes.try_into().map_err(|_| Error::Protocol(answer))?))
    }

    /// Writes a core register.
    ///
    /// # Errors
    /// Fails if the stub refuses.
    pub fn set_register(&mut self, number: u32, value: u32) -> Result<(), Error> {
        self.order(&format!("P{number:x}={:08x}", value.swap_bytes()))
    }

    /// Reads `N` bytes of memory.
    ///
    /// # Errors
    /// Fails if the stub refuses.
    pub fn memory<const N: usize>(&mut self, address: u32) -> Result<[u8; N], Error> {
        let answer = self.ask(&format!("m{address:x},{N:x}"))?;
        from_hex(&answer)?.try_into().map_err(|_| Error::Protocol(answer))
    }

    /// Writes to RAM or, unlike a processor, also to flash.
    ///
    /// # Errors
    /// Fails if the stub refuses.
    pub fn set_memory(&mut self, address: u32, bytes: &[u8]) -> Result<(), Error> {
        let hex: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        self.order(&format!("M{address:x},{:x}:{hex}", bytes.len()))
    }

    /// Makes a halted processor store a word, since the stub cannot write device registers. Overwrites the first bytes
    /// of the core-coupled memory.
    ///
    /// # Errors
    /// Fails if the stub refuses.
    pub fn store(&mut self, address: u32, value: u32) -> Result<(), Error> {
        // The far end of the stack, which is never reached (docs/budgets.md).
        const SCRATCH: u32 = 0x1000_0000;
        // STR r1, [r0]
        self.set_memory(SCRATCH, &[0x01, 0x60])?;
        let registers = [(0, address), (1, value), (PC, SCRATCH)];
        let before = [self.register(0)?, self.register(1)?, self.register(PC)?];
        for (number, value) in registers {
            self.set_register(number, value)?;
        }
        self.step()?;
        for ((number, _), value) in registers.into_iter().zip(before) {
            self.set_register(number, value)?;
        }
        Ok(())
    }

    /// Stops the processor before its next access to the word at `address`.
    ///
    /// # Errors
    /// Fails if the stub refuses.
    pub fn watch(&mut self, watch: Watchpoint, address: u32) -> Result<(), Error> {
        self.order(&format!("Z{},{address:x},4", watch as u32))
    }

    /// Removes the watchpoint of [`Gdb::watch`].
    ///
    /// # Errors
    /// Fails if the stub refuses.
    pub fn unwatch(&mut self, watch: Watchpoint, address: u32) -> Result<(), Error> {
        self.order(&format!("z{},{address:x},4", watch as u32))
    }

    /// Executes one instruction.
    ///
    /// # Errors
    /// Fails if the stub refuses.
    pub fn step(&mut self) -> Result<(), Error> {
        self.ask("s").map(drop)
    }

    /// Runs until a watchpoint stops the processor and returns the accessed address; `None` if the processor still runs
    /// after `patience`.
    ///
    /// # Errors
    /// Fails if the processor stops for another reason.
    pub fn run(&mut self, patience: Duration) -> Result<Option<u32>, Error> {
        self.send("c")?;
        self.stream.get_ref().set_read_timeout(Some(patience))?;
        let stop = self.receive();
        self.stream.get_ref().set_read_timeout(Some(ANSWER_TIMEOUT))?;
        let stop = match stop {
            Err(Error::Io(e)) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => return Ok(None),
            stop => stop?,
        };
        // Example: T05thread:p01.01;awatch:40023800;
        let address = stop.split(';').find_map(|field| field.split_once("watch:")).map(|(_, address)| address);
        let address = address.and_then(|address| u32::from_str_radix(address, 16).ok());
        address.map(Some).ok_or(Error::Protocol(stop))
    }

    /// Runs a halted processor to the instruction at `address`, which must not be its present one.
    ///
    /// # Errors
    /// Fails if the processor does not get there within `patience`.
    pub fn run_to(&mut self, address: u32, patience: Duration) -> Result<(), Error> {
        self.order(&format!("Z1,{address:x},2"))?;
        self.send("c")?;
        self.stream.get_ref().set_read_timeout(Some(patience))?;
        let stop = self.receive();
        self.stream.get_ref().set_read_timeout(Some(ANSWER_TIMEOUT))?;
        stop?;
        self.order(&format!("z1,{address:x},2"))
    }

    /// Counts a halted processor's instructions until the present exception ends, with other interrupts held off.
    ///
    /// # Errors
    /// Fails if the stub refuses, or if the exception does not end.
    pub fn count_exception(&mut self) -> Result<u32, Error> {
        let exception = |gdb: &mut Self| Ok::<_, Error>(gdb.register(XPSR)? & 0x1FF);
        let this = exception(self)?;
        self.count_while(|gdb| Ok(exception(gdb)? == this))
    }

    /// Counts a halted processor's instructions until the function just entered returns.
    ///
    /// # Errors
    /// Fails if the stub refuses, or if the function does not return.
    pub fn count_function(&mut self) -> Result<u32, Error> {
        let back = self.register(LR)? & !1;
        self.count_while(|gdb| Ok(gdb.register(PC)? != back))
    }

    fn count_while(&mut self, mut within: impl FnMut(&mut Self) -> Result<bool, Error>) -> Result<u32, Error> {
        /// Number of instructions after which counting fails. Any counted code takes far fewer.
        const STEPS_MAX: u32 = 100_000;
        for steps in 1..STEPS_MAX {
            self.step()?;
            if !within(self)? {
                return Ok(steps);
            }
        }
        Err(Error::Protocol(format!("the code did not return within {STEPS_MAX} instructions")))
    }

    /// Halts a running processor.
    ///
    /// # Errors
    /// Fails if the processor does not halt.
    pub fn halt(&mut self) -> Result<(), Error> {
        self.stream.get_mut().write_all(&[0x03])?;
        self.receive().map(drop)
    }

    /// Lets a halted processor run, without waiting for it to stop.
    ///
    /// # Errors
    /// Fails if the connection breaks.
    pub fn resume(&mut self) -> Result<(), Error> {
        self.send("c")
    }

    fn order(&mut self, order: &str) -> Result<(), Error> {
        match self.ask(order)?.as_str() {
            "OK" => Ok(()),
            answer => Err(Error::Protocol(format!("{answer:?} to {order}"))),
        }
    }

    fn ask(&mut self, question: &str) -> Result<String, Error> {
        self.send(question)?;
        self.receive()
    }

    fn send(&mut self, packet: &str) -> Result<(), Error> {
        let sum = packet.bytes().fold(0, u8::wrapping_add);
        Ok(write!(self.stream.get_mut(), "${packet}#{sum:02x}")?)
    }

    /// Returns the next packet, skipping acknowledgements.
    fn receive(&mut self) -> Result<String, Error> {
        let mut packet = Vec::new();
        self.stream.read_until(b'#', &mut packet)?;
        let mut sum = [0; 2];
        std::io::Read::read_exact(&mut self.stream, &mut sum)?;
        self.stream.get_mut().write_all(b"+")?;
        let packet = String::from_utf8_lossy(&packet).into_owned();
        match packet.split_once('$') {
            Some((_, body)) => Ok(body.trim_end_matches('#').to_owned()),
            None => Err(Error::Protocol(packet)),
        }
    }
}

/// Connects to a socket that QEMU is about to open.
pub(crate) fn connect(socket: &Path) -> Result<UnixStream, Error> {
    let start = Instant::now();
    loop {
        match UnixStream::connect(socket) {
            Ok(stream) => return Ok(stream),
            Err(error) if start.elapsed() > Duration::from_secs(5) => return Err(error.into()),
            Err(_) => std::thread::sleep(Duration::from_millis(10)),
        }
    }
}

fn from_hex(hex: &str) -> Result<Vec<u8>, Error> {
    let digits = hex.as_bytes().chunks(2).map(|pair| {
        let pair = std::str::from_utf8(pair).ok()?;
        u8::from_str_radix(pair, 16).ok()
    });
    digits.collect::<Option<_>>().ok_or_else(|| Error::Protocol(hex.to_owned()))
}
