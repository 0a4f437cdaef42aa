//! Definition of a campaign.

use afbc_plant::Motion;
use afbc_scenario::Scenario;
use afbc_scenario::trajectory::Trajectory;
use serde::Serialize;

/// A quantity and the interval from which it is drawn uniformly; a single value if both ends are equal.
#[derive(Clone, Copy, Debug)]
pub struct Spread {
    /// Index in [`QUANTITIES`](crate::QUANTITIES).
    pub(crate) quantity: usize,
    /// Ends of the interval, in the quantity's unit.
    pub ends: [f64; 2],
}

/// A reference, and the initial state of flights along it.
#[derive(Clone, Debug, Serialize)]
pub struct NamedTrajectory {
    /// Name of the scenario it is from.
    pub name: String,
    /// The reference.
    pub trajectory: Trajectory,
    /// Motion at t = 0.
    pub initial: Motion,
}

/// Everything that determines a campaign.
#[derive(Clone, Debug)]
pub struct Campaign {
    /// Short name, used in file names.
    pub name: String,
    /// Description in one line.
    pub description: String,
    /// Number of flights of each contender.
    pub flights: u64,
    /// Seed of every draw.
    pub seed: u64,
    /// Everything that is not drawn.
    pub scenario: Scenario,
    /// Trajectories flown in turn: flight `i` takes the one at `i` modulo their number. At least one.
    pub trajectories: Vec<NamedTrajectory>,
    /// Quantities drawn, in the order of [`QUANTITIES`](crate::QUANTITIES).
    pub spreads: Vec<Spread>,
}
