//! Contact with the ground.

use crate::body_axes::BodyAxes;
use afbc_types::{Declared, OutOfRange, Parameters, Range, parameters};
use libm::sqrt;
use nalgebra::Vector3;

parameters! {
    /// The ground, the plane z = 0, below four feet under the arms and the four rotors, which touch it upside down.
    ///
    /// Each of these points is a spring and a damper that push and never pull, N = max(0, -k z - c dz/dt): the linear
    /// model in D. W. Marhefka, D. E. Orin 1999, *A compliant contact model with nonlinear damping for simulation of
    /// robotic systems*, IEEE Trans. SMC-A 29(6). Friction opposes slip; it is viscous with the damper's c up to
    /// Coulomb's mu N, which keeps the integration stable but lets a steady push creep: 10 mm/s under 0.3 N on the
    /// paper's vehicle.
    ///
    /// The smallest sink and the largest damping also depend on the vehicle and the step, so that the integration is
    /// stable ([`Contact::validate_for`]).
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct Contact {
        /// Compression of the feet's springs by the vehicle at rest; determines their stiffness k.
        #[parameter(SINK, "m", 1e-5..=0.5)]
        pub sink_m: f64 = 0.005,
        /// Damping ratio of the vehicle on its feet; with 1, the vehicle does not bounce. Determines c.
        #[parameter(DAMPING, "1", 0.05..=5.0)]
        pub damping_ratio: f64 = 0.7,
        /// mu: coefficient of friction.
        #[parameter(FRICTION, "1", 0.0..=3.0)]
        pub friction: f64 = 0.6,
        /// Distance of each foot from the body's z axis.
        #[parameter(FOOT_RAD, "m", 0.0..=10.0)]
        pub foot_radius_m: f64 = 0.12,
        /// Depth of the feet below the centre of mass.
        #[parameter(FOOT_DEPTH, "m", 0.001..=10.0)]
        pub foot_depth_m: f64 = 0.08,
        /// Height of the rotors above the centre of mass.
        #[parameter(ROT_HEIGHT, "m", 0.0..=10.0)]
        pub rotor_height_m: f64 = 0.02,
    }
}

/// Limits for stable integration: largest (natural frequency times step)^2 of the stiffest motion, and largest damping
/// rate times step. The Runge-Kutta method is stable up to 8 and 2.78; the margin covers released payloads and changed
/// inertia.
const STIFFNESS_PER_STEP_MAX: f64 = 0.5;
const DAMPING_PER_STEP_MAX: f64 = 1.4;

impl Contact {
    /// Estimated for the paper's vehicle.
    pub const PAPER: Self = Self::DEFAULT;

    /// Checks every parameter for this vehicle and step.
    ///
    /// # Errors
    /// Returns the first parameter that is out of range.
    pub fn validate_for(&self, vehicle: &Parameters<f64>, step_s: f64) -> Result<(), OutOfRange> {
        self.validate()?;
        // Largest acceleration of a point per force on it, with all four feet at the longest lever.
        let lever_m = self.ground(vehicle).reach_m;
        let compliance = 1.0 / vehicle.mass_kg + lever_m * lever_m / vehicle.inertia_kg_m2.min();
        let weight_n = vehicle.weight_n();
        let softest = weight_n * compliance * step_s * step_s / STIFFNESS_PER_STEP_MAX;
        Range { min: softest, ..Self::SINK.range }.check(self.sink_m)?;
        let per_ratio =
            4.0 * Contact { damping_ratio: 1.0, ..*self }.ground(vehicle).damping_n_s_m * compliance * step_s;
        Range { max: DAMPING_PER_STEP_MAX / per_ratio, ..Self::DAMPING.range }.check(self.damping_ratio)
    }

