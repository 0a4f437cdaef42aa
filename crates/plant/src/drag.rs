//! Aerodynamic drag: a concrete form of the paper's A_i = 1/2 rho C_i W^2.

use crate::frame::{RotorLayout, RotorSums};
use afbc_types::{Declared, OutOfRange, Parameters, Range, parameters};
use libm::sqrt;
use nalgebra::Vector3;

parameters! {
    /// Drag of blades and body due to the airspeed W = velocity - wind, in body axes.
    ///
    /// * **Blades**: the blades of rotor i give a force -k omega_i (W + Omega x r_i) in the rotor plane, with k =
    ///   `blade_n_s2_m`, that rotor's speed omega_i and the airspeed of its hub at r_i, where the force acts. The sum
    ///   is -k sum(omega_i) W; since the hubs move around the centre of mass, yaw is damped, on the paper's frame with
    ///   the rate 4 k omega l^2/Iz, and rotors of unequal speed in wind give a yaw moment. Linear, and the larger part
    ///   at hover speeds. P. Martin, E. Salaun 2010, *The true role of accelerometer feedback in quadrotor control*,
    ///   ICRA; M. Faessler, A. Franchi, D. Scaramuzza 2018, *Differential flatness of quadrotor dynamics subject to
    ///   rotor drag*, RA-L 3(2), whose mass-normalised 0.2 to 0.6 1/s are this factor times the sum of the rotor speeds
    ///   over the mass.
    /// * **Body**: -1/2 rho C_i S_i |W| W_i along each body axis, which is the paper's A_i for flow along that axis.
    ///   The body's rotation has no effect.
    ///
    /// Wind acts through drag only. The largest blade factor and area also depend on the vehicle and the step, so that
    /// the integration is stable up to [`AIRSPEED_M_S`] ([`Drag::validate_for`]).
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct Drag {
        /// rho: density of the air.
        #[parameter(DENSITY, "kg/m3", 0.0..=5.0)]
        pub air_density_kg_m3: f64 = 1.225,
        /// k: blade force of one rotor per rotor speed and in-plane airspeed.
        #[parameter(BLADE, "N s2/m", 0.0..=1.0)]
        pub blade_n_s2_m: f64 = 2.4e-4,
        /// Height of the rotor plane above the centre of mass, where the blade forces act.
        #[parameter(ROT_HEIGHT, "m", -1.0..=1.0)]
        pub rotor_height_m: f64 = 0.02,
        /// C_i S_i: drag area along each body axis.
        #[parameter(AREA, "m2", 0.0..=100.0)]
        pub area_m2: Vector3<f64> = Vector3::new(0.01, 0.01, 0.02),
        /// Point where the body's drag acts, from the centre of mass, body frame.
        #[parameter(CENTRE, "m", -1.0..=1.0)]
        pub centre_m: Vector3<f64> = Vector3::new(0.0, 0.0, 0.01),
    }
}

/// Airspeed up to which drag is integrated stably \[m/s\].
pub const AIRSPEED_M_S: f64 = 100.0;

/// Largest product of a drag rate and the step. The Runge-Kutta method is stable up to 2.78.
const RATE_PER_STEP_MAX: f64 = 0.5;

impl Drag {
    /// Estimated for the paper's vehicle: blades at 0.4 1/s in hover, a body of about 0.1 m by 0.1 m.
    pub const PAPER: Self = Self::DEFAULT;

    /// Checks every parameter for a vehicle with this frame, rotor speeds up to `max_rad_s`, and this step.
    ///
    /// # Errors
    /// Returns the first parameter that is out of range.
    pub fn validate_for(
        &self,
        vehicle: &Parameters<f64>,
        frame: &RotorLayout,
        max_rad_s: f64,
        step_s: f64,
    ) -> Result<(), OutOfRange> {
        self.validate()?;
        // `rate_max` bounds the rate at which a force in the rotor plane changes the velocity of its hub. The force
        // pushes, tilts and turns the vehicle.
        let Parameters { mass_kg, arm_m, inertia_kg_m2: i, .. } = vehicle;
        let (height_m, rate_max) = (self.rotor_height_m, RATE_PER_STEP_MAX / step_s);
        let hub_per_kg = 1.0 / mass_kg + height_m * height_m / i.x.min(i.y) + arm_m * arm_m * frame.square_max() / i.z;
        Range { max: rate_max / (frame.count() as f64 * max_rad_s * hub_per_kg), ..Self::BLADE.range }
            .check(self.blade_n_s2_m)?;
        let per_area = self.air_density_kg_m3 * AIRSPEED_M_S;
        Range { max: rate_max * mass_kg / per_area, ..Self::AREA.range }.check(self.area_m2.max())
    }

    /// Returns the drag for one step, with arms of `arm_m` and these rotor speeds \[rad/s\].
    #[inline]
    pub(crate) fn held(&self, speeds: &RotorSums, arm_m: f64) -> HeldDrag {
        let RotorSums { all, x, y, square, .. } = *speeds;
        let lever = self.blade_n_s2_m * arm_m;
        HeldDrag {
            blade_n_s_m: self.blade_n_s2_m * all,
            lever_x_n_s: lever * x,
            lever_y_n_s: lever * y,
            yaw_n_m_s: self.blade_n_s2_m * square * arm_m * arm_m,
            rotor_height_m: self.rotor_height_m,
            body_n_s2_m2: self.area_m2 * (0.5 * self.air_density_kg_m3),
            centre_m: self.centre_m,
        }
    }
}

/// Drag at constant rotor speeds, as a function of the motion. The sums over the rotors of k omega_i (1, x_i, y_i,
/// x_i^2 + y_i^2) are precomputed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HeldDrag {
    /// Sum of k omega_i \[N s/m\].
    blade_n_s_m: f64,
    /// Sum of k omega_i x_i \[N s\].
    lever_x_n_s: f64,
    /// Sum of k omega_i y_i \[N s\].
    lever_y_n_s: f64,
    /// Sum of k omega_i (x_i^2 + y_i^2) \[N m s\].
    yaw_n_m_s: f64,
    rotor_height_m: f64,
    /// 1/2 rho C_i S_i \[N s2/m2\].
    body_n_s2_m2: Vector3<f64>,
    centre_m: Vector3<f64>,
}

impl HeldDrag {
    /// Returns force \[N\] and moment \[N m\] in body axes, for the airspeed `w` of the centre of mass \[m/s\] and
    /// `rates` \[rad/s\].
    #[inline]
    pub(crate) fn wrench(&self, w: &Vector3<f64>, rates: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        let h = self.rotor_height_m;
        // W + Omega x r in the middle of the rotor plane. Hub i moves by r (-y_i, x_i) relative to it.
        let (x, y, r) = (w.x + rates.y * h, w.y - rates.x * h, rates.z);
        let blade = Vector3::new(
            self.lever_y_n_s * r - self.blade_n_s_m * x,
            -(self.lever_x_n_s * r) - self.blade_n_s_m * y,
            0.0,
        );
        let yaw = self.lever_y_n_s * x - self.lever_x_n_s * y - self.yaw_n_m_s * r;
        let body = self.body_n_s2_m2.component_mul(w) * -sqrt(w.norm_squared());
        (blade + body, Vector3::new(-h * blade.y, h * blade.x, yaw) + self.centre_m.cross(&body))
    }
}
