//! What is known of any law's controller beside its interface.

use crate::laws::{AnyController, AnyControllerMemory};
use afbc::monitor::Norm;
use afbc::{AdaptiveEstimate, Guarded};
use afbc_onboard::FlightLaw;
use afbc_types::{Axis, PerAxis};

impl<const N: usize> AnyControllerMemory<N> {
    /// Returns AFBC's estimates, with or without its monitor; none of another law.
    #[inline(always)]
    pub fn estimates(&self) -> Option<PerAxis<AdaptiveEstimate>> {
        match self {
            AnyControllerMemory::Monitored(memory) => Some(memory.estimates()),
            AnyControllerMemory::Afbc(memory) => Some(memory.estimates),
            _ => None,
        }
    }
}

impl<const N: usize> FlightLaw<N> for AnyController<N> {
    fn norms(memory: &AnyControllerMemory<N>) -> Option<(Axis, Norm)> {
        match memory {
            AnyControllerMemory::Monitored(memory) => Guarded::norms(memory),
            _ => None,
        }
    }
}
