//! Fits the ellipsoid of a magnetometer's readings.

use crate::CalibrationFailure;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Unit of the sums \[uT\], so that their numbers are near one.
const UNIT_UT: f64 = 50.0;
/// Accepted strength: the earth's field, 22 to 67 uT (IGRF-14), plus the effect of steel in a building \[uT\].
const STRENGTH_UT: core::ops::RangeInclusive<f64> = 15.0..=100.0;
/// Largest offset \[uT\]: a much larger one than the earth's field leaves few digits, or saturates the sensor.
const OFFSET_MAX_UT: f64 = 400.0;
/// Largest root mean square distance from the ellipsoid, divided by the field's strength.
const RESIDUAL_MAX: f64 = 0.06;
/// The ellipsoid is used only if its squared residuals are below this share of the sphere's, because it has five more
/// parameters.
const WORTH: f64 = 0.8;
/// Smallest 27 det C, where C has the second moments of the directions. Even directions have 1, a ring at a third of
/// the radius 0.5, half a sphere 1.
const EVENNESS_MIN: f64 = 0.7;
/// Largest norm of the mean direction. Even directions have 0, a ring at a third of the radius 0.33, half a sphere 0.5.
const MEAN_MAX: f64 = 0.25;
/// Smallest number of readings.
const READINGS_MIN: f64 = 30.0;

/// Result of the fit: errors of the magnetometer, as in [`SensorCalibration`](afbc_types::SensorCalibration).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldFit {
    /// Offset \[uT\].
    pub offset_ut: Vector3<f32>,
    /// Diagonal of the matrix.
    pub scale: Vector3<f32>,
    /// Elements xy, xz, yz of the matrix.
    pub off_diagonal: Vector3<f32>,
    /// Strength of the corrected field \[uT\].
    pub strength_ut: f32,
    /// Root mean square distance from the ellipsoid or the sphere \[uT\].
    pub residual_ut: f32,
}

/// Normal equations of the ellipsoid; the readings themselves are not kept. With x in `UNIT_UT`, a reading fulfils
///
/// ```text
/// (1 + u) x^2 + (1 + v) y^2 + (1 - u - v) z^2 + 2 d xy + 2 e xz + 2 f yz + 2 g x + 2 h y + 2 i z + k = 0
/// ```
///
/// whose nine numbers are found by least squares. Fixing the trace of the quadratic part at 3 is possible for any
/// ellipsoid at any place. The last four numbers alone, with the others at zero, describe a sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldSums {
    normal: SMatrix<f64, 9, 9>,
    right: SVector<f64, 9>,
    right_squared: f64,
    readings: f64,
}

impl Default for FieldSums {
    fn default() -> Self {
        FieldSums { normal: SMatrix::zeros(), right: SVector::zeros(), right_squared: 0.0, readings: 0.0 }
    }
}

impl FieldSums {
    /// Adds a reading \[uT\]. A reading that is NaN or too large is skipped.
    pub fn add(&mut self, field_ut: &Vector3<f32>) {
        if !field_ut.iter().all(|it| it.abs() < 1e6) {
            return;
        }
        let [[x, y, z]] = (field_ut.cast::<f64>() / UNIT_UT).data.0;
        let (xx, yy, zz) = (x * x, y * y, z * z);
        let row = SVector::<f64, 9>::from([
            xx - zz,
            yy - zz,
            2.0 * x * y,
            2.0 * x * z,
            2.0 * y * z,
            2.0 * x,
            2.0 * y,
            2.0 * z,
            1.0,
        ]);
        let right = -(xx + yy + zz);
        self.normal += row * row.transpose();
        self.right += row * right;
        self.right_squared += right * right;
        self.readings += 1.0;
    }

    /// Fits an ellipsoid if it is much better than a sphere, which is reliable with fewer readings.
    ///
    /// # Errors
    /// [`TooFewDirections`](CalibrationFailure::TooFewDirections), [`TooLarge`](CalibrationFailure::TooLarge),
    /// [`FieldStrength`](CalibrationFailure::FieldStrength) or [`FieldUneven`](CalibrationFailure::FieldUneven).
    pub fn fit(&self) -> Result<FieldFit, CalibrationFailure> {
        if self.readings < READINGS_MIN {
            return Err(CalibrationFailure::TooFewDirections);
        }
        let (sphere, sphere_error) = self.sphere().ok_or(CalibrationFailure::TooFewDirections)?;
        let ellipsoid = self.ellipsoid().filter(|(_, error)| *error < WORTH * sphere_error);
        let (numbers, squared) = ellipsoid.unwrap_or((sphere, sphere_error));
        let Ellipsoid { centre, matrix, strength } =
            Ellipsoid::of(&numbers).ok_or(CalibrationFailure::TooFewDirections)?;
        if !self.covers(&centre, &matrix, strength) {
            return Err(CalibrationFailure::TooFewDirections);
        }
        if !STRENGTH_UT.contains(&(strength * UNIT_UT)) {
            return Err(CalibrationFailure::FieldStrength);
        }
        // Near the surface, the equation's value is twice the strength times the distance.
        let residual = libm::sqrt(squared.max(0.0) / self.readings) / (2.0 * strength);
        if residual > RESIDUAL_MAX * strength {
            return Err(CalibrationFailure::FieldUneven);
        }
        let [[sx, xy, xz], [_, sy, yz], [.., sz]] = matrix.data.0;
        let (scale, off_diagonal) = (Vector3::new(sx, sy, sz), Vector3::new(xy, xz, yz));
        let is_usual = (centre * UNIT_UT).amax() <= OFFSET_MAX_UT
            && scale.amin() >= 0.6
            && scale.amax() <= 1.6
            && off_diagonal.amax() <= 0.4;
        is_usual.then_some(()).ok_or(CalibrationFailure::TooLarge)?;
        Ok(FieldFit {
            offset_ut: (centre * UNIT_UT).cast(),
            scale: scale.cast(),
            off_diagonal: off_diagonal.cast(),
            strength_ut: (strength * UNIT_UT) as f32,
            residual_ut: (residual * UNIT_UT) as f32,
        })
    }

