//! Makes a smooth curve through samples.

use super::polynomial::Knot;
use super::smoothing::RoundedColumn;

/// Samples of x, y, z \[m\] and yaw \[rad\] over time, with derivatives where known.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PathSamples {
    /// Increasing times \[s\].
    pub time_s: Vec<f64>,
    /// Values of x, y, z and yaw at these times.
    pub values: [Vec<f64>; 4],
    /// First derivatives, if known.
    pub rates: [Option<Vec<f64>>; 4],
    /// Second derivatives, if known; not used without first derivatives.
    pub accelerations: [Option<Vec<f64>>; 4],
}

impl PathSamples {
    /// Returns the samples as knots. If the first derivatives are unknown, both derivatives come from the natural cubic
    /// spline through the values. If only the second ones are unknown, they come from the natural cubic spline through
    /// the first derivatives.
    pub fn knots(&self) -> Vec<Knot> {
        let axes: Vec<[Vec<f64>; 2]> = (0..4).map(|axis| self.derivatives(axis)).collect();
        let knot = |(i, time_s): (usize, &f64)| {
            let mut values = [[0.0; 3]; 4];
            for (axis, (value, derivatives)) in values.iter_mut().zip(&axes).enumerate() {
                let of = |numbers: &[f64]| numbers.get(i).copied().unwrap_or_default();
                let [rates, accelerations] = derivatives;
                *value = [self.values.get(axis).map_or(0.0, |values| of(values)), of(rates), of(accelerations)];
            }
            Knot { time_s: *time_s, values }
        };
        self.time_s.iter().enumerate().map(knot).collect()
    }

    /// Returns the known columns of each coordinate, rounded to multiples of these units.
    pub fn columns(&self, units: &[[f64; 3]; 4]) -> [Vec<RoundedColumn<'_>>; 4] {
        let mut axes: [Vec<RoundedColumn<'_>>; 4] = Default::default();
        let known = self.values.iter().zip(&self.rates).zip(&self.accelerations);
        for ((axis, ((values, rates), accelerations)), units) in axes.iter_mut().zip(known).zip(units) {
            let columns = [Some(values), rates.as_ref(), accelerations.as_ref()];
            for (order, (values, unit)) in columns.into_iter().zip(units).enumerate() {
                axis.extend(values.map(|values| RoundedColumn { order, values, unit: *unit }));
            }
        }
        axes
    }

    /// Returns first and second derivatives of a coordinate.
    fn derivatives(&self, axis: usize) -> [Vec<f64>; 2] {
        let known = |of: &[Option<Vec<f64>>; 4]| of.get(axis).cloned().flatten();
        let empty = Vec::new();
        let values = self.values.get(axis).unwrap_or(&empty);
        match (known(&self.rates), known(&self.accelerations)) {
            (Some(rates), Some(accelerations)) => [rates, accelerations],
            (Some(rates), None) => {
                let [accelerations, _] = natural(&self.time_s, &rates);
                [rates, accelerations]
            }
            (None, _) => natural(&self.time_s, values),
        }
    }
}

/// Returns first and second derivatives of the natural cubic spline at its points. Thomas' algorithm solves the
/// continuity of the first derivative.
fn natural(times: &[f64], values: &[f64]) -> [Vec<f64>; 2] {
    let steps: Vec<f64> = times.iter().zip(times.iter().skip(1)).map(|(a, b)| b - a).collect();
    let slopes: Vec<f64> =
        values.iter().zip(values.iter().skip(1)).zip(&steps).map(|((a, b), h)| (b - a) / h).collect();
    // Elimination from the left gives second derivatives m_i = known - factor m_(i + 1).
    let mut eliminated = vec![(0.0, 0.0)];
    for ((h, next_h), (slope, next)) in
        steps.iter().zip(steps.iter().skip(1)).zip(slopes.iter().zip(slopes.iter().skip(1)))
    {
        let (factor, known) = eliminated.last().copied().unwrap_or_default();
        let own = 2.0 * (h + next_h) - h * factor;
        eliminated.push((next_h / own, (6.0 * (next - slope) - h * known) / own));
    }
    // The second derivative is zero at both ends.
    eliminated.resize(values.len(), (0.0, 0.0));
    let mut second = vec![0.0; values.len()];
    let mut after = 0.0;
    for (m, (factor, known)) in second.iter_mut().zip(&eliminated).rev() {
        *m = known - factor * after;
        after = *m;
    }
    let mut first: Vec<f64> = Vec::with_capacity(values.len());
    for (i, (h, slope)) in steps.iter().zip(&slopes).enumerate() {
        if let [m, next, ..] = second.get(i..).unwrap_or_default() {
            first.push(slope - h * (2.0 * m + next) / 6.0);
        }
    }
    let end = match (steps.last(), slopes.last(), second.as_slice()) {
        (Some(h), Some(slope), [.., m, last]) => slope + h * (m + 2.0 * last) / 6.0,
        _ => 0.0,
    };
    first.push(end);
    [first, second]
}
