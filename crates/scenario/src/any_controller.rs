//! Functions of any law's controller beyond the common interface. All controllers are compiled here.

use crate::FlownLaw;
use crate::laws::{AnyController, AnyControllerMemory};
use afbc::monitor::EstimateNorms;
use afbc::{AdaptiveEstimate, Guarded};
use afbc_control::{Action, FlightController};
use afbc_onboard::{AnyFlight, Configuration, ControlInputs, FlightLaw, Readings, Report};
use afbc_types::{Axis, OutOfRange, PerAxis, Setpoint, State};

/// A function that computes a controller's decision.
type Decide<const N: usize> = fn(&AnyController<N>, &mut AnyControllerMemory<N>, &State, &Setpoint, bool) -> Action<N>;

const fn decide<const N: usize>() -> Decide<N> {
    <AnyController<N> as FlightController<N>>::decide
}

/// Functions that make and fly a vehicle with any number of rotors.
type Fly = (
    fn(&FlownLaw, &Configuration) -> Result<AnyFlight<FlownLaw>, OutOfRange>,
    fn(&mut AnyFlight<FlownLaw>, u64, &mut ControlInputs, &Readings) -> Report,
);

/// Makes the compiler compile these functions here for every number of rotors; other crates then share them, since they
/// are not inlined. Otherwise each crate would have its own copies, with 40 KB of `decide` for each number of rotors.
#[used]
static COMPILED: (Fly, Decide<4>, Decide<5>, Decide<6>, Decide<7>, Decide<8>) =
    ((AnyFlight::new, AnyFlight::tick), decide(), decide(), decide(), decide(), decide());

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
    fn norms(memory: &AnyControllerMemory<N>) -> Option<(Axis, EstimateNorms)> {
        match memory {
            AnyControllerMemory::Monitored(memory) => Guarded::norms(memory),
            _ => None,
        }
    }

    fn estimates(memory: &AnyControllerMemory<N>) -> Option<PerAxis<AdaptiveEstimate>> {
        memory.estimates()
    }
}
