//! Reference trajectories with analytic derivatives: velocity and acceleration of position and heading (assumption A5),
//! and jerk and snap of the position.
//!
//! Trigonometry comes from `libm`, so that a flight gives the same bits on every host.

pub mod minimum_snap;
pub mod polynomial;
mod reference;
pub mod smoothing;
pub mod spline;

use core::f64::consts::{PI, TAU};
use libm::{cos, rint, sin, sincos};
use nalgebra::Vector3;
pub use polynomial::PolynomialPiece;
pub use reference::Reference;

/// A position at which the vehicle must be at rest at a given time.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Waypoint {
    /// Time \[s\].
    pub time_s: f64,
    /// Position \[m\].
    pub position_m: Vector3<f64>,
    /// Yaw \[rad\].
    pub yaw_rad: f64,
}

/// A sine along one axis: amplitude sin(2 pi t / period + phase).
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Sine {
    /// Amplitude \[m\].
    pub amplitude_m: f64,
    /// Period \[s\].
    pub period_s: f64,
    /// Phase \[rad\].
    pub phase_rad: f64,
}

impl Sine {
    /// Returns the value and four derivatives at time `t`.
    #[inline]
    fn at(&self, t: f64) -> [f64; 5] {
        let rate = TAU / self.period_s;
        let (s, c) = sincos(rate * t + self.phase_rad);
        let [value, first] = [self.amplitude_m * s, self.amplitude_m * rate * c];
        let second = -self.amplitude_m * rate * rate * s;
        let [third, fourth] = [first, second].map(|derivative| -rate * rate * derivative);
        [value, first, second, third, fourth]
    }
}

/// A reference trajectory.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub enum Trajectory {
    /// Section IV: a tilted ellipse from 2 m to 8 m height with a period of 60 s.
    Paper,
    /// A constant position and heading.
    Hover {
        /// Position \[m\].
        position_m: Vector3<f64>,
        /// Yaw \[rad\].
        yaw_rad: f64,
    },
    /// A step of position and heading.
    Step {
        /// Position before `at_s` \[m\].
        from_m: Vector3<f64>,
        /// Position from `at_s` on \[m\].
        to_m: Vector3<f64>,
        /// Time of the step \[s\].
        at_s: f64,
        /// Yaw before `at_s` \[rad\].
        yaw_rad: f64,
        /// Change of yaw at `at_s` \[rad\].
        turn_rad: f64,
    },
    /// A level circle, counter-clockwise seen from above, starting in direction +x from the centre.
    Circle {
        /// Centre \[m\].
        centre_m: Vector3<f64>,
        /// Radius \[m\].
        radius_m: f64,
        /// Period \[s\].
        period_s: f64,
        /// Yaw \[rad\].
        yaw_rad: f64,
    },
    /// A sine along each axis about a centre.
    Lissajous {
        /// Centre \[m\].
        centre_m: Vector3<f64>,
        /// Sines along x, y, z.
        sines: [Sine; 3],
        /// Yaw \[rad\].
        yaw_rad: f64,
    },
    /// Minimum-jerk motion from rest to rest between waypoints with increasing times; at rest before the first and
    /// after the last. Position, velocity and acceleration are continuous; the jerk jumps at each waypoint. The heading
    /// turns by the difference of the waypoints' yaw: [`nearest_heading`] makes that the short way round.
    Waypoints(Vec<Waypoint>),
    /// Polynomial pieces. Each piece begins where the previous piece ends. The reference rests before the first and
    /// after the last piece.
    Polynomials(Vec<PolynomialPiece>),
}

impl Trajectory {
    /// Returns the reference at time `t` \[s\].
    #[inline]
    pub fn at(&self, t: f64) -> Reference {
        match self {
            Trajectory::Paper => paper(t),
            Trajectory::Hover { position_m, yaw_rad } => Reference::rest(*position_m, *yaw_rad),
            Trajectory::Step { from_m, yaw_rad, at_s, .. } if t < *at_s => Reference::rest(*from_m, *yaw_rad),
            Trajectory::Step { to_m, yaw_rad, turn_rad, .. } => Reference::rest(*to_m, yaw_rad + turn_rad),
            Trajectory::Circle { centre_m, radius_m, period_s, yaw_rad } => {
                let rate = TAU / period_s;
                let radius = Vector3::new(cos(rate * t), sin(rate * t), 0.0) * *radius_m;
                let velocity_m_s = Vector3::new(-radius.y, radius.x, 0.0) * rate;
                let acceleration_m_s2 = -radius * (rate * rate);
                Reference {
                    position_m: centre_m + radius,
                    velocity_m_s,
                    acceleration_m_s2,
                    jerk_m_s3: velocity_m_s * -(rate * rate),
                    snap_m_s4: acceleration_m_s2 * -(rate * rate),
                    ..Reference::rest(*centre_m, *yaw_rad)
                }
            }
            Trajectory::Lissajous { centre_m, sines, yaw_rad } => {
                let [[x, vx, ax, jx, sx], [y, vy, ay, jy, sy], [z, vz, az, jz, sz]] = sines.map(|sine| sine.at(t));
                Reference {
                    position_m: centre_m + Vector3::new(x, y, z),
                    velocity_m_s: Vector3::new(vx, vy, vz),
                    acceleration_m_s2: Vector3::new(ax, ay, az),
                    jerk_m_s3: Vector3::new(jx, jy, jz),
                    snap_m_s4: Vector3::new(sx, sy, sz),
                    ..Reference::rest(*centre_m, *yaw_rad)
                }
            }
            Trajectory::Waypoints(waypoints) => between(waypoints, t),
            Trajectory::Polynomials(pieces) => polynomial::at(pieces, t),
        }
    }

