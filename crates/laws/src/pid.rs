//! Cascaded PID like the PX4 autopilot: four loops, each commanding the next.
//!
//! With the setpoint's position p_d, velocity v_d, acceleration a_d and yaw psi_d, and all errors as setpoint minus
//! state:
//!
//! ```text
//! position     v_sp = v_d + sat(k_p (p_d - p))
//! velocity     a_sp = a_d + k_v (v_sp - v) + i_v - d_v dv/dt
//!              di_v/dt = k_i ((v_sp - v) - (2 / k_v) (a_sp - a_given)), |i_v| <= g
//! thrust       s_z = h (a_sp_z + g),  s_xy = s_z a_sp_xy / g,  s within Limits
//!              R_d along s: its tilt is that of [a_sp_x, a_sp_y, g]; its yaw is psi_d
//!              U4 = m |s| = m s_z / cos(tilt of R_d)
//!              a_given = [g s_x / s_z, g s_y / s_z, s_z / h - g]
//! hover thrust h, see the estimator; each change of h moves i_v so that s_z does not change
//! attitude     Omega_sp = k_a e(R, R_d) + R' e_z dpsi_d/dt, e tilt-prioritised
//! rates        dOmega/dt = k_w (Omega_sp - Omega) + i_w - d_w dOmega/dt|measured + f Omega_sp
//!              di_w/dt = k_iw (Omega_sp - Omega), not towards what the rotors could not give, |i_w| <= 20 rad/s2
//! inputs       U1 = Ix/l dp/dt, U2 = Iy/l dq/dt, U3 = Iz/(d/b) dr/dt
//! ```
//!
//! The tilt comes from the horizontal acceleration and gravity alone. So a thrust error, which i_v or h corrects, does
//! not change the horizontal acceleration. The estimator of h is in `hover_thrust.rs`.
//!
//! Sources: PX4-Autopilot, `mc_pos_control` (PositionControl), `mc_hover_thrust_estimator`, `mc_att_control`
//! (AttitudeControl) and `lib/rate_control`, for their structure. The attitude error is Brescianini and D'Andrea's (see
//! [`crate::attitude`]). The tracking anti-windup of the velocity loop is Rundqwist's, *Anti-reset windup for PID
//! controllers*, IFAC 1990.
//!
//! Differences from PX4:
//!
//! * Gains of the rate loop are in 1/s, because the inertia scales the moment.
//! * Thrust is in newtons, so h is relative to the nominal weight.
//! * [`SpecificForceLimits`] keep no margin for horizontal thrust.
//! * Tracking anti-windup also covers height. Along x and y it compares with the effect of the tilt, not of tilt and
//!   thrust together.
//! * Derivatives are those of [`crate::differentiator`].
//! * The rate integrator is not slowed down at large errors.

