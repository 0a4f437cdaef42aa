//! Check of a condition.

use std::error::Error;

/// Fails with `what` if the condition does not hold.
pub fn check(holds: bool, what: &str) -> Result<(), Box<dyn Error>> {
    if holds { Ok(()) } else { Err(format!("check failed: {what}").into()) }
}
