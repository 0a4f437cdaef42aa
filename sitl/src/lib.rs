//! Software in the loop: scenarios, lockstep flights, logs, figures. See the `sitl` binary for the command line.

pub mod aboard;
pub mod campaign;
pub mod claims;
pub mod compare;
pub mod contender;
pub mod flight;
pub mod in_the_loop;
pub mod metrics;
pub mod output;
pub mod paper;
pub mod results;
pub mod run;
pub mod scenario;
pub mod subject;
pub mod trajectory;
pub mod tune;
