//! Software in the loop: scenarios, lockstep flights, logs, figures. See the `sitl` binary for the command line.

pub mod flight;
pub mod metrics;
pub mod paper;
pub mod scenario;
pub mod trajectory;
