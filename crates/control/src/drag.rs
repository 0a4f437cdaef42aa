//! Known drag from the vehicle's file, for laws that compensate it.
//!
//! ```text
//! a = -(k_r sqrt(T/T_h) P + k_b |v|) v        P = 1 - z_b z_b'
//! ```
//!
//! where z_b is the direction of the thrust. Blade drag acts in the rotor plane, in proportion to the blades' speed
//! (Faessler, Franchi, Scaramuzza, *Differential flatness of quadrotor dynamics subject to rotor drag for accurate
//! tracking of high-speed trajectories*, RA-L 3(2), 2018). Body drag grows with the square of the speed. The wind is
//! unknown, so v is the speed over the ground.

use crate::math;
use afbc_types::parameters;
use nalgebra::Vector3;

/// Smallest speed used as a divisor in the derivative of the body drag \[m/s\].
const SPEED_MIN_M_S: f32 = 0.01;
/// Smallest thrust used as a divisor \[m/s2\], and smallest share of it left after the drag along the thrust.
const THRUST_MIN_M_S2: f32 = 1.0;
const SHARE_MIN: f32 = 0.3;

parameters! {
    /// Drag per mass. The default is no drag.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
    #[cfg_attr(feature = "defmt", derive(defmt::Format))]
    pub struct KnownDrag {
        /// k_r: drag of the rotors when hovering, per mass and speed; a vehicle's file states it in `[drag]`.
        #[parameter(DRAG_ROTOR, "1/s", 0.0..=10.0)]
        pub rotor_drag_1_s: f32 = 0.0,
        /// k_b: drag of the body along x and y, per mass and speed squared; a vehicle's file states it in `[drag]`.
        #[parameter(DRAG_BODY, "1/m", 0.0..=10.0)]
        pub body_drag_1_m: f32 = 0.0,
        /// h: height of the rotors above the centre of mass, where their drag acts; a vehicle's file states it in
        /// `[drag]`.
        #[parameter(DRAG_HEIGHT, "m", -1.0..=1.0)]
        pub rotor_height_m: f32 = 0.0,
    }
}

impl KnownDrag {
    /// No drag.
    pub const NONE: Self = Self::DEFAULT;
    /// Drag of the paper's vehicle in `vehicles/paper.toml`, to which a test compares it.
    pub const PAPER: Self =
        KnownDrag { rotor_drag_1_s: 0.394_782_78, body_drag_1_m: 0.012_602_881, rotor_height_m: 0.02 };

    /// Returns the acceleration due to drag \[m/s2\] at `velocity_m_s`, with the thrust along the unit vector `up` and
    /// at `share` of the hover thrust.
    #[inline]
    pub fn acceleration(&self, velocity_m_s: &Vector3<f32>, up: &Vector3<f32>, share: f32) -> Vector3<f32> {
        let in_plane = velocity_m_s - up * up.dot(velocity_m_s);
        let rotors = self.rotor_drag_1_s * math::sqrt(math::max(share, 0.0));
        let body = self.body_drag_1_m * math::sqrt(velocity_m_s.norm_squared());
        in_plane * -rotors - velocity_m_s * body
    }

    /// Returns the moment per mass about the body axes \[m2/s2\] due to blade drag, which acts above the centre of
    /// mass. The velocity is in body coordinates.
    #[inline]
    pub fn moment(&self, velocity_body_m_s: &Vector3<f32>, share: f32) -> Vector3<f32> {
        let lever = self.rotor_height_m * self.rotor_drag_1_s * math::sqrt(math::max(share, 0.0));
        Vector3::new(lever * velocity_body_m_s.y, -lever * velocity_body_m_s.x, 0.0)
    }

    /// Returns jerk and snap of the thrust per mass f \[m/s3, m/s4\] that give the velocity these three derivatives.
    /// The thrust is `thrust_m_s2` along `up`, and `share` of the hover thrust.
    ///
    /// Let u = f/|f| and k = k_r sqrt(T/T_h). f must compensate the blade drag k P v = k (v - c u) with c = u v, and
    /// the body drag b(v), whose derivative along a is b'(a). The direction u turns with f, so its derivatives appear
    /// in those of f:
    ///
    /// ```text
    /// df/dt    =  q - k (c du/dt + w u) + dk/dt P v                 q = j + k a + b'(a)    w = v du/dt + u a
    /// d2f/dt2  =  r - k (c d2u/dt2 + 2w du/dt) + 2 dk/dt (a - c du/dt - w u) + d2k/dt2 P v    r = s + k j + b'(j)
    /// du/dt    =  P (q + dk/dt P v) / (|f| + k c)
    /// d2u/dt2  =  P (d2f/dt2 - 2 d|f|/dt du/dt) / |f|
    /// ```
    ///
    /// In the second derivative, the terms along u, which turn nothing, and the second derivative of b are neglected.
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
        // c is negative in a descent: keep the divisor positive.
        let per_force = 1.0 / math::max(force + rotors * c, force * SHARE_MIN);
        // The turn depends on dk/dt, and dk/dt on the turn: compute the turn without, then with dk/dt.
        let turn = across(q) * per_force;
        let w = velocity_m_s.dot(&turn) + up.dot(a);
        // Blade drag grows with the root of the thrust, which changes as well.
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
