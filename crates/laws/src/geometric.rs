//! Geometric tracking on SE(3).
//!
//! Lee, Leok, McClamroch, *Geometric tracking control of a quadrotor UAV on SE(3)*, CDC 2010, in frames with z up; the
//! integral terms, 0 in the original, are those of Goodarzi, Lee, Leok, *Geometric nonlinear PID control of a quadrotor
//! UAV on SE(3)*, ECC 2013. With e_x = x - x_d, e_v = v - v_d:
//!
//! ```text
//! s   = -k_x e_x - k_v e_v - sat(k_i int e_x) + g e_z + a_d, within Limits      specific force: F/m of the paper
//! f   = m s . R e_3                                                             thrust
//! R_d: third column along s, heading psi_d
//! e_R = (R_d' R - R' R_d)^v / 2,  e_Omega = Omega - R' R_d Omega_d
//! I^-1 M = -k_R e_R - k_Omega e_Omega - sat(k_I int(e_Omega + c e_R))
//!          + I^-1 (Omega x I Omega) - (Omega x R' R_d Omega_d - R' R_d dOmega_d/dt)
//! ```
//!
//! # Decisions
//!
//! * **Gains** are the paper's divided by mass and inertia: k_x, k_R in 1/s2, k_v, k_Omega in 1/s. Yaw has its own k_R
//!   and k_Omega, because its control authority is a sixtieth of that of roll and pitch; the proof has one number for
//!   all axes.
//! * **R_d, Omega_d and dOmega_d/dt** need two derivatives of s, which contains the measured state. So s first passes a
//!   critically damped second-order filter w^2/(s + w)^2, which gives the filtered s with ds/dt and d2s/dt2 exactly
//!   (command filtering, as in AFBC). R_d follows the filtered s. Omega_d is that of [`crate::flatness`], and
//!   dOmega_d/dt uses one more derivative of s and psi_d. The products of rates are neglected: at 1 rad/s they are 1
//!   rad/s2, while k_R e_R is tens. The setpoint's jerk and snap are not used.
//! * **Heading**: b1 is perpendicular to y_C, so that the yaw of R_d is exactly psi_d. The paper projects a freely
//!   chosen direction; this is one such choice.
//! * **Limits**: the paper assumes that s never vanishes and that rotor forces are unlimited; here
//!   [`SpecificForceLimits`] bounds s.
//! * **Integrals**: the position integral is of e_x alone. The source adds the integral of e_v, which is e_x and thus
//!   part of k_x. In the attitude integral, c = k_R / k_Omega. The integrals are bounded by
//!   +-[`Gains::position_integral_max_m_s2`] and +-20 rad/s2. Anti-windup stops them where limits or rotors are
//!   saturated.

use crate::attitude::{geometric_error, r_earth_body, unit};
use crate::body::{Demand, NominalVehicle};
use crate::differentiator::{Differentiator, DifferentiatorMemory};
use crate::flatness::{AttitudeReference, DesiredFrame};
use crate::integral::{RATE_INTEGRAL_MAX_RAD_S2, away_from, integrate};
use crate::limits::SpecificForceLimits;
use crate::loops::{TrackingLoop, TrackingOutput, xy_and_z};
use afbc_control::{Action, FlightController, Mixer, Settings, Smoothed, Smoothing, Trace};
use afbc_types::{Airframe, Declared, OutOfRange, Setpoint, State, parameters};
use nalgebra::Vector3;

