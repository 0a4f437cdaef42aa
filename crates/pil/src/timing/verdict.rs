//! Compares late rows with the known ones.

use super::known::KnownLateness;
use super::work::TimingRow;

/// Returns a line for each row that is late but not known to be, later than known, or known to be late but in time.
#[must_use]
pub fn verdicts(known: &[KnownLateness], best: &[TimingRow], bound: &[TimingRow]) -> Vec<String> {
    let mut wrong = Vec::new();
    for (best, bound) in best.iter().zip(bound) {
        let name = bound.name;
        match (bound.is_late(), known.iter().find(|known| known.row == name)) {
            (false, None) => (),
            (false, Some(_)) => {
                wrong.push(format!("{name}: listed as late, but in time; delete the entry in known.rs"))
            }
            (true, None) => wrong.push(format!("{name}: over its deadline")),
            (true, Some(known)) => {
                // A response without a bound is later than any limit.
                let is_later = known
                    .most_us
                    .is_some_and(|most_us| bound.response_ns.is_none_or(|response_ns| response_ns > 1000 * most_us));
                if is_later {
                    wrong.push(format!("{name}: later than known.rs allows"));
                }
                if best.is_late() && !known.at_best {
                    wrong.push(format!("{name}: late even in the best case"));
                }
            }
        }
    }
    let rows = |known: &&KnownLateness| bound.iter().all(|row| row.name != known.row);
    wrong.extend(
        known
            .iter()
            .filter(rows)
            .map(|known| format!("{}: listed in known.rs as late, but there is no such task", known.row)),
    );
    wrong
}
