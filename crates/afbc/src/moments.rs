//! Observer of the moments that the rotors do not give: from weak rotors, bent propellers or a payload off the centre.
//! Not in the paper.
//!
//! With g_i of (6) the observer predicts the body rates:
//!
//! ```text
//! dOmega_hat/dt = g U + d + f_hat + 2w (Omega - Omega_hat)      U: U1..U3 as carried out, behind the rotors' lag
//! df_hat/dt     = w^2 (Omega - Omega_hat)                       d: known moments
//! ```
//!
//! g of roll and pitch is the model's times the [learnt share](crate::effectiveness). With f_hat in place of f, (16)
//! commands what INDI does: the given input plus the missing acceleration, each behind the same two poles.

use crate::disturbance::{DisturbanceObserver, ObserverConditions};
use crate::effectiveness::{Effectiveness, EffectivenessMemory};
use afbc_control::math::{self, max};
use afbc_types::{Inputs, Parameters};
use nalgebra::Vector3;

/// Age of the rates that the moment observer assumes, in addition to the rotor lag \[s\]: rates may be new or 20 ms
/// old.
pub const AGE_S: f32 = 0.01;
/// Smallest bandwidth used in the jump limit of the rates \[rad/s\].
const W_MIN_RAD_S: f32 = 1.0;

/// Moment observer with its constants. Everything that changes in flight is in [`MomentObserverMemory`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MomentObserver {
    /// Corrections of Omega_hat \[1\] and f_hat \[1/s\] per step and rate difference.
    rate: Vector3<f32>,
    acceleration: Vector3<f32>,
    /// Shares replaced per step: of the filtered inputs, and of the filtered known acceleration.
    lag: f32,
    age: f32,
    dt_s: f32,
    /// g of roll, pitch and yaw.
    effectiveness: Vector3<f32>,
    /// Angular acceleration by a moment per mass \[1/m2\].
    per_moment: Vector3<f32>,
    /// -1/g of roll, pitch and yaw.
    ineffectiveness: Vector3<f32>,
    /// Largest f_hat \[rad/s2\], and largest Omega - Omega_hat that f_hat can cause \[rad/s\].
    acceleration_max: Vector3<f32>,
    jump: Vector3<f32>,
    /// `None` without an observer of roll and pitch.
    learner: Option<Effectiveness>,
}

/// Memory of the moment observer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MomentObserverMemory {
    rates_rad_s: Vector3<f32>,
    acceleration_rad_s2: Vector3<f32>,
    /// Angular acceleration g U by the inputs \[rad/s2\].
    given_rad_s2: Vector3<f32>,
    /// Known angular acceleration, delayed to the age of the rates \[rad/s2\].
    known_rad_s2: Vector3<f32>,
    effectiveness: EffectivenessMemory,
}

impl MomentObserverMemory {
    /// Returns the learnt effectiveness of roll and pitch as a share of the model's.
    #[inline]
    pub fn effectiveness_share(&self) -> f32 {
        self.effectiveness.share
    }
}

impl MomentObserver {
    /// Creates the observer from valid settings, for rotors that give at most `thrust_max_n` together, advanced every
    /// `dt_s` seconds. `None` if both bandwidths are 0.
    pub fn new(settings: &DisturbanceObserver, vehicle: &Parameters, thrust_max_n: f32, dt_s: f32) -> Option<Self> {
        let DisturbanceObserver { disturbance_tilt_rad_s: tilt, disturbance_yaw_rad_s: yaw, .. } = *settings;
        let bandwidth = Vector3::new(tilt, tilt, yaw);
        let rest = bandwidth.map(|w| 1.0 - math::exp(-w * dt_s));
        let lag_s = settings.disturbance_lag_s + AGE_S;
        let effectiveness = vehicle.effectiveness();
        // The observed acceleration is limited to what the rotors can compensate.
        let acceleration_max = effectiveness * (0.5 * thrust_max_n);
        let (rate, acceleration) = (rest * 2.0, rest.map(|rest| rest * rest / dt_s));
        // A step of f moves Omega - Omega_hat by f t exp(-w t), which is at most f/(e w).
        let jump = acceleration_max
            .zip_map(&bandwidth, |most, w| max(most / (core::f32::consts::E * max(w, W_MIN_RAD_S)), 1.0));
        (tilt + yaw > 0.0).then(|| MomentObserver {
            rate,
            acceleration,
            lag: 1.0 - math::exp(-dt_s / lag_s),
            age: 1.0 - math::exp(-dt_s / AGE_S),
            dt_s,
            effectiveness,
            per_moment: vehicle.inertia_kg_m2.map(|inertia| vehicle.mass_kg / inertia),
            ineffectiveness: effectiveness.map(|g| -1.0 / g),
            acceleration_max,
            jump,
            learner: (tilt > 0.0).then(|| Effectiveness::new([rate.x, acceleration.x], jump.x, dt_s)),
        })
    }

