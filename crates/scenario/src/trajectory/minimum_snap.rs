//! Minimum-snap motion through waypoints: D. Mellinger and V. Kumar, "Minimum Snap Trajectory Generation and Control
//! for Quadrotors", ICRA 2011.
//!
//! For given times, the integral of the squared snap is least for pieces of degree seven with six continuous
//! derivatives at the waypoints and rest at both ends. Velocity, acceleration and jerk at the inner waypoints are
//! unknown. The continuity of the fourth to sixth derivatives gives a block-tridiagonal system for them.
#![allow(clippy::indexing_slicing, reason = "coordinates of four, derivatives of three")]

use super::nearest_heading;
use super::polynomial::{COEFFICIENTS, PolynomialPiece, peaks};
use nalgebra::{Matrix3, SMatrix, Vector3};

/// Unknowns at a waypoint: columns x, y, z, yaw; rows velocity, acceleration, jerk.
type Unknown = SMatrix<f64, 3, 4>;

/// Flat output of a quadrotor at a waypoint: x, y, z \[m\] and yaw \[rad\].
pub type FlatOutput = [f64; 4];

/// Largest speed and acceleration of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PaceLimits {
    /// Largest speed \[m/s\].
    pub speed_m_s: f64,
    /// Largest acceleration \[m/s2\].
    pub acceleration_m_s2: f64,
}

/// Shortest distance between two consecutive places \[m\], since a leg's time follows from its length.
pub const LEG_MIN_M: f64 = 1e-3;
/// Largest distance that a path may swing away from its places \[longest legs\]. On a way there and back whose legs
/// differ by a factor of up to five, the swing stays within 3.6. At a factor of ten it reaches 17, and it grows without
/// bound beyond.
pub const SWING_MAX: f64 = 5.0;
/// Samples per piece for its peaks. By Markov's inequality, a piece of degree seven exceeds its samples by at most 1680
/// / (8 * 512^2) = 0.08 % in speed, and by 0.04 % in acceleration.
const SAMPLES: u32 = 512;
/// Factor on all times that covers peaks between the samples.
const MARGIN: f64 = 1.001;

/// Reason for which there is no path through the places.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoPath {
    /// There are fewer than two places.
    TooFew,
    /// The leg with this index, counted from 0, is shorter than [`LEG_MIN_M`].
    ShortLeg(usize),
    /// On the leg with this index the path swings away by more than [`SWING_MAX`]: the lengths of the legs differ too
    /// much.
    Swings(usize),
    /// The lengths of the legs differ too much for the arithmetic.
    Unsolvable,
}

/// Returns the distance between two places \[m\].
pub fn distance_m(from: &FlatOutput, to: &FlatOutput) -> f64 {
    let [x, y, z] = [0, 1, 2].map(|i| to[i] - from[i]);
    libm::sqrt(x * x + y * y + z * z)
}

/// Returns the motion through `places` from rest at `start_s` to rest. All times are scaled by one factor, so that the
/// motion is as fast as `limits` allow. The heading turns the short way round.
///
/// # Errors
/// The reason for which there is no path.
pub fn minimum_snap(places: &[FlatOutput], start_s: f64, limits: PaceLimits) -> Result<Vec<PolynomialPiece>, NoPath> {
    let places = &unwrapped(places);
    let lengths_m: Vec<f64> = places.iter().zip(places.iter().skip(1)).map(|(from, to)| distance_m(from, to)).collect();
    if lengths_m.is_empty() {
        return Err(NoPath::TooFew);
    }
    if let Some(leg) = lengths_m.iter().position(|length_m| *length_m < LEG_MIN_M) {
        return Err(NoPath::ShortLeg(leg));
    }
    // The first guess of each leg's share of the time is the square root of its length, as at constant acceleration.
    let per_metre = limits.acceleration_m_s2.sqrt() / limits.speed_m_s;
    let durations_s: Vec<f64> = lengths_m.iter().map(|length_m| libm::sqrt(*length_m) + length_m * per_metre).collect();
    let first = timed(places, &durations_s, start_s).ok_or(NoPath::Unsolvable)?;
    // A derivative of order n scales with the power -n of all times.
    let [speed, acceleration, ..] = peaks(&first, SAMPLES);
    let scale = MARGIN * (speed / limits.speed_m_s).max(libm::sqrt(acceleration / limits.acceleration_m_s2));
    let durations_s: Vec<f64> = durations_s.iter().map(|duration_s| duration_s * scale).collect();
    let pieces = timed(places, &durations_s, start_s).ok_or(NoPath::Unsolvable)?;
    let longest_m = lengths_m.iter().copied().fold(0.0, f64::max);
    if let Some(leg) = pieces.iter().position(|piece| swings(piece, longest_m)) {
        return Err(NoPath::Swings(leg));
    }
    let [speed, acceleration, ..] = peaks(&pieces, SAMPLES);
    let is_within = speed <= limits.speed_m_s && acceleration <= limits.acceleration_m_s2;
    if is_within { Ok(pieces) } else { Err(NoPath::Unsolvable) }
}

/// Returns the places with headings that turn the short way round.
fn unwrapped(places: &[FlatOutput]) -> Vec<FlatOutput> {
    let mut before_rad = None;
    let turned = |&[x, y, z, yaw_rad]: &FlatOutput| {
        let yaw_rad = before_rad.map_or(yaw_rad, |before_rad| nearest_heading(before_rad, yaw_rad));
        before_rad = Some(yaw_rad);
        [x, y, z, yaw_rad]
    };
    places.iter().map(turned).collect()
}

