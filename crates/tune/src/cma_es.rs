//! Separable CMA-ES: an evolution strategy that adapts its step size along each coordinate.
//!
//! The algorithm is from R. Ros, N. Hansen, *A simple modification in CMA-ES achieving linear time and space
//! complexity*, PPSN X, 2008, the constants from N. Hansen, *The CMA evolution strategy: a tutorial*, 2016. A thousand
//! evaluations are too few to learn a full covariance matrix of some twenty gains, and gains differ mainly in scale.
//!
//! Libraries use the platform's logarithms and exponentials, and a difference in the last bit soon changes the whole
//! search. With this implementation the same seed gives the same search on every machine.

use afbc_plant::noise::{Noise, NoiseStream};
use libm::{exp, log, sqrt};

/// A search for the minimum of a function of several numbers.
#[derive(Clone, Debug)]
pub(super) struct CmaEs {
    coordinates: Vec<SearchCoordinate>,
    /// Step size sigma.
    step: f64,
    generation: u32,
    noise: Noise,
}

/// State of the search along one coordinate.
#[derive(Clone, Copy, Debug)]
struct SearchCoordinate {
    mean: f64,
    /// Diagonal element of the covariance matrix C.
    variance: f64,
    /// Element of p_sigma, the recent movement of the mean, measured in steps.
    step_path: f64,
    /// Element of p_c, the recent movement of the mean, not scaled by the variance.
    path: f64,
}

impl CmaEs {
    /// Starts a search at `start` with the initial step size `step` in every coordinate.
    pub(super) fn new(start: &[f64], step: f64, seed: u64) -> Self {
        let at = |&mean: &f64| SearchCoordinate { mean, variance: 1.0, step_path: 0.0, path: 0.0 };
        let noise = Noise::new(seed, NoiseStream::Scenario);
        CmaEs { coordinates: start.iter().map(at).collect(), step, generation: 0, noise }
    }

    /// Returns the mean of the search.
    pub(super) fn mean(&self) -> Vec<f64> {
        self.coordinates.iter().map(|coordinate| coordinate.mean).collect()
    }

    /// Returns the number of points per generation.
    pub(super) fn population(&self) -> usize {
        4 + (3.0 * log(self.coordinates.len().max(1) as f64)) as usize
    }

    /// Draws the points of the next generation.
    pub(super) fn ask(&mut self) -> Vec<Vec<f64>> {
        let population = self.population();
        let CmaEs { coordinates, step, noise, .. } = self;
        let point = |_| coordinates.iter().map(|c| c.mean + *step * sqrt(c.variance) * noise.normal()).collect();
        (0..population).map(point).collect()
    }

    /// Updates the search with the points of one generation, best first.
    pub(super) fn tell(&mut self, ranked: &[Vec<f64>]) {
        let n = self.coordinates.len() as f64;
        let weights = weights(ranked.len());
        let effective = 1.0 / weights.iter().map(|weight| weight * weight).sum::<f64>();

        // Learning rates. A diagonal C allows larger ones.
        let c_step = (effective + 2.0) / (n + effective + 5.0);
        let damping = 1.0 + c_step + 2.0 * (sqrt((effective - 1.0) / (n + 1.0)) - 1.0).max(0.0);
        let c_path = (4.0 + effective / n) / (n + 4.0 + 2.0 * effective / n);
        let faster = (n + 2.0) / 3.0;
        let c_one = (faster * 2.0 / ((n + 1.3) * (n + 1.3) + effective)).min(1.0);
        let c_mu = faster * 2.0 * (effective - 2.0 + 1.0 / effective) / ((n + 2.0) * (n + 2.0) + effective);
        let c_mu = c_mu.min(1.0 - c_one);

        let (step, mut length) = (self.step, 0.0);
        let moves =
            |i: usize, mean: f64| ranked.iter().filter_map(move |point| point.get(i)).map(move |x| (x - mean) / step);
        let weighted = |i, mean| weights.iter().zip(moves(i, mean));
        for (i, c) in self.coordinates.iter_mut().enumerate() {
            let mean_move: f64 = weighted(i, c.mean).map(|(weight, y)| weight * y).sum();
            let push = sqrt(c_step * (2.0 - c_step) * effective) * mean_move / sqrt(c.variance);
            c.step_path = (1.0 - c_step) * c.step_path + push;
            length += c.step_path * c.step_path;
        }
        // The length is divided by the expected length of a vector of n normal numbers.
        let length = sqrt(length) / (sqrt(n) * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n)));
        self.generation += 1;
        // The path starts at zero. This is its expected length until it has settled. libm computes the power, since the
        // platform's powers differ in the last bit.
        let begun = sqrt(1.0 - exp(2.0 * f64::from(self.generation) * log(1.0 - c_step)));
        // p_c is not updated while the steps are much too short.
        let follow = if length / begun < 1.4 + 2.0 / (n + 1.0) { 1.0 } else { 0.0 };
        for (i, c) in self.coordinates.iter_mut().enumerate() {
            let mean_move: f64 = weighted(i, c.mean).map(|(weight, y)| weight * y).sum();
            let spread: f64 = weighted(i, c.mean).map(|(weight, y)| weight * y * y).sum();
            c.path = (1.0 - c_path) * c.path + follow * sqrt(c_path * (2.0 - c_path) * effective) * mean_move;
            let kept = 1.0 - c_one - c_mu + (1.0 - follow) * c_one * c_path * (2.0 - c_path);
            c.variance = kept * c.variance + c_one * c.path * c.path + c_mu * spread;
            c.mean += step * mean_move;
        }
        // The step size grows by a factor of e at most per generation.
        self.step *= exp((c_step / damping * (length - 1.0)).min(1.0));
    }
}

/// Returns the weights of the better half of `points`, decreasing with rank; they sum to 1.
fn weights(points: usize) -> Vec<f64> {
    let raw: Vec<f64> = (1..=points / 2).map(|rank| log((points as f64 + 1.0) / 2.0) - log(rank as f64)).collect();
    let sum: f64 = raw.iter().sum();
    raw.into_iter().map(|weight| weight / sum).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns `f` at the mean of a search that starts at all ones and takes `evaluations`.
    fn minimum(f: impl Fn(&[f64]) -> f64, n: usize, evaluations: usize) -> f64 {
        let mut search = CmaEs::new(&vec![1.0; n], 0.5, 1);
        for _ in 0..evaluations / search.population() {
            let mut points = search.ask();
            points.sort_by(|a, b| f(a).total_cmp(&f(b)));
            search.tell(&points);
        }
        f(&search.mean())
    }

    fn sphere(x: &[f64]) -> f64 {
        x.iter().map(|x| x * x).sum()
    }

    #[test]
    fn finds_the_bottom_of_a_sphere() {
        assert!(minimum(sphere, 10, 2000) < 1e-9);
        assert!(minimum(sphere, 1, 400) < 1e-9);
    }

    /// The scales of the coordinates differ by a factor of up to 1000.
    #[test]
    fn learns_the_scale_of_each_coordinate() {
        let weight = |i: usize| libm::pow(1e6, i as f64 / 9.0);
        let ellipsoid = |x: &[f64]| x.iter().enumerate().map(|(i, x)| weight(i) * x * x).sum();
        assert!(minimum(ellipsoid, 10, 4000) < 1e-9);
    }

    #[test]
    fn weights_sum_to_one_and_fall() {
        let weights = weights(13);
        assert_eq!(weights.len(), 6);
        assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert!(weights.is_sorted_by(|a, b| a > b));
    }
}
