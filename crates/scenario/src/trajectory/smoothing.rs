//! Smooths samples that were rounded when they were written, such as positions with three decimals at 30 Hz.
//!
//! A curve through rounded samples has derivatives that the vehicle's path never had: a rounding of 1 mm at 30 Hz makes
//! hundreds of m/s4 of snap. This curve passes within the rounding instead. It is a spline of degree seven with evenly
//! spaced knots and a penalty (a P-spline: Eilers and Marx, *Flexible smoothing with B-splines and penalties*,
//! Statistical Science 11, 1996), whose coefficients c minimise
//!
//! ```text
//! sum over samples ((p(t) - y) / sigma)^2 + lambda sum over k (c_k - 4 c_(k+1) + 6 c_(k+2) - 4 c_(k+3) + c_(k+4))^2
//! ```
//!
//! with the standard deviation sigma = unit / sqrt(12) of a rounding to multiples of `unit`. lambda is the largest one
//! for which the errors of every column are no larger than those of rounding.

use super::polynomial::{COEFFICIENTS, PolynomialCoefficients, PolynomialPiece, derivatives};

/// Coefficients that one sample depends on, and the width of the equations' upper band.
const BAND: usize = COEFFICIENTS;
/// Coefficients of the penalised difference.
const DIFFERENCE: [f64; 5] = [1.0, -4.0, 6.0, -4.0, 1.0];
/// Largest snap that a rounding may cause without being smoothed \[m/s4\].
const SNAP_M_S4: f64 = 1.0;
/// Root of the sum of the squares of the fourth difference's coefficients.
const AMPLIFICATION: f64 = 8.366_600_265_340_756;
/// Searched exponents of lambda, and number of bisections.
const EXPONENTS: [f64; 2] = [-9.0, 9.0];
const BISECTIONS: usize = 14;
/// Largest mean square of the errors over that of rounding. Larger ones have another cause.
const SQUARE_MAX: f64 = 1.5;
/// Largest number of knots for each sample. Samples with wider gaps are not smoothed.
const KNOTS_PER_SAMPLE: usize = 4;

/// A column of samples: a coordinate or one of its derivatives.
#[derive(Clone, Copy, Debug)]
pub struct RoundedColumn<'a> {
    /// Order of the derivative: 0 for the coordinate.
    pub order: usize,
    /// Samples.
    pub values: &'a [f64],
    /// The values are rounded to multiples of this unit.
    pub unit: f64,
}

/// Returns true if a rounding of coordinates to multiples of `unit`, sampled every `step_s`, disturbs the snap.
pub fn disturbs(unit: f64, step_s: f64) -> bool {
    AMPLIFICATION * unit > SNAP_M_S4 * step_s.powi(4)
}

/// Returns the median of the steps between increasing times.
pub fn median_step(times: &[f64]) -> f64 {
    let mut steps: Vec<f64> = times.iter().zip(times.iter().skip(1)).map(|(a, b)| b - a).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(0.0)
}

