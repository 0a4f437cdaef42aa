//! Forces and moments over one step.

use crate::environment::{Segment, WrenchEffect};
use crate::frame::{PerRotor, RotorLayout, RotorSums};
use afbc_types::Parameters;
use nalgebra::Vector3;

/// Forces and moments that are constant during one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Load {
    /// Thrust of all rotors per mass, along body z \[m/s2\].
    thrust_m_s2: f64,
    gravity_m_s2: f64,
    /// Moment of the rotors divided by the inertia, body frame \[rad/s2\].
    rotor_rad_s2: Vector3<f64>,
    /// Disturbance \[A_x, A_y, A_z\] \[m/s2\].
    a_force: Vector3<f64>,
    /// Disturbance \[A_phi, A_theta, A_psi\] \[rad/s2\].
    a_moment: Vector3<f64>,
    /// Coefficients a_1, a_3, a_5 of (6).
    coupling: Vector3<f64>,
    /// I_r omega divided by Ix and Iy: a_2 omega, -a_4 omega \[1/s\].
    gyroscopic: [f64; 2],
}

impl Load {
    /// Computes the load of rotors at `speeds_rad_s` on a vehicle with these parameters and the paper's frame, with the
    /// paper's disturbances `a_force` = \[A_x, A_y, A_z\] (earth) and `a_moment` = \[A_phi, A_theta, A_psi\] (body).
    #[inline]
    pub fn new(
        parameters: &Parameters<f64>,
        speeds_rad_s: [f64; 4],
        a_force: Vector3<f64>,
        a_moment: Vector3<f64>,
    ) -> Self {
        let [w1, w2, w3, w4] = speeds_rad_s;
        let speeds = PerRotor::from([w1, w2, w3, w4, 0.0, 0.0, 0.0, 0.0]);
        let segment = Segment::new(*parameters, WrenchEffect::intact(), [a_force, a_moment], f64::INFINITY);
        Self::ideal(&segment, &RotorLayout::default(), &speeds)
    }

    /// Computes the load of ideal rotors on any frame, including the segment's moment factors and levers.
    #[inline]
    pub(crate) fn ideal(segment: &Segment, frame: &RotorLayout, speeds_rad_s: &PerRotor) -> Self {
        let squares = speeds_rad_s.map(|w| w * w);
        let [speeds, squares] = [speeds_rad_s, &squares].map(|values| frame.sums(values));
        Self::of_rotors(segment, [&speeds, &squares], 1.0)
    }

    /// Computes the load from sums over the rotors' `speeds` \[rad/s\] and over their `squares` \[rad2/s2\], which
    /// already include each rotor's efficiency. Thrusts and drag moments follow from the squares; thrusts are also
    /// multiplied by `thrust_ratio`.
    #[inline]
    pub(crate) fn of_rotors(segment: &Segment, [speeds, squares]: [&RotorSums; 2], thrust_ratio: f64) -> Self {
        let Segment { parameters, ratios, rig, a_force, a_moment, .. } = segment;
        let Parameters { mass_kg, arm_m, inertia_kg_m2: i, rotor_inertia_kg_m2, .. } = *parameters;
        let RotorSums { all, x, y, spin, .. } = *squares;
        let (b, d) = (thrust_ratio * parameters.thrust_factor_n_s2, parameters.drag_factor_n_m_s2);
        let (thrust_n, WrenchEffect { moments, lever_m }) = (b * all, rig);
        let momentum = rotor_inertia_kg_m2 * speeds.spin;
        Load {
            thrust_m_s2: thrust_n / mass_kg,
            gravity_m_s2: parameters.gravity_m_s2,
            rotor_rad_s2: Vector3::new(
                moments.x * (arm_m * b * y / i.x) - lever_m.x * thrust_n / i.x,
                moments.y * (arm_m * b * -x / i.y) - lever_m.y * thrust_n / i.y,
                moments.z * (d * spin / i.z),
            ),
            a_force: *a_force,
            a_moment: *a_moment,
            coupling: ratios.coupling,
            gyroscopic: [momentum / i.x, momentum / i.y],
        }
    }

    /// Returns the thrust of all rotors per mass \[m/s2\].
    pub(crate) fn thrust_m_s2(&self) -> f64 {
        self.thrust_m_s2
    }

    /// Returns d^2 xi/dt^2 in the earth frame \[m/s2\], given the direction of body z in the earth frame.
    #[inline]
    pub(crate) fn acceleration(&self, body_z: &Vector3<f64>) -> Vector3<f64> {
        body_z * self.thrust_m_s2 - Vector3::new(0.0, 0.0, self.gravity_m_s2) - self.a_force
    }

    /// Returns d Omega/dt in the body frame \[rad/s2\]: rotors, Omega x I Omega, rotor gyroscopics, disturbance.
    #[inline]
    pub(crate) fn angular_acceleration(&self, rates: &Vector3<f64>) -> Vector3<f64> {
        let (p, q, r) = (rates.x, rates.y, rates.z);
        let [gyro_x, gyro_y] = self.gyroscopic;
        let cross = self.coupling.component_mul(&Vector3::new(q * r, p * r, p * q));
        self.rotor_rad_s2 + cross + Vector3::new(q * gyro_x, -p * gyro_y, 0.0) - self.a_moment
    }
}
