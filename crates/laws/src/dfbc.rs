//! Differential-flatness-based control with an incremental inner loop.
//!
//! Sun, Romero, Foehn, Kaufmann, Scaramuzza, *A comparative study of nonlinear MPC and differential-flatness-based
//! control for quadrotor agile flight*, IEEE T-RO 38(6), 2022, Section IV: a PD law on position, the attitude error of
//! Brescianini and D'Andrea (see [`crate::attitude`]), feed-forward of the reference's own rates and angular
//! accelerations, and incremental inversion of the moments as in [`crate::indi`]. Subscript f marks filtered signals:
//!
//! ```text
//! actuators  omega_i += (1 - exp(-dt/tau)) (omega_i commanded - omega_i)      rotor model, from limited commands
//! position   s = k_x (p_d - p) + k_v (v_d - v) + sat(k_i int (p_d - p)) + a_d + g e_z, within Limits
//!            U4 = m s . R e_z;  R_d along s with yaw psi_d
//! reference  R_r, Omega_r, dOmega_r/dt from a_d + g e_z, within Limits, jerk, snap, psi_d
//! attitude   nu = k_R e(R, R_d) + k_Omega (R' R_r Omega_r - Omega) + R' R_r dOmega_r/dt - Omega x R' R_r Omega_r
//! inversion  dOmega/dt = (G u)_f + nu - (dOmega/dt)_f,  G u = [l/Ix U1, l/Iy U2, (d/b)/Iz U3]
//! ```
//!
//! # Decisions
//!
//! * **Error**: e = \[2 Im(q_tilt), 2 Im(q_yaw)\], with a separate k_R for yaw, as in the source.
//! * **Feed-forward** uses the reference only, not the vehicle's motion: Omega_r and dOmega_r/dt belong to the flat
//!   trajectory (see [`crate::flatness`]) and are rotated to the body frame.
//! * **Integral**: 0 in the source, whose PD law keeps an error under every steady force. Here as in
//!   [`crate::geometric`].
//! * **Desaturation**: the source allocates by a quadratic program that gives up thrust first, then yaw, then roll and
//!   pitch. The mixer that all controllers share gives up yaw first, in closed form.
//! * **Drag**: the source's model of rotor drag is [`KnownDrag`], with the coefficients in the vehicle file.
//! * **Rotor knowledge**: the time constant [`Gains::rotor_time_constant_s`], like INDI.

use crate::attitude::{r_earth_body, unit};
use crate::body::{Demand, NominalVehicle};
use crate::flat_attitude::{AttitudeDemand, AttitudeGains, FlatAttitude, dragged};
use crate::increment::IncrementMemory;
use crate::limits::SpecificForceLimits;
use crate::loops::{TrackingLoop, xy_and_z};
use crate::rotor_model::{RotorModel, RotorModelMemory};
use afbc_control::drag::KnownDrag;
use afbc_control::{Action, FlightController, Mixer, Settings, Smoothed, Smoothing, Trace};
use afbc_types::{Airframe, Declared, OutOfRange, Setpoint, State, parameters};
use nalgebra::Vector3;

/// Smallest cosine of the tilt in the thrust for the drag.
const SHARE_MIN: f32 = 0.25;

