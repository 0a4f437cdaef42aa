//! Forces of air and ground, which depend on position and velocity within a step.

use crate::body_axes::BodyAxes;
use crate::contact::SimulatedGround;
use crate::drag::HeldDrag;
use crate::ratios::Ratios;
use nalgebra::Vector3;

/// Air and ground over one step: the wind is constant, drag and contact follow the motion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AirAndGround<'a> {
    drag: Option<&'a HeldDrag>,
    /// Velocity of the air, earth frame \[m/s\].
    wind_m_s: Vector3<f64>,
    ground: Option<&'a SimulatedGround>,
    ratios: &'a Ratios,
}

impl<'a> AirAndGround<'a> {
    pub(crate) fn new(
        ratios: &'a Ratios,
        drag: Option<&'a HeldDrag>,
        wind_m_s: Vector3<f64>,
        ground: Option<&'a SimulatedGround>,
    ) -> Self {
        AirAndGround { drag, wind_m_s, ground, ratios }
    }

    /// Returns true if there are no such forces.
    #[inline]
    pub(crate) fn are_empty(&self) -> bool {
        self.drag.is_none() && self.ground.is_none()
    }

    /// Returns the contributions to d^2 xi/dt^2 \[m/s2\], earth frame, and to d Omega/dt \[rad/s2\], body frame.
    // This function is always inlined: passing its vectors through memory costs more than its arithmetic.
    #[inline(always)]
    pub(crate) fn accelerations(
        &self,
        height_m: f64,
        velocity_m_s: &Vector3<f64>,
        axes: &BodyAxes,
        rates_rad_s: &Vector3<f64>,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let (mut force, mut moment) = match &self.drag {
            Some(drag) => {
                let airspeed = axes.to_body(&(velocity_m_s - self.wind_m_s));
                let (force, moment) = drag.wrench(&airspeed, rates_rad_s);
                (axes.to_earth(&force), moment)
            }
            None => (Vector3::zeros(), Vector3::zeros()),
        };
        if let Some(ground) = self.ground {
            let (ground_force, ground_moment) = ground.wrench(height_m, velocity_m_s, axes, rates_rad_s);
            force += ground_force;
            moment += ground_moment;
        }
        (force * self.ratios.per_mass, moment.component_mul(&self.ratios.per_inertia))
    }
}
