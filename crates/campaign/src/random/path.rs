//! Paths of a size and speed that suit the vehicle.

use super::bisection::largest;
use super::mismatch::whole;
use super::power::Power;
use afbc_plant::noise::Noise;
use afbc_scenario::trajectory::{Sine, Trajectory, Waypoint};
use core::f64::consts::TAU;
use libm::sqrt;
use nalgebra::Vector3;

/// Length of a flight \[s\].
pub(super) const DURATION_S: f64 = 20.0;
/// Time by which the last waypoint is reached \[s\].
const LAST_S: f64 = 18.0;
/// Largest number of waypoints.
const WAYPOINTS: usize = 32;
/// Slowest rate of a moving path \[rad/s\]. A vehicle that cannot fly this fast hovers.
const RATE_MIN: f64 = 0.02;
/// Fastest rate of a path \[rad/s\].
const RATE_MAX: f64 = 50.0;

/// A path whose speed is not yet chosen.
#[derive(Clone, Debug)]
pub(super) struct UntimedPath {
    shape: PathShape,
    yaw_rad: f64,
    /// Height of the path's centre \[m\].
    height_m: f64,
    /// Height of the centre of mass of a vehicle that stands on the ground; none if the path begins in the air \[m\].
    stands_m: Option<f64>,
}

#[derive(Clone, Debug)]
enum PathShape {
    /// x = a sin(w t), y = a/2 sin(2 w t).
    Lemniscate(f64),
    Circle(f64),
    /// Corners relative to the centre \[m\], each with the yaw there \[rad\] and the duration of the leg to it in
    /// periods.
    Waypoints(Vec<(Vector3<f64>, f64, f64)>),
    Hover,
}

impl UntimedPath {
    /// Names of the kinds.
    pub(super) const KINDS: [&str; 4] = ["lemniscate", "circle", "waypoints", "hover"];

    /// Draws a path at height `height_m` for a vehicle with arms of `arm_m`. If the vehicle can stand on the ground,
    /// with its centre of mass at `stands_m`, waypoints and hovers begin there.
    pub(super) fn draw(noise: &mut Noise, arm_m: f64, height_m: f64, stands_m: Option<f64>) -> Self {
        let kind = whole(noise, Self::KINDS.len());
        let mut between = |low: f64, high: f64| low + (high - low) * noise.uniform();
        let half_m = between(0.6, 4.0) * (arm_m / 0.2).clamp(0.4, 1.6);
        let yaw_rad = between(-1.0, 1.0);
        let shape = match kind {
            0 => PathShape::Lemniscate(half_m),
            1 => PathShape::Circle(half_m),
            2 => {
                let mut last_m = Vector3::zeros();
                let mut corner = |()| {
                    let [x, y, z] = [half_m, half_m, 0.5 * half_m.min(2.0)].map(|most_m| between(-most_m, most_m));
                    let place_m = Vector3::new(x, y, z);
                    let far = (place_m - last_m).norm() / (2.0 * half_m);
                    last_m = place_m;
                    (place_m, between(-1.0, 1.0), sqrt(far.max(0.1)) * between(1.0, 2.0))
                };
                PathShape::Waypoints((0..WAYPOINTS).map(|_| corner(())).collect())
            }
            _ => PathShape::Hover,
        };
        let stands_m = stands_m.filter(|_| matches!(shape, PathShape::Waypoints(_) | PathShape::Hover));
        UntimedPath { shape, yaw_rad, height_m, stands_m }
    }