parameters! {
    /// Gains and limits. Defaults are for the paper's vehicle with a rotor lag of 20 ms: a short search of `sitl tune`,
    /// integrals of the position raised by hand for slower vehicles (`docs/tuning.md`).
    ///
    /// For the law of Sun et al. 2022, leave both integrals (names with `_i_`) at 0.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct Gains {
        /// k_x along x and y.
        #[parameter(POS_P, "1/s2", 0.5..=100.0, tuned)]
        pub position_p_1_s2: f32 = 36.92,
        /// k_v along x and y.
        #[parameter(POS_D, "1/s", 0.5..=20.0, tuned)]
        pub position_d_1_s: f32 = 12.22,
        /// k_i along x and y.
        #[parameter(POS_I, "1/s3", 0.0..=200.0, tuned)]
        pub position_i_1_s3: f32 = 161.5,
        /// k_x along z.
        #[parameter(HEIGHT_P, "1/s2", 0.5..=200.0, tuned)]
        pub height_p_1_s2: f32 = 92.6,
        /// k_v along z.
        #[parameter(HEIGHT_D, "1/s", 0.5..=60.0, tuned)]
        pub height_d_1_s: f32 = 35.33,
        /// k_i along z.
        #[parameter(HEIGHT_I, "1/s3", 0.0..=300.0, tuned)]
        pub height_i_1_s3: f32 = 47.74,
        /// k_R of roll and pitch: gain on the attitude error.
        #[parameter(TILT_P, "1/s2", 10.0..=1000.0, tuned)]
        pub tilt_p_1_s2: f32 = 410.0,
        /// k_Omega of roll and pitch: gain on the error of the angular rate.
        #[parameter(TILT_D, "1/s", 2.0..=100.0, tuned)]
        pub tilt_d_1_s: f32 = 39.24,
        /// k_R of yaw: gain on the yaw error.
        #[parameter(YAW_P, "1/s2", 0.5..=200.0, tuned)]
        pub yaw_p_1_s2: f32 = 128.2,
        /// k_Omega of yaw: gain on the error of the yaw rate.
        #[parameter(YAW_D, "1/s", 0.5..=40.0, tuned)]
        pub yaw_d_1_s: f32 = 21.2,
        /// w: bandwidth of the filter on rates and U1..U3.
        #[parameter(ATT_FILTER, "rad/s", 10.0..=500.0, tuned)]
        pub attitude_filter_rad_s: f32 = 10.05,
        /// tau: time constant of the rotor model.
        #[parameter(ROT_LAG, "s", 0.0..=0.5)]
        pub rotor_time_constant_s: f32 = 0.02,
        /// Largest position integral, per coordinate.
        #[parameter(POS_INT_MAX, "m/s2", 0.0..=50.0)]
        pub position_integral_max_m_s2: f32 = 10.0,
        /// Largest tilt.
        #[parameter(TILT_MAX, "rad", 0.05..=1.2)]
        pub tilt_max_rad: f32 = 1.0,
        /// Filters on U1..U4.
        #[group("")]
        pub smoothing: Smoothing = Smoothing {
            smooth_tilt_rad_s: 140.8,
            smooth_yaw_rad_s: 103.0,
            smooth_lift_rad_s: 80.49,
            lead_s: 0.02281,
        },
    }
}

impl Gains {
    /// Tuned gains (the defaults), with integrals raised by hand.
    pub const TUNED: Self = Self::DEFAULT;

    /// Gains tuned by hand for the paper's vehicle with a rotor lag of 20 ms.
    pub const PAPER_VEHICLE: Self = Gains {
        position_p_1_s2: 12.0,
        position_d_1_s: 6.0,
        position_i_1_s3: 12.0,
        height_p_1_s2: 25.0,
        height_d_1_s: 10.0,
        height_i_1_s3: 40.0,
        tilt_p_1_s2: 200.0,
        tilt_d_1_s: 22.0,
        yaw_p_1_s2: 16.0,
        yaw_d_1_s: 6.0,
        attitude_filter_rad_s: 80.0,
        rotor_time_constant_s: 0.02,
        position_integral_max_m_s2: 10.0,
        tilt_max_rad: 1.0,
        smoothing: Smoothing::DEFAULT,
    };

    /// Law of the source, without integrals. Hand-tuned for the paper's vehicle with a rotor lag of 20 ms.
    pub const SUN_2022: Self = Gains { position_i_1_s3: 0.0, height_i_1_s3: 0.0, ..Self::PAPER_VEHICLE };
}

/// DFBC controller with its constants. Everything that changes in flight is in [`Memory`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dfbc<const N: usize = 4> {
    body: NominalVehicle<N>,
    dt_s: f32,
    drag: KnownDrag,
    position: TrackingLoop,
    rotors: RotorModel<N>,
    attitude: FlatAttitude,
}

/// State of the controller between steps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Memory<const N: usize = 4> {
    /// sat(k_i int (p_d - p)), earth frame \[m/s2\].
    pub position_integral: Vector3<f32>,
    rotors: RotorModelMemory<N>,
    reaction: IncrementMemory,
    smoothed: Option<Smoothed>,
    /// Trace of the last step.
    trace: Trace,
}

