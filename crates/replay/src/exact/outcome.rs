//! What a replay has found.

use super::compare::ChangeComparison;

/// A parameter in a log.
#[derive(Clone, Debug, PartialEq)]
pub struct LoggedParameter {
    /// Time from the first tick of the log on \[s\]; none for one that was so at the first start.
    pub at_s: Option<f64>,
    /// Its name; none if all were set to what the image has.
    pub name: Option<String>,
    /// Its value.
    pub value: f32,
}

/// A signal that is not what it was.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GivenSignal {
    /// The flight core's mode, by its number.
    Mode {
        /// In the log.
        then: u8,
        /// Now.
        now: u8,
    },
    /// The estimate of the state.
    Estimate,
    /// The rotor speeds.
    Speeds,
    /// The throttle of a motor, counted from 1.
    Throttle {
        /// Number of the motor.
        motor: usize,
        /// In the log.
        then: u16,
        /// Now.
        now: u16,
    },
}

/// Why a replay has ended before the log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ReplayFinding {
    /// A tick gives something else.
    Given(Vec<GivenSignal>),
    /// The tick is not in the log.
    Missing,
    /// The configuration that the tick was the first to fly is not in the log.
    Configuration,
    /// A parameter before the tick is not known, or makes a vehicle that cannot fly.
    Parameter,
}

/// The first tick that gives something else, or cannot be run again.
#[derive(Clone, Debug, PartialEq)]
pub struct FirstDifference {
    /// Start of the processor, counted from 1.
    pub start: u32,
    /// Number of the tick since that start.
    pub tick: u32,
    /// Time of the tick since that start, or of the last one before it that is in the log \[s\].
    pub at_s: f64,
    /// Place in the file of the record at which it was found \[bytes\].
    pub byte: usize,
    /// What was found.
    pub finding: ReplayFinding,
}

/// An exact log, replayed.
#[derive(Clone, Debug)]
pub struct ExactReplay {
    /// Name of the vehicle.
    pub vehicle: String,
    /// Name of the law.
    pub law: String,
    /// Number of rotors.
    pub rotors: usize,
    /// Starts of the processor.
    pub starts: u32,
    /// Ticks in the log.
    pub ticks: u64,
    /// Ticks in the log in which the motors were driven.
    pub armed_ticks: u64,
    /// Number of times that it was armed.
    pub flights: u32,
    /// Ticks that the log lacks between two others.
    pub lost_ticks: u64,
    /// Records of what messages have brought.
    pub messages: u64,
    /// Parameters that were not as in the image, at the first start and from then on.
    pub parameters: Vec<LoggedParameter>,
    /// Length of the file \[bytes\].
    pub bytes: u64,
    /// Frames that cannot be read, and the place of the first in the file \[bytes\].
    pub damaged: (u64, Option<usize>),
    /// Bytes at the end of the file that are no whole frame.
    pub cut_bytes: usize,
    /// Ticks that were run again with the same result.
    pub same_ticks: u64,
    /// The first tick that gives something else, or cannot be run; the log is not run any further.
    pub first_difference: Option<FirstDifference>,
    /// What other settings would have commanded, if they were asked for.
    pub comparison: Option<ChangeComparison>,
}

impl ExactReplay {
    /// True if every tick gave the same again, and nothing between them was lost.
    #[must_use]
    pub fn is_same(&self) -> bool {
        self.first_difference.is_none() && self.damaged.0 == 0
    }
}
