//! Rate controller of acro mode: controls body rates instead of the law. Not in the paper.
//!
//! With the error e = Omega_d - Omega, the commanded angular acceleration is
//!
//! ```text
//! u = k_1 e - k_2 a + z + I^-1 (Omega x I Omega),   tau da/dt = u_given - a,   dz/dt = k_i e s
//! ```
//!
//! a is the angular acceleration that the rotors give by now, from their nominal lag tau. z learns constant moments
//! that the nominal model lacks. The weight s = 1 - (e/E)^2, at least 0, stops the learning at large errors. With e and
//! a alone, the loop's polynomial is s^2 + (1 + k_2)/tau s + k_1/tau. The gains k_1 = w^2 tau and k_2 = 2 D w tau - 1
//! place its poles at w with damping D. Like PX4's, it is a loop of its own: the laws track an attitude, which a pilot
//! in acro mode does not command.

use crate::motor::Response;
use afbc_control::{Action, Mixer, math};
use afbc_types::{Inputs, Parameters, State};
use nalgebra::Vector3;

/// Largest w tau. Faster loops with slow rotors would need an exact model.
const AGAINST_LAG: f32 = 1.5;
/// Largest w \[rad/s\], limited by the filters and delays of gyroscopes.
const BANDWIDTH_MAX: f32 = 25.0;
/// Damping D.
const DAMPING: f32 = 0.8;
/// k_i as a share of w^2: z converges in half a second.
const LEARNS: f32 = 0.05;
/// E: error above which nothing is learnt \[rad/s\], since the vehicle is still accelerating to the rate.
const LEARNS_RAD_S: f32 = 1.5;
/// Largest |z| \[rad/s2\].
const LEARNT_MAX: f32 = 50.0;

/// Body rates and thrust that a pilot commands.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RateTarget {
    /// Desired rates Omega_d, body frame \[rad/s\].
    pub rates_rad_s: Vector3<f32>,
    /// Thrust as a share of the rotors' largest, 0 to 1.
    pub thrust: f32,
}

impl RateTarget {
    /// True if all numbers are finite, the rates are at most 1e3 rad/s, and the thrust is within 0 to 1.
    pub(crate) fn is_plausible(&self) -> bool {
        self.rates_rad_s.iter().all(|rate| rate.abs() <= 1e3) && (0.0..=1.0).contains(&self.thrust)
    }
}

/// Rate controller of one vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RateControl {
    inertia_kg_m2: Vector3<f32>,
    /// Inputs per angular acceleration \[N s2/rad\].
    inputs_per: Vector3<f32>,
    /// Gains k_1 \[1/s\], k_2, k_i \[1/s2\].
    gains: [f32; 3],
    /// Share of the difference to their command that the rotors make up in a tick.
    follows: f32,
    dt_s: f32,
}

/// Memory of the rate controller between ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct RateMemory {
    /// Angular acceleration a that the rotors give by now \[rad/s2\].
    given: Vector3<f32>,
    /// Learnt angular acceleration z \[rad/s2\].
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
            // k_2 is negative for rotors faster than the poles require. The loop's damping (1 + k_2)/tau stays
            // positive.
            gains: [squared * lag_s, 2.0 * DAMPING * bandwidth * lag_s - 1.0, LEARNS * squared],
            follows: rotors.share(dt_s),
            dt_s,
        }
    }

    /// Runs one step for a vehicle in `state`.
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
        // Do not learn while rotors saturate: the missing moment is no model error, and z would wind up.
        if !action.health.saturated {
            let size = error.norm_squared() / (LEARNS_RAD_S * LEARNS_RAD_S);
            let more = error * (k_i * self.dt_s * math::max(1.0 - size, 0.0));
            *learnt = (*learnt + more).map(|learnt| math::max(math::min(learnt, LEARNT_MAX), -LEARNT_MAX));
        }
        let Inputs { roll_n, pitch_n, yaw_n, .. } = action.given;
        // The part that compensates z and the gyroscopic moment does not accelerate the body, and is not part of a.
        let reached = Vector3::new(roll_n, pitch_n, yaw_n).component_div(&self.inputs_per) - *learnt - gyroscopic;
        *given += (reached - *given) * self.follows;
        action
    }
}
