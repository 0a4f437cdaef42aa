//! The control tick of a vehicle with any number of rotors, for hosts. A firmware image knows its vehicle's number, and
//! uses [`Flight`].

use crate::configuration::Configuration;
use crate::control_inputs::ControlInputs;
use crate::flight::{Flight, Prepared};
use crate::imu_selector::ImuSelector;
use crate::law::FlightLaw;
use crate::readings::Readings;
use crate::tick_record::{Report, TickBefore, TickDetails, TickInputs};
use afbc::{AdaptiveEstimate, Guarded};
use afbc_control::Trace;
use afbc_estimator::VelocityNotch;
use afbc_types::{OutOfRange, PerAxis};

/// Builds flights from configurations, under a law of its choice.
pub trait Prepare {
    /// The law of a vehicle with `N` rotors.
    type Law<const N: usize>: FlightLaw<N>;

    /// Prepares a flight.
    ///
    /// # Errors
    /// The first parameter out of range. Also if there are not `N` rotors.
    fn prepare<const N: usize>(&self, configuration: &Configuration) -> Result<Prepared<N, Self::Law<N>>, OutOfRange>;
}

/// Prepares flights under the firmware's own law.
impl Prepare for () {
    type Law<const N: usize> = Guarded<N>;

    fn prepare<const N: usize>(&self, configuration: &Configuration) -> Result<Prepared<N>, OutOfRange> {
        Prepared::new(configuration)
    }
}

/// A [`Flight`] of four to eight rotors, under the law of `P`. No other host code knows the number of rotors.
#[derive(Clone)]
#[allow(clippy::large_enum_variant, reason = "one per vehicle")]
#[expect(missing_docs, reason = "named after the number of rotors")]
pub enum AnyFlight<P: Prepare = ()> {
    Four(Flight<4, P::Law<4>>),
    Five(Flight<5, P::Law<5>>),
    Six(Flight<6, P::Law<6>>),
    Seven(Flight<7, P::Law<7>>),
    Eight(Flight<8, P::Law<8>>),
}

/// Evaluates an expression for the flight, whatever its number of rotors is.
macro_rules! each {
    ($any:expr, $flight:ident => $body:expr) => {
        match $any {
            AnyFlight::Four($flight) => $body,
            AnyFlight::Five($flight) => $body,
            AnyFlight::Six($flight) => $body,
            AnyFlight::Seven($flight) => $body,
            AnyFlight::Eight($flight) => $body,
        }
    };
}

// Long functions are not inlined, so that other crates share their code instead of compiling it again.
impl<P: Prepare> AnyFlight<P> {
    /// Creates the vehicle, disarmed.
    ///
    /// # Errors
    /// The first parameter out of range.
    #[inline(never)]
    pub fn new(prepare: &P, configuration: &Configuration) -> Result<Self, OutOfRange> {
        Ok(match configuration.rotors.count() {
            4 => AnyFlight::Four(Flight::of(prepare.prepare(configuration)?)),
            5 => AnyFlight::Five(Flight::of(prepare.prepare(configuration)?)),
            6 => AnyFlight::Six(Flight::of(prepare.prepare(configuration)?)),
            7 => AnyFlight::Seven(Flight::of(prepare.prepare(configuration)?)),
            // Eight: `Rotors` has no other number.
            _ => AnyFlight::Eight(Flight::of(prepare.prepare(configuration)?)),
        })
    }

    /// Does the same as [`Flight::adopt`].
    ///
    /// # Errors
    /// The first parameter out of range.
    #[inline(never)]
    pub fn adopt(&mut self, prepare: &P, configuration: &Configuration) -> Result<bool, OutOfRange> {
        each!(self, flight => Ok(flight.adopt(&prepare.prepare(configuration)?)))
    }

    /// Does the same as [`Flight::change_law`].
    ///
    /// # Errors
    /// The first parameter out of range.
    #[inline(never)]
    pub fn change_law(&mut self, prepare: &P, configuration: &Configuration) -> Result<(), OutOfRange> {
        each!(self, flight => flight.change_law(&prepare.prepare(configuration)?));
        Ok(())
    }

    /// Does the same as [`Flight::tick`].
    #[inline(never)]
    pub fn tick(&mut self, now_us: u64, inputs: &mut ControlInputs, readings: &Readings) -> Report {
        each!(self, flight => flight.tick(now_us, inputs, readings))
    }

    /// Does the same as [`Flight::before`].
    pub fn before(&self, messages: &ControlInputs) -> TickBefore {
        each!(self, flight => flight.before(messages))
    }

    /// Does the same as [`Flight::details`].
    #[inline(never)]
    pub fn details(&self, inputs: &TickInputs, before: &TickBefore, messages: &ControlInputs) -> TickDetails {
        each!(self, flight => flight.details(inputs, before, messages))
    }

    /// Does the same as [`Flight::cross_check`].
    #[inline(never)]
    pub fn cross_check(&self, selector: &mut ImuSelector, readings: &Readings) {
        each!(self, flight => flight.cross_check(selector, readings))
    }

    /// Does the same as [`Flight::move_notch`].
    pub fn move_notch(&mut self, to: &VelocityNotch) {
        each!(self, flight => flight.move_notch(to))
    }

    /// Does the same as [`Flight::distrust_clock`].
    pub fn distrust_clock(&mut self) {
        each!(self, flight => flight.distrust_clock())
    }

    /// Does the same as [`Flight::trace`].
    #[inline(never)]
    pub fn trace(&self) -> Trace {
        each!(self, flight => flight.trace())
    }

    /// Does the same as [`Flight::estimates`].
    pub fn estimates(&self) -> Option<PerAxis<AdaptiveEstimate>> {
        each!(self, flight => flight.estimates())
    }
}
