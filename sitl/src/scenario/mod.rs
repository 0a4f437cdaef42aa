//! What is flown: one vehicle, one trajectory, one environment, the controllers to compare.
//!
//! A scenario comes from [`crate::paper`], from a file ([`load`]) or from the [`built_in`] ones.

mod built_in;
mod error;
mod file;
mod reader;
mod words;

pub use built_in::{BUILT_IN, BuiltIn, built_in, similar_built_in};
pub use error::FileError;
pub use file::{load, parse};

use crate::flight::{Flight, adaptive_law, backstepping_law};
use crate::paper::Case;
use crate::trajectory::Trajectory;
use afbc::{Profile, Settings, adaptive};
use airframe::{OutOfRange, Parameters, PerAxis, Range};
use plant::{Environment, Model, Motion};

/// Accepted length of a flight \[s\].
pub const DURATION: Range = Range::new("duration_s", 0.1, 36_000.0);

/// A control law to fly with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ControllerKind {
    /// Adaptive fuzzy backstepping (20)-(22).
    Afbc,
    /// Classical backstepping (16), (21).
    Backstepping,
}

impl ControllerKind {
    /// Every law.
    pub const ALL: [ControllerKind; 2] = [ControllerKind::Afbc, ControllerKind::Backstepping];

    /// Lower-case name, as in scenario files and logs.
    pub const fn name(self) -> &'static str {
        match self {
            ControllerKind::Afbc => "afbc",
            ControllerKind::Backstepping => "backstepping",
        }
    }

    /// Name for people.
    pub const fn title(self) -> &'static str {
        match self {
            ControllerKind::Afbc => "AFBC",
            ControllerKind::Backstepping => "backstepping",
        }
    }
}

/// Everything that determines a flight.
#[derive(Clone, Debug, PartialEq)]
pub struct Scenario {
    /// Short name: file names come from it.
    pub name: String,
    /// One line for people.
    pub description: String,
    /// Which reading of the paper's experiment this is, if it is one.
    pub case: Option<Case>,
    /// Length of the flight \[s\].
    pub duration_s: f64,
    /// Equations that move the vehicle.
    pub model: Model,
    /// The vehicle as the controller believes it to be.
    pub vehicle: Parameters<f64>,
    /// The vehicle as it is, and what pushes it.
    pub environment: Environment,
    /// Motion at t = 0.
    pub initial: Motion,
    /// The reference.
    pub trajectory: Trajectory,
    /// Laws to compare, each in a flight of its own.
    pub controllers: Vec<ControllerKind>,
    /// Where gains and settings started from.
    pub profile: Profile,
    /// Gains; the baseline takes their backstepping part.
    pub gains: PerAxis<adaptive::Gains>,
    /// Settings of the cascade.
    pub settings: Settings,
}

impl Scenario {
    /// Builds every controller once, just as a flight would.
    ///
    /// # Errors
    /// The first parameter, gain or setting out of range.
    pub fn check(&self) -> Result<(), OutOfRange> {
        self.controllers.iter().try_for_each(|kind| match kind {
            ControllerKind::Afbc => Flight::new(self, adaptive_law(self)?).map(drop),
            ControllerKind::Backstepping => Flight::new(self, backstepping_law(self)?).map(drop),
        })
    }
}