/// Returns true if a piece departs from its start by more than [`SWING_MAX`] longest legs, or if a position is NaN.
fn swings(piece: &PolynomialPiece, longest_m: f64) -> bool {
    let mut samples = piece.samples(SAMPLES);
    let Some(start) = samples.next() else { return true };
    !samples.all(|at| (at.position_m - start.position_m).norm() <= SWING_MAX * longest_m)
}

/// Returns the motion through `places` with these durations; none if they differ too much for the arithmetic.
fn timed(places: &[FlatOutput], durations_s: &[f64], start_s: f64) -> Option<Vec<PolynomialPiece>> {
    let between = between(places, durations_s)?;
    let rest = Unknown::zeros();
    let knots: Vec<&Unknown> = core::iter::once(&rest).chain(&between).chain([&rest]).collect();
    let mut pieces = Vec::with_capacity(durations_s.len());
    let mut begin_s = start_s;
    for (i, duration_s) in durations_s.iter().copied().enumerate() {
        let (from, to) = (places.get(i)?, places.get(i + 1)?);
        let (a, b) = (*knots.get(i)?, *knots.get(i + 1)?);
        let mut coefficients = [[0.0; COEFFICIENTS]; 4];
        for (axis, coefficients) in coefficients.iter_mut().enumerate() {
            let [start, end] = [(from, a), (to, b)]
                .map(|(place, knot)| [place[axis], knot[(0, axis)], knot[(1, axis)], knot[(2, axis)]]);
            *coefficients = septic(start, end, duration_s);
        }
        pieces.push(PolynomialPiece { start_s: begin_s, duration_s, coefficients });
        begin_s += duration_s;
    }
    Some(pieces)
}

/// Returns the septic polynomial from value and three derivatives at 0 to value and three derivatives at `t`.
fn septic([p0, v0, a0, j0]: [f64; 4], [p1, v1, a1, j1]: [f64; 4], t: f64) -> [f64; COEFFICIENTS] {
    let (t2, t3) = (t * t, t * t * t);
    let p = p1 - (p0 + v0 * t + a0 * t2 / 2.0 + j0 * t3 / 6.0);
    let v = (v1 - (v0 + a0 * t + j0 * t2 / 2.0)) * t;
    let a = (a1 - (a0 + j0 * t)) * t2;
    let j = (j1 - j0) * t3;
    let t4 = t2 * t2;
    [
        p0,
        v0,
        a0 / 2.0,
        j0 / 6.0,
        (35.0 * p - 15.0 * v + 2.5 * a - j / 6.0) / t4,
        (-84.0 * p + 39.0 * v - 7.0 * a + j / 2.0) / (t4 * t),
        (70.0 * p - 34.0 * v + 6.5 * a - j / 2.0) / (t4 * t2),
        (-20.0 * p + 10.0 * v - 2.0 * a + j / 6.0) / (t4 * t3),
    ]
}

/// Returns how the fourth to sixth derivatives at the start of a piece depend on three inputs. These are the difference
/// of the end places, the velocity, acceleration and jerk at the start, and the same at the end. For the derivatives at
/// the end, reverse time.
fn ends(t: f64) -> ([f64; 3], Matrix3<f64>, Matrix3<f64>) {
    // Columns of `septic`: the response to a unit argument.
    let response = |argument: usize| {
        let mut arguments = [[0.0; 4]; 2];
        arguments[argument / 4][argument % 4] = 1.0;
        let [start, end] = arguments;
        let [.., c4, c5, c6, _] = septic(start, end, t);
        // The n-th derivative at 0 is n! times the n-th coefficient.
        [24.0 * c4, 120.0 * c5, 720.0 * c6]
    };
    let place = response(4);
    let block = |first: usize| Matrix3::from_columns(&[0, 1, 2].map(|i| response(first + i).into()));
    (place, block(1), block(5))
}

/// Solves for velocity, acceleration and jerk at the inner places, by Thomas' algorithm on blocks.
fn between(places: &[FlatOutput], durations_s: &[f64]) -> Option<Vec<Unknown>> {
    // Reversed time changes the sign of odd derivatives: of the unknowns (1, 2, 3) and of the equations (4, 5, 6).
    let odd = Matrix3::from_diagonal(&[-1.0, 1.0, -1.0].into());
    let even = Matrix3::from_diagonal(&[1.0, -1.0, 1.0].into());
    let mut solved: Vec<(Matrix3<f64>, Unknown)> = Vec::new();
    for (i, place) in places.iter().enumerate().skip(1).take(places.len().saturating_sub(2)) {
        let (before, after) = (places.get(i - 1)?, places.get(i + 1)?);
        let ([left_t, right_t], zero) = ([*durations_s.get(i - 1)?, *durations_s.get(i)?], Matrix3::zeros());
        let (left_place, left_own, left_other) = ends(left_t);
        let (right_place, right_own, right_other) = ends(right_t);
        let mut wanted = Unknown::zeros();
        for axis in 0..4 {
            let left = Vector3::from(left_place) * (before[axis] - place[axis]);
            let right = Vector3::from(right_place) * (after[axis] - place[axis]);
            wanted.set_column(axis, &(even * left - right));
        }
        let (lower, own, upper) = (-even * left_other * odd, right_own - even * left_own * odd, right_other);
        let (factor, known) = solved.last().copied().unwrap_or((zero, Unknown::zeros()));
        let inverse = (own - lower * factor).try_inverse()?;
        solved.push((inverse * upper, inverse * (wanted - lower * known)));
    }
    let mut next = Unknown::zeros();
    let mut found: Vec<Unknown> = Vec::with_capacity(solved.len());
    for (factor, known) in solved.into_iter().rev() {
        next = known - factor * next;
        found.push(next);
    }
    found.reverse();
    found.iter().all(|knot| knot.iter().all(|value| value.is_finite())).then_some(found)
}
