//! Nominal model (7) for the baseline and the feed-forward: f_i and g_i without disturbances (A_F = A_T = 0).

use afbc_control::{Errors, math};
use afbc_types::{Axis, Parameters, State};
use nalgebra::{Matrix3, Vector3};

/// Terms of d x_2/dt = f + g u of one subsystem, and dg/dt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dynamics {
    /// f_i \[m/s2 or rad/s2\].
    pub f: f32,
    /// g_i, per unit of the input; positive (A4).
    pub g: f32,
    /// d g_i/dt
    pub g_dot: f32,
}

/// Smallest cos(phi) cos(theta) in g_4, and smallest cos(theta) in d eta/dt: a tilt of 84 degrees. Not in the paper,
/// which assumes A3 instead.
pub const TILT_COSINE_MIN: f32 = 0.1;

/// Sines and cosines of roll and pitch, computed once per step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RollPitch {
    sin_phi: f32,
    cos_phi: f32,
    sin_theta: f32,
    cos_theta: f32,
}

impl RollPitch {
    /// Computes sines and cosines for a state.
    #[inline(always)]
    pub fn new(state: &State) -> Self {
        RollPitch::of(state.attitude_rad.x, state.attitude_rad.y)
    }

    /// Returns the cosine of the tilt.
    #[inline(always)]
    pub fn tilt_cosine(&self) -> f32 {
        self.cos_phi * self.cos_theta
    }

    /// Computes sines and cosines for these angles.
    #[inline(always)]
    pub(crate) fn of(phi: f32, theta: f32) -> Self {
        RollPitch {
            sin_phi: math::sin(phi),
            cos_phi: math::cos(phi),
            sin_theta: math::sin(theta),
            cos_theta: math::cos(theta),
        }
    }

    /// Returns R = Rz(psi) Ry(theta) Rx(phi), from the body to the earth.
    #[inline(always)]
    pub(crate) fn r_earth_body(&self, [sin_psi, cos_psi]: [f32; 2]) -> Matrix3<f32> {
        let RollPitch { sin_phi, cos_phi, sin_theta, cos_theta } = *self;
        Matrix3::new(
            cos_psi * cos_theta,
            cos_psi * sin_theta * sin_phi - sin_psi * cos_phi,
            cos_psi * sin_theta * cos_phi + sin_psi * sin_phi,
            sin_psi * cos_theta,
            sin_psi * sin_theta * sin_phi + cos_psi * cos_phi,
            sin_psi * sin_theta * cos_phi - cos_psi * sin_phi,
            -sin_theta,
            cos_theta * sin_phi,
            cos_theta * cos_phi,
        )
    }

    /// Returns the body rates Omega for d eta/dt.
    #[inline(always)]
    pub(crate) fn body_rates(&self, eta_dot: &Vector3<f32>) -> Vector3<f32> {
        let RollPitch { sin_phi, cos_phi, sin_theta, cos_theta } = *self;
        let [phi, theta, psi] = (*eta_dot).into();
        let level = cos_theta * psi;
        Vector3::new(phi - sin_theta * psi, cos_phi * theta + sin_phi * level, cos_phi * level - sin_phi * theta)
    }

    /// Returns d Omega/dt for Omega of [`RollPitch::body_rates`], d eta/dt and d^2 eta/dt^2.
    #[inline(always)]
    pub(crate) fn body_accelerations(
        &self,
        omega: &Vector3<f32>,
        eta_dot: &Vector3<f32>,
        eta_ddot: &Vector3<f32>,
    ) -> Vector3<f32> {
        // d phi/dt turns the body about its own x, and y and z with it; d theta/dt turns the axis of psi.
        let RollPitch { sin_phi, cos_phi, sin_theta, cos_theta } = *self;
        let [phi, theta, psi] = (*eta_dot).into();
        let turned = theta * psi;
        self.body_rates(eta_ddot)
            + Vector3::new(
                -cos_theta * turned,
                phi * omega.z - sin_phi * sin_theta * turned,
                -phi * omega.y - cos_phi * sin_theta * turned,
            )
    }
}

/// Attitude of the vehicle in one step, with derived quantities that are computed once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attitude {
    /// phi, theta \[rad\].
    pub roll_pitch_rad: [f32; 2],
    /// Sines and cosines of phi and theta.
    pub roll_pitch: RollPitch,
    /// Sine and cosine of psi.
    pub heading: [f32; 2],
    /// R, from the body to the earth.
    pub r_earth_body: Matrix3<f32>,
}

impl Attitude {
    /// Computes the attitude for a state.
    #[inline(always)]
    pub fn of(state: &State) -> Self {
        let [phi, theta, psi] = state.attitude_rad.into();
        let (roll_pitch, heading) = (RollPitch::of(phi, theta), [math::sin(psi), math::cos(psi)]);
        let r_earth_body = roll_pitch.r_earth_body(heading);
        Attitude { roll_pitch_rad: [phi, theta], roll_pitch, heading, r_earth_body }
    }

    /// Returns the direction of the thrust, R e_z.
    #[inline(always)]
    pub fn up(&self) -> Vector3<f32> {
        self.r_earth_body.column(2).into()
    }

    /// Returns an earth frame vector in body axes.
    #[inline(always)]
    pub fn in_body(&self, earth: &Vector3<f32>) -> Vector3<f32> {
        self.r_earth_body.tr_mul(earth)
    }
}

