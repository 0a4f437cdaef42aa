//! Interface to the law of a flight.

use afbc::monitor::EstimateNorms;
use afbc::{AdaptiveEstimate, Guarded, guarded};
use afbc_control::FlightController;
use afbc_types::{Axis, PerAxis};

/// A law that a [`Flight`](crate::Flight) can fly.
pub trait FlightLaw<const N: usize>: FlightController<N> + Clone {
    /// Returns the norms of one subsystem's estimates, a different subsystem in each tick; none for a law without a
    /// monitor.
    fn norms(memory: &Self::Memory) -> Option<(Axis, EstimateNorms)>;

    /// Returns AFBC's adaptive estimates; none for another law.
    fn estimates(memory: &Self::Memory) -> Option<PerAxis<AdaptiveEstimate>>;
}

impl<const N: usize> FlightLaw<N> for Guarded<N> {
    #[inline(always)]
    fn norms(memory: &guarded::Memory<N>) -> Option<(Axis, EstimateNorms)> {
        Some(memory.figures().latest())
    }

    fn estimates(memory: &guarded::Memory<N>) -> Option<PerAxis<AdaptiveEstimate>> {
        Some(memory.estimates())
    }
}
