//! Search for gains. Every law gets the same flights, cost, search and number of tries.
//!
//! `docs/tuning.md` describes the search and its results.
#![forbid(unsafe_code)]

mod builder;
mod cma_es;
mod conditions;
mod cost;
mod fast;
pub mod fleet;
mod flights;
mod gains;
mod report;
mod scale;
mod search;
mod start;

pub use builder::is_paper;
pub use conditions::{Condition, conditions, conditions_on, factor};
pub use cost::{JUMP_N, LOST, POSITION_M, WORST_M, YAW_RAD, cost, costs, mean};
pub use flights::{held_out, held_out_on, training, training_on};
pub use gains::{GainChange, found_text, fragment};
pub use report::report;
pub use search::{STEP, SearchOptions, SearchResult, search};
pub use start::{by_hand, by_hand_on};
