//! The vehicle's physical parameters.

use crate::{ParameterNumber, parameters};
use nalgebra::Vector3;

parameters! {
    /// Physical parameters of a quadrotor, Sections II and IV. The control law has their nominal values in `f32`, the
    /// plant their true values in `f64`. The ranges admit vehicles from palm size up to passenger drones.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
    #[cfg_attr(
        feature = "serde",
        serde(bound = "T: crate::ParameterNumber + serde::Serialize + serde::de::DeserializeOwned")
    )]
    #[cfg_attr(feature = "defmt", derive(defmt::Format))]
    pub struct Parameters<T = f32, f64> {
        /// m: mass of the vehicle.
        #[parameter(MASS, "kg", 0.01..=500.0)]
        pub mass_kg: T = 0.486,
        /// l: distance from the centre of mass to a rotor shaft.
        #[parameter(ARM, "m", 0.01..=10.0)]
        pub arm_m: T = 0.25,
        /// diag(Ix, Iy, Iz): inertia about the body axes.
        #[parameter(INERTIA, "kg m2", 1e-6..=1e3)]
        pub inertia_kg_m2: Vector3<T> = Vector3::new(0.0038, 0.0038, 0.0076),
        /// I_r: inertia of one rotor with its propeller, about its shaft.
        #[parameter(ROT_INERTIA, "kg m2", 0.0..=10.0)]
        pub rotor_inertia_kg_m2: T = 3.357e-5,
        /// b: thrust factor of a rotor, F = b omega^2.
        #[parameter(THRUST, "N s2", 1e-10..=1.0)]
        pub thrust_factor_n_s2: T = 2.984e-5,
        /// d: drag factor of a rotor, moment = d omega^2.
        #[parameter(DRAG, "N m s2", 1e-12..=1.0)]
        pub drag_factor_n_m_s2: T = 3.232e-7,
        /// g: acceleration of free fall.
        #[parameter(GRAVITY, "m/s2", 0.1..=30.0)]
        pub gravity_m_s2: T = 9.81,
    }
}

impl<T: ParameterNumber> Parameters<T> {
    /// Returns the weight m g \[N\].
    #[must_use]
    pub fn weight_n(&self) -> T {
        self.mass_kg * self.gravity_m_s2
    }

    /// Returns l/Ix, l/Iy, (d/b)/Iz: angular acceleration about each body axis per newton of U1, U2, U3 \[rad/s2 per
    /// N\].
    #[must_use]
    pub fn effectiveness(&self) -> Vector3<T> {
        let (l, i) = (self.arm_m, &self.inertia_kg_m2);
        let c = self.drag_factor_n_m_s2 / self.thrust_factor_n_s2;
        Vector3::new(l / i.x, l / i.y, c / i.z)
    }
}

impl Parameters<f64> {
    /// The vehicle of Section IV.
    pub const PAPER: Self = Self::DEFAULT;

    /// Returns the parameters in the controller's precision.
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