use crate::attitude::{facing, length, r_earth_body};
use crate::body::{Demand, NominalVehicle};
use crate::differentiator::{Differentiator, DifferentiatorMemory};
use crate::hover_thrust::{HoverThrust, HoverThrustEstimator};
use crate::integral::{RATE_INTEGRAL_MAX_RAD_S2, away_from, integrate};
use crate::limits::SpecificForceLimits;
use crate::loops::{AttitudeLoop, AttitudeOutput, PositionLoop, PositionOutput, xy_and_z};
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
        pub position_p_1_s: f32 = 1.384,
        /// k_v along x and y.
        #[parameter(VEL_P, "1/s", 0.5..=20.0, tuned)]
        pub velocity_p_1_s: f32 = 7.14,
        /// k_i along x and y.
        #[parameter(VEL_I, "1/s2", 0.0..=200.0, tuned)]
        pub velocity_i_1_s2: f32 = 72.11,
        /// d_v along x and y.
        #[parameter(VEL_D, "1", 0.0..=2.0, tuned)]
        pub velocity_d: f32 = 0.1796,
        /// k_p along z.
        #[parameter(HEIGHT_P, "1/s", 0.2..=20.0, tuned)]
        pub height_p_1_s: f32 = 1.94,
        /// k_v along z.
        #[parameter(CLIMB_P, "1/s", 0.5..=40.0, tuned)]
        pub climb_p_1_s: f32 = 18.72,
        /// k_i along z.
        #[parameter(CLIMB_I, "1/s2", 0.0..=200.0, tuned)]
        pub climb_i_1_s2: f32 = 179.6,
        /// d_v along z.
        #[parameter(CLIMB_D, "1", 0.0..=2.0, tuned)]
        pub climb_d: f32 = 0.0,
        /// w: bandwidth of the estimate of the hover thrust; 0 for none.
        #[parameter(HOVER, "1/s", 0.0..=2.0, tuned)]
        pub hover_thrust_1_s: f32 = 0.1255,
        /// k_a of roll and pitch: gain on the attitude error.
        #[parameter(TILT_P, "1/s", 1.0..=30.0, tuned)]
        pub tilt_p_1_s: f32 = 25.42,
        /// k_a of yaw for small errors; not reduced by `yaw_weight`.
        #[parameter(YAW_P, "1/s", 0.2..=15.0, tuned)]
        pub yaw_p_1_s: f32 = 7.178,
        /// k_w of roll and pitch: gain on the error of the angular rate.
        #[parameter(TILTRATE_P, "1/s", 2.0..=100.0, tuned)]
        pub tilt_rate_p_1_s: f32 = 28.75,
        /// k_iw of roll and pitch: gain on the integral of the angular rate's error.
        #[parameter(TILTRATE_I, "1/s2", 0.0..=500.0, tuned)]
        pub tilt_rate_i_1_s2: f32 = 24.44,
        /// d_w of roll and pitch: gain on the derivative of the angular rate.
        #[parameter(TILTRATE_D, "1", 0.0..=3.0, tuned)]
        pub tilt_rate_d: f32 = 0.2859,
        /// k_w of yaw: gain on the error of the yaw rate.
        #[parameter(YAWRATE_P, "1/s", 0.5..=40.0, tuned)]
        pub yaw_rate_p_1_s: f32 = 16.93,
        /// k_iw of yaw: gain on the integral of the yaw rate's error.
        #[parameter(YAWRATE_I, "1/s2", 0.0..=100.0, tuned)]
        pub yaw_rate_i_1_s2: f32 = 82.47,
        /// f: feed-forward of the rate setpoint.
        #[parameter(RATE_FF, "1/s", 0.0..=20.0, tuned)]
        pub rate_feed_forward_1_s: f32 = 0.0,
        /// Bandwidth of the filters behind both derivatives.
        #[parameter(FILTER, "rad/s", 10.0..=500.0, tuned)]
        pub filter_rad_s: f32 = 138.3,
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
            smooth_tilt_rad_s: 105.9,
            smooth_yaw_rad_s: 111.9,
            smooth_lift_rad_s: 84.68,
            lead_s: 0.05431,
        },
    }
}

impl Gains {
    /// Gains tuned by `sitl tune` for the paper's vehicle with a rotor lag of 20 ms (`docs/tuning.md`).
    pub const TUNED: Self = Self::DEFAULT;

    /// Gains tuned by hand for the paper's vehicle with a rotor lag of 20 ms.
    pub const PAPER_VEHICLE: Self = Gains {
        position_p_1_s: 2.0,
        velocity_p_1_s: 5.0,
        velocity_i_1_s2: 12.0,
        velocity_d: 0.05,
        height_p_1_s: 2.0,
        climb_p_1_s: 7.0,
        climb_i_1_s2: 30.0,
        climb_d: 0.0,
        hover_thrust_1_s: 0.1,
        tilt_p_1_s: 11.0,
        yaw_p_1_s: 2.0,
        tilt_rate_p_1_s: 30.0,
        tilt_rate_i_1_s2: 40.0,
        tilt_rate_d: 0.05,
        yaw_rate_p_1_s: 8.0,
        yaw_rate_i_1_s2: 15.0,
        rate_feed_forward_1_s: 0.0,
        filter_rad_s: 100.0,
        yaw_weight: 0.4,
        speed_max_m_s: 3.0,
        tilt_max_rad: 1.0,
        smoothing: Smoothing::DEFAULT,
    };
}

