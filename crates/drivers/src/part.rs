//! What a part is: scripts of register accesses, and arithmetic on what they read. No I/O.

use crate::bus::SpiFormat;
use core::fmt;

/// A step of a script.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Expects one of the values in a register: the part's identity.
    Identify(u8, &'static [u8]),
    /// Writes a byte to a register whose value is read back, after the script and then again and again in flight: a
    /// part that was reset meanwhile has lost it.
    Set(u8, u8),
    /// Sets a register, as [`Step::Set`], to a value and those bits of a mask that another register, or it itself,
    /// holds: register, value, mask, the other register.
    SetLike(u8, u8, u8, u8),
    /// Writes a byte to a register that is not read back.
    Write(u8, u8),
    /// Writes bytes from a register on, in one transfer; none are a command.
    WriteAll(u8, &'static [u8]),
    /// Reads so many bytes from a register on, at most [`READ_MAX`](crate::READ_MAX), for [`SensorPart::take`]. Three
    /// and more whose bits are all equal are no answer; one or two may well be.
    Read(u8, usize),
    /// Waits until the bits of a mask in a register have a value: register, mask, value, at most so many milliseconds.
    Await(u8, u8, u8, u32),
    /// Waits so long \[us\].
    Wait(u32),
    /// Waits for the part's interrupt, at most so long \[us\], which is twice the time of a sample; without one, for
    /// that time.
    Ready(u32),
}

/// The test of a part that reads `R`.
#[derive(Clone, Copy, Debug)]
pub struct SelfTest<R> {
    /// Sets the part up for readings without the stimulus, or with the opposite one; after [`SensorPart::SETUP`].
    pub quiet: &'static [Step],
    /// Before the stimulus: the register of the first of three bytes that the factory has written, after a step.
    pub trims: &'static [(Step, u8)],
    /// After these.
    pub between: &'static [Step],
    /// Applies the stimulus.
    pub stimulated: &'static [Step],
    /// Readings of each kind that are left out, and those that are averaged.
    pub skipped: u32,
    /// See above.
    pub averaged: u32,
    /// Returns a reading as the test counts it: rates and specific force in the part's numbers, or a field \[uT\].
    pub axes: fn(&R) -> [f32; 6],
    /// True if the response is one that the data sheet allows.
    pub passes: fn(&SelfTestResponse) -> bool,
}

/// What a test has found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SelfTestResponse {
    /// Mean reading without the stimulus.
    pub quiet: [f32; 6],
    /// By how much it changes with the stimulus.
    pub change: [f32; 6],
    /// What the factory has written.
    pub trims: [[u8; 3]; 2],
}

/// A part of a data sheet.
pub trait SensorPart {
    /// What it reads.
    type Reading: Copy;
    /// Its name.
    const NAME: &'static str;
    /// How it is read over SPI; `None` if it has I2C alone.
    const SPI: Option<SpiFormat>;
    /// Its addresses on I2C, of seven bits, the usual one first; none if it has SPI alone.
    const I2C: &'static [u8];
    /// Sets it up from any state that it may be in.
    const SETUP: &'static [Step];
    /// Takes one reading, or a part of it.
    const CYCLE: &'static [Step];
    /// So many equal readings in a row are a stuck part.
    const STUCK_AFTER: u32;
    /// Its own test, if it has one that is run here.
    const SELF_TEST: Option<SelfTest<Self::Reading>> = None;

    /// Takes the answer to a [`Step::Read`] of `register`, and returns the reading that it completes.
    ///
    /// # Errors
    /// The answer is not one that a working part gives.
    fn take(&mut self, register: u8, answer: &[u8]) -> Result<Option<Self::Reading>, PartFault>;
}

/// What is wrong with a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartFault {
    /// A transfer has failed.
    Bus,
    /// Nothing answers: every bit reads the same.
    Silent,
    /// Another part answers: what it says it is.
    Identity(u8),
    /// A register does not hold what was written to it.
    Register(u8),
    /// The part does not become ready.
    Late,
    /// What it reads does not change.
    Stuck,
    /// What it reads is outside of what it can measure.
    Range,
    /// Its factory calibration is damaged, or is none.
    Calibration,
    /// It has failed its own test.
    SelfTest,
    /// It has lost readings: its buffer is full.
    Overflow,
}

impl fmt::Display for PartFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            PartFault::Bus => f.write_str("a transfer failed: check wiring and address"),
            PartFault::Silent => f.write_str("no answer: check wiring and power"),
            PartFault::Identity(identity) => write!(f, "another part answers, with identity {identity:#04x}"),
            PartFault::Register(register) => write!(f, "register {register:#04x} does not keep its value"),
            PartFault::Late => f.write_str("it does not become ready"),
            PartFault::Stuck => f.write_str("its readings do not change"),
            PartFault::Range => f.write_str("its readings are outside of its range"),
            PartFault::Calibration => f.write_str("its factory calibration is damaged"),
            PartFault::SelfTest => f.write_str("it failed its self-test"),
            PartFault::Overflow => f.write_str("it lost readings"),
        }
    }
}
