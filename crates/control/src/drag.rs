//! Drag that the vehicle's file knows of, for laws that make up for it.
//!
//! ```text
//! a = -(k_r sqrt(T/T_h) P + k_b |v|) v        P = 1 - z_b z_b'
//! ```
//!
//! with z_b the direction of the thrust: blades drag in the plane of the rotors, and in proportion to their speed;
//! Faessler, Franchi, Scaramuzza, *Differential flatness of quadrotor dynamics subject to rotor drag for accurate
//! tracking of high-speed trajectories*, RA-L 3(2), 2018. The body's drag grows with the square of the speed. Of the
//! wind nothing is known: v is the speed over the ground.

use crate::math;
use afbc_types::parameters;
use nalgebra::Vector3;

/// Speed below which that of the body is none \[m/s\].
const SPEED_MIN_M_S: f32 = 0.01;
/// Smallest thrust that drag turns \[m/s2\], and smallest share of it left beside the drag along it.
const THRUST_MIN_M_S2: f32 = 1.0;
const SHARE_MIN: f32 = 0.3;

parameters! {
    /// Drag per mass. The default is none.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
    #[cfg_attr(feature = "defmt", derive(defmt::Format))]
    pub struct KnownDrag {
        /// k_r: drag of the rotors when hovering, per mass and speed; a vehicle's file states it in `[drag]`.
        #[parameter(DRAG_ROTOR, "1/s", 0.0..=10.0)]
        pub rotor_drag_1_s: f32 = 0.0,
        /// k_b: drag of the body along x and y, per mass and speed squared; likewise.
        #[parameter(DRAG_BODY, "1/m", 0.0..=10.0)]
        pub body_drag_1_m: f32 = 0.0,
        /// h: height of the rotors above the centre of mass, where their drag acts; likewise.
        #[parameter(DRAG_HEIGHT, "m", -1.0..=1.0)]
        pub rotor_height_m: f32 = 0.0,
    }
}

impl KnownDrag {
    /// None.
    pub const NONE: Self = Self::DEFAULT;
    /// That of the paper's vehicle with the drag in `vehicles/paper.toml`; a test compares them.
    pub const PAPER: Self =
        KnownDrag { rotor_drag_1_s: 0.394_782_78, body_drag_1_m: 0.012_602_881, rotor_height_m: 0.02 };

    /// Returns the acceleration by drag \[m/s2\] at `velocity_m_s` with the thrust along the unit vector `up`, and
    /// `share` of the hover thrust.
    #[inline]
    pub fn acceleration(&self, velocity_m_s: &Vector3<f32>, up: &Vector3<f32>, share: f32) -> Vector3<f32> {
        let in_plane = velocity_m_s - up * up.dot(velocity_m_s);
        let rotors = self.rotor_drag_1_s * math::sqrt(math::max(share, 0.0));
        let body = self.body_drag_1_m * math::sqrt(velocity_m_s.norm_squared());
        in_plane * -rotors - velocity_m_s * body
    }

    /// Returns the moment per mass about the axes of the body \[m2/s2\] by which the drag of the rotors, above the
    /// centre of mass, turns a vehicle at this velocity in the body's axes.
    #[inline]
    pub fn moment(&self, velocity_body_m_s: &Vector3<f32>, share: f32) -> Vector3<f32> {
        let lever = self.rotor_height_m * self.rotor_drag_1_s * math::sqrt(math::max(share, 0.0));
        Vector3::new(lever * velocity_body_m_s.y, -lever * velocity_body_m_s.x, 0.0)
    }

    /// Returns jerk and snap of the thrust per mass f \[m/s3, m/s4\] that give a vehicle a velocity with these three
    /// derivatives; the thrust is `thrust_m_s2` along `up`, and `share` of that of hover.
    ///
    /// With u = f/|f| and k = k_r sqrt(T/T_h), f makes up for the blades' drag k P v = k (v - c u), c = u v, and for
    /// that of the body, b(v), whose derivative along a is b'(a). So u, which turns with f, is in its derivatives:
    ///
    /// ```text
    /// df/dt    =  q - k (c du/dt + w u) + dk/dt P v                 q = j + k a + b'(a)    w = v du/dt + u a
    /// d2f/dt2  =  r - k (c d2u/dt2 + 2w du/dt) + 2 dk/dt (a - c du/dt - w u) + d2k/dt2 P v    r = s + k j + b'(j)
    /// du/dt    =  P (q + dk/dt P v) / (|f| + k c)
    /// d2u/dt2  =  P (d2f/dt2 - 2 d|f|/dt du/dt) / |f|
    /// ```
    ///
    /// In the second, what is along u, which turns nothing, and the second derivative of b are left out.
    #[inline]
    pub fn followed(
        &self,
        velocity_m_s: &Vector3<f32>,
        up: &Vector3<f32>,
        [share, thrust_m_s2]: [f32; 2],
        [a, jerk, snap]: [&Vector3<f32>; 3],
    ) -> [Vector3<f32>; 2] {
        let rotors = self.rotor_drag_1_s * math::sqrt(math::max(share, 0.0));
        // d(|v| v) = |v| dv + v (v dv)/|v|
        let speed = math::sqrt(velocity_m_s.norm_squared());
        let along = velocity_m_s * (self.body_drag_1_m / math::max(speed, SPEED_MIN_M_S));
        let more =
            |change: &Vector3<f32>| change * (rotors + self.body_drag_1_m * speed) + along * velocity_m_s.dot(change);
        let (q, r) = (jerk + more(a), snap + more(jerk));
        let across = |of: Vector3<f32>| of - up * up.dot(&of);
        let c = up.dot(velocity_m_s);
        let force = math::max(thrust_m_s2, THRUST_MIN_M_S2);
        // c is negative in a descent: the divisor is kept positive.
        let per_force = 1.0 / math::max(force + rotors * c, force * SHARE_MIN);
        // The turn depends on dk/dt, and dk/dt on the turn: first without, then with it.
        let turn = across(q) * per_force;
        let w = velocity_m_s.dot(&turn) + up.dot(a);
        // Blades drag by the root of the thrust, which changes, too.
        let thrust_dot = up.dot(&q) - rotors * w;
        let rotors_dot = 0.5 * rotors * thrust_dot / force;
        let in_plane = across(*velocity_m_s);
        let turn = turn + in_plane * (rotors_dot * per_force);
        let w = velocity_m_s.dot(&turn) + up.dot(a);
        let in_plane_dot = a - turn * c - up * w;
        let jerk = q - (turn * c + up * w) * rotors + in_plane * rotors_dot;
        let thrust_ddot = up.dot(&r) + force * turn.norm_squared() - 2.0 * rotors * turn.dot(a);
        let rotors_ddot = 0.5 * rotors * (thrust_ddot - 0.5 * thrust_dot * thrust_dot / force) / force;
        let r = r + in_plane_dot * (2.0 * rotors_dot) + in_plane * rotors_ddot;
        let turn_dot = across(r - turn * (2.0 * (rotors * w + thrust_dot))) * per_force;
        [jerk, r - (turn_dot * c + turn * (2.0 * w)) * rotors]
    }
}
