//! Incremental nonlinear dynamic inversion, of attitude and of position.
//!
//! Smeur, Chu, de Croon, *Adaptive incremental nonlinear dynamic inversion for attitude control of micro air vehicles*, JGCD
//! 39(3), 2016, for attitude; Smeur, de Croon, Chu, *Cascaded incremental nonlinear dynamic inversion for MAV disturbance
//! rejection*, Control Engineering Practice 73, 2018, for position, in the vector form of Tal and Karaman, *Accurate
//! tracking of aggressive quadrotor trajectories using incremental nonlinear dynamic inversion and differential
//! flatness*, IEEE TCST 29(3), 2021. Neither models a force or moment other than the rotors': what the vehicle is doing says
//! what acts on it. Subscript f marks what passed a filter, one and the same in each equation:
//!
//! ```text
//! actuators  omega_i += (1 - exp(-dt/tau)) (omega_i commanded - omega_i)            rotor model, from limited commands
//! position   a_ref = a_d + k_v (v_d + sat(k_p (p_d - p)) - v)
//!            s = (U4/m R e_z)_f + a_ref - (dv/dt)_f, within Limits;  U4 = m s . R e_z
//! attitude   R_d along s with yaw psi_d;  Omega_ref = k_a e(R, R_d) + R' e_z dpsi_d/dt
//!            nu = k_w (Omega_ref - Omega) + R' e_z d2psi_d/dt2
//!            dOmega/dt = (G u)_f + nu - (dOmega/dt)_f,  G u = [l/Ix U1, l/Iy U2, (d/b)/Iz U3]
//! ```
//!
//! With exact actuators, the acceleration follows its reference as the actuators follow their command, whatever the
//! filter; the filter says how fast a disturbance is seen. Both filters are critically damped,
//! w^2/(s + w)^2 (see [`crate::differentiator`]); Smeur's is of second order too, with 50 rad/s and a damping of 0.55.
//!
//! # Decisions
//!
//! * **The rotor model** is a first-order lag of the speed with the time constant [`Gains::rotor_time_constant_s`]; it
//!   starts at hover speeds. Being driven by what is commanded after rotor limits, it cannot wind up.
//! * **Not adaptive**: G is the nominal one. A true effectiveness above the nominal by a factor k raises the loop gain by
//!   as much.
//! * **Left out**: the moment that spins the propellers up (G2 of the 2016 paper), which no model of this project's plant
//!   has.
//! * **The attitude error** is tilt-prioritised, as in [`crate::pid`].
//! * **On the ground** an increment finds no acceleration to compare with: thrust rises, within Limits, until
//!   the vehicle lifts off or the setpoint lies below it. Do not step while disarmed.

use crate::attitude::{facing, r_earth_body, tilt_prioritised_error, unit};
use crate::body::{Body, Demand};
use crate::differentiator::{Differentiator, Smooth};
use crate::limits::{Limits, TILT_MAX, cylinder};
use crate::pid::{SPEED_MAX, YAW_WEIGHT};
use crate::within;
use afbc_control::{Action, FlightController, Mixer, Settings, Trace, math};
use afbc_types::{OutOfRange, Parameters, Range, RotorSpeeds, Setpoint, State};
use nalgebra::Vector3;

/// Range of each tunable of [`Gains`].
#[expect(missing_docs, reason = "named after the field that each bounds")]
pub mod ranges {
    use afbc_types::Range;
    pub const POSITION_P: Range = Range::new("position_p_1_s", 0.2, 10.0);
    pub const VELOCITY_P: Range = Range::new("velocity_p_1_s", 0.5, 20.0);
    pub const HEIGHT_P: Range = Range::new("height_p_1_s", 0.2, 20.0);
    pub const CLIMB_P: Range = Range::new("climb_p_1_s", 0.5, 40.0);
    pub const TILT_P: Range = Range::new("tilt_p_1_s", 1.0, 30.0);
    pub const TILT_RATE_P: Range = Range::new("tilt_rate_p_1_s", 2.0, 100.0);
    pub const YAW_P: Range = Range::new("yaw_p_1_s", 0.2, 15.0);
    pub const YAW_RATE_P: Range = Range::new("yaw_rate_p_1_s", 0.5, 40.0);
    pub const POSITION_FILTER: Range = Range::new("position_filter_rad_s", 5.0, 300.0);
    pub const ATTITUDE_FILTER: Range = Range::new("attitude_filter_rad_s", 10.0, 500.0);
}

/// Accepted time constant of the rotors; 0 for rotors that follow at once \[s\].
pub const ROTOR_TIME_CONSTANT: Range = Range::new("rotor_time_constant_s", 0.0, 0.5);

