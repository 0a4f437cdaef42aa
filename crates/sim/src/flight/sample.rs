//! Record of one step of a flight.

use super::estimation::EstimateErrors;
use afbc::AdaptiveEstimate;
use afbc_control::{Action, Trace};
use afbc_flight_core::Mode;
use afbc_plant::{EffectsState, Motion, StateMeasurement};
use afbc_scenario::AnyControllerMemory;
use afbc_scenario::trajectory::Reference;
use afbc_types::{PerAxis, ROTORS_MAX};
use core::any::Any;

/// All quantities of one step.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Time \[s\].
    pub time_s: f64,
    /// True motion.
    pub motion: Motion,
    /// Measurement by the sensors; none if the sensors are perfect.
    pub measurement: Option<StateMeasurement>,
    /// Errors of the vehicle's own estimate; none without instruments.
    pub estimated: Option<EstimateErrors>,
    /// State of rotors, air and ground after the previous step; none for an ideal plant.
    pub telemetry: Option<EffectsState>,
    /// Reference at this time.
    pub reference: Reference,
    /// Mode of the flight core; none without a flight core.
    pub mode: Option<Mode>,
    /// The controller's output; 0 for rotors that the vehicle does not have.
    pub action: Action<ROTORS_MAX>,
    /// The controller's trace.
    pub trace: Trace,
    /// AFBC's estimates; none for other laws.
    pub estimates: Option<PerAxis<AdaptiveEstimate>>,
}

/// Returns AFBC's adaptive estimates if `memory` belongs to an AFBC controller; none for other laws.
#[inline(always)]
pub(super) fn estimates<const N: usize>(memory: &dyn Any) -> Option<PerAxis<AdaptiveEstimate>> {
    memory.downcast_ref().and_then(AnyControllerMemory::<N>::estimates)
}
