//! How far the log's estimate and ours are apart.

use crate::recording::LoggedState;
use afbc_estimator::Estimate;
use nalgebra::{Quaternion, Vector3};

/// The differences of one quantity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ErrorFigure {
    /// Number of times at which both are valid.
    pub count: u64,
    /// Number of times at which the log's is, whatever ours.
    pub logged: u64,
    squares: f64,
    /// The largest one.
    pub largest: f64,
    /// Number of coordinates within three of our standard deviations, and of all.
    within: (u64, u64),
}

impl ErrorFigure {
    /// Adds a vector of differences with standard deviations.
    fn add(&mut self, difference: &[f64], sigma: &[f64]) {
        let square: f64 = difference.iter().map(|part| part * part).sum();
        self.count += 1;
        self.squares += square;
        self.largest = self.largest.max(libm::sqrt(square));
        let inside = difference.iter().zip(sigma).filter(|(part, sigma)| part.abs() <= 3.0 * **sigma).count();
        self.within = (self.within.0 + inside as u64, self.within.1 + difference.len() as u64);
    }

    /// Root mean square; none if nothing could be compared.
    #[must_use]
    pub fn rms(&self) -> Option<f64> {
        (self.count > 0).then(|| libm::sqrt(self.squares / self.count as f64))
    }

    /// Share of the coordinates within three of our standard deviations.
    #[must_use]
    pub fn within_ratio(&self) -> Option<f64> {
        let (inside, all) = self.within;
        (all > 0).then(|| inside as f64 / all as f64)
    }

    /// Share of the log's times at which ours was valid.
    #[must_use]
    pub fn valid_ratio(&self) -> Option<f64> {
        (self.logged > 0).then(|| self.count as f64 / self.logged as f64)
    }
}

/// All differences.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Figures {
    /// Angle between the attitudes \[degrees\].
    pub attitude: ErrorFigure,
    /// Its part about horizontal axes \[degrees\].
    pub tilt: ErrorFigure,
    /// Its part about the vertical axis \[degrees\].
    pub heading: ErrorFigure,
    /// Velocity \[m/s\].
    pub velocity: ErrorFigure,
    /// Position \[m\].
    pub position: ErrorFigure,
    /// Its horizontal part \[m\].
    pub horizontal: ErrorFigure,
    /// Its vertical part \[m\].
    pub height: ErrorFigure,
}

impl Figures {
    /// Adds the log's state and our estimate of the same time.
    pub(crate) fn add(&mut self, logged: &LoggedState, ours: &Estimate) {
        let (validity, sigmas) = (&ours.validity, &ours.sigmas);
        let wide = |v: &Vector3<f32>| v.cast::<f64>();
        if let Some(attitude) = &logged.attitude {
            let turn = turn(attitude, &ours.attitude).map(f64::to_degrees);
            let sigma = wide(&sigmas.attitude_rad).map(f64::to_degrees);
            let (tilt, about) = (turn.xy(), sigma.xy());
            compare(&mut self.tilt, validity.attitude, tilt.as_slice(), about.as_slice());
            compare(&mut self.heading, validity.heading, &[turn.z], &[sigma.z]);
            let all = validity.attitude && validity.heading;
            compare(&mut self.attitude, all, turn.as_slice(), sigma.as_slice());
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

/// Returns the rotation from `ours` to `theirs`, both w, x, y, z from body to earth, as a vector about the axes of the
/// earth frame \[rad\].
pub(crate) fn turn(theirs: &[f32; 4], ours: &[f32; 4]) -> Vector3<f64> {
    let [w, x, y, z] = theirs.map(f64::from);
    let [ow, ox, oy, oz] = ours.map(f64::from);
    let turn = Quaternion::new(w, x, y, z) * Quaternion::new(ow, -ox, -oy, -oz);
    // The shorter way round: q and -q are the same rotation.
    let turn = if turn.w < 0.0 { -turn } else { turn };
    let sine = turn.vector().norm();
    // angle/sin(angle/2), whose limit is 2.
    let per_sine = if sine > 1e-9 { 2.0 * libm::atan2(sine, turn.w) / sine } else { 2.0 };
    turn.vector() * per_sine
}