impl<const N: usize> Dfbc<N> {
    /// Creates a controller for a vehicle with these nominal parameters.
    ///
    /// # Errors
    /// Returns the first parameter, setting or gain that is out of range.
    pub fn new(vehicle: impl Into<Airframe<N>>, settings: Settings, gains: Gains) -> Result<Self, OutOfRange> {
        let vehicle = vehicle.into();
        let body = NominalVehicle::new(&vehicle, &settings, &gains.smoothing)?;
        let (vehicle, thrust_max_n) = (vehicle.parameters, body.mixer.thrust_max_n());
        gains.validate()?;
        let inner = AttitudeGains {
            tilt: [gains.tilt_p_1_s2, gains.tilt_d_1_s],
            yaw: [gains.yaw_p_1_s2, gains.yaw_d_1_s],
            filter_rad_s: gains.attitude_filter_rad_s,
        };
        Ok(Dfbc {
            body,
            dt_s: settings.dt_s,
            drag: settings.drag,
            position: TrackingLoop {
                position_p: xy_and_z(gains.position_p_1_s2, gains.height_p_1_s2),
                position_d: xy_and_z(gains.position_d_1_s, gains.height_d_1_s),
                position_i: xy_and_z(gains.position_i_1_s3, gains.height_i_1_s3),
                integral_max_m_s2: gains.position_integral_max_m_s2,
                limits: SpecificForceLimits::new(&vehicle, thrust_max_n, gains.tilt_max_rad),
                dt_s: settings.dt_s,
            },
            rotors: RotorModel::new(&body, vehicle.weight_n(), gains.rotor_time_constant_s, settings.dt_s),
            attitude: FlatAttitude::new(&inner, settings.dt_s)?,
        })
    }
}

impl<const N: usize> FlightController<N> for Dfbc<N> {
    type Memory = Memory<N>;

    fn dt_s(&self) -> f32 {
        self.dt_s
    }

    fn mixer(&self) -> &Mixer<N> {
        &self.body.mixer
    }

    fn trace(memory: &Memory<N>) -> Trace {
        memory.trace
    }

    #[inline]
    fn decide(&self, memory: &mut Memory<N>, state: &State, setpoint: &Setpoint, fresh: bool) -> Action<N> {
        let r = r_earth_body(&state.attitude_rad);
        if fresh {
            let now = self.rotors.inputs(&self.body, &memory.rotors);
            self.attitude.measure(&mut memory.reaction, &self.body.angular_acceleration(&now), &state.rates_rad_s);
        }

        // The position loop follows. The thrust must also compensate drag, and turns as drag changes with the velocity.
        let up = unit(&r.column(2).into());
        // Thrust for level flight at this tilt, as a share of the hover thrust.
        let share = 1.0 / up.z.max(SHARE_MIN);
        let setpoint = &Setpoint {
            acceleration_m_s2: setpoint.acceleration_m_s2 - self.drag.acceleration(&state.velocity_m_s, &up, share),
            ..dragged(&self.drag, setpoint, &up, [share, share * self.position.limits.gravity().z])
        };
        let position = self.position.output(state, setpoint, &memory.position_integral);
        let specific_force = position.specific_force_m_s2;

        // Attitude.
        let limits = &self.position.limits;
        // Within the limits it points up, as `flat` requires: in a free fall the thrust would have no direction.
        let flying = limits.apply(&(setpoint.acceleration_m_s2 + limits.gravity()));
        let AttitudeDemand { desired, rates_rad_s, angular_acceleration_rad_s2, attitude_error, rate_error } =
            self.attitude.output(&memory.reaction, &r, state, [&specific_force, &flying], setpoint);

        let demand = Demand {
            thrust_n: self.body.mass_kg * specific_force.dot(&up).max(0.0),
            angular_acceleration_rad_s2,
            acceleration_m_s2: position.acceleration_m_s2,
            desired,
            desired_rates_rad_s: rates_rad_s,
            errors: [position.position_error_m, position.velocity_error_m_s, attitude_error, rate_error],
        };
        let (action, trace, _) = self.body.act(&demand, &mut memory.smoothed);
        memory.trace = trace;
        self.rotors.advance(&mut memory.rotors, &action.speeds);
        if fresh {
            self.position.learn(&mut memory.position_integral, &position);
        }
        action
    }
}
