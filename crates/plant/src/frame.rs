//! Positions and directions of the rotors, prepared for sums over the rotors.

use afbc_types::{OutOfRange, PLUS, Parameters, ROTOR_POSITION, ROTORS, ROTORS_MAX, Rotor, RotorSpeeds};
use libm::sqrt;
use nalgebra::{SMatrix, SVector, Vector4};

type Matrix4xX8 = SMatrix<f64, 4, ROTORS_MAX>;

/// One number per rotor, 0 beyond the number of rotors.
pub type PerRotor = SVector<f64, ROTORS_MAX>;

/// Rotors of a vehicle. The default is the paper's frame, [`PLUS`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct RotorLayout {
    count: usize,
    /// 1 for each rotor that exists.
    present: PerRotor,
    /// Six weights per rotor for [`RotorLayout::sums`]: 1; yaw direction (1 if the rotor pushes the body to positive
    /// yaw, else -1); position x, y in arm lengths; x^2 + y^2; 0 as padding.
    weights: [[f64; 6]; ROTORS_MAX],
}

/// Smallest number of rotors, and by far the most common one: loops over eight take twice as long.
pub(crate) const FEW: usize = 4;

/// Sums over the rotors, weighted by position and direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RotorSums {
    /// Unweighted sum.
    pub(crate) all: f64,
    /// Sums weighted by position, in arm lengths.
    pub(crate) x: f64,
    pub(crate) y: f64,
    /// Sum weighted by the square of the distance from body z.
    pub(crate) square: f64,
    /// Sum weighted by the yaw direction, 1 or -1.
    pub(crate) spin: f64,
}

/// Returns the sum of squares times speeds, with even and odd rotors summed separately: results for four rotors depend
/// on this order.
#[inline]
pub(crate) fn power(squares: &PerRotor, speeds: &PerRotor) -> f64 {
    let products = squares.component_mul(speeds);
    let [mut even, mut odd] = [0.0; 2];
    for pair in products.as_slice().chunks_exact(2) {
        if let [first, second] = pair {
            even += first;
            odd += second;
        }
    }
    even + odd
}

impl RotorLayout {
    /// Creates the frame of these rotors.
    ///
    /// # Errors
    /// Returns an error for fewer than four or more than eight rotors, or a position out of [`ROTOR_POSITION`].
    pub fn new(rotors: &[Rotor<f64>]) -> Result<Self, OutOfRange> {
        ROTORS.check(rotors.len() as f64)?;
        for rotor in rotors {
            ROTOR_POSITION.check(rotor.x)?;
            ROTOR_POSITION.check(rotor.y)?;
        }
        Ok(Self::of(rotors))
    }

    fn of(rotors: &[Rotor<f64>]) -> Self {
        let square = |rotor: &Rotor<f64>| rotor.x * rotor.x + rotor.y * rotor.y;
        let weights = |rotor: &Rotor<f64>| [1.0, rotor.spin(), rotor.x, rotor.y, square(rotor), 0.0];
        RotorLayout {
            count: rotors.len(),
            present: PerRotor::from_fn(|i, _| if i < rotors.len() { 1.0 } else { 0.0 }),
            weights: core::array::from_fn(|i| rotors.get(i).map_or([0.0; 6], weights)),
        }
    }

    /// Returns the number of rotors.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Returns the squared distance of the outermost rotor from body z, in arm lengths.
    pub(crate) fn square_max(&self) -> f64 {
        self.weights.iter().fold(0.0, |most, [.., square, _]| square.max(most))
    }

    /// Returns `values` with 0 beyond the number of rotors.
    #[inline]
    pub(crate) fn masked(&self, values: &PerRotor) -> PerRotor {
        self.present.component_mul(values)
    }

    /// Returns each rotor's share of a thrust without moments, with the smallest sum of squares. The shares are equal
    /// if the frame allows it.
    pub(crate) fn hover_shares(&self) -> PerRotor {
        let equal = self.present / self.count as f64;
        let RotorSums { x, y, spin, .. } = self.sums(&equal);
        // By the inverse the shares would be equal only up to rounding.
        if x == 0.0 && y == 0.0 && spin == 0.0 {
            return equal;
        }
        let columns = self.weights.map(|[one, spin, x, y, ..]| Vector4::new(y, -x, spin, one));
        let b = Matrix4xX8::from_columns(&columns);
        let shares = (b * b.transpose()).try_inverse().map(|inverse| b.transpose() * inverse * Vector4::w());
        // Rotors cannot pull.
        shares.filter(|shares| shares.min() >= 0.0).unwrap_or(equal)
    }

    /// Returns the rotor speeds that carry this vehicle in hover \[rad/s\].
    pub(crate) fn hover_rad_s(&self, vehicle: &Parameters<f64>) -> PerRotor {
        self.hover_shares().map(|share| sqrt(vehicle.weight_n() * share / vehicle.thrust_factor_n_s2))
    }

    /// Returns `value` for each rotor.
    pub(crate) fn repeat(&self, value: f64) -> PerRotor {
        self.present * value
    }

    /// Returns the commanded speeds. A rotor without a command stands still.
    #[inline]
    pub(crate) fn speeds<const N: usize>(&self, speeds: &RotorSpeeds<N>) -> PerRotor {
        let of = |count| {
            let mut lanes = PerRotor::zeros();
            let present = lanes.as_mut_slice().iter_mut().zip(speeds.0.as_slice()).take(count);
            present.for_each(|(lane, speed)| *lane = f64::from(*speed));
            lanes
        };
        if self.count == FEW { of(FEW) } else { of(self.count) }
    }

    /// Sums `values` in the order of the rotors. `values` must be 0 beyond the number of rotors.
    #[inline]
    pub(crate) fn sums(&self, values: &PerRotor) -> RotorSums {
        if self.count == FEW { self.sums_of::<FEW>(values) } else { self.sums_of::<ROTORS_MAX>(values) }
    }

    /// Sums the first `N` of `values`; the others are 0.
    #[inline]
    fn sums_of<const N: usize>(&self, values: &PerRotor) -> RotorSums {
        let mut sums = [0.0; 6];
        for (weights, value) in self.weights.iter().zip(values.as_slice()).take(N) {
            sums.iter_mut().zip(weights).for_each(|(sum, weight)| *sum += weight * value);
        }
        let [all, spin, x, y, square, _] = sums;
        RotorSums { all, x, y, square, spin }
    }
}

impl Default for RotorLayout {
    fn default() -> Self {
        Self::of(&PLUS.map(|rotor| rotor.to_f64()))
    }
}
