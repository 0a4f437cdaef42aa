//! Mean and standard deviation of vectors.

use nalgebra::Vector3;

/// Running mean and sum of squared differences, by Welford's algorithm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct VectorStatistics {
    count: u32,
    mean: Vector3<f64>,
    squares: Vector3<f64>,
}

impl VectorStatistics {
    pub(crate) fn of(vectors: impl IntoIterator<Item = Vector3<f32>>) -> Self {
        let mut all = VectorStatistics::default();
        for vector in vectors {
            let vector = vector.cast::<f64>();
            all.count += 1;
            let difference = vector - all.mean;
            all.mean += difference / f64::from(all.count);
            all.squares += difference.component_mul(&(vector - all.mean));
        }
        all
    }

    pub(crate) fn mean(&self) -> Vector3<f64> {
        self.mean
    }

    /// Returns the standard deviation; zeros for fewer than two vectors.
    pub(crate) fn deviation(&self) -> Vector3<f64> {
        let divisor = f64::from(self.count.saturating_sub(1).max(1));
        self.squares.map(|squares| (squares / divisor).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The numbers 2, 4, 4, 4, 5, 5, 7, 9 have the mean 5. Their squared differences sum to 32, divided by seven.
    #[test]
    fn of_eight_numbers() {
        let numbers = [2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0];
        let found = VectorStatistics::of(numbers.map(|number| Vector3::new(number, -number, 1.0)));
        assert!((found.mean() - Vector3::new(5.0, -5.0, 1.0)).norm() < 1e-12);
        let expected = (32.0_f64 / 7.0).sqrt();
        assert!((found.deviation() - Vector3::new(expected, expected, 0.0)).norm() < 1e-12);
        assert_eq!(VectorStatistics::of([]).deviation(), Vector3::zeros());
    }
}