parameters! {
    /// Gains and limits. Defaults are the result of `sitl tune` for the paper's vehicle with a rotor lag of 20 ms
    /// (`docs/tuning.md`).
    ///
    /// For the law of Lee et al. 2010, leave the four integrals (names with `_i_`) at 0.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct Gains {
        /// k_x along x and y.
        #[parameter(POS_P, "1/s2", 0.5..=100.0, tuned)]
        pub position_p_1_s2: f32 = 43.59,
        /// k_v along x and y.
        #[parameter(POS_D, "1/s", 0.5..=20.0, tuned)]
        pub position_d_1_s: f32 = 13.18,
        /// k_i along x and y.
        #[parameter(POS_I, "1/s3", 0.0..=200.0, tuned)]
        pub position_i_1_s3: f32 = 179.6,
        /// k_x along z.
        #[parameter(HEIGHT_P, "1/s2", 0.5..=200.0, tuned)]
        pub height_p_1_s2: f32 = 72.05,
        /// k_v along z.
        #[parameter(HEIGHT_D, "1/s", 0.5..=60.0, tuned)]
        pub height_d_1_s: f32 = 35.56,
        /// k_i along z.
        #[parameter(HEIGHT_I, "1/s3", 0.0..=300.0, tuned)]
        pub height_i_1_s3: f32 = 47.22,
        /// k_R of roll and pitch: gain on the attitude error.
        #[parameter(TILT_P, "1/s2", 10.0..=1000.0, tuned)]
        pub tilt_p_1_s2: f32 = 191.2,
        /// k_Omega of roll and pitch: gain on the error of the angular rate.
        #[parameter(TILT_D, "1/s", 2.0..=100.0, tuned)]
        pub tilt_d_1_s: f32 = 35.66,
        /// k_I of roll and pitch: gain on the integral of the attitude error.
        #[parameter(TILT_I, "1/s2", 0.0..=500.0, tuned)]
        pub tilt_i_1_s2: f32 = 43.27,
        /// k_R of yaw: gain on the yaw error.
        #[parameter(YAW_P, "1/s2", 0.5..=200.0, tuned)]
        pub yaw_p_1_s2: f32 = 80.45,
        /// k_Omega of yaw: gain on the error of the yaw rate.
        #[parameter(YAW_D, "1/s", 0.5..=40.0, tuned)]
        pub yaw_d_1_s: f32 = 16.45,
        /// k_I of yaw: gain on the integral of the yaw error.
        #[parameter(YAW_I, "1/s2", 0.0..=100.0, tuned)]
        pub yaw_i_1_s2: f32 = 26.96,
        /// w: bandwidth of the filter on the specific force.
        #[parameter(FILTER, "rad/s", 10.0..=500.0, tuned)]
        pub filter_rad_s: f32 = 26.5,
        /// Largest position integral, per coordinate.
        #[parameter(POS_INT_MAX, "m/s2", 0.0..=50.0)]
        pub position_integral_max_m_s2: f32 = 10.0,
        /// Largest tilt.
        #[parameter(TILT_MAX, "rad", 0.05..=1.2)]
        pub tilt_max_rad: f32 = 0.7,
        /// Filters on U1..U4.
        #[group("")]
        pub smoothing: Smoothing = Smoothing {
            smooth_tilt_rad_s: 92.94,
            smooth_yaw_rad_s: 116.5,
            smooth_lift_rad_s: 77.0,
            lead_s: 0.02306,
        },
    }
}

impl Gains {
    /// Gains of the law that Lee published in 2010, without integrals. They are tuned by hand for the paper's vehicle
    /// with a rotor lag of 20 ms.
    pub const LEE_2010: Self = Gains {
        position_p_1_s2: 16.0,
        position_d_1_s: 8.0,
        position_i_1_s3: 0.0,
        height_p_1_s2: 25.0,
        height_d_1_s: 12.0,
        height_i_1_s3: 0.0,
        tilt_p_1_s2: 250.0,
        tilt_d_1_s: 26.0,
        tilt_i_1_s2: 0.0,
        yaw_p_1_s2: 24.0,
        yaw_d_1_s: 8.0,
        yaw_i_1_s2: 0.0,
        filter_rad_s: 60.0,
        position_integral_max_m_s2: 10.0,
        tilt_max_rad: 0.7,
        smoothing: Smoothing::DEFAULT,
    };

