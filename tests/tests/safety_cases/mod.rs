//! The faults, and what is expected of each.

mod case;
mod pairs;
mod singles;

pub(crate) use case::{Case, Do, Start};

/// Every case.
pub(crate) fn cases() -> Vec<Case> {
    [singles::cases(), pairs::cases()].concat()
}
