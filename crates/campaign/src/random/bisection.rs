//! Bisection.

/// Returns the largest number up to `most` that `fits`, if smaller ones fit whenever larger ones do; 0 if none does.
pub(super) fn largest(most: f64, fits: impl Fn(f64) -> bool) -> f64 {
    if fits(most) {
        return most;
    }
    let (mut low, mut high) = (0.0, most);
    // Leaves a share of 2^-40 of the interval, less than matters to a flight.
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if fits(middle) { low = middle } else { high = middle }
    }
    low
}
