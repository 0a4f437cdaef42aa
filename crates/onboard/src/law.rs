//! Interface to the law of a flight.

use afbc::monitor::Norm;
use afbc::{Guarded, guarded};
use afbc_control::FlightController;
use afbc_types::Axis;

/// A law that a [`Flight`](crate::Flight) can fly.
pub trait FlightLaw<const N: usize>: FlightController<N> + Clone {
    /// Returns the norms of one subsystem's estimates, a different subsystem in each tick; none for a law without a
    /// monitor.
    fn norms(memory: &Self::Memory) -> Option<(Axis, Norm)>;
}

impl<const N: usize> FlightLaw<N> for Guarded<N> {
    #[inline(always)]
    fn norms(memory: &guarded::Memory<N>) -> Option<(Axis, Norm)> {
        Some(memory.figures().latest())
    }
}
