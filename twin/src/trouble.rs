//! What a fault sees of the models, and what became of a vehicle.

use crate::aloft::Link;
use crate::random::Random;
use rigless::emulator::Host;
use rigless::machine::matekh743::{Conditions, MatekH743};
use rigless::session::Session;
use rigless::time::VirtualNanos;
use std::fmt;

/// What became of a vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Outcome {
    /// It fell, or turned over.
    Lost,
    /// It came down, upright and slowly, and disarmed.
    Lands,
    /// It went on as it was ordered.
    FliesOn,
}

impl fmt::Display for Outcome {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Outcome::Lost => "lost",
            Outcome::Lands => "lands",
            Outcome::FliesOn => "flies on",
        })
    }
}

/// The models while a fault is there.
pub struct Trouble<'a> {
    pub session: &'a mut Session<MatekH743>,
    pub host: &'a mut dyn Host,
    pub link: &'a Link,
    pub conditions: &'a mut Conditions,
    pub random: &'a mut Random,
    pub at: VirtualNanos,
    pub instructions: u64,
    /// Time since the fault began.
    pub since_ns: u64,
    /// Times that the fault has looked at the models before, and what it keeps.
    pub looks: u64,
    pub kept: &'a mut u64,
}
