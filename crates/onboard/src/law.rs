//! Which law flies.

use afbc::monitor::Norm;
use afbc::{Guarded, guarded};
use afbc_control::{Action, FlightController, Mixer, Trace};
use afbc_types::{Axis, Setpoint, State};

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

/// A law without a monitor, for flights in simulation.
#[derive(Clone, Copy, Debug)]
pub struct Unmonitored<C>(pub C);

impl<C: FlightController<N> + Clone, const N: usize> FlightLaw<N> for Unmonitored<C> {
    fn norms(_: &C::Memory) -> Option<(Axis, Norm)> {
        None
    }
}

impl<C: FlightController<N>, const N: usize> FlightController<N> for Unmonitored<C> {
    type Memory = C::Memory;

    fn dt_s(&self) -> f32 {
        self.0.dt_s()
    }

    fn mixer(&self) -> &Mixer<N> {
        self.0.mixer()
    }

    fn decide(&self, memory: &mut C::Memory, state: &State, setpoint: &Setpoint, fresh: bool) -> Action<N> {
        self.0.decide(memory, state, setpoint, fresh)
    }

    fn position_lost(&self, memory: &mut C::Memory) {
        self.0.position_lost(memory);
    }

    fn trace(memory: &C::Memory) -> Trace {
        C::trace(memory)
    }

    fn engage(&self, memory: &mut C::Memory) -> bool {
        self.0.engage(memory)
    }
}
