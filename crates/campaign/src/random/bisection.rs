//! Bisection for the largest number that fits.

/// Returns the largest number from 0 to `most` that `fits`, or 0 if none does. Assumes that all smaller numbers fit if
/// a larger one does.
pub(super) fn largest(most: f64, fits: impl Fn(f64) -> bool) -> f64 {
    if fits(most) {
        return most;
    }
    let (mut low, mut high) = (0.0, most);
    // 40 halvings leave 2^-40 of the interval, too little to matter to a flight.
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if fits(middle) { low = middle } else { high = middle }
    }
    low
}
