//! Monte Carlo campaigns: one scenario, flown many times with drawn vehicles, weather and faults.
//!
//! Flight `i` is drawn from the campaign's seed and `i` alone, so it can be flown again by itself, on any machine; every
//! contender flies the same draws. The format of campaign files is in `docs/campaigns.md`.

mod built_in;
mod draw;
mod error;
mod file;
mod fly;
mod folder;
mod manifest;
mod parquet;
mod quantity;
mod row;
pub mod statistics;
mod summary;

pub use built_in::{BUILT_IN, BuiltIn, built_in, similar_built_in};
pub use draw::Draw;
pub use error::Error;
pub use file::parse;
pub use fly::{fly, merge};
pub use folder::Folder;
pub use manifest::{Drawn, Manifest, Shard};
pub use quantity::{QUANTITIES, Quantity};
pub use row::{Column, FIGURES, Figure, Row};
pub use summary::{BINS, Bad, Count, Summary, Tally};

use crate::scenario::Scenario;
use crate::trajectory::Trajectory;
use afbc_plant::Motion;

/// A quantity and the interval that it is drawn from, evenly; a single value if both ends are the same.
#[derive(Clone, Copy, Debug)]
pub struct Spread {
    /// Index in [`QUANTITIES`].
    quantity: usize,
    /// Ends of the interval, in the quantity's unit.
    pub ends: [f64; 2],
}

/// A reference, and how a flight along it begins.
#[derive(Clone, Debug)]
pub struct Course {
    /// The name of the scenario that it is from.
    pub name: String,
    /// The reference.
    pub trajectory: Trajectory,
    /// Motion at t = 0.
    pub initial: Motion,
}

/// Everything that determines a campaign.
#[derive(Clone, Debug)]
pub struct Campaign {
    /// Short name: file names come from it.
    pub name: String,
    /// One line for people.
    pub description: String,
    /// How many flights each contender makes.
    pub flights: u64,
    /// Where every draw comes from.
    pub seed: u64,
    /// What is not drawn.
    pub scenario: Scenario,
    /// Flown in turn: flight `i` takes the one at `i` modulo their number. At least one.
    pub courses: Vec<Course>,
    /// In the order of [`QUANTITIES`].
    pub spreads: Vec<Spread>,
}