    /// Gains of the law with the integral terms of 2013, tuned by `sitl tune` for the paper's vehicle with a rotor lag
    /// of 20 ms (`docs/tuning.md`).
    pub const TUNED: Self = Self::DEFAULT;

    /// Gains of the law with the integral terms that Goodarzi published in 2013. They are tuned by hand for the paper's
    /// vehicle with a rotor lag of 20 ms.
    pub const GOODARZI_2013: Self =
        Gains { position_i_1_s3: 25.0, height_i_1_s3: 60.0, tilt_i_1_s2: 20.0, yaw_i_1_s2: 10.0, ..Self::LEE_2010 };
}

/// Geometric controller with its constants. Everything that changes in flight is in [`Memory`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geometric<const N: usize = 4> {
    pub(crate) body: NominalVehicle<N>,
    position: TrackingLoop,
    filter: Differentiator,
    dt_s: f32,
    k_r: Vector3<f32>,
    k_omega: Vector3<f32>,
    /// k_I
    k_integral: Vector3<f32>,
    /// c = k_R / k_Omega \[1/s\]
    c: Vector3<f32>,
}

/// State of the controller between steps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Memory {
    /// sat(k_i int (x_d - x)), earth frame \[m/s2\].
    pub position_integral: Vector3<f32>,
    /// sat(-k_I int(e_Omega + c e_R)), body frame \[rad/s2\].
    pub attitude_integral: Vector3<f32>,
    /// Unallocated part of U1..U3 in the last step \[N\].
    unallocated: Vector3<f32>,
    specific_force: DifferentiatorMemory,
    pub(crate) smoothed: Option<Smoothed>,
    /// Trace of the last step.
    pub(crate) trace: Trace,
}

/// Errors that the integrals learn from in a step.
pub(crate) struct IntegralErrors {
    position: TrackingOutput,
    /// -(e_Omega + c e_R) \[rad/s\]
    attitude: Vector3<f32>,
}

/// Returns the attitude along a specific force with two derivatives \[m/s2, m/s3, m/s4\], at the setpoint's heading,
/// neglecting products of rates. The specific force must point up.
#[inline]
pub fn desired(specific_force: [Vector3<f32>; 3], setpoint: &Setpoint) -> AttitudeReference {
    let [s, s_dot, s_ddot] = specific_force;
    let frame = DesiredFrame::new(&s, setpoint.yaw_rad);
    AttitudeReference {
        r_earth_desired: frame.r,
        rates_rad_s: frame.turn(&s_dot, setpoint.yaw_rate_rad_s),
        rates_dot_rad_s2: frame.turn(&s_ddot, setpoint.yaw_acceleration_rad_s2),
    }
}

impl<const N: usize> Geometric<N> {
    /// Creates a controller for a vehicle with these nominal parameters.
    ///
    /// # Errors
    /// Returns the first parameter, setting or gain that is out of range.
    pub fn new(vehicle: impl Into<Airframe<N>>, settings: Settings, gains: Gains) -> Result<Self, OutOfRange> {
        let vehicle = vehicle.into();
        let body = NominalVehicle::new(&vehicle, &settings, &gains.smoothing)?;
        let (vehicle, thrust_max_n) = (vehicle.parameters, body.mixer.thrust_max_n());
        gains.validate()?;
        let (k_r, k_omega) =
            (xy_and_z(gains.tilt_p_1_s2, gains.yaw_p_1_s2), xy_and_z(gains.tilt_d_1_s, gains.yaw_d_1_s));
        Ok(Geometric {
            body,
            position: TrackingLoop {
                position_p: xy_and_z(gains.position_p_1_s2, gains.height_p_1_s2),
                position_d: xy_and_z(gains.position_d_1_s, gains.height_d_1_s),
                position_i: xy_and_z(gains.position_i_1_s3, gains.height_i_1_s3),
                integral_max_m_s2: gains.position_integral_max_m_s2,
                limits: SpecificForceLimits::new(&vehicle, thrust_max_n, gains.tilt_max_rad),
                dt_s: settings.dt_s,
            },
            filter: Differentiator::new(gains.filter_rad_s, settings.dt_s)?,
            dt_s: settings.dt_s,
            k_r,
            k_omega,
            k_integral: xy_and_z(gains.tilt_i_1_s2, gains.yaw_i_1_s2),
            // k_Omega is at least 0.5 by its range.
            c: k_r.component_div(&k_omega),
        })
    }

