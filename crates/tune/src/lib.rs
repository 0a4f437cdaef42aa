//! Finding gains, in one way for every law: the same flights, the same cost, the same search, the same effort.
//!
//! `docs/tuning.md` says what that is and what came of it.
#![forbid(unsafe_code)]

mod cma_es;
mod cost;
mod flights;
mod gains;
mod report;
mod search;
mod start;

pub use cost::{JUMP_N, LOST, POSITION_M, WORST_M, YAW_RAD, cost, costs, mean};
pub use flights::{held_out, training};
pub use gains::{Change, fragment};
pub use report::report;
pub use search::{Found, search};
pub use start::by_hand;
