//! Flight without measurements. The whole state comes over the link, so an outage leaves only the last measurement and
//! the commands sent to the rotors since. Not in the paper.
//!
//! Roll and pitch are dead-reckoned from the last measurement by
//!
//! ```text
//! d^2 x/dt^2 = (l/I) (U_a - U_trim),   lag dU_a/dt = U - U_a
//! ```
//!
//! where U_a are the inputs delayed by the [rotors' lag](crate::motor::Response). Without this lag, laws whose inputs
//! lead the rotors lose a vehicle whose states come every 10 ms. A critically damped law holds the reckoned angle and
//! stops the last measured rotation:
//!
//! ```text
//! U = U_trim - (I/l) (w^2 (x - x_held) + 2 w dx/dt)
//! ```
//!
//! U_trim are the inputs in equilibrium: they compensate an off-centre mass, wind and weight. For roll and pitch they
//! are observed in flight, from the difference between measured and reckoned rates; for thrust and yaw they are the
//! mean of the recent inputs. Yaw is not controlled further: its authority is too small to spend thrust on it.
//!
//! Errors of the trim make the true attitude diverge from the reckoned one as t^2. Dead reckoning therefore works for
//! fractions of a second, plus the two seconds of the descent that follows.

use crate::motor::Response;
use afbc_control::math::{max, min, settled};
use afbc_types::{Inputs, Parameters, State};
use nalgebra::{Vector2, Vector3};

/// w: bandwidth of the hold \[rad/s\].
pub const HOLD_RAD_S: f32 = 10.0;
/// Time constant of the trim \[s\].
pub const TRIM_S: f32 = 1.0;
/// Largest difference between measured and reckoned rate used by the trim, so that jumps have little effect \[rad/s\].
pub const INNOVATION_MAX_RAD_S: f32 = 0.1;
/// Share of the trimmed thrust in a blind descent, which accelerates by 1 m/s2 downwards.
pub const DESCENT_THRUST: f32 = 0.9;

/// Constants: the response of the nominal vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeadReckoning {
    /// Angular acceleration per roll and pitch input: l/Ix, l/Iy \[rad/s2 per N\].
    authority: Vector2<f32>,
    /// Inverse of `authority`: Ix/l, Iy/l \[N per rad/s2\].
    inverse_authority: Vector2<f32>,
    /// Angular acceleration per yaw input: (d/b)/Iz \[rad/s2 per N\].
    pub(crate) yaw_authority: f32,
    /// Weight m g \[N\].
    pub(crate) weight_n: f32,
    pub(crate) gravity_m_s2: f32,
    pub(crate) dt_s: f32,
    /// Share of the difference U - U_a that the rotors make up in a step.
    pub(crate) rotor_share: f32,
}

/// Dead-reckoned attitude and trim.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reckoning {
    /// Roll and pitch at the last measurement \[rad\].
    pub held_rad: Vector2<f32>,
    /// Dead-reckoned roll and pitch \[rad\].
    pub angle_rad: Vector2<f32>,
    /// Dead-reckoned rates of roll and pitch \[rad/s\].
    pub rate_rad_s: Vector2<f32>,
    /// Lagged roll and pitch inputs U_a \[N\].
    pub acting_n: Vector2<f32>,
    /// Trim U_trim.
    pub trim: Inputs,
}

impl Reckoning {
    /// Returns the state between two measurements, with dead-reckoned roll, pitch and rates. With the last measured
    /// rates instead, AFBC would lose a vehicle with 100 states per second, each 10 ms late.
    #[inline]
    #[must_use]
    pub fn between(&self, state: &State) -> State {
        let (attitude, rates) = (&state.attitude_rad, &state.rates_rad_s);
        State {
            attitude_rad: Vector3::new(self.angle_rad.x, self.angle_rad.y, attitude.z),
            rates_rad_s: Vector3::new(self.rate_rad_s.x, self.rate_rad_s.y, rates.z),
            ..*state
        }
    }
}

impl DeadReckoning {
    /// Makes the dead reckoning of a nominal vehicle with valid parameters, stepped every `dt_s` seconds.
    pub fn new(vehicle: &Parameters, rotors: &Response, dt_s: f32) -> Self {
        DeadReckoning {
            authority: vehicle.effectiveness().xy(),
            inverse_authority: vehicle.inertia_kg_m2.xy() / vehicle.arm_m,
            yaw_authority: vehicle.effectiveness().z,
            gravity_m_s2: vehicle.gravity_m_s2,
            weight_n: vehicle.weight_n(),
            dt_s,
            rotor_share: rotors.share(dt_s),
        }
    }

