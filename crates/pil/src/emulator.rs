//! Runs the `pil` image in lockstep.
//!
//! Bytes are exchanged over two FIFOs in the format of [`ReplyHead`].

use crate::Error;
use crate::qemu::{self, Qemu};
use afbc_onboard::{Readings, ReplyHead};
use afbc_types::ROTORS_MAX;
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::Path;
use std::process::Command;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread::JoinHandle;
use std::time::Duration;

/// A tick that takes longer than this on the host counts as stuck.
const PATIENCE: Duration = Duration::from_secs(20);
/// Interval between checks that QEMU still runs.
const LOOK: Duration = Duration::from_millis(500);
/// Longest accepted reply \[bytes\].
const REPLY_MAX: usize = 4096;

/// Result of a control tick of the firmware.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TickReply {
    /// Start of the tick since power-up \[us\].
    pub time_us: u64,
    /// Duration in core cycles, as the firmware measures it.
    pub cycles: u32,
    /// Duration in instructions, as the emulator counts them.
    pub instructions: u32,
    /// Largest stack depth so far, including interrupts, as of the last full second \[bytes\].
    pub stack_bytes: u32,
    /// Throttles of the motors: 0, or 48 to 2047; 0 where there is no motor.
    pub throttles: [u16; ROTORS_MAX],
    /// Bytes that the firmware sent over the link.
    pub bytes: Vec<u8>,
}

impl TickReply {
    /// Returns the tick's duration as the firmware reports it over MAVLink \[us\].
    pub fn tick_us(&self) -> f32 {
        self.cycles as f32 / qemu::CORE_MHZ as f32
    }
}

/// The `pil` image in lockstep with the host.
#[derive(Debug)]
pub struct Emulator {
    qemu: Qemu,
    to_firmware: File,
    readings: Readings,
    replies: Receiver<io::Result<TickReply>>,
    /// Writing end of the FIFO from the firmware: while it is open, the reader waits for more.
    hold: Option<File>,
    reader: Option<JoinHandle<()>>,
}

impl Emulator {
    /// Starts the image; before its first control tick it waits for the first [exchange](Self::exchange).
    ///
    /// # Errors
    /// Fails if QEMU or the image is missing, or if QEMU does not start.
    pub fn start(elf: &Path) -> Result<Self, Error> {
        Emulator::start_slower(elf, 0)
    }

    /// Starts the image on a processor whose instructions take 2^`slower` times as long: 8 ns, 16 ns, 32 ns.
    ///
    /// # Errors
    /// The same as for [`Emulator::start`].
    pub fn start_slower(elf: &Path, slower: u32) -> Result<Self, Error> {
        let shift = qemu::SHIFT + slower;
        let folder = Qemu::folder()?;
        let open = |name: &str| -> Result<File, Error> {
            let path = folder.join(name);
            if !Command::new("mkfifo").arg(&path).status()?.success() {
                return Err(Error::Protocol(format!("mkfifo {} failed", path.display())));
            }
            // Opening a FIFO for reading and writing does not wait for its other end.
            Ok(OpenOptions::new().read(true).write(true).open(path)?)
        };
        let to_firmware = open("to_firmware")?;
        let hold = open("from_firmware")?;
        let mut from_firmware = File::open(folder.join("from_firmware"))?;
        let arguments = [qemu::count_instructions(shift).as_slice(), &["-serial".into(), "none".into()]].concat();
        let qemu = Qemu::start(elf, folder, &[qemu::OLIMEX, qemu::NETDUINO], &arguments)?;

        let (sender, replies) = mpsc::channel();
        let reader = std::thread::spawn(move || {
            loop {
                let reply = read_reply(&mut from_firmware, shift);
                let last = reply.is_err();
                if sender.send(reply).is_err() || last {
                    return;
                }
            }
        });
        let readings = Readings::NONE;
        Ok(Emulator { qemu, to_firmware, readings, replies, hold: Some(hold), reader: Some(reader) })
    }

    /// Sets the vehicle's own sensor readings for the next tick only.
    pub fn sense(&mut self, readings: &Readings) {
        self.readings = *readings;
    }

    /// Runs one control tick. Delivers `to_firmware` before the tick and returns the firmware's output after it.
    ///
    /// # Errors
    /// Fails if the firmware panics, faults or hangs.
    pub fn exchange(&mut self, to_firmware: &[u8]) -> Result<TickReply, Error> {
        let mut frame = core::mem::take(&mut self.readings).to_bytes().to_vec();
        frame.extend_from_slice(&(to_firmware.len() as u32).to_le_bytes());
        frame.extend_from_slice(to_firmware);
        self.to_firmware.write_all(&frame)?;

        let mut waited = Duration::ZERO;
        loop {
            match self.replies.recv_timeout(LOOK) {
                Ok(reply) => return Ok(reply?),
                Err(RecvTimeoutError::Disconnected) => return Err(Error::Protocol("reply cut short".into())),
                Err(RecvTimeoutError::Timeout) => self.qemu.check()?,
            }
            waited += LOOK;
            if waited >= PATIENCE {
                return Err(Error::Silent(waited));
            }
        }
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        // With both writing ends closed, the reader sees the end of the FIFO.
        self.qemu.kill();
        self.hold = None;
        if let Some(reader) = self.reader.take() {
            let _ = reader.join();
        }
    }
}

fn read_reply(from: &mut impl Read, shift: u32) -> io::Result<TickReply> {
    let mut head = [0; ReplyHead::LEN];
    from.read_exact(&mut head)?;
    let ReplyHead { time_us, cycles, stack_bytes, length, throttles } = ReplyHead::from_bytes(&head);
    if length as usize > REPLY_MAX {
        return Err(io::Error::new(io::ErrorKind::InvalidData, format!("a reply of {length} bytes")));
    }
    let mut bytes = vec![0; length as usize];
    from.read_exact(&mut bytes)?;
    Ok(TickReply { time_us, cycles, instructions: qemu::instructions(cycles, shift), stack_bytes, throttles, bytes })
}
