//! Incremental nonlinear dynamic inversion, of attitude and of position.
//!
//! Smeur, Chu, de Croon, *Adaptive incremental nonlinear dynamic inversion for attitude control of micro air vehicles*,
//! JGCD 39(3), 2016, for attitude; Smeur, de Croon, Chu, *Cascaded incremental nonlinear dynamic inversion for MAV
//! disturbance rejection*, Control Engineering Practice 73, 2018, for position, in the vector form of Tal and Karaman,
//! *Accurate tracking of aggressive quadrotor trajectories using incremental nonlinear dynamic inversion and
//! differential flatness*, IEEE TCST 29(3), 2021. Only the rotors' forces and moments are modelled; all others are
//! inferred from the measured acceleration. Subscript f marks filtered signals, with the same filter throughout an
//! equation:
//!
//! ```text
//! actuators  omega_i += (1 - exp(-dt/tau)) (omega_i commanded - omega_i)            rotor model, from limited commands
//! position   a_ref = a_d + k_v (v_d + sat(k_p (p_d - p)) - v)
//!            s = (U4/m R e_z)_f + a_ref - (dv/dt)_f, within Limits;  U4 = m s . R e_z
//! attitude   R_d along s with yaw psi_d;  Omega_d, dOmega_d/dt from s, jerk and snap of the setpoint, psi_d
//!            Omega_ref = k_a e(R, R_d) + R' R_d Omega_d
//!            nu = k_w (Omega_ref - Omega) + R' R_d dOmega_d/dt - Omega x R' R_d Omega_d
//!            dOmega/dt = (G u)_f + nu - (dOmega/dt)_f,  G u = [l/Ix U1, l/Iy U2, (d/b)/Iz U3]
//! ```
//!
//! With exact actuators, the acceleration follows its reference as the actuators follow their command, for any filter.
//! The filter determines how fast a disturbance is detected. Both filters are critically damped, w^2/(s + w)^2 (see
//! [`crate::differentiator`]); Smeur's is also of second order, with 50 rad/s and a damping of 0.55.
//!
//! # Decisions
//!
//! * **Feed-forward** is Tal and Karaman's: Omega_d and dOmega_d/dt by [`crate::flatness`] from the setpoint's jerk and
//!   snap, which equal the derivatives of the specific force because gravity is constant. They are applied to the
//!   commanded s, not the reference's. If the setpoint has no jerk and snap, R_d follows s by feedback alone.
//! * **Rotor model**: a first-order lag of the speed with the time constant [`Gains::rotor_time_constant_s`], initially
//!   at hover. Its input is the command after rotor limits, so it cannot wind up.
//! * **Rotor knowledge**: only that time constant, not the delay. The default of 20 ms is the rotor lag for which all
//!   gains here are tuned; [`crate::slowed`] scales them for others. INDI still flies with lags from half to twice the
//!   assumed one (`tests/flights.rs`).
//! * **Not adaptive**: G is nominal. A true effectiveness of k times the nominal raises the loop gain by the factor k.
//! * **Neglected**: the moment that accelerates the propellers (G2 of the 2016 paper), which this project's plant
//!   models do not have.
//! * **The attitude error** is tilt-prioritised, as in [`crate::pid`].
//! * **On the ground**, no acceleration follows the increments, so thrust rises within Limits until the vehicle lifts
//!   off or the setpoint lies below it. Do not step while disarmed.

use crate::attitude::{r_earth_body, unit};
use crate::body::{Demand, NominalVehicle};
use crate::differentiator::{Differentiator, DifferentiatorMemory};
use crate::flatness::{AttitudeReference, flat};
use crate::increment::{Increment, IncrementMemory};
use crate::limits::SpecificForceLimits;
use crate::loops::{AttitudeLoop, AttitudeOutput, PositionLoop, PositionOutput, xy_and_z};
use crate::rotor_model::{RotorModel, RotorModelMemory};
use afbc_control::{Action, FlightController, Mixer, Settings, Smoothed, Smoothing, Trace};
use afbc_types::{Airframe, Declared, OutOfRange, Setpoint, State, parameters};
use nalgebra::Vector3;