    /// Returns the reckoning of a vehicle before take-off, trimmed for the nominal weight.
    pub fn start(&self, state: &State) -> Reckoning {
        let angle_rad = state.attitude_rad.xy();
        let trim = Inputs { thrust_n: self.weight_n, ..Inputs::default() };
        let rate_rad_s = state.rates_rad_s.xy();
        Reckoning { held_rad: angle_rad, angle_rad, rate_rad_s, acting_n: Vector2::zeros(), trim }
    }

    /// Advances the dead reckoning by one step with the inputs commanded to the rotors.
    pub fn advance(&self, reckoning: &mut Reckoning, applied: &Inputs) {
        let asked_n = Vector2::new(applied.roll_n, applied.pitch_n);
        let acting_n = reckoning.acting_n;
        reckoning.acting_n = (acting_n + (asked_n - acting_n) * self.rotor_share).map(settled);
        let excess = reckoning.acting_n - Vector2::new(reckoning.trim.roll_n, reckoning.trim.pitch_n);
        reckoning.rate_rad_s += self.authority.component_mul(&excess) * self.dt_s;
        reckoning.angle_rad += reckoning.rate_rad_s * self.dt_s;
    }

    /// Restarts from a measurement, and corrects the trim by the difference from the reckoning.
    pub fn measure(&self, reckoning: &mut Reckoning, state: &State) {
        let rate_rad_s = state.rates_rad_s.xy();
        let innovation =
            (rate_rad_s - reckoning.rate_rad_s).map(|rate| min(max(rate, -INNOVATION_MAX_RAD_S), INNOVATION_MAX_RAD_S));
        // The error of a wrong trim grows with the time since the last measurement, so TRIM_S holds at any measurement
        // rate.
        let learnt = self.inverse_authority.component_mul(&innovation) / TRIM_S;
        reckoning.trim.roll_n -= learnt.x;
        reckoning.trim.pitch_n -= learnt.y;
        reckoning.rate_rad_s = rate_rad_s;
        reckoning.angle_rad = state.attitude_rad.xy();
        reckoning.held_rad = reckoning.angle_rad;
    }

    /// Filters the law's thrust and yaw into the trim. Each sample is limited to twice the weight in thrust and a tenth
    /// of the weight in yaw, so that transients have little effect.
    pub fn trim(&self, reckoning: &mut Reckoning, applied: &Inputs) {
        let share = self.dt_s / TRIM_S;
        let yaw_max = 0.1 * self.weight_n;
        let Inputs { yaw_n, thrust_n, .. } = &mut reckoning.trim;
        *yaw_n += share * (min(max(applied.yaw_n, -yaw_max), yaw_max) - *yaw_n);
        *thrust_n += share * (min(max(applied.thrust_n, 0.0), 2.0 * self.weight_n) - *thrust_n);
    }

    /// Returns the inputs that hold the last attitude with the trimmed thrust.
    pub fn coast(&self, reckoning: &Reckoning) -> Inputs {
        self.hold(reckoning, &reckoning.held_rad, 1.0)
    }

    /// Returns the inputs that level the vehicle and let it descend.
    pub fn descend(&self, reckoning: &Reckoning) -> Inputs {
        self.hold(reckoning, &Vector2::zeros(), DESCENT_THRUST)
    }

    fn hold(&self, reckoning: &Reckoning, held_rad: &Vector2<f32>, thrust: f32) -> Inputs {
        let Reckoning { angle_rad, rate_rad_s, trim, .. } = reckoning;
        let wanted_rad_s2 = (held_rad - angle_rad) * (HOLD_RAD_S * HOLD_RAD_S) - rate_rad_s * (2.0 * HOLD_RAD_S);
        let moment = self.inverse_authority.component_mul(&wanted_rad_s2);
        Inputs {
            roll_n: trim.roll_n + moment.x,
            pitch_n: trim.pitch_n + moment.y,
            yaw_n: trim.yaw_n,
            thrust_n: trim.thrust_n * thrust,
        }
    }
}