    /// Returns the name of the path's kind.
    pub(super) const fn kind(&self) -> &'static str {
        let [lemniscate, circle, waypoints, hover] = Self::KINDS;
        match self.shape {
            PathShape::Lemniscate(_) => lemniscate,
            PathShape::Circle(_) => circle,
            PathShape::Waypoints(_) => waypoints,
            PathShape::Hover => hover,
        }
    }

    /// True if the path begins on the ground.
    pub(super) const fn stands(&self) -> bool {
        self.stands_m.is_some()
    }

    /// Returns the trajectory that asks for the fraction `boldness`, 0 to 1, of the possible acceleration.
    pub(super) fn flown(&self, power: &Power, boldness: f64) -> Trajectory {
        let fits = |rate: f64| {
            let trajectory = self.at(rate);
            power.asked_by(&trajectory, &self.times_s(&trajectory)) <= 1.0
        };
        // Accelerations grow with the square of the rate.
        self.at(sqrt(boldness) * largest(RATE_MAX, fits))
    }

    /// Returns the trajectory at this rate \[rad/s\].
    fn at(&self, rate: f64) -> Trajectory {
        let centre_m = Vector3::new(0.0, 0.0, self.height_m);
        // At a rate of 0 the period is infinite, but not used.
        let (yaw_rad, period_s) = (self.yaw_rad, TAU / rate);
        match &self.shape {
            _ if rate < RATE_MIN => self.rest(centre_m),
            PathShape::Lemniscate(half_m) => {
                let sine = |amplitude_m, period_s| Sine { amplitude_m, period_s, phase_rad: 0.0 };
                let sines = [sine(*half_m, period_s), sine(0.5 * half_m, 0.5 * period_s), sine(0.0, period_s)];
                Trajectory::Lissajous { centre_m, sines, yaw_rad }
            }
            PathShape::Circle(radius_m) => Trajectory::Circle { centre_m, radius_m: *radius_m, period_s, yaw_rad },
            PathShape::Waypoints(corners) => {
                let mut waypoints = self.before(centre_m);
                let mut time_s = waypoints.last().map_or(0.0, |last| last.time_s);
                for (place_m, yaw_rad, periods) in corners {
                    time_s += periods * period_s;
                    if time_s > LAST_S {
                        break;
                    }
                    waypoints.push(Waypoint { time_s, position_m: centre_m + place_m, yaw_rad: *yaw_rad });
                }
                Trajectory::Waypoints(waypoints)
            }
            PathShape::Hover => self.rest(centre_m),
        }
    }

    /// Returns a hover, preceded by a climb if the path begins on the ground.
    fn rest(&self, centre_m: Vector3<f64>) -> Trajectory {
        match self.stands() {
            true => Trajectory::Waypoints(self.before(centre_m)),
            false => Trajectory::Hover { position_m: centre_m, yaw_rad: self.yaw_rad },
        }
    }

    /// Returns the waypoints before the first corner: the centre, preceded by the place on the ground if the path
    /// begins there.
    fn before(&self, centre_m: Vector3<f64>) -> Vec<Waypoint> {
        let at = |time_s, position_m| Waypoint { time_s, position_m, yaw_rad: self.yaw_rad };
        match self.stands_m {
            Some(height_m) => vec![at(1.0, Vector3::new(0.0, 0.0, height_m)), at(5.0, centre_m)],
            None => vec![at(3.0, centre_m)],
        }
    }

    /// Returns the times at which a trajectory is checked: 64 per period, or 64 per leg after the climb.
    fn times_s(&self, trajectory: &Trajectory) -> Vec<f64> {
        let within = |from_s: f64, to_s: f64| (0..64).map(move |k| from_s + (to_s - from_s) * f64::from(k) / 64.0);
        match trajectory {
            Trajectory::Lissajous { sines: [sine, ..], .. } => within(0.0, sine.period_s.min(DURATION_S)).collect(),
            // A circle demands the same acceleration at every point, so one point is enough.
            Trajectory::Circle { .. } => vec![0.0],
            Trajectory::Waypoints(waypoints) => {
                let legs = waypoints.iter().zip(waypoints.iter().skip(1)).skip(usize::from(self.stands()));
                legs.flat_map(|(from, to)| within(from.time_s, to.time_s)).collect()
            }
            _ => Vec::new(),
        }
    }
}
