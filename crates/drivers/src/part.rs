//! Description of a part: scripts of register accesses, and the decoding of their answers. No I/O.

use crate::bus::SpiFormat;
use core::fmt;

/// One step of a script.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScriptStep {
    /// Checks that a register, the part's identity, holds one of these values.
    Identify(u8, &'static [u8]),
    /// Writes a byte to a register. The value is read back after the script and repeatedly in flight, since a part that
    /// was reset has lost it.
    Set(u8, u8),
    /// Sets a register like [`ScriptStep::Set`], keeping some bits of another register or of the register itself.
    /// Fields: register, value, mask of the kept bits, the register they are read from.
    SetLike(u8, u8, u8, u8),
    /// Writes a byte to a register, without reading it back.
    Write(u8, u8),
    /// Writes bytes to consecutive registers in one transfer; without bytes, sends a command.
    WriteAll(u8, &'static [u8]),
    /// Reads this number of bytes from consecutive registers for [`SensorPart::take`], at most
    /// [`READ_MAX`](crate::READ_MAX). Three or more bytes whose bits are all equal count as no answer; one or two may
    /// be genuine.
    Read(u8, usize),
    /// Polls a register until its masked bits have a value. Fields: register, mask, value, time limit \[ms\].
    Await(u8, u8, u8, u32),
    /// Waits for this time \[us\].
    Wait(u32),
    /// Waits for the part's interrupt, at most for this time \[us\], which is twice the sample time. Without a wired
    /// interrupt, waits for the whole time.
    Ready(u32),
}

/// Self-test of a part with readings `R`.
#[derive(Clone, Copy, Debug)]
pub struct SelfTest<R> {
    /// Steps after [`SensorPart::SETUP`] for readings without stimulus, or with the opposite one.
    pub quiet: &'static [ScriptStep],
    /// Factory's responses, read before the stimulus: a step, then the first of three one-byte registers.
    pub trims: &'static [(ScriptStep, u8)],
    /// Steps after reading the factory's responses.
    pub between: &'static [ScriptStep],
    /// Steps that apply the stimulus.
    pub stimulated: &'static [ScriptStep],
    /// Number of readings skipped, without and with stimulus each.
    pub skipped: u32,
    /// Number of readings averaged, without and with stimulus each.
    pub averaged: u32,
    /// Converts a reading for the test: rates and specific force in raw numbers, or a field \[uT\].
    pub axes: fn(&R) -> [f32; 6],
    /// True if the data sheet allows the response.
    pub passes: fn(&SelfTestResponse) -> bool,
}

/// Result of a self-test.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SelfTestResponse {
    /// Mean reading without the stimulus.
    pub quiet: [f32; 6],
    /// Change of the mean reading by the stimulus.
    pub change: [f32; 6],
    /// Factory's responses, in codes.
    pub trims: [[u8; 3]; 2],
}

/// A kind of sensor part, described by its data sheet.
pub trait SensorPart {
    /// Type of its readings.
    type Reading: Copy;
    /// Name of the part.
    const NAME: &'static str;
    /// Frame format on SPI; `None` if the part is used only on I2C.
    const SPI: Option<SpiFormat>;
    /// Seven-bit addresses on I2C, the usual one first; empty if the part is used only on SPI.
    const I2C: &'static [u8];
    /// Script that sets the part up from any state.
    const SETUP: &'static [ScriptStep];
    /// Script that takes one reading, or a part of one.
    const CYCLE: &'static [ScriptStep];
    /// Number of consecutive equal readings that means a stuck part.
    const STUCK_AFTER: u32;
    /// Self-test, if the part has one that is supported.
    const SELF_TEST: Option<SelfTest<Self::Reading>> = None;

    /// Takes the answer to a [`ScriptStep::Read`] of `register`; returns the reading that it completes, if any.
    ///
    /// # Errors
    /// If no working part gives this answer.
    fn take(&mut self, register: u8, answer: &[u8]) -> Result<Option<Self::Reading>, PartFault>;
}

/// Fault of a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartFault {
    /// A transfer failed.
    Bus,
    /// No answer: all bits read the same.
    Silent,
    /// Wrong part; holds its identity.
    Identity(u8),
    /// A register does not hold the value written to it.
    Register(u8),
    /// The part does not become ready in time.
    Late,
    /// The readings do not change.
    Stuck,
    /// The reading is outside the part's range.
    Range,
    /// The factory calibration is damaged or missing.
    Calibration,
    /// The part failed its self-test.
    SelfTest,
    /// The part lost readings, since its buffer was full.
    Overflow,
}

impl fmt::Display for PartFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            PartFault::Bus => f.write_str("a transfer failed: check wiring and address"),
            PartFault::Silent => f.write_str("no answer: check wiring and power"),
            PartFault::Identity(identity) => write!(f, "a different part answers, with identity {identity:#04x}"),
            PartFault::Register(register) => write!(f, "register {register:#04x} does not keep its value"),
            PartFault::Late => f.write_str("the part does not become ready"),
            PartFault::Stuck => f.write_str("the part's readings do not change"),
            PartFault::Range => f.write_str("the part's readings are out of its range"),
            PartFault::Calibration => f.write_str("the part's factory calibration is damaged"),
            PartFault::SelfTest => f.write_str("the part failed its self-test"),
            PartFault::Overflow => f.write_str("it lost readings"),
        }
    }
}