/// Gains and limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gains {
    /// k_p along x and y \[1/s\].
    pub position_p_1_s: f32,
    /// k_v along x and y \[1/s\].
    pub velocity_p_1_s: f32,
    /// k_p along z \[1/s\].
    pub height_p_1_s: f32,
    /// k_v along z \[1/s\].
    pub climb_p_1_s: f32,
    /// k_a of roll and pitch \[1/s\].
    pub tilt_p_1_s: f32,
    /// k_w of roll and pitch \[1/s\].
    pub tilt_rate_p_1_s: f32,
    /// k_a of yaw for small errors; the weight is made up for \[1/s\].
    pub yaw_p_1_s: f32,
    /// k_w of yaw \[1/s\].
    pub yaw_rate_p_1_s: f32,
    /// w of the filter on velocity and thrust \[rad/s\].
    pub position_filter_rad_s: f32,
    /// w of the filter on rates and U1..U3 \[rad/s\].
    pub attitude_filter_rad_s: f32,
    /// tau of the rotor model \[s\]. Not a tunable.
    pub rotor_time_constant_s: f32,
    /// How much of a large yaw error is corrected together with the tilt, 0 to 1. Not a tunable.
    pub yaw_weight: f32,
    /// Largest velocity that a position error may add, sideways and upwards \[m/s\]. Not a tunable.
    pub speed_max_m_s: f32,
    /// Largest tilt \[rad\]. Not a tunable.
    pub tilt_max_rad: f32,
}

impl Gains {
    /// As `sitl tune` found it for the paper's vehicle with rotors of 20 ms (`docs/tuning.md`).
    pub const TUNED: Self = Gains {
        position_p_1_s: 3.227,
        velocity_p_1_s: 5.183,
        height_p_1_s: 2.841,
        climb_p_1_s: 7.548,
        tilt_p_1_s: 15.04,
        tilt_rate_p_1_s: 14.82,
        yaw_p_1_s: 3.147,
        yaw_rate_p_1_s: 4.979,
        position_filter_rad_s: 71.32,
        attitude_filter_rad_s: 113.5,
        ..Self::PAPER_VEHICLE
    };

    /// Ours, by hand, for the paper's vehicle with rotors of 20 ms.
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
        tilt_max_rad: 0.7,
    };

    /// Every gain that is a matter of taste, with the range to search it in.
    pub fn tunables(&mut self) -> [(&'static Range, &mut f32); 10] {
        use ranges::*;
        [
            (&POSITION_P, &mut self.position_p_1_s),
            (&VELOCITY_P, &mut self.velocity_p_1_s),
            (&HEIGHT_P, &mut self.height_p_1_s),
            (&CLIMB_P, &mut self.climb_p_1_s),
            (&TILT_P, &mut self.tilt_p_1_s),
            (&TILT_RATE_P, &mut self.tilt_rate_p_1_s),
            (&YAW_P, &mut self.yaw_p_1_s),
            (&YAW_RATE_P, &mut self.yaw_rate_p_1_s),
            (&POSITION_FILTER, &mut self.position_filter_rad_s),
            (&ATTITUDE_FILTER, &mut self.attitude_filter_rad_s),
        ]
    }

    /// What the vehicle and its task ask for instead, with the accepted range of each.
    pub fn others(&mut self) -> [(&'static Range, &mut f32); 4] {
        [
            (&ROTOR_TIME_CONSTANT, &mut self.rotor_time_constant_s),
            (&YAW_WEIGHT, &mut self.yaw_weight),
            (&SPEED_MAX, &mut self.speed_max_m_s),
            (&TILT_MAX, &mut self.tilt_max_rad),
        ]
    }

    /// Checks every gain and limit.
    ///
    /// # Errors
    /// The first one out of range.
    pub fn validate(&self) -> Result<(), OutOfRange> {
        let mut gains = *self;
        within(gains.tunables())?;
        within(gains.others())
    }
}

/// The controller: fixed from here on. What changes in flight is in [`Memory`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Indi {
    body: Body,
    dt_s: f32,
    limits: Limits,
    position_filter: Differentiator,
    attitude_filter: Differentiator,
    hover: RotorSpeeds,
    /// 1 - exp(-dt / tau)
    rotor_gain: f32,
    position_p: Vector3<f32>,
    velocity_p: Vector3<f32>,
    attitude_p: Vector3<f32>,
    rate_p: Vector3<f32>,
    yaw_weight: f32,
    speed_max: f32,
}

/// What the controller remembers between steps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Memory {
    /// The rotor model's speeds; none before the first step.
    rotors: Option<RotorSpeeds>,
    velocity: Smooth,
    specific_force: Smooth,
    rates: Smooth,
    /// G u \[rad/s2\]
    rotor_acceleration: Smooth,
    /// Of the last step.
    trace: Trace,
}

