//! What every controller of this project looks like from outside, so that one harness, one tuner and one campaign fly
//! them all.

use crate::adaptive::Estimate;
use crate::cascade::{Cascade, Command, Controller, Health, Law};
use crate::screen::Screen;
use afbc_types::{PerAxis, Setpoint, State};

/// What a controller remembers between steps: the last plausible input, and its own.
///
/// The default is that of a controller that has not flown yet.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Memory<M> {
    screen: Screen,
    /// Of the controller behind the screen.
    pub control: M,
}

/// A controller from measured and wanted motion to rotor speeds.
///
/// A controller is checked when it is built and fixed from then on; what changes in flight is in its [`Memory`]. One step
/// is called every `dt_s` seconds of its settings.
///
/// ```
/// use afbc::{Backstepping, Controller, FlightController, Memory, Profile};
/// use afbc_types::{OutOfRange, Parameters, PerAxis, Setpoint, State};
///
/// fn first_thrust_n<C: FlightController>(controller: &C) -> f32 {
///     controller.step(&mut Memory::default(), &State::default(), &Setpoint::default()).inputs.thrust_n
/// }
///
/// let vehicle = Parameters::PAPER.to_f32();
/// let gains = PerAxis::from_fn(|axis| Profile::Paper.gains().get(axis).backstepping);
/// let controller = Controller::new(vehicle, Profile::Paper.settings(), Backstepping::new(&vehicle, gains)?)?;
/// assert!((first_thrust_n(&controller) - 0.486 * 9.81).abs() < 1e-5); // nothing to correct: the weight
/// # Ok::<(), OutOfRange>(())
/// ```
pub trait FlightController {
    /// What the controller itself remembers between steps.
    type Memory: Copy + Default + core::fmt::Debug;

    /// The decision of one step, from a plausible state and setpoint ([`State::is_plausible`],
    /// [`Setpoint::is_plausible`]). If the state is not `fresh` but an old one, nothing is learnt, integrated or filtered
    /// from it. Cannot fail or panic; gives finite rotor speeds within their limits.
    fn decide(&self, memory: &mut Self::Memory, state: &State, setpoint: &Setpoint, fresh: bool) -> Command;

    /// One step from any input, finite or not: [`FlightController::decide`] behind a [`Screen`]. [`Command::health`] tells
    /// what was not plausible.
    // Always: copying the command out of a call costs a tenth of a closed-loop step.
    #[inline(always)]
    fn step(&self, memory: &mut Memory<Self::Memory>, state: &State, setpoint: &Setpoint) -> Command {
        let mut screened = Health::default();
        let Some((state, setpoint)) = memory.screen.pass(state, setpoint, &mut screened) else {
            return Command { health: screened, ..Command::default() };
        };
        let mut command = self.decide(&mut memory.control, &state, &setpoint, !screened.state_rejected);
        command.health.state_rejected = screened.state_rejected;
        command.health.setpoint_rejected = screened.setpoint_rejected;
        command
    }

    /// Gives the flight back to a controller that has fallen back on another law, without a jump of its inputs; true if it
    /// had. Does nothing to one that has not.
    fn engage(&self, _memory: &mut Self::Memory) -> bool {
        false
    }

    /// What `memory` holds in AFBC's terms, for logs and monitors; zero for a controller that learns nothing.
    fn learnt(_memory: &Self::Memory) -> PerAxis<Estimate> {
        PerAxis::default()
    }
}

impl<L: Law> FlightController for Controller<L> {
    type Memory = Cascade<L::Estimate>;

    #[inline(always)]
    fn decide(&self, memory: &mut Self::Memory, state: &State, setpoint: &Setpoint, fresh: bool) -> Command {
        self.cascade(memory, state, setpoint, fresh)
    }

    fn learnt(memory: &Self::Memory) -> PerAxis<Estimate> {
        PerAxis::from_fn(|axis| L::learnt(memory.estimates.get(axis)))
    }
}
