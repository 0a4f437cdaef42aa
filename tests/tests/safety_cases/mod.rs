//! Faults, and the expected result of each.

mod case;
mod pairs;
mod singles;

pub(crate) use case::{Case, Do, Start};

/// Returns all cases.
pub(crate) fn cases() -> Vec<Case> {
    [singles::cases(), pairs::cases()].concat()
}
