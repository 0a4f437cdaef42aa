//! A hand that holds and turns a vehicle.

use afbc_plant::Motion;
use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::{FRAC_PI_2, PI};

/// Time for moving the vehicle to another attitude \[s\].
const TURN_S: f64 = 1.0;
/// Height at which the hand holds the vehicle, above where it stood \[m\].
const HEIGHT_M: f64 = 0.8;

/// State of a vehicle in a person's hand: held, or put down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Grip {
    /// The vehicle is put down where it stood, and released.
    Down,
    /// The vehicle is held in the air at this roll and pitch, and turned about the vertical.
    Held {
        /// Roll and pitch \[rad\].
        level_rad: [f64; 2],
        /// Turn rate about the vertical, positive to the left \[rad/s\].
        turn_rad_s: f64,
    },
}

/// Names of the vehicle's sides, with the roll and pitch that turn each side down.
pub(crate) const SIDES: [(&str, [f64; 2]); 6] = [
    ("down", [0.0, 0.0]),
    ("up", [PI, 0.0]),
    ("left", [-FRAC_PI_2, 0.0]),
    ("right", [FRAC_PI_2, 0.0]),
    ("front", [0.0, FRAC_PI_2]),
    ("back", [0.0, -FRAC_PI_2]),
];

/// A hand that moves a vehicle from one grip to the next.
#[derive(Clone, Debug)]
pub(crate) struct HandheldMotion {
    /// Motion of the vehicle when it was picked up.
    stood: Motion,
    grip: Grip,
    /// Attitude and height \[m\] when the grip changed, and the time of that change \[s\].
    from: (UnitQuaternion<f64>, f64),
    since_s: f64,
}

impl HandheldMotion {
    /// Picks up a vehicle that stands with this motion, at `now_s`.
    pub(crate) fn new(stood: &Motion, now_s: f64) -> Self {
        let from = (attitude(&stood.attitude_rad), stood.position_m.z);
        HandheldMotion { stood: *stood, grip: Grip::Down, from, since_s: now_s }
    }

    /// Changes the grip at `now_s`.
    pub(crate) fn take(&mut self, grip: Grip, now_s: f64) {
        let now = self.motion(now_s);
        (self.from, self.since_s) = ((attitude(&now.attitude_rad), now.position_m.z), now_s);
        self.grip = grip;
    }

    /// Returns true if the vehicle has been put down.
    pub(crate) fn is_released(&self, now_s: f64) -> bool {
        self.grip == Grip::Down && now_s - self.since_s >= TURN_S
    }

    /// Returns the vehicle's motion at `now_s`.
    pub(crate) fn motion(&self, now_s: f64) -> Motion {
        let ([roll, pitch], turn_rad_s, height_m) = match self.grip {
            Grip::Down => ([0.0; 2], 0.0, 0.0),
            Grip::Held { level_rad, turn_rad_s } => (level_rad, turn_rad_s, HEIGHT_M),
        };
        let yaw = self.stood.attitude_rad.z;
        let (first, height_from_m) = self.from;
        let to = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
        let to_m = self.stood.position_m.z + height_m;
        let elapsed_s = now_s - self.since_s;
        let (attitude, rates_rad_s, z) = if elapsed_s < TURN_S {
            let way = (first.inverse() * to).scaled_axis();
            let share = elapsed_s / TURN_S;
            let attitude = first * UnitQuaternion::from_scaled_axis(way * share);
            (attitude, way / TURN_S, height_from_m + (to_m - height_from_m) * share)
        } else {
            let turned = Vector3::z() * turn_rad_s;
            let attitude = UnitQuaternion::from_scaled_axis(turned * (elapsed_s - TURN_S)) * to;
            (attitude, attitude.inverse() * turned, to_m)
        };
        let (roll, pitch, yaw) = attitude.euler_angles();
        Motion {
            position_m: Vector3::new(self.stood.position_m.x, self.stood.position_m.y, z),
            velocity_m_s: Vector3::zeros(),
            attitude_rad: Vector3::new(roll, pitch, yaw),
            rates_rad_s,
        }
    }
}

fn attitude(angles_rad: &Vector3<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_euler_angles(angles_rad.x, angles_rad.y, angles_rad.z)
}
