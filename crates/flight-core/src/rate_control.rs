//! Control of the body's rates in place of the law: acro mode. Not in the paper.
//!
//! With the error e = Omega_d - Omega, the rotors are asked for the angular acceleration
//!
//! ```text
//! u = k_1 e - k_2 a + z + I^-1 (Omega x I Omega),   tau da/dt = u_given - a,   dz/dt = k_i e s
//! ```
//!
//! a is what the rotors give by now, as far as their nominal lag tau tells, and z learns what the nominal model does
//! not know, with s = 1 - (e/E)^2 that ends at 0. With e and a alone the loop is s^2 + (1 + k_2)/tau s + k_1/tau,
//! whose poles are put at w with damping D by
//! k_1 = w^2 tau and k_2 = 2 D w tau - 1. It is a loop of its own, like PX4's: an attitude to track, which the laws
//! need, is what a pilot in acro mode does not command.

use crate::motor::Response;
use afbc_control::{Action, Mixer, math};
use afbc_types::{Inputs, Parameters, State};
use nalgebra::Vector3;

/// w tau, at most: slow rotors follow as far as their model is right.
const AGAINST_LAG: f32 = 1.5;
/// Largest w \[rad/s\]: what filters and delays of gyroscopes leave.
const BANDWIDTH_MAX: f32 = 25.0;
/// D.
const DAMPING: f32 = 0.8;
/// k_i as a share of w squared: z follows in half a second.
const LEARNS: f32 = 0.05;
/// Error from which on nothing is learnt \[rad/s\]: the vehicle is still turning up to the rate.
const LEARNS_RAD_S: f32 = 1.5;
/// Largest |z| \[rad/s2\].
const LEARNT_MAX: f32 = 50.0;

/// Rates about the body's axes and a thrust that a pilot commands.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RateTarget {
    /// Omega_d, body frame \[rad/s\].
    pub rates_rad_s: Vector3<f32>,
    /// Thrust as a share of the most that the rotors give, 0 to 1.
    pub thrust: f32,
}

impl RateTarget {
    /// True if every number is one, and the rates are at most 1e3 rad/s.
    pub(crate) fn is_plausible(&self) -> bool {
        self.rates_rad_s.iter().all(|rate| rate.abs() <= 1e3) && (0.0..=1.0).contains(&self.thrust)
    }
}

/// The controller of one vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RateControl {
    inertia_kg_m2: Vector3<f32>,
    /// Inputs per angular acceleration \[N s2/rad\].
    inputs_per: Vector3<f32>,
    /// k_1 \[1/s\], k_2, k_i \[1/s2\].
    gains: [f32; 3],
    /// Share of the way to their command that the rotors go in a tick.
    follows: f32,
    dt_s: f32,
}

/// What it remembers of a vehicle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct RateMemory {
    /// a \[rad/s2\].
    given: Vector3<f32>,
    /// z \[rad/s2\].
    pub(crate) learnt: Vector3<f32>,
}

impl RateControl {
    pub(crate) fn new(parameters: &Parameters, rotors: &Response, dt_s: f32) -> Self {
        let lag_s = rotors.time_constant_s;
        let bandwidth = math::min(AGAINST_LAG / lag_s, BANDWIDTH_MAX);
        let squared = bandwidth * bandwidth;
        RateControl {
            inertia_kg_m2: parameters.inertia_kg_m2,
            inputs_per: parameters.effectiveness().map(|effectiveness| 1.0 / effectiveness),
            // k_2 is negative for rotors faster than the poles ask; the loop's own damping, (1 + k_2)/tau, is not.
            gains: [squared * lag_s, 2.0 * DAMPING * bandwidth * lag_s - 1.0, LEARNS * squared],
            follows: rotors.share(dt_s),
            dt_s,
        }
    }

    /// Runs a step for a vehicle in `state`.
    pub(crate) fn advance<const N: usize>(
        &self,
        mixer: &Mixer<N>,
        memory: &mut RateMemory,
        state: &State,
        target: &RateTarget,
    ) -> Action<N> {
        let rates = &state.rates_rad_s;
        let error = target.rates_rad_s - rates;
        let gyroscopic = rates.cross(&self.inertia_kg_m2.component_mul(rates)).component_div(&self.inertia_kg_m2);
        let ([k_1, k_2, k_i], RateMemory { given, learnt }) = (self.gains, memory);
        let wanted_rad_s2 = error * k_1 - *given * k_2 + *learnt + gyroscopic;
        let [roll_n, pitch_n, yaw_n] = wanted_rad_s2.component_mul(&self.inputs_per).into();
        let thrust_n = target.thrust * mixer.thrust_max_n();
        let action = mixer.action(&Inputs { roll_n, pitch_n, yaw_n, thrust_n });
        // What saturated rotors do not give is no moment that the model does not know: z would wind up.
        if !action.health.saturated {
            let size = error.norm_squared() / (LEARNS_RAD_S * LEARNS_RAD_S);
            let more = error * (k_i * self.dt_s * math::max(1.0 - size, 0.0));
            *learnt = (*learnt + more).map(|learnt| math::max(math::min(learnt, LEARNT_MAX), -LEARNT_MAX));
        }
        let Inputs { roll_n, pitch_n, yaw_n, .. } = action.given;
        // What makes up for z and for the gyroscopic moment turns nothing, and is no part of a.
        let reached = Vector3::new(roll_n, pitch_n, yaw_n).component_div(&self.inputs_per) - *learnt - gyroscopic;
        *given += (reached - *given) * self.follows;
        action
    }
}