parameters! {
    /// Gains and limits. Defaults are the result of `sitl tune` for the paper's vehicle with a rotor lag of 20 ms
    /// (`docs/tuning.md`).
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct Gains {
        /// k_p along x and y.
        #[parameter(POS_P, "1/s", 0.2..=10.0, tuned)]
        pub position_p_1_s: f32 = 3.451,
        /// k_v along x and y.
        #[parameter(VEL_P, "1/s", 0.5..=20.0, tuned)]
        pub velocity_p_1_s: f32 = 6.291,
        /// k_p along z.
        #[parameter(HEIGHT_P, "1/s", 0.2..=20.0, tuned)]
        pub height_p_1_s: f32 = 2.657,
        /// k_v along z.
        #[parameter(CLIMB_P, "1/s", 0.5..=40.0, tuned)]
        pub climb_p_1_s: f32 = 13.2,
        /// k_a of roll and pitch: gain on the attitude error.
        #[parameter(TILT_P, "1/s", 1.0..=30.0, tuned)]
        pub tilt_p_1_s: f32 = 13.39,
        /// k_w of roll and pitch: gain on the error of the angular rate.
        #[parameter(TILTRATE_P, "1/s", 2.0..=100.0, tuned)]
        pub tilt_rate_p_1_s: f32 = 16.84,
        /// k_a of yaw for small errors; not reduced by `yaw_weight`.
        #[parameter(YAW_P, "1/s", 0.2..=15.0, tuned)]
        pub yaw_p_1_s: f32 = 8.166,
        /// k_w of yaw: gain on the error of the yaw rate.
        #[parameter(YAWRATE_P, "1/s", 0.5..=40.0, tuned)]
        pub yaw_rate_p_1_s: f32 = 14.89,
        /// w: bandwidth of the filter on velocity and thrust.
        #[parameter(POS_FILTER, "rad/s", 5.0..=300.0, tuned)]
        pub position_filter_rad_s: f32 = 138.6,
        /// w: bandwidth of the filter on rates and U1..U3.
        #[parameter(ATT_FILTER, "rad/s", 10.0..=500.0, tuned)]
        pub attitude_filter_rad_s: f32 = 115.7,
        /// tau: time constant of the rotor model.
        #[parameter(ROT_LAG, "s", 0.0..=0.5)]
        pub rotor_time_constant_s: f32 = 0.02,
        /// Share of a large yaw error that is corrected together with the tilt, 0 to 1.
        #[parameter(YAW_WEIGHT, "1", 0.05..=1.0)]
        pub yaw_weight: f32 = 0.4,
        /// Largest velocity due to a position error, horizontal and vertical.
        #[parameter(SPEED_MAX, "m/s", 0.1..=100.0)]
        pub speed_max_m_s: f32 = 3.0,
        /// Largest tilt.
        #[parameter(TILT_MAX, "rad", 0.05..=1.2)]
        pub tilt_max_rad: f32 = 1.0,
        /// Filters on U1..U4.
        #[group("")]
        pub smoothing: Smoothing = Smoothing {
            smooth_tilt_rad_s: 182.2,
            smooth_yaw_rad_s: 91.73,
            smooth_lift_rad_s: 111.9,
            lead_s: 0.01342,
        },
    }
}

impl Gains {
    /// Gains tuned by `sitl tune` for the paper's vehicle with a rotor lag of 20 ms (`docs/tuning.md`).
    pub const TUNED: Self = Self::DEFAULT;

    /// Gains tuned by hand for the paper's vehicle with a rotor lag of 20 ms.
    pub const PAPER_VEHICLE: Self = Gains {
        position_p_1_s: 2.0,
        velocity_p_1_s: 4.5,
        height_p_1_s: 3.0,
        climb_p_1_s: 8.0,
        tilt_p_1_s: 10.0,
        tilt_rate_p_1_s: 25.0,
        yaw_p_1_s: 3.0,
        yaw_rate_p_1_s: 8.0,
        position_filter_rad_s: 40.0,
        attitude_filter_rad_s: 80.0,
        rotor_time_constant_s: 0.02,
        yaw_weight: 0.4,
        speed_max_m_s: 3.0,
        tilt_max_rad: 1.0,
        smoothing: Smoothing::DEFAULT,
    };
}

/// INDI controller with its constants. Everything that changes in flight is in [`Memory`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Indi<const N: usize = 4> {
    body: NominalVehicle<N>,
    dt_s: f32,
    limits: SpecificForceLimits,
    position_filter: Differentiator,
    increment: Increment,
    rotors: RotorModel<N>,
    position: PositionLoop,
    attitude: AttitudeLoop,
    rate_p: Vector3<f32>,
}