/// Returns smooth pieces near the samples of four coordinates at these increasing times. Returns none if no smooth
/// curve is as near as rounded samples must be.
pub fn smoothed(times: &[f64], axes: [&[RoundedColumn<'_>]; 4]) -> Option<Vec<PolynomialPiece>> {
    let (first_s, last_s) = (times.first()?, times.last()?);
    let step_s = median_step(times);
    let count = ((last_s - first_s) / step_s).ceil().max(1.0);
    if !(step_s > 0.0 && count <= (times.len() * KNOTS_PER_SAMPLE) as f64) {
        return None;
    }
    // The last sample lies at the end of the last piece.
    let knots = Knots { first_s: *first_s, step_s: (last_s - first_s) / count, count: count as usize, basis: basis() };
    let splines = axes.map(|columns| knots.fit(times, columns));
    let mut pieces = Vec::with_capacity(knots.count);
    for piece in 0..knots.count {
        let mut coefficients = [[0.0; COEFFICIENTS]; 4];
        for (to, spline) in coefficients.iter_mut().zip(&splines) {
            *to = knots.polynomial(spline.as_ref()?.get(piece..piece + BAND)?);
        }
        let start_s = knots.first_s + knots.step_s * piece as f64;
        pieces.push(PolynomialPiece { start_s, duration_s: knots.step_s, coefficients });
    }
    Some(pieces)
}

/// Evenly spaced knots of a spline of degree seven.
struct Knots {
    first_s: f64,
    step_s: f64,
    /// Number of pieces.
    count: usize,
    basis: [PolynomialCoefficients; BAND],
}

/// Returns the eight pieces of the B-spline of degree seven, as polynomials of the time since the piece's start, in
/// steps.
/// The recursion of Cox and de Boor on even knots: d N_d(x) = x N_(d-1)(x) + (d + 1 - x) N_(d-1)(x - 1).
fn basis() -> [PolynomialCoefficients; BAND] {
    let mut pieces = [[0.0; COEFFICIENTS]; BAND];
    pieces[0][0] = 1.0;
    for degree in 1..BAND {
        let lower = pieces;
        let d = degree as f64;
        for (j, piece) in pieces.iter_mut().enumerate() {
            *piece = [0.0; COEFFICIENTS];
            let start = j as f64;
            // x = j + u: the first factor is (j + u) / d, the second one (d + 1 - j - u) / d.
            let mut add = |of: Option<&PolynomialCoefficients>, constant: f64, slope: f64| {
                for (power, coefficient) in of.into_iter().flatten().enumerate() {
                    if let Some(to) = piece.get_mut(power) {
                        *to += coefficient * constant / d;
                    }
                    if let Some(to) = piece.get_mut(power + 1) {
                        *to += coefficient * slope / d;
                    }
                }
            };
            add(lower.get(j), start, 1.0);
            add(j.checked_sub(1).and_then(|j| lower.get(j)), d + 1.0 - start, -1.0);
        }
    }
    pieces
}

/// A sample's equation: the first coefficient it depends on, the weights of eight coefficients, the value, and the
/// inverse of the rounding's standard deviation.
struct Observation {
    first: usize,
    weights: [f64; BAND],
    value: f64,
    inverse_sigma: f64,
    unit: f64,
}

impl Observation {
    /// Returns the difference of the spline from the sample.
    fn error(&self, spline: &[f64]) -> f64 {
        let of = spline.get(self.first..).unwrap_or_default();
        self.weights.iter().zip(of).map(|(weight, c)| weight * c).sum::<f64>() - self.value
    }
}

/// Symmetric banded equations: row i holds the elements (i, i) to (i, i + 7).
type BandedEquations = Vec<[f64; BAND]>;

impl Knots {
    /// Returns the coefficients of the smoothest spline near the columns, or none if none is near enough.
    fn fit(&self, times: &[f64], columns: &[RoundedColumn<'_>]) -> Option<Vec<f64>> {
        let observed: Vec<Vec<Observation>> = columns.iter().map(|column| self.observations(times, column)).collect();
        let (mut data, mut known) = (vec![[0.0; BAND]; self.count + BAND - 1], vec![0.0; self.count + BAND - 1]);
        for observation in observed.iter().flatten() {
            let weight = observation.inverse_sigma * observation.inverse_sigma;
            for (i, own) in observation.weights.iter().enumerate() {
                let (row, right) = (data.get_mut(observation.first + i)?, known.get_mut(observation.first + i)?);
                *right += weight * own * observation.value;
                for (element, other) in row.iter_mut().zip(observation.weights.iter().skip(i)) {
                    *element += weight * own * other;
                }
            }
        }
        let scale = data.iter().map(|row| row[0]).sum::<f64>() / data.len() as f64;
        let spline = |exponent: f64| solve(&penalised(&data, scale * 10_f64.powf(exponent)), &known);
        let [mut low, mut high] = EXPONENTS;
        let mut best = spline(low);
        // By chance, the errors of rounding may be a little larger than expected.
        let limits = observed.iter().map(|column| {
            let least = mean_square(column, &best).filter(|least| *least <= SQUARE_MAX)?;
            Some((1.1 * least).max(1.0))
        });
        let limits: Vec<f64> = limits.collect::<Option<_>>()?;
        let is_near = |spline: &[f64]| {
            observed.iter().zip(&limits).all(|(column, most)| mean_square(column, spline).is_some_and(|e| e <= *most))
        };
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            let tried = spline(middle);
            if is_near(&tried) {
                (low, best) = (middle, tried);
            } else {
                high = middle;
            }
        }
        Some(best)
    }

    fn observations(&self, times: &[f64], column: &RoundedColumn<'_>) -> Vec<Observation> {
        let inverse_sigma = 12_f64.sqrt() / column.unit;
        let observation = |(time_s, value): (&f64, &f64)| {
            let steps = (time_s - self.first_s) / self.step_s;
            let first = (steps as usize).min(self.count - 1);
            let u = steps - first as f64;
            let scale = self.step_s.powi(-(column.order as i32));
            // The first of the eight coefficients belongs to the B-spline that ends with this piece.
            let mut weights = [0.0; BAND];
            for (weight, piece) in weights.iter_mut().zip(self.basis.iter().rev()) {
                *weight = derivatives(piece, u).get(column.order).copied().unwrap_or_default() * scale;
            }
            Observation { first, weights, value: *value, inverse_sigma, unit: column.unit }
        };
        times.iter().zip(column.values).map(observation).collect()
    }

    /// Returns the polynomial of a piece, from its eight coefficients.
    fn polynomial(&self, spline: &[f64]) -> PolynomialCoefficients {
        let mut polynomial = [0.0; COEFFICIENTS];
        for (c, piece) in spline.iter().zip(self.basis.iter().rev()) {
            let mut scale = *c;
            for (to, coefficient) in polynomial.iter_mut().zip(piece) {
                *to += scale * coefficient;
                scale /= self.step_s;
            }
        }
        polynomial
    }
}

/// Returns the mean square of a column's errors, over that of rounding; none if an error is larger than a whole unit.
fn mean_square(column: &[Observation], spline: &[f64]) -> Option<f64> {
    let mut squares = 0.0;
    for observation in column {
        let error = observation.error(spline);
        if error.is_nan() || error.abs() > observation.unit {
            return None;
        }
        squares += (error * observation.inverse_sigma).powi(2);
    }
    Some(squares / column.len() as f64)
}

/// Returns the equations with the penalty on the fourth differences.
fn penalised(data: &BandedEquations, lambda: f64) -> BandedEquations {
    let mut equations = data.clone();
    for k in 0..equations.len().saturating_sub(DIFFERENCE.len() - 1) {
        for (i, own) in DIFFERENCE.iter().enumerate() {
            let Some(row) = equations.get_mut(k + i) else { continue };
            for (element, other) in row.iter_mut().zip(DIFFERENCE.iter().skip(i)) {
                *element += lambda * own * other;
            }
        }
    }
    equations
}

/// Solves symmetric positive banded equations by elimination, with one step of iterative refinement.
fn solve(equations: &BandedEquations, known: &[f64]) -> Vec<f64> {
    let mut eliminated = equations.clone();
    for i in 0..eliminated.len() {
        let (before, after) = eliminated.split_at_mut(i + 1);
        let Some(pivot) = before.last() else { continue };
        for ((j, factor), row) in pivot.iter().enumerate().skip(1).zip(after) {
            let factor = factor / pivot[0];
            row.iter_mut().zip(pivot.iter().skip(j)).for_each(|(element, above)| *element -= factor * above);
        }
    }
    let mut solution = substituted(&eliminated, known.to_vec());
    let product = times(equations, &solution);
    let left = known.iter().zip(product).map(|(known, product)| known - product).collect();
    solution.iter_mut().zip(substituted(&eliminated, left)).for_each(|(c, more)| *c += more);
    solution
}

/// Returns the solution of eliminated equations for this right side.
fn substituted(eliminated: &BandedEquations, mut right: Vec<f64>) -> Vec<f64> {
    for (i, row) in eliminated.iter().enumerate() {
        let (before, after) = right.split_at_mut(i + 1);
        let Some(own) = before.last() else { continue };
        row.iter().skip(1).zip(after).for_each(|(element, below)| *below -= element / row[0] * own);
    }
    for (i, row) in eliminated.iter().enumerate().rev() {
        let (before, after) = right.split_at_mut(i + 1);
        let Some(own) = before.last_mut() else { continue };
        let known: f64 = row.iter().skip(1).zip(after.iter()).map(|(element, c)| element * c).sum();
        *own = (*own - known) / row[0];
    }
    right
}

/// Returns the product of symmetric banded equations with a vector.
fn times(equations: &BandedEquations, vector: &[f64]) -> Vec<f64> {
    let mut product = vec![0.0; vector.len()];
    for (i, row) in equations.iter().enumerate() {
        for (j, element) in row.iter().enumerate() {
            let (Some(own), Some(other)) = (vector.get(i), vector.get(i + j)) else { continue };
            if let Some(to) = product.get_mut(i) {
                *to += element * other;
            }
            if let (1.., Some(to)) = (j, product.get_mut(i + j)) {
                *to += element * own;
            }
        }
    }
    product
}
