//! Functions of any law's controller beyond the common interface. All controllers are compiled here.

use crate::FlownLaw;
use crate::laws::{AnyController, AnyControllerMemory};
use afbc::monitor::Norm;
use afbc::{AdaptiveEstimate, Guarded};
use afbc_control::{Action, FlightController};
use afbc_onboard::{Configuration, FlightLaw, Prepare, Prepared};
use afbc_types::{Axis, OutOfRange, PerAxis, Setpoint, State};

/// Functions that make a controller for the firmware's code and that compute its decision.
type Compiled<const N: usize> = (
    fn(&FlownLaw, &Configuration<N>) -> Result<Prepared<N, AnyController<N>>, OutOfRange>,
    fn(&AnyController<N>, &mut AnyControllerMemory<N>, &State, &Setpoint, bool) -> Action<N>,
);

const fn compiled<const N: usize>() -> Compiled<N> {
    (<FlownLaw as Prepare<N>>::prepare, <AnyController<N> as FlightController<N>>::decide)
}

/// Makes the compiler compile these functions here for every number of rotors; other crates then share them, since they
/// are not inlined. Otherwise each crate would have its own copies, with 40 KB of `decide` for each number of rotors.
#[used]
static COMPILED: (Compiled<4>, Compiled<5>, Compiled<6>, Compiled<7>, Compiled<8>) =
    (compiled(), compiled(), compiled(), compiled(), compiled());

impl<const N: usize> AnyControllerMemory<N> {
    /// Returns AFBC's adaptive estimates, with or without its monitor; none for another law.
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