/// PID controller with its constants. Everything that changes in flight is in [`Memory`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pid<const N: usize = 4> {
    body: NominalVehicle<N>,
    limits: SpecificForceLimits,
    differentiator: Differentiator,
    dt_s: f32,
    position: PositionLoop,
    velocity_i: Vector3<f32>,
    velocity_d: Vector3<f32>,
    /// 2 / k_v
    anti_windup: Vector3<f32>,
    hover_thrust: HoverThrustEstimator,
    attitude: AttitudeLoop,
    rate_p: Vector3<f32>,
    rate_i: Vector3<f32>,
    rate_d: Vector3<f32>,
    rate_feed_forward: f32,
}

/// State of the controller between steps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Memory {
    /// i_v, earth frame \[m/s2\].
    pub velocity_integral: Vector3<f32>,
    /// i_w, body frame \[rad/s2\].
    pub rate_integral: Vector3<f32>,
    /// Unallocated part of U1..U3 in the last step \[N\].
    unallocated: Vector3<f32>,
    hover_thrust: HoverThrust,
    /// U4 given in the last step \[N\], `None` before the first step.
    thrust_n: Option<f32>,
    /// a_sp_z of the last step \[m/s2\].
    climb_m_s2: f32,
    /// t: vertical thrust divided by the nominal weight, delayed like `velocity`; x and y are 0.
    thrust_share: DifferentiatorMemory,
    velocity: DifferentiatorMemory,
    rates: DifferentiatorMemory,
    smoothed: Option<Smoothed>,
    /// Trace of the last step.
    trace: Trace,
}

impl<const N: usize> Pid<N> {
    /// Creates a controller for a vehicle with these nominal parameters.
    ///
    /// # Errors
    /// Returns the first parameter, setting or gain that is out of range.
    pub fn new(vehicle: impl Into<Airframe<N>>, settings: Settings, gains: Gains) -> Result<Self, OutOfRange> {
        let vehicle = vehicle.into();
        let body = NominalVehicle::new(&vehicle, &settings, &gains.smoothing)?;
        let (vehicle, thrust_max_n) = (vehicle.parameters, body.mixer.thrust_max_n());
        gains.validate()?;
        let velocity_p = xy_and_z(gains.velocity_p_1_s, gains.climb_p_1_s);
        Ok(Pid {
            body,
            limits: SpecificForceLimits::new(&vehicle, thrust_max_n, gains.tilt_max_rad),
            differentiator: Differentiator::new(gains.filter_rad_s, settings.dt_s)?,
            dt_s: settings.dt_s,
            position: PositionLoop {
                position_p: xy_and_z(gains.position_p_1_s, gains.height_p_1_s),
                velocity_p,
                speed_max_m_s: gains.speed_max_m_s,
            },
            velocity_i: xy_and_z(gains.velocity_i_1_s2, gains.climb_i_1_s2),
            velocity_d: xy_and_z(gains.velocity_d, gains.climb_d),
            anti_windup: velocity_p.map(|k| 2.0 / k),
            hover_thrust: HoverThrustEstimator::new(gains.hover_thrust_1_s, vehicle.gravity_m_s2, settings.dt_s),
            attitude: AttitudeLoop::new(gains.tilt_p_1_s, gains.yaw_p_1_s, gains.yaw_weight),
            rate_p: xy_and_z(gains.tilt_rate_p_1_s, gains.yaw_rate_p_1_s),
            rate_i: xy_and_z(gains.tilt_rate_i_1_s2, gains.yaw_rate_i_1_s2),
            rate_d: xy_and_z(gains.tilt_rate_d, 0.0),
            rate_feed_forward: gains.rate_feed_forward_1_s,
        })
    }
}

