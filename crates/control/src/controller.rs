//! Interface of all controllers, so that the same test harness, tuner and campaign can fly any of them.

use crate::screen::Validated;
use crate::{Action, Health, Mixer, Trace};
use afbc_types::{Setpoint, State};

/// A controller: computes the speeds of `N` rotors from the measured state and the setpoint.
///
/// A controller is validated when it is built, and immutable afterwards. Everything that changes in flight is in its
/// memory. Call [`step`](FlightController::step) every [`dt_s`](FlightController::dt_s) seconds.
///
/// ```
/// use afbc_control::{Action, FlightController, Mixer, Validated, Trace};
/// use afbc_types::{Inputs, OutOfRange, Parameters, Setpoint, State};
///
/// /// Carries the weight and does nothing else.
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
/// let float = Float(Mixer::new(Parameters::PAPER.to_f32(), 3.0)?);
/// let mut memory = Validated::default();
/// let action = float.step(&mut memory, Some(&State::default()), &Setpoint::default());
/// assert!((action.forces.0.sum() - 0.486 * 9.81).abs() < 1e-5);
/// # Ok::<(), OutOfRange>(())
/// ```
pub trait FlightController<const N: usize = 4> {
    /// Memory of the controller between steps.
    type Memory: Copy + Default + core::fmt::Debug + 'static;

    /// Returns the time between steps \[s\].
    fn dt_s(&self) -> f32;

    /// Returns the mixer that allocates the inputs to the rotors.
    fn mixer(&self) -> &Mixer<N>;

    /// Computes the action of one step from a plausible state and setpoint ([`State::is_plausible`],
    /// [`Setpoint::is_plausible`]). If the state is repeated instead of `fresh`, no estimate, integral or measurement
    /// filter is updated. Does not fail or panic. The rotor speeds are finite and within their limits.
    fn decide(&self, memory: &mut Self::Memory, state: &State, setpoint: &Setpoint, fresh: bool) -> Action<N>;

    /// Announces that the vehicle stands on the ground before a take-off. The law must not learn the moments with which
    /// the ground holds the feet.
    fn on_ground(&self, _memory: &mut Self::Memory) {}

    /// Announces that the position is lost: the horizontal motion of the next state is reckoned instead of measured.
    /// The law must not learn from it.
    fn position_lost(&self, _memory: &mut Self::Memory) {}

    /// Runs one step from a measurement that may be missing, implausible or not finite: [`FlightController::decide`]
    /// behind a [`Screen`](crate::Screen). [`Action::health`] reports rejected inputs.
    // This function is always inlined: copying the action out of a call costs a tenth of a closed-loop step.
    #[inline(always)]
    fn step(&self, memory: &mut Validated<Self::Memory>, measured: Option<&State>, setpoint: &Setpoint) -> Action<N> {
        let mut screened = Health::default();
        let (screen, control) = memory.parts();
        let Some((state, setpoint)) = screen.pass(measured, setpoint, &mut screened) else {
            return Action { health: screened, ..Action::default() };
        };
        let mut action = self.decide(control, state, setpoint, !screened.state_rejected);
        action.health.state_rejected = screened.state_rejected;
        action.health.setpoint_rejected = screened.setpoint_rejected;
        action
    }

    /// Returns the internal signals of the last step.
    fn trace(memory: &Self::Memory) -> Trace;

    /// Returns from a fallback law to the controller's own, without a jump of the inputs. Returns true if the fallback
    /// was active; otherwise nothing changes.
    fn engage(&self, _memory: &mut Self::Memory) -> bool {
        false
    }
}
