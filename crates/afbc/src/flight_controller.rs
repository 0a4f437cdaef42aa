//! What every controller of this project looks like from outside, so that one harness, one tuner and one campaign fly
//! them all.

use crate::adaptive::Estimate;
use crate::cascade::{Command, Controller, Law, Memory};
use airframe::{PerAxis, Setpoint, State};

/// A controller from measured and wanted motion to rotor speeds.
///
/// A controller is checked when it is built and fixed from then on; what changes in flight is in its `Memory`, whose
/// default is that of a controller that has not flown yet. One step is called every `dt_s` seconds of its settings.
///
/// ```
/// use afbc::{Backstepping, Controller, FlightController, Profile};
/// use airframe::{OutOfRange, Parameters, PerAxis, Setpoint, State};
///
/// fn first_thrust_n<C: FlightController>(controller: &C) -> f32 {
///     controller.step(&mut C::Memory::default(), &State::default(), &Setpoint::default()).inputs.thrust_n
/// }
///
/// let vehicle = Parameters::PAPER.to_f32();
/// let gains = PerAxis::from_fn(|axis| Profile::Paper.gains().get(axis).backstepping);
/// let controller = Controller::new(vehicle, Profile::Paper.settings(), Backstepping::new(&vehicle, gains)?)?;
/// assert!((first_thrust_n(&controller) - 0.486 * 9.81).abs() < 1e-5); // nothing to correct: the weight
/// # Ok::<(), OutOfRange>(())
/// ```
pub trait FlightController {
    /// What the controller remembers between steps.
    type Memory: Copy + Default + core::fmt::Debug;

    /// One step. Cannot fail or panic; gives finite rotor speeds within their limits whatever it is given, and tells in
    /// [`Command::health`] what of it was not plausible.
    fn step(&self, memory: &mut Self::Memory, state: &State, setpoint: &Setpoint) -> Command;

    /// The step behind a [`Screen`](crate::Screen) of the caller's own: state and setpoint must be plausible
    /// ([`State::is_plausible`], [`Setpoint::is_plausible`]).
    fn step_screened(&self, memory: &mut Self::Memory, state: &State, setpoint: &Setpoint) -> Command {
        self.step(memory, state, setpoint)
    }

    /// Gives the flight back to a controller that has fallen back on another law, without a jump of its inputs. Does
    /// nothing to one that has not.
    fn engage(&self, _memory: &mut Self::Memory) {}

    /// What `memory` holds in AFBC's terms, for logs and monitors; zero for a controller that learns nothing.
    fn learnt(_memory: &Self::Memory) -> PerAxis<Estimate> {
        PerAxis::default()
    }
}

impl<L: Law> FlightController for Controller<L> {
    type Memory = Memory<L::Estimate>;

    #[inline(always)]
    fn step(&self, memory: &mut Self::Memory, state: &State, setpoint: &Setpoint) -> Command {
        Controller::step(self, memory, state, setpoint)
    }

    #[inline(always)]
    fn step_screened(&self, memory: &mut Self::Memory, state: &State, setpoint: &Setpoint) -> Command {
        Controller::step_screened(self, memory, state, setpoint)
    }

    fn learnt(memory: &Self::Memory) -> PerAxis<Estimate> {
        PerAxis::from_fn(|axis| L::learnt(memory.estimates.get(axis)))
    }
}