impl<const N: usize> Pid<N> {
    /// Updates the estimated hover thrust after the thrust `thrust_n` along body z, whose vertical part is `upright`.
    /// The integral compensates the change of the estimate, so the thrust does not jump.
    #[inline]
    fn estimate_hover_thrust(&self, memory: &mut Memory, thrust_n: f32, upright: f32) {
        let gravity_m_s2 = self.limits.gravity().z;
        let share = thrust_n * upright / (self.body.mass_kg * gravity_m_s2);
        self.differentiator.advance(&mut memory.thrust_share, &Vector3::new(0.0, 0.0, share));
        let (measured_m_s2, before) = (memory.velocity.derivative().z, memory.hover_thrust.share());
        self.hover_thrust.advance(&mut memory.hover_thrust, measured_m_s2, memory.thrust_share.value().z);
        let change = before / memory.hover_thrust.share() - 1.0;
        memory.velocity_integral.z += (memory.climb_m_s2 + gravity_m_s2) * change;
    }
}

impl<const N: usize> FlightController<N> for Pid<N> {
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
        let r = r_earth_body(&state.attitude_rad);
        if fresh {
            self.differentiator.advance(&mut memory.velocity, &state.velocity_m_s);
            self.differentiator.advance(&mut memory.rates, &state.rates_rad_s);
            // Before the first step no thrust was given that could explain a motion.
            if let Some(thrust_n) = memory.thrust_n {
                self.estimate_hover_thrust(memory, thrust_n, r.m33);
            }
        }

        // Position and velocity.
        let PositionOutput { position_error_m, velocity_error_m_s, acceleration_m_s2 } =
            self.position.output(state, setpoint);
        let acceleration =
            acceleration_m_s2 + memory.velocity_integral - self.velocity_d.component_mul(&memory.velocity.derivative());

        // Thrust and attitude.
        let (g, h) = (self.limits.gravity().z, memory.hover_thrust.share());
        let vertical = self.limits.vertical(h * (acceleration.z + g));
        let wanted = Vector3::new(acceleration.x, acceleration.y, g) * (vertical / g);
        let specific_force = self.limits.apply(&wanted);
        // Limits keep the vertical part at 10 % of gravity or more, so the division is safe.
        let tilted = specific_force * (g / specific_force.z);
        let missing = acceleration - Vector3::new(tilted.x, tilted.y, specific_force.z / h - g);
        let desired = facing(&specific_force, setpoint.yaw_rad);
        let turning = r.row(2).transpose() * setpoint.yaw_rate_rad_s;
        let AttitudeOutput { attitude_error_rad, rates_rad_s, rate_error_rad_s } =
            self.attitude.output(&r, &desired, &turning, state);

        // Rates.
        let angular_acceleration = self.rate_p.component_mul(&rate_error_rad_s) + memory.rate_integral
            - self.rate_d.component_mul(&memory.rates.derivative())
            + rates_rad_s * self.rate_feed_forward;

        let demand = Demand {
            thrust_n: self.body.mass_kg * length(&specific_force),
            angular_acceleration_rad_s2: angular_acceleration,
            acceleration_m_s2: acceleration,
            desired,
            desired_rates_rad_s: rates_rad_s,
            errors: [position_error_m, velocity_error_m_s, attitude_error_rad, rate_error_rad_s],
        };
        let (action, trace, unallocated) = self.body.act(&demand, &mut memory.smoothed);
        memory.trace = trace;
        (memory.thrust_n, memory.climb_m_s2) = (Some(action.given.thrust_n), acceleration.z);

        if fresh {
            let unwound = velocity_error_m_s - self.anti_windup.component_mul(&missing);
            memory.velocity_integral =
                integrate(&memory.velocity_integral, &self.velocity_i.component_mul(&unwound), self.dt_s, g);
            let allowed = rate_error_rad_s.zip_map(&memory.unallocated, away_from);
            memory.rate_integral = integrate(
                &memory.rate_integral,
                &self.rate_i.component_mul(&allowed),
                self.dt_s,
                RATE_INTEGRAL_MAX_RAD_S2,
            );
        }
        memory.unallocated = unallocated;
        action
    }
}
