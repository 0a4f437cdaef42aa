//! Differences between the log's estimate and ours.

use crate::recording::LoggedState;
use afbc_estimator::Estimate;
use nalgebra::{Quaternion, Vector3};

/// Statistics of the differences in one quantity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ErrorFigure {
    /// Number of times at which the log's value and ours are both valid.
    pub count: u64,
    /// Number of compared times at which the log has a value, whether or not ours is valid.
    pub logged: u64,
    squares: f64,
    /// Largest difference.
    pub largest: f64,
    /// Number of coordinates within three of our standard deviations, and number of all coordinates.
    within: (u64, u64),
}

impl ErrorFigure {
    /// Adds a vector of differences with our standard deviations.
    fn add(&mut self, difference: &[f64], sigma: &[f64]) {
        let square: f64 = difference.iter().map(|part| part * part).sum();
        self.count += 1;
        self.squares += square;
        self.largest = self.largest.max(libm::sqrt(square));
        let inside = difference.iter().zip(sigma).filter(|(part, sigma)| part.abs() <= 3.0 * **sigma).count();
        self.within = (self.within.0 + inside as u64, self.within.1 + difference.len() as u64);
    }

    /// Returns the root mean square; none if nothing could be compared.
    #[must_use]
    pub fn rms(&self) -> Option<f64> {
        (self.count > 0).then(|| libm::sqrt(self.squares / self.count as f64))
    }

    /// Returns the share of the coordinates that lie within three of our standard deviations.
    #[must_use]
    pub fn within_ratio(&self) -> Option<f64> {
        let (inside, all) = self.within;
        (all > 0).then(|| inside as f64 / all as f64)
    }

    /// Returns the share of the compared times with a value in the log at which our estimate was valid, too.
    #[must_use]
    pub fn valid_ratio(&self) -> Option<f64> {
        (self.logged > 0).then(|| self.count as f64 / self.logged as f64)
    }
}

/// Statistics of the differences in all quantities.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Figures {
    /// Angle between the attitudes \[degrees\].
    pub attitude: ErrorFigure,
    /// Roll and pitch part of the angle \[degrees\].
    pub tilt: ErrorFigure,
    /// Yaw part of the angle \[degrees\].
    pub heading: ErrorFigure,
    /// Velocity \[m/s\].
    pub velocity: ErrorFigure,
    /// Position \[m\].
    pub position: ErrorFigure,
    /// Horizontal part of the position \[m\].
    pub horizontal: ErrorFigure,
    /// Vertical part of the position \[m\].
    pub height: ErrorFigure,
}

impl Figures {
    /// Adds the log's state and our estimate for the same time.
    pub(crate) fn add(&mut self, logged: &LoggedState, ours: &Estimate) {
        let (validity, sigmas) = (&ours.validity, &ours.sigmas);
        let wide = |v: &Vector3<f32>| v.cast::<f64>();
        if let Some(attitude) = &logged.attitude {
            let rotation = rotation_between(attitude, &ours.attitude).map(f64::to_degrees);
            let sigma = wide(&sigmas.attitude_rad).map(f64::to_degrees);
            let (tilt, about) = (rotation.xy(), sigma.xy());
            compare(&mut self.tilt, validity.attitude, tilt.as_slice(), about.as_slice());
            compare(&mut self.heading, validity.heading, &[rotation.z], &[sigma.z]);
            let all = validity.attitude && validity.heading;
            compare(&mut self.attitude, all, rotation.as_slice(), sigma.as_slice());
        }
        if let Some(velocity) = &logged.velocity_m_s {
            let difference = wide(velocity) - wide(&ours.state.velocity_m_s);
            compare(
                &mut self.velocity,
                validity.velocity,
                difference.as_slice(),
                wide(&sigmas.velocity_m_s).as_slice(),
            );
        }
        if let Some(position) = &logged.position_m {
            let difference = wide(position) - wide(&ours.state.position_m);
            let sigma = wide(&sigmas.position_m);
            compare(&mut self.position, validity.position, difference.as_slice(), sigma.as_slice());
            let (plane, across) = (difference.xy(), sigma.xy());
            compare(&mut self.horizontal, validity.position, plane.as_slice(), across.as_slice());
            compare(&mut self.height, validity.height, &[difference.z], &[sigma.z]);
        }
    }
}

fn compare(figure: &mut ErrorFigure, valid: bool, difference: &[f64], sigma: &[f64]) {
    figure.logged += 1;
    if valid {
        figure.add(difference, sigma);
    }
}

/// Returns the rotation from `ours` to `theirs` as a vector about the axes of the earth frame \[rad\]. Both are
/// quaternions w, x, y, z from body to earth.
pub(crate) fn rotation_between(theirs: &[f32; 4], ours: &[f32; 4]) -> Vector3<f64> {
    let [w, x, y, z] = theirs.map(f64::from);
    let [ow, ox, oy, oz] = ours.map(f64::from);
    let rotation = Quaternion::new(w, x, y, z) * Quaternion::new(ow, -ox, -oy, -oz);
    // Take the shorter way round: q and -q are the same rotation.
    let rotation = if rotation.w < 0.0 { -rotation } else { rotation };
    let sine = rotation.vector().norm();
    // angle/sin(angle/2) tends to 2 for a small angle.
    let per_sine = if sine > 1e-9 { 2.0 * libm::atan2(sine, rotation.w) / sine } else { 2.0 };
    rotation.vector() * per_sine
}