    /// Returns the ground contact of this vehicle.
    pub(crate) fn ground(&self, vehicle: &Parameters<f64>) -> SimulatedGround {
        let stiffness_n_m = vehicle.weight_n() / (4.0 * self.sink_m);
        let (feet, arm) = (self.foot_radius_m, vehicle.arm_m);
        let around = |radius: f64, z: f64| {
            [(radius, 0.0), (0.0, radius), (-radius, 0.0), (0.0, -radius)].map(|(x, y)| Vector3::new(x, y, z))
        };
        let points = [around(feet, -self.foot_depth_m), around(arm, self.rotor_height_m)];
        let reach = |[point, ..]: &[Vector3<f64>; 4]| sqrt(point.norm_squared());
        SimulatedGround {
            stiffness_n_m,
            // Four feet share 2 zeta sqrt(4 k m).
            damping_n_s_m: 0.5 * self.damping_ratio * sqrt(4.0 * stiffness_n_m * vehicle.mass_kg),
            friction: self.friction,
            reach_m: points.iter().map(reach).fold(0.0, f64::max),
            points,
        }
    }
}

/// A vehicle counts as near if it can fall to the ground within this time, which is longer than any step \[s\].
const NEAR_S: f64 = 0.04;
/// Margin on the reach of feet and rotors, so that a vehicle just above the ground counts as near, too \[m\].
const NEAR_M: f64 = 0.02;

/// Ground below one vehicle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SimulatedGround {
    /// Stiffness k and damping c of each point.
    stiffness_n_m: f64,
    damping_n_s_m: f64,
    friction: f64,
    /// Distance of the farthest point from the centre of mass. Above this height nothing touches the ground.
    reach_m: f64,
    /// Feet and rotors, body frame \[m\].
    points: [[Vector3<f64>; 4]; 2],
}

impl SimulatedGround {
    /// Returns true if a vehicle at this height may touch the ground within a step.
    #[inline]
    pub(crate) fn is_near(&self, height_m: f64, climb_m_s: f64) -> bool {
        height_m + NEAR_S * climb_m_s.min(0.0) < self.reach_m + NEAR_M
    }

    /// Returns true if any point is below the ground.
    pub(crate) fn touches(&self, height_m: f64, axes: &BodyAxes) -> bool {
        self.points.iter().flatten().any(|point| height_m + axes.height(point) < 0.0)
    }

    /// Returns force, earth frame \[N\], and moment, body frame \[N m\], on a moving vehicle at `height_m`.
    // This function is not inlined, because it is only called near the ground.
    #[inline(never)]
    pub(crate) fn wrench(
        &self,
        height_m: f64,
        velocity_m_s: &Vector3<f64>,
        axes: &BodyAxes,
        rates_rad_s: &Vector3<f64>,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let (mut force, mut moment) = (Vector3::zeros(), Vector3::zeros());
        for point in self.points.iter().flatten() {
            let depth_m = -(height_m + axes.height(point));
            if depth_m > 0.0 {
                let at_point = self.push(depth_m, &(velocity_m_s + axes.to_earth(&rates_rad_s.cross(point))));
                force += at_point;
                moment += point.cross(&axes.to_body(&at_point));
            }
        }
        (force, moment)
    }

    /// Returns the force on one point `depth_m` below the ground, earth frame \[N\].
    fn push(&self, depth_m: f64, velocity_m_s: &Vector3<f64>) -> Vector3<f64> {
        let normal_n = (self.stiffness_n_m * depth_m - self.damping_n_s_m * velocity_m_s.z).max(0.0);
        let slip_m_s = sqrt(velocity_m_s.x * velocity_m_s.x + velocity_m_s.y * velocity_m_s.y);
        // The larger of two divisors makes the friction viscous up to its limit, without a division by zero.
        let drag = self.damping_n_s_m * self.friction * normal_n
            / (self.damping_n_s_m * slip_m_s).max(self.friction * normal_n).max(f64::MIN_POSITIVE);
        Vector3::new(-drag * velocity_m_s.x, -drag * velocity_m_s.y, normal_n)
    }
}