    /// Returns f_hat of roll, pitch and yaw \[rad/s2\] for these rates, in addition to `known` \[rad/s2\]. Advances
    /// f_hat by one step if the rates are `fresh`. Returns zero while the vehicle touches the ground.
    // One copy for both laws and any number of rotors, which keeps the image small.
    #[inline(never)]
    pub fn advance(
        &self,
        memory: &mut Option<MomentObserverMemory>,
        rates_rad_s: &Vector3<f32>,
        known: &Vector3<f32>,
        ObserverConditions { fresh, touches_ground }: ObserverConditions,
    ) -> Vector3<f32> {
        let zero = Vector3::zeros();
        let start = MomentObserverMemory {
            rates_rad_s: *rates_rad_s,
            acceleration_rad_s2: zero,
            given_rad_s2: zero,
            known_rad_s2: *known,
            effectiveness: EffectivenessMemory::default(),
        };
        let memory = memory.get_or_insert(start);
        if touches_ground {
            *memory = MomentObserverMemory { effectiveness: memory.effectiveness.restarted(), ..start };
            return zero;
        }
        if !fresh {
            return memory.acceleration_rad_s2;
        }
        let MomentObserverMemory {
            rates_rad_s: omega_hat,
            acceleration_rad_s2: f_hat,
            given_rad_s2: given,
            known_rad_s2,
            effectiveness,
        } = memory;
        // The known moments are delayed to the assumed age of the rates. Otherwise every change of them would be
        // observed as a disturbance.
        *known_rad_s2 = (*known_rad_s2 + (known - *known_rad_s2) * self.age).map(math::settled);
        let off = rates_rad_s - *omega_hat;
        if let Some(learner) = &self.learner {
            learner.learn(effectiveness, [off.x, off.y], [given.x, given.y]);
        }
        let found =
            f_hat.zip_zip_map(&self.acceleration.component_mul(&off), &self.acceleration_max, |f, more, most| {
                math::settled(math::limited(f + more, most))
            });
        let within = off.zip_map(&self.jump, |off, jump| off.abs() <= jump);
        *f_hat = within.zip_zip_map(f_hat, &found, |within, before, found| if within { found } else { before });
        let corrected = *omega_hat + self.rate.component_mul(&off);
        let start = within.zip_zip_map(&corrected, rates_rad_s, |within, to, jumped| if within { to } else { jumped });
        *omega_hat = (start + (*given + *known_rad_s2 + *f_hat) * self.dt_s).map(math::settled);
        *f_hat
    }

    /// Returns the angular acceleration \[rad/s2\] by a moment per mass \[m2/s2\].
    #[inline]
    pub fn angular_acceleration_rad_s2(&self, moment_m2_s2: &Vector3<f32>) -> Vector3<f32> {
        moment_m2_s2.component_mul(&self.per_moment)
    }

    /// Returns U1..U3 \[N\] that compensate an angular acceleration.
    #[inline]
    pub fn compensating_inputs_n(&self, acceleration_rad_s2: &Vector3<f32>) -> [f32; 3] {
        acceleration_rad_s2.component_mul(&self.ineffectiveness).into()
    }

    /// Stores U1..U3 commanded in this step \[N\], which are `effort` times as large as for the model's rotors.
    #[inline]
    pub fn record_inputs(&self, memory: &mut Option<MomentObserverMemory>, given: &Inputs, effort: f32) {
        if let Some(memory) = memory {
            let given = Vector3::new(given.roll_n, given.pitch_n, given.yaw_n);
            // Known weakness of the rotors is no moment. `effort` is bounded away from zero.
            let mut given = given.component_mul(&self.effectiveness) * (1.0 / effort);
            let share = memory.effectiveness.share;
            (given.x, given.y) = (given.x * share, given.y * share);
            memory.given_rad_s2 = (memory.given_rad_s2 + (given - memory.given_rad_s2) * self.lag).map(math::settled);
        }
    }
}
