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

/// A reference trajectory and the initial state of flights along it.
#[derive(Clone, Debug, Serialize)]
pub struct NamedTrajectory {
    /// Name of the scenario that the trajectory is from.
    pub name: String,
    /// Reference trajectory.
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
    /// Seed of all draws.
    pub seed: u64,
    /// Scenario with everything that is not drawn.
    pub scenario: Scenario,
    /// Trajectories flown in turn, at least one. Flight `i` takes the trajectory at index `i` modulo their number.
    pub trajectories: Vec<NamedTrajectory>,
    /// Drawn quantities, in the order of [`QUANTITIES`](crate::QUANTITIES).
    pub spreads: Vec<Spread>,
}
