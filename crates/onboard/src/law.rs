//! Which law flies.

use afbc::monitor::Norm;
use afbc::{Guarded, guarded};
use afbc_control::FlightController;
use afbc_types::Axis;

/// A law of a [`Flight`](crate::Flight).
pub trait FlightLaw<const N: usize>: FlightController<N> + Clone {
    /// Returns the norms of the estimates of one subsystem, all in turn; none for a law without a monitor.
    fn norms(memory: &Self::Memory) -> Option<(Axis, Norm)>;
}

impl<const N: usize> FlightLaw<N> for Guarded<N> {
    #[inline(always)]
    fn norms(memory: &guarded::Memory<N>) -> Option<(Axis, Norm)> {
        Some(memory.figures().latest())
    }
}