/// Returns the Euler angles' derivatives d eta/dt for these body rates. The model (6) takes d eta/dt as equal to the
/// body rates.
///
/// ```text
/// d psi/dt = (q sin phi + r cos phi) / cos theta
/// d phi/dt = p + sin theta d psi/dt
/// d theta/dt = q cos phi - r sin phi
/// ```
#[inline(always)]
pub(crate) fn euler_rates(rates_rad_s: &Vector3<f32>, at: &RollPitch) -> Vector3<f32> {
    let [p, q, r] = (*rates_rad_s).into();
    let RollPitch { sin_phi, cos_phi, sin_theta, cos_theta } = *at;
    let psi_dot = (q * sin_phi + r * cos_phi) / math::max(cos_theta, TILT_COSINE_MIN);
    Vector3::new(p + sin_theta * psi_dot, q * cos_phi - r * sin_phi, psi_dot)
}

/// Constants a_1..a_5, b_1..b_3, 1/m and g of (6).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelConstants {
    a1: f32,
    a2: f32,
    a3: f32,
    a4: f32,
    a5: f32,
    b1: f32,
    b2: f32,
    b3: f32,
    mass: f32,
    gravity: f32,
}

impl ModelConstants {
    /// Computes the constants of (6) for a vehicle with valid parameters.
    pub fn new(vehicle: &Parameters) -> Self {
        let Parameters { mass_kg, rotor_inertia_kg_m2, gravity_m_s2, .. } = *vehicle;
        let (ix, iy, iz) = (vehicle.inertia_kg_m2.x, vehicle.inertia_kg_m2.y, vehicle.inertia_kg_m2.z);
        let effectiveness = vehicle.effectiveness();
        ModelConstants {
            a1: (iy - iz) / ix,
            // Rotors that push to positive yaw spin negatively, hence the signs of a_2 and a_4.
            a2: rotor_inertia_kg_m2 / ix,
            a3: (iz - ix) / iy,
            a4: -rotor_inertia_kg_m2 / iy,
            a5: (ix - iy) / iz,
            b1: effectiveness.x,
            b2: effectiveness.y,
            b3: effectiveness.z,
            mass: mass_kg,
            gravity: gravity_m_s2,
        }
    }

    /// Returns g_i of `axis` for a level vehicle.
    pub fn hover_gain(&self, axis: Axis) -> f32 {
        match axis {
            Axis::Roll => self.b1,
            Axis::Pitch => self.b2,
            Axis::Yaw => self.b3,
            Axis::Z => 1.0 / self.mass,
            Axis::X | Axis::Y => 1.0,
        }
    }

    /// Returns f_i, g_i and dg_i/dt of `axis`, with d eta/dt in place of Omega as in (6).
    pub fn dynamics(&self, axis: Axis, state: &State, rotor_residual_rad_s: f32) -> Dynamics {
        self.dynamics_at(axis, &state.rates_rad_s, &RollPitch::new(state), rotor_residual_rad_s)
    }

    /// Returns the computable terms of a subsystem's Lyapunov function (14), (27): e_1^2 / 2 + e_2^2 / (2 g_i), with
    /// the paper's weight c = 1 of e_1. The terms of the estimation errors are left out, because the optimal values are
    /// unknown.
    pub fn lyapunov(&self, axis: Axis, state: &State, errors: &Errors) -> f32 {
        // g_i does not depend on the rotors.
        0.5 * errors.e1 * errors.e1 + 0.5 * errors.e2 * errors.e2 / self.dynamics(axis, state, 0.0).g
    }

    /// Returns f of roll, pitch and yaw \[rad/s2\]: the gyroscopic angular acceleration of body and rotors without any
    /// moment.
    #[inline(always)]
    pub(crate) fn gyroscopic(&self, rates: &Vector3<f32>, omega: f32) -> Vector3<f32> {
        Vector3::new(
            rates.y * rates.z * self.a1 + rates.y * self.a2 * omega,
            rates.x * rates.z * self.a3 + rates.x * self.a4 * omega,
            rates.x * rates.y * self.a5,
        )
    }

    /// Returns f_i, g_i and dg_i/dt like [`ModelConstants::dynamics`], for given rates and angles.
    #[inline(always)]
    pub(crate) fn dynamics_at(&self, axis: Axis, rates: &Vector3<f32>, at: &RollPitch, omega: f32) -> Dynamics {
        let constant = |f, g| Dynamics { f, g, g_dot: 0.0 };
        match axis {
            Axis::Roll => constant(self.gyroscopic(rates, omega).x, self.b1),
            Axis::Pitch => constant(self.gyroscopic(rates, omega).y, self.b2),
            Axis::Yaw => constant(self.gyroscopic(rates, omega).z, self.b3),
            Axis::Z => {
                let RollPitch { sin_phi, cos_phi, sin_theta, cos_theta } = *at;
                let tilt_cosine_dot = -sin_phi * cos_theta * rates.x - cos_phi * sin_theta * rates.y;
                Dynamics {
                    f: -self.gravity,
                    g: math::max(at.tilt_cosine(), TILT_COSINE_MIN) / self.mass,
                    g_dot: tilt_cosine_dot / self.mass,
                }
            }
            // The virtual controls u5, u6 are accelerations.
            Axis::X | Axis::Y => constant(0.0, 1.0),
        }
    }
}