    /// Returns the sphere's numbers and the sum of its squared residuals.
    fn sphere(&self) -> Option<(SVector<f64, 9>, f64)> {
        let normal = self.normal.fixed_view::<4, 4>(5, 5).into_owned();
        let right = self.right.fixed_rows::<4>(5).into_owned();
        let found = normal.cholesky()?.solve(&right);
        let mut numbers = SVector::<f64, 9>::zeros();
        numbers.fixed_rows_mut::<4>(5).copy_from(&found);
        // At the least squares solution |A x - b|^2 = b^T b - x^T A^T b, which needs no readings.
        Some((numbers, self.right_squared - right.dot(&found)))
    }

    fn ellipsoid(&self) -> Option<(SVector<f64, 9>, f64)> {
        let numbers = self.normal.cholesky()?.solve(&self.right);
        Ellipsoid::of(&numbers)?;
        Some((numbers, self.right_squared - self.right.dot(&numbers)))
    }

    /// Returns true if the corrected readings cover all directions.
    fn covers(&self, centre: &Vector3<f64>, matrix: &Matrix3<f64>, strength: f64) -> bool {
        // The last column has the sums of the elements of all rows.
        let sums = self.normal.column(8) / self.readings;
        let [[a, b, xy2, xz2, yz2, x2, y2, z2, _]] = sums.data.0;
        let squares = -self.right.iter().next_back().copied().unwrap_or(0.0) / self.readings;
        // xx = zz + a and yy = zz + b, and all three add up to `squares`.
        let zz = (squares - a - b) / 3.0;
        let (xy, xz, yz) = (0.5 * xy2, 0.5 * xz2, 0.5 * yz2);
        let moments = Matrix3::new(zz + a, xy, xz, xy, zz + b, yz, xz, yz, zz);
        let mean = 0.5 * Vector3::new(x2, y2, z2);
        let about = moments - centre * mean.transpose() - mean * centre.transpose() + centre * centre.transpose();
        let directions = matrix * about * matrix / (strength * strength);
        let mean_direction = matrix * (mean - centre) / strength;
        27.0 * directions.determinant() >= EVENNESS_MIN && mean_direction.norm() <= MEAN_MAX
    }
}

/// Surface |matrix (x - centre)| = strength, in [`UNIT_UT`], with a matrix of determinant 1.
struct Ellipsoid {
    centre: Vector3<f64>,
    matrix: Matrix3<f64>,
    strength: f64,
}

impl Ellipsoid {
    /// Returns the ellipsoid of these nine numbers, `None` if they describe another surface.
    fn of(numbers: &SVector<f64, 9>) -> Option<Self> {
        let [[u, v, d, e, f, g, h, i, k]] = numbers.data.0;
        let quadratic = Matrix3::new(1.0 + u, d, e, d, 1.0 + v, f, e, f, 1.0 - u - v);
        let inverse = quadratic.cholesky()?.inverse();
        let centre = -(inverse * Vector3::new(g, h, i));
        let size = centre.dot(&(quadratic * centre)) - k;
        let root = square_root(&quadratic)?;
        let mean = libm::cbrt(root.determinant());
        let strength = libm::sqrt(size) / mean;
        // NaN makes this false.
        (size > 0.0 && mean > 0.0 && strength < 1e3).then_some(Ellipsoid { centre, matrix: root / mean, strength })
    }
}

/// Returns the symmetric root of a symmetric positive definite matrix near the identity: Denman and Beavers (1976).
fn square_root(matrix: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    let (mut root, mut inverse) = (*matrix, Matrix3::identity());
    for _ in 0..12 {
        let (of_root, of_inverse) = (root.try_inverse()?, inverse.try_inverse()?);
        (root, inverse) = (0.5 * (root + of_inverse), 0.5 * (inverse + of_root));
    }
    Some(root)
}
