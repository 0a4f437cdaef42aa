//! What can be done with a controller, whichever law it has.

use afbc_control::FlightController;
use afbc_types::OutOfRange;

/// A task that can be run with a controller of any type.
pub trait Task {
    /// Result of the task.
    type Output;

    /// Runs the task.
    ///
    /// # Errors
    /// A further value out of range.
    fn with<C, const N: usize>(self, controller: C) -> Result<Self::Output, OutOfRange>
    where
        C: FlightController<N> + Clone + 'static;
}