    /// Calls `take` with the reference at [`SAMPLES`] + 1 times of each period, leg or piece.
    pub fn sample(&self, take: &mut dyn FnMut(Reference)) {
        let mut within = |from_s: f64, length_s: f64| {
            (0..=SAMPLES).for_each(|k| take(self.at(from_s + length_s * f64::from(k) / f64::from(SAMPLES))));
        };
        match self {
            Trajectory::Paper => within(0.0, PAPER_PERIOD_S),
            Trajectory::Hover { .. } => within(0.0, 0.0),
            Trajectory::Step { at_s, .. } => within(0.0, *at_s),
            Trajectory::Circle { period_s, .. } => within(0.0, *period_s),
            // Each coordinate takes all of its values within its own period.
            Trajectory::Lissajous { sines, .. } => sines.iter().for_each(|sine| within(0.0, sine.period_s)),
            Trajectory::Waypoints(waypoints) => {
                waypoints.iter().zip(waypoints.iter().skip(1)).for_each(|(from, to)| {
                    within(from.time_s, to.time_s - from.time_s);
                });
            }
            Trajectory::Polynomials(pieces) => {
                pieces.iter().flat_map(|piece| piece.samples(SAMPLES)).for_each(take);
            }
        }
    }

    /// Returns the time from which the reference is at rest; none if it never is \[s\].
    pub fn end_s(&self) -> Option<f64> {
        match self {
            Trajectory::Paper | Trajectory::Circle { .. } | Trajectory::Lissajous { .. } => None,
            Trajectory::Hover { .. } => Some(0.0),
            Trajectory::Step { at_s, .. } => Some(*at_s),
            Trajectory::Waypoints(waypoints) => waypoints.last().map(|waypoint| waypoint.time_s),
            Trajectory::Polynomials(pieces) => pieces.last().map(PolynomialPiece::end_s),
        }
    }
}

/// Number of steps between samples in a period, leg or piece.
pub const SAMPLES: u32 = 64;
/// Period of the paper's trajectory \[s\].
const PAPER_PERIOD_S: f64 = 60.0;

/// Returns `yaw_rad` shifted by whole turns to within half a turn of `before_rad`.
pub fn nearest_heading(before_rad: f64, yaw_rad: f64) -> f64 {
    yaw_rad - TAU * rint((yaw_rad - before_rad) / TAU)
}

/// Returns the reference of Section IV, with sin(a + pi/2) = cos a and sin(a + pi) = -sin a inserted.
fn paper(t: f64) -> Reference {
    let rate = PI / 30.0;
    let (s, c) = sincos(rate * t);
    let velocity_m_s = Vector3::new(s, 2.0 * c, 3.0 * s) * rate;
    let acceleration_m_s2 = Vector3::new(c, -2.0 * s, 3.0 * c) * (rate * rate);
    Reference {
        position_m: Vector3::new(1.0 - c, 2.0 * s, 5.0 - 3.0 * c),
        velocity_m_s,
        acceleration_m_s2,
        jerk_m_s3: velocity_m_s * -(rate * rate),
        snap_m_s4: acceleration_m_s2 * -(rate * rate),
        yaw_rad: -0.43 * s,
        yaw_rate_rad_s: -0.43 * rate * c,
        yaw_acceleration_rad_s2: 0.43 * rate * rate * s,
    }
}

/// Returns the minimum-jerk reference, with the blend 10 s^3 - 15 s^4 + 6 s^5 over each leg.
fn between(waypoints: &[Waypoint], t: f64) -> Reference {
    let next = waypoints.partition_point(|waypoint| waypoint.time_s <= t);
    let before = next.checked_sub(1).and_then(|index| waypoints.get(index));
    let (from, to) = match (before, waypoints.get(next)) {
        (Some(from), Some(to)) => (from, to),
        (Some(only), None) | (None, Some(only)) => return Reference::rest(only.position_m, only.yaw_rad),
        (None, None) => return Reference::default(),
    };
    let length = to.time_s - from.time_s;
    let s = (t - from.time_s) / length;
    let blend = s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
    let blend_dot = 30.0 * s * s * (1.0 - s) * (1.0 - s) / length;
    let blend_ddot = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / (length * length);
    let jerk = 60.0 * (1.0 - 6.0 * s * (1.0 - s)) / (length * length * length);
    let snap = 360.0 * (2.0 * s - 1.0) / (length * length * length * length);
    let (leg, turn) = (to.position_m - from.position_m, to.yaw_rad - from.yaw_rad);
    Reference {
        position_m: from.position_m + leg * blend,
        velocity_m_s: leg * blend_dot,
        acceleration_m_s2: leg * blend_ddot,
        jerk_m_s3: leg * jerk,
        snap_m_s4: leg * snap,
        yaw_rad: from.yaw_rad + turn * blend,
        yaw_rate_rad_s: turn * blend_dot,
        yaw_acceleration_rad_s2: turn * blend_ddot,
    }
}