/// State of the controller between steps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Memory<const N: usize = 4> {
    rotors: RotorModelMemory<N>,
    velocity: DifferentiatorMemory,
    specific_force: DifferentiatorMemory,
    reaction: IncrementMemory,
    smoothed: Option<Smoothed>,
    /// Trace of the last step.
    trace: Trace,
}

impl<const N: usize> Indi<N> {
    /// Creates a controller for a vehicle with these nominal parameters.
    ///
    /// # Errors
    /// Returns the first parameter, setting or gain that is out of range.
    pub fn new(vehicle: impl Into<Airframe<N>>, settings: Settings, gains: Gains) -> Result<Self, OutOfRange> {
        let vehicle = vehicle.into();
        let body = NominalVehicle::new(&vehicle, &settings, &gains.smoothing)?;
        let (vehicle, thrust_max_n) = (vehicle.parameters, body.mixer.thrust_max_n());
        gains.validate()?;
        Ok(Indi {
            body,
            dt_s: settings.dt_s,
            limits: SpecificForceLimits::new(&vehicle, thrust_max_n, gains.tilt_max_rad),
            position_filter: Differentiator::new(gains.position_filter_rad_s, settings.dt_s)?,
            increment: Increment(Differentiator::new(gains.attitude_filter_rad_s, settings.dt_s)?),
            rotors: RotorModel::new(&body, vehicle.weight_n(), gains.rotor_time_constant_s, settings.dt_s),
            position: PositionLoop {
                position_p: xy_and_z(gains.position_p_1_s, gains.height_p_1_s),
                velocity_p: xy_and_z(gains.velocity_p_1_s, gains.climb_p_1_s),
                speed_max_m_s: gains.speed_max_m_s,
            },
            attitude: AttitudeLoop::new(gains.tilt_p_1_s, gains.yaw_p_1_s, gains.yaw_weight),
            rate_p: xy_and_z(gains.tilt_rate_p_1_s, gains.yaw_rate_p_1_s),
        })
    }
}

impl<const N: usize> FlightController<N> for Indi<N> {
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
        // The axis is normalised, because sines are off by up to 1.7e-4.
        let body_z = unit(&r.column(2).into());

        // Present rotor forces by the model, and the measured reaction of the vehicle.
        let now = self.rotors.inputs(&self.body, &memory.rotors);
        // Without a new measurement no filter advances, so that all four stay synchronous.
        if fresh {
            let specific_force = body_z * (now.thrust_n / self.body.mass_kg);
            self.position_filter.advance(&mut memory.specific_force, &specific_force);
            self.position_filter.advance(&mut memory.velocity, &state.velocity_m_s);
            let given = self.body.angular_acceleration(&now);
            self.increment.measure(&mut memory.reaction, &given, &state.rates_rad_s);
        }

        // Position.
        let PositionOutput { position_error_m, velocity_error_m_s, acceleration_m_s2 } =
            self.position.output(state, setpoint);
        let increment = acceleration_m_s2 - memory.velocity.derivative();
        let specific_force = self.limits.apply(&(memory.specific_force.value() + increment));

        // Attitude.
        let AttitudeReference { r_earth_desired: desired, rates_rad_s: omega_d, rates_dot_rad_s2 } =
            flat([specific_force, setpoint.jerk_m_s3, setpoint.snap_m_s4], setpoint);
        let to_body = r.transpose() * desired;
        let omega_d = to_body * omega_d;
        let AttitudeOutput { attitude_error_rad, rates_rad_s, rate_error_rad_s } =
            self.attitude.output(&r, &desired, &omega_d, state);
        let nu = self.rate_p.component_mul(&rate_error_rad_s) + to_body * rates_dot_rad_s2
            - state.rates_rad_s.cross(&omega_d);

        let demand = Demand {
            // If the specific force is more than 90 degrees from body z, the rotors would have to pull.
            thrust_n: self.body.mass_kg * specific_force.dot(&body_z).max(0.0),
            angular_acceleration_rad_s2: self.increment.invert(&memory.reaction, &nu),
            acceleration_m_s2,
            desired,
            desired_rates_rad_s: rates_rad_s,
            errors: [position_error_m, velocity_error_m_s, attitude_error_rad, rate_error_rad_s],
        };
        let (action, trace, _) = self.body.act(&demand, &mut memory.smoothed);
        memory.trace = trace;
        self.rotors.advance(&mut memory.rotors, &action.speeds);
        action
    }
}
