//! The vehicle's physical parameters.

use crate::OutOfRange;
use nalgebra::Vector3;

/// Physical parameters of a quadrotor, Section II and IV. The law holds nominal ones in `f32`, the plant its own, true
/// ones in `f64`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters<T = f32> {
    /// m \[kg\].
    pub mass_kg: T,
    /// l: centre of mass to rotor shaft \[m\].
    pub arm_m: T,
    /// diag(Ix, Iy, Iz) about the body axes \[kg m2\].
    pub inertia_kg_m2: Vector3<T>,
    /// I_r: one rotor with its propeller, about its shaft \[kg m2\].
    pub rotor_inertia_kg_m2: T,
    /// b: F = b omega^2 \[N s2\].
    pub thrust_factor_n_s2: T,
    /// d: drag moment = d omega^2 \[N m s2\].
    pub drag_factor_n_m_s2: T,
    /// g \[m/s2\].
    pub gravity_m_s2: T,
}

/// Accepted range of each parameter, from palm-sized vehicles to those that carry a person.
#[expect(missing_docs, reason = "named after the field that each bounds")]
pub mod limits {
    use crate::Range;
    pub const MASS: Range = Range::new("mass_kg", 0.01, 500.0);
    pub const ARM: Range = Range::new("arm_m", 0.01, 10.0);
    pub const INERTIA: Range = Range::new("inertia_kg_m2", 1e-6, 1e3);
    pub const ROTOR_INERTIA: Range = Range::new("rotor_inertia_kg_m2", 0.0, 10.0);
    pub const THRUST_FACTOR: Range = Range::new("thrust_factor_n_s2", 1e-10, 1.0);
    pub const DRAG_FACTOR: Range = Range::new("drag_factor_n_m_s2", 1e-12, 1.0);
    pub const GRAVITY: Range = Range::new("gravity_m_s2", 0.1, 30.0);
}

impl Parameters<f64> {
    /// The vehicle of Section IV.
    pub const PAPER: Self = Parameters {
        mass_kg: 0.486,
        arm_m: 0.25,
        inertia_kg_m2: Vector3::new(0.0038, 0.0038, 0.0076),
        rotor_inertia_kg_m2: 3.357e-5,
        thrust_factor_n_s2: 2.984e-5,
        drag_factor_n_m_s2: 3.232e-7,
        gravity_m_s2: 9.81,
    };

    /// The same parameters, rounded for the controller.
    pub fn to_f32(&self) -> Parameters<f32> {
        Parameters {
            mass_kg: self.mass_kg as f32,
            arm_m: self.arm_m as f32,
            inertia_kg_m2: self.inertia_kg_m2.map(|i| i as f32),
            rotor_inertia_kg_m2: self.rotor_inertia_kg_m2 as f32,
            thrust_factor_n_s2: self.thrust_factor_n_s2 as f32,
            drag_factor_n_m_s2: self.drag_factor_n_m_s2 as f32,
            gravity_m_s2: self.gravity_m_s2 as f32,
        }
    }
}

impl<T: nalgebra::Scalar + Copy + Into<f64>> Parameters<T> {
    /// Checks every parameter against [`limits`].
    ///
    /// # Errors
    /// The first one out of range, by name.
    pub fn validate(&self) -> Result<(), OutOfRange> {
        limits::MASS.check(self.mass_kg)?;
        limits::ARM.check(self.arm_m)?;
        limits::INERTIA.check(self.inertia_kg_m2.x)?;
        limits::INERTIA.check(self.inertia_kg_m2.y)?;
        limits::INERTIA.check(self.inertia_kg_m2.z)?;
        limits::ROTOR_INERTIA.check(self.rotor_inertia_kg_m2)?;
        limits::THRUST_FACTOR.check(self.thrust_factor_n_s2)?;
        limits::DRAG_FACTOR.check(self.drag_factor_n_m_s2)?;
        limits::GRAVITY.check(self.gravity_m_s2)
    }
}
