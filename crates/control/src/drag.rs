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

    /// Returns by what that acceleration changes \[m/s3\] while the velocity does at `change`, thrust and `up` held;
    /// for a `change` of that change, the same of it.
    #[inline]
    pub fn change(
        &self,
        velocity_m_s: &Vector3<f32>,
        up: &Vector3<f32>,
        share: f32,
        change: &Vector3<f32>,
    ) -> Vector3<f32> {
        let in_plane = change - up * up.dot(change);
        let rotors = self.rotor_drag_1_s * math::sqrt(math::max(share, 0.0));
        // d(|v| v) = |v| dv + v (v dv)/|v|
        let speed = math::sqrt(velocity_m_s.norm_squared());
        let along = velocity_m_s * (velocity_m_s.dot(change) / math::max(speed, SPEED_MIN_M_S));
        in_plane * -rotors - (change * speed + along) * self.body_drag_1_m
    }
}