    /// Computes the demand of one step and the errors for the integrals.
    #[inline]
    pub(crate) fn demand(&self, memory: &mut Memory, state: &State, setpoint: &Setpoint) -> (Demand, IntegralErrors) {
        let position = self.position.output(state, setpoint, &memory.position_integral);
        let specific_force = position.specific_force_m_s2;

        // Desired attitude.
        // The filter advances also without a new state, because the filtered signal is a command, not a measurement.
        self.filter.advance(&mut memory.specific_force, &specific_force);
        let filtered = &memory.specific_force;
        let second = self.filter.second_derivative(filtered, &specific_force);
        let AttitudeReference { r_earth_desired, rates_rad_s, rates_dot_rad_s2 } =
            desired([filtered.value(), filtered.derivative(), second], setpoint);

        // Attitude.
        let r = r_earth_body(&state.attitude_rad);
        let omega = state.rates_rad_s;
        let to_body = r.transpose() * r_earth_desired;
        let omega_d = to_body * rates_rad_s;
        let attitude_error = geometric_error(&r, &r_earth_desired);
        let rate_error = omega_d - omega;
        let angular_acceleration = self.k_r.component_mul(&attitude_error)
            + self.k_omega.component_mul(&rate_error)
            + memory.attitude_integral
            - self.body.coupling(&omega)
            - (omega.cross(&omega_d) - to_body * rates_dot_rad_s2);

        let demand = Demand {
            thrust_n: self.body.mass_kg * specific_force.dot(&unit(&r.column(2).into())).max(0.0),
            angular_acceleration_rad_s2: angular_acceleration,
            acceleration_m_s2: position.acceleration_m_s2,
            desired: r_earth_desired,
            desired_rates_rad_s: rates_rad_s,
            errors: [position.position_error_m, position.velocity_error_m_s, attitude_error, rate_error],
        };
        (demand, IntegralErrors { position, attitude: rate_error + self.c.component_mul(&attitude_error) })
    }

    /// Advances the integrals if the state was `fresh`. `unallocated` is the part of U1..U3 that the rotors could not
    /// give.
    #[inline]
    pub(crate) fn learn(&self, memory: &mut Memory, lesson: &IntegralErrors, fresh: bool, unallocated: Vector3<f32>) {
        if fresh {
            self.position.learn(&mut memory.position_integral, &lesson.position);
            let allowed = lesson.attitude.zip_map(&memory.unallocated, away_from);
            memory.attitude_integral = integrate(
                &memory.attitude_integral,
                &self.k_integral.component_mul(&allowed),
                self.dt_s,
                RATE_INTEGRAL_MAX_RAD_S2,
            );
        }
        memory.unallocated = unallocated;
    }
}

impl<const N: usize> FlightController<N> for Geometric<N> {
    type Memory = Memory;

    fn dt_s(&self) -> f32 {
        self.dt_s
    }

    fn mixer(&self) -> &Mixer<N> {
        &self.body.mixer
    }

    fn trace(memory: &Memory) -> Trace {
        memory.trace
    }

    #[inline]
    fn decide(&self, memory: &mut Memory, state: &State, setpoint: &Setpoint, fresh: bool) -> Action<N> {
        let (demand, lesson) = self.demand(memory, state, setpoint);
        let (action, trace, unallocated) = self.body.act(&demand, &mut memory.smoothed);
        memory.trace = trace;
        self.learn(memory, &lesson, fresh, unallocated);
        action
    }
}
