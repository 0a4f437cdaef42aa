//! Scenarios: one vehicle, one trajectory, one environment, the controllers to compare.
//!
//! A scenario comes from [`crate::paper`], from a file ([`load`]) or from the [`built_in()`] ones.

mod built_in;
mod definition;
mod file;

pub use built_in::{BUILT_IN, built_in, similar_built_in};
pub use definition::{DURATION, Outage, Scenario};
pub use file::{load, parse, read};
