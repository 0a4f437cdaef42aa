//! What is known of any law's controller beside its interface, and the one place where all of them are compiled.

use crate::FlownLaw;
use crate::laws::{AnyController, AnyControllerMemory};
use afbc::monitor::Norm;
use afbc::{AdaptiveEstimate, Guarded};
use afbc_control::{Action, FlightController};
use afbc_onboard::{Configuration, FlightLaw, Prepare, Prepared};
use afbc_types::{Axis, OutOfRange, PerAxis, Setpoint, State};

/// How a controller is made for the firmware's code, and what it decides.
type Compiled<const N: usize> = (
    fn(&FlownLaw, &Configuration<N>) -> Result<Prepared<N, AnyController<N>>, OutOfRange>,
    fn(&AnyController<N>, &mut AnyControllerMemory<N>, &State, &Setpoint, bool) -> Action<N>,
);

const fn compiled<const N: usize>() -> Compiled<N> {
    (<FlownLaw as Prepare<N>>::prepare, <AnyController<N> as FlightController<N>>::decide)
}

/// Makes the compiler compile them here, for every number of rotors, since crates that use this one share what is
/// compiled and not inlined. Otherwise each of them would have copies of its own, 40 KB of `decide` for each number.
#[used]
static COMPILED: (Compiled<4>, Compiled<5>, Compiled<6>, Compiled<7>, Compiled<8>) =
    (compiled(), compiled(), compiled(), compiled(), compiled());

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
