//! The result of a replay.

use super::compare::ChangeComparison;

/// A parameter value recorded in a log.
#[derive(Clone, Debug, PartialEq)]
pub struct LoggedParameter {
    /// Time of the change, from the first tick of the log on \[s\]; none for a value in force at the first start.
    pub at_s: Option<f64>,
    /// Name of the parameter; none if all parameters were reset to the image's defaults.
    pub name: Option<String>,
    /// Value of the parameter.
    pub value: f32,
}

/// A signal of a tick that differs between the log and the replay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GivenSignal {
    /// Number of the flight core's mode.
    Mode {
        /// Value in the log.
        then: u8,
        /// Value in the replay.
        now: u8,
    },
    /// The state estimate.
    Estimate,
    /// The rotor speeds.
    Speeds,
    /// Throttle of a motor.
    Throttle {
        /// Number of the motor, counted from 1.
        motor: usize,
        /// Value in the log.
        then: u16,
        /// Value in the replay.
        now: u16,
    },
}

/// Reason for which a replay ended before the log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ReplayFinding {
    /// A tick's outputs differ in these signals.
    Given(Vec<GivenSignal>),
    /// A tick is missing in the log.
    Missing,
    /// The log lacks the configuration that this tick was the first to use.
    Configuration,
    /// A parameter change before the tick is unknown or makes a vehicle that cannot fly.
    Parameter,
}

/// The first tick whose outputs differ or which cannot be run.
#[derive(Clone, Debug, PartialEq)]
pub struct FirstDifference {
    /// Number of the processor's start, counted from 1.
    pub start: u32,
    /// Number of the tick, counted since that start.
    pub tick: u32,
    /// Time of the tick since that start; for a missing tick, the time of the last tick before it \[s\].
    pub at_s: f64,
    /// Offset in the file of the record at which the difference was found \[bytes\].
    pub byte: usize,
    /// Kind of difference.
    pub finding: ReplayFinding,
}

/// Result of replaying an exact log.
#[derive(Clone, Debug)]
pub struct ExactReplay {
    /// Name of the vehicle.
    pub vehicle: String,
    /// Name of the law.
    pub law: String,
    /// Number of rotors.
    pub rotors: usize,
    /// Number of starts of the processor.
    pub starts: u32,
    /// Number of ticks in the log.
    pub ticks: u64,
    /// Number of ticks in the log in which the motors were driven.
    pub armed_ticks: u64,
    /// Number of times that the vehicle was armed.
    pub flights: u32,
    /// Number of ticks missing between two logged ticks.
    pub lost_ticks: u64,
    /// Number of records with received messages.
    pub messages: u64,
    /// Parameters that differed from the image at the first start, and all later changes.
    pub parameters: Vec<LoggedParameter>,
    /// Length of the file \[bytes\].
    pub bytes: u64,
    /// Number of unreadable frames, and the offset of the first in the file \[bytes\].
    pub damaged: (u64, Option<usize>),
    /// Number of bytes at the end of the file that are no whole frame.
    pub cut_bytes: usize,
    /// Number of ticks that gave the same result in the replay.
    pub same_ticks: u64,
    /// The first tick that differs or cannot be run; the replay stops there.
    pub first_difference: Option<FirstDifference>,
    /// Comparison with the changed settings, if there are any.
    pub comparison: Option<ChangeComparison>,
}

impl ExactReplay {
    /// Returns true if every tick gave the same result and no frame is damaged.
    #[must_use]
    pub fn is_same(&self) -> bool {
        self.first_difference.is_none() && self.damaged.0 == 0
    }
}