impl Indi {
    /// A controller for a vehicle with these nominal parameters.
    ///
    /// # Errors
    /// The first parameter, setting or gain out of range.
    pub fn new(vehicle: Parameters, settings: Settings, gains: Gains) -> Result<Self, OutOfRange> {
        let body = Body::new(&vehicle, &settings)?;
        gains.validate()?;
        let twice = |tilt, yaw| Vector3::new(tilt, tilt, yaw);
        let tau = gains.rotor_time_constant_s;
        Ok(Indi {
            body,
            dt_s: settings.dt_s,
            limits: Limits::new(&vehicle, &settings, gains.tilt_max_rad)?,
            position_filter: Differentiator::new(gains.position_filter_rad_s, settings.dt_s)?,
            attitude_filter: Differentiator::new(gains.attitude_filter_rad_s, settings.dt_s)?,
            hover: body.hover(vehicle.gravity_m_s2),
            rotor_gain: if tau > 0.0 { 1.0 - math::exp(-settings.dt_s / tau) } else { 1.0 },
            position_p: twice(gains.position_p_1_s, gains.height_p_1_s),
            velocity_p: twice(gains.velocity_p_1_s, gains.climb_p_1_s),
            attitude_p: twice(gains.tilt_p_1_s, gains.yaw_p_1_s / gains.yaw_weight),
            rate_p: twice(gains.tilt_rate_p_1_s, gains.yaw_rate_p_1_s),
            yaw_weight: gains.yaw_weight,
            speed_max: gains.speed_max_m_s,
        })
    }
}

impl FlightController for Indi {
    type Memory = Memory;

    fn dt_s(&self) -> f32 {
        self.dt_s
    }

    fn mixer(&self) -> &Mixer {
        &self.body.mixer
    }

    fn trace(memory: &Memory) -> Trace {
        memory.trace
    }

    #[inline]
    fn decide(&self, memory: &mut Memory, state: &State, setpoint: &Setpoint, fresh: bool) -> Action {
        let r = r_earth_body(&state.attitude_rad);
        let (body_z, earth_z) = (unit(&r.column(2).into()), r.row(2).transpose());

        // What the rotors do now, and what the vehicle makes of it.
        let rotors = memory.rotors.unwrap_or(self.hover);
        let now = Mixer::inputs(&self.body.mixer.forces(&rotors));
        // Without a new measurement all four rest, so that they stay in step.
        if fresh {
            let specific_force = body_z * (now.thrust_n / self.body.mass_kg);
            self.position_filter.advance(&mut memory.specific_force, &specific_force);
            self.position_filter.advance(&mut memory.velocity, &state.velocity_m_s);
            self.attitude_filter.advance(&mut memory.rotor_acceleration, &self.body.angular_acceleration(&now));
            self.attitude_filter.advance(&mut memory.rates, &state.rates_rad_s);
        }

        // Position.
        let position_error = setpoint.position_m - state.position_m;
        let velocity_wanted =
            setpoint.velocity_m_s + cylinder(&self.position_p.component_mul(&position_error), self.speed_max);
        let velocity_error = velocity_wanted - state.velocity_m_s;
        let acceleration = setpoint.acceleration_m_s2 + self.velocity_p.component_mul(&velocity_error);
        let increment = acceleration - memory.velocity.derivative();
        let specific_force = self.limits.apply(&(memory.specific_force.value() + increment));

        // Attitude.
        let desired = facing(&specific_force, setpoint.yaw_rad);
        let attitude_error = tilt_prioritised_error(&r, &desired, self.yaw_weight);
        let rates_wanted = self.attitude_p.component_mul(&attitude_error) + earth_z * setpoint.yaw_rate_rad_s;
        let rate_error = rates_wanted - state.rates_rad_s;
        let nu = self.rate_p.component_mul(&rate_error) + earth_z * setpoint.yaw_acceleration_rad_s2;
        let increment = nu - memory.rates.derivative();

        let demand = Demand {
            thrust_n: self.body.mass_kg * specific_force.dot(&body_z).max(0.0),
            angular_acceleration_rad_s2: memory.rotor_acceleration.value() + increment,
            acceleration_m_s2: acceleration,
            desired,
            desired_rates_rad_s: rates_wanted,
            errors: [position_error, velocity_error, attitude_error, rate_error],
        };
        let (action, trace, _) = self.body.act(&demand);
        memory.trace = trace;
        memory.rotors = Some(RotorSpeeds(rotors.0 + (action.speeds.0 - rotors.0) * self.rotor_gain));
        action
    }
}
