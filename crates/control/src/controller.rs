//! What every controller looks like from outside, so that one harness, one tuner and one campaign fly them all.

use crate::screen::Screened;
use crate::{Action, Estimate, Health, Mixer, Trace};
use afbc_types::{PerAxis, Setpoint, State};

/// A controller from measured and wanted motion to rotor speeds.
///
/// A controller is checked when it is built and fixed from then on; what changes in flight is in its memory. One step
/// is called every [`dt_s`](FlightController::dt_s) seconds.
///
/// ```
/// use afbc_control::{Action, FlightController, Mixer, Screened, Trace};
/// use afbc_types::{Inputs, OutOfRange, Parameters, Setpoint, State};
///
/// /// Rotors that carry the weight, and nothing else.
/// struct Float(Mixer);
///
/// impl FlightController for Float {
///     type Memory = ();
///
///     fn dt_s(&self) -> f32 {
///         0.001
///     }
///
///     fn mixer(&self) -> &Mixer {
///         &self.0
///     }
///
///     fn decide(&self, (): &mut (), _: &State, _: &Setpoint, _fresh: bool) -> Action {
///         self.0.action(&Inputs { thrust_n: 0.486 * 9.81, ..Inputs::default() })
///     }
///
///     fn trace((): &()) -> Trace {
///         Trace::default()
///     }
/// }
///
/// let float = Float(Mixer::new(&Parameters::PAPER.to_f32(), 3.0)?);
/// let mut memory = Screened::default();
/// let action = float.step(&mut memory, Some(&State::default()), &Setpoint::default());
/// assert!((action.forces.0.sum() - 0.486 * 9.81).abs() < 1e-5);
/// # Ok::<(), OutOfRange>(())
/// ```
pub trait FlightController {
    /// What the controller itself remembers between steps.
    type Memory: Copy + Default + core::fmt::Debug;

    /// Time between steps \[s\].
    fn dt_s(&self) -> f32;

    /// How it shares its inputs out among the rotors.
    fn mixer(&self) -> &Mixer;

    /// The decision of one step, from a plausible state and setpoint ([`State::is_plausible`],
    /// [`Setpoint::is_plausible`]). If the state is not `fresh` but an old one, nothing is learnt, integrated or filtered
    /// from it. Cannot fail or panic; gives finite rotor speeds within their limits.
    fn decide(&self, memory: &mut Self::Memory, state: &State, setpoint: &Setpoint, fresh: bool) -> Action;

    /// One step from what was measured, if anything was, finite or not: [`FlightController::decide`] behind a
    /// [`Screen`](crate::Screen). [`Action::health`] tells what was not plausible.
    // Always: copying the action out of a call costs a tenth of a closed-loop step.
    #[inline(always)]
    fn step(&self, memory: &mut Screened<Self::Memory>, measured: Option<&State>, setpoint: &Setpoint) -> Action {
        let mut screened = Health::default();
        let (screen, control) = memory.parts();
        let Some((state, setpoint)) = screen.pass(measured, setpoint, &mut screened) else {
            return Action { health: screened, ..Action::default() };
        };
        let mut action = self.decide(control, &state, &setpoint, !screened.state_rejected);
        action.health.state_rejected = screened.state_rejected;
        action.health.setpoint_rejected = screened.setpoint_rejected;
        action
    }

    /// Why the last step decided as it did.
    fn trace(memory: &Self::Memory) -> Trace;

    /// What `memory` holds in AFBC's terms; zero for a controller that learns nothing.
    fn learnt(_memory: &Self::Memory) -> PerAxis<Estimate> {
        PerAxis::default()
    }

    /// Gives the flight back to a controller that has fallen back on another law, without a jump of its inputs; true if it
    /// had. Does nothing to one that has not.
    fn engage(&self, _memory: &mut Self::Memory) -> bool {
        false
    }
}
