//! What a campaign is.

use afbc_plant::Motion;
use afbc_sim::scenario::Scenario;
use afbc_sim::trajectory::Trajectory;

/// A quantity and the interval that it is drawn from, evenly; a single value if both ends are the same.
#[derive(Clone, Copy, Debug)]
pub struct Spread {
    /// Index in [`QUANTITIES`](crate::QUANTITIES).
    pub(crate) quantity: usize,
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
    /// In the order of [`QUANTITIES`](crate::QUANTITIES).
    pub spreads: Vec<Spread>,
}
