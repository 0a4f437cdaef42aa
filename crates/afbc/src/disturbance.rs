//! Observers of unmodelled disturbances: the horizontal acceleration, mostly wind, and moments, from weak rotors or a
//! payload off the centre. Not in the paper.
//!
//! (16) needs f of x and y, which the model takes as zero. Without an observer all of f must be learnt from the error
//! that it causes. But the vehicle measures its velocity v and knows its thrust:
//!
//! ```text
//! dv_hat/dt = T/T_h g (R e_z) + a + f_hat + 2w (v - v_hat)  a: known drag; T: thrust behind the rotors' lag
//! df_hat/dt = w^2 (v - v_hat)                               T_h: learnt hover thrust
//! ```
//!
//! f_hat is f behind two poles at w. T is divided by the learnt hover thrust, as in (40), so weak rotors do not look
//! like wind.
//!
//! This is the extended state observer of Han, *From PID to active disturbance rejection control*, IEEE TIE 56(3),
//! 2009, with both poles at the same place as in Gao, *Scaling and bandwidth-parameterization based controller tuning*,
//! ACC 2003, in exact discrete form.

use crate::force_map::{ForceMap, ForceMapWeights};
use afbc_control::Settings;
use afbc_control::drag::KnownDrag;
use afbc_control::math::{self, max};
use afbc_types::{Inputs, OutOfRange, Parameters, State, parameters};
use nalgebra::Vector3;

/// Largest f_hat \[m/s2\], that of a wind of some 20 m/s.
pub const ACCELERATION_MAX_M_S2: f32 = 10.0;
/// Age of the rates that the moment observer assumes, in addition to the rotor lag \[s\]: rates may be new or 20 ms
/// old.
pub const AGE_S: f32 = 0.01;
/// Smallest bandwidth used in the jump limit of the rates \[rad/s\].
const W_MIN_RAD_S: f32 = 1.0;
/// Largest v - v_hat that f can cause, at most f/(e w) \[m/s\]. A larger difference is a jump of the state, as after an
/// outage.
pub const JUMP_M_S: f32 = 0.1;

parameters! {
    /// Disturbance observer. By default there is none.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct DisturbanceObserver {
        /// w: bandwidth of the disturbance observer; 0 for none.
        #[parameter(DIST_XY, "rad/s", 0.0..=200.0, tuned)]
        pub disturbance_rad_s: f32 = 0.0,
        /// w: bandwidth of the observer of moments about x and y; 0 for none.
        #[parameter(DIST_TILT, "rad/s", 0.0..=500.0, tuned)]
        pub disturbance_tilt_rad_s: f32 = 0.0,
        /// w: bandwidth of the observer of moments about z; 0 for none.
        #[parameter(DIST_YAW, "rad/s", 0.0..=500.0, tuned)]
        pub disturbance_yaw_rad_s: f32 = 0.0,
        /// gamma: rate at which the memory learns the disturbance observer's estimate; 0 for no memory.
        #[parameter(MEM_RATE, "1/s", 0.0..=10.0)]
        pub memory_1_s: f32 = 0.0,
        /// Speed at the centre of the memory's outer fuzzy rules.
        #[parameter(MEM_SPEED, "m/s", 0.1..=50.0)]
        pub memory_speed_m_s: f32 = 4.0,
        /// Rotor lag that both observers model.
        #[parameter(DIST_LAG, "s", 0.0..=0.5)]
        pub disturbance_lag_s: f32 = 0.02,
    }
}

impl DisturbanceObserver {
    /// Returns the observer for a vehicle that is `slowness` times slower.
    #[must_use]
    pub(crate) fn slowed(self, slowness: f32, lag_s: f32) -> Self {
        DisturbanceObserver {
            disturbance_rad_s: self.disturbance_rad_s / slowness,
            disturbance_tilt_rad_s: self.disturbance_tilt_rad_s / slowness,
            disturbance_yaw_rad_s: self.disturbance_yaw_rad_s / slowness,
            disturbance_lag_s: lag_s,
            ..self
        }
    }
}

/// Force observer with its constants. Everything that changes in flight is in [`ForceObserverMemory`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceObserver {
    /// Corrections of v_hat \[1\] and f_hat \[1/s\] per step and velocity difference.
    velocity: f32,
    acceleration: f32,
    /// Share of the filtered thrust that is replaced per step.
    lag: f32,
    dt_s: f32,
    drag: KnownDrag,
    memory: Option<ForceMap>,
    gravity_m_s2: f32,
    weight_n: f32,
}

/// Conditions of a tick that decide whether an observer advances.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ObserverConditions {
    /// True if the state has been measured since the last tick.
    pub fresh: bool,
    /// True if the vehicle touches the ground, whose forces are no disturbance.
    pub touches_ground: bool,
}

/// Memory of the force observer: v_hat, f_hat along x and y, and T.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceObserverMemory {
    velocity_m_s: [f32; 2],
    acceleration_m_s2: [f32; 2],
    thrust_n: f32,
    /// Learnt relation between velocity and force.
    pub remembered: ForceMapWeights,
    /// True if the next velocity is not measured.
    held: bool,
}

impl ForceObserverMemory {
    /// Keeps f_hat unchanged in the next step.
    pub fn hold(&mut self) {
        self.held = true;
    }
}

impl ForceObserver {
    /// Creates the observer from valid settings, `None` if its bandwidth is 0.
    ///
    /// # Errors
    /// Returns an error if the speed of the memory is out of range.
    pub fn new(
        settings: &DisturbanceObserver,
        common: &Settings,
        vehicle: &Parameters,
    ) -> Result<Option<Self>, OutOfRange> {
        let DisturbanceObserver { disturbance_rad_s: bandwidth, disturbance_lag_s: lag_s, .. } = *settings;
        let Settings { dt_s, drag, .. } = *common;
        // The observer has two poles at exp(-w dt).
        let rest = 1.0 - math::exp(-bandwidth * dt_s);
        let memory = ForceMap::new(settings.memory_1_s, settings.memory_speed_m_s, dt_s)?;
        Ok((bandwidth > 0.0).then(|| ForceObserver {
            velocity: 2.0 * rest,
            acceleration: rest * rest / dt_s,
            lag: if lag_s > 0.0 { 1.0 - math::exp(-dt_s / lag_s) } else { 1.0 },
            dt_s,
            drag,
            memory,
            gravity_m_s2: vehicle.gravity_m_s2,
            weight_n: vehicle.weight_n(),
        }))
    }

    /// Returns f \[m/s2\] for this state with the thrust along `up`: known drag plus, along x and y, the remembered
    /// force and f_hat. Advances f_hat by one step if the state is `fresh`. Returns zero while the vehicle touches
    /// the ground.
    #[inline]
    pub fn advance(
        &self,
        observed: &mut Option<ForceObserverMemory>,
        state: &State,
        up: &Vector3<f32>,
        hover_n: f32,
        ObserverConditions { fresh, touches_ground }: ObserverConditions,
    ) -> Vector3<f32> {
        let measured = [state.velocity_m_s.x, state.velocity_m_s.y];
        let start = |thrust_n, remembered| ForceObserverMemory {
            velocity_m_s: measured,
            acceleration_m_s2: [0.0; 2],
            thrust_n,
            remembered,
            held: false,
        };
        // A flight that begins in the air is assumed to hover, with a thrust equal to the weight.
        let observed = observed.get_or_insert_with(|| start(self.weight_n, ForceMapWeights::default()));
        if touches_ground {
            // The thrust and the learnt force survive a touch of the ground.
            *observed = start(observed.thrust_n, observed.remembered);
            return Vector3::zeros();
        }
        let share = observed.thrust_n / hover_n;
        let mut drag = self.drag.acceleration(&state.velocity_m_s, up, share);
        let ForceObserverMemory { velocity_m_s, acceleration_m_s2, remembered, held, .. } = observed;
        if let Some(memory) = &self.memory {
            let weights = memory.weights(measured);
            if fresh && !*held {
                memory.learn(remembered, &weights, *acceleration_m_s2);
            }
            let [x, y] = remembered.recall(&weights);
            (drag.x, drag.y) = (drag.x + x, drag.y + y);
        }
        let known = [drag.x + up.x * share * self.gravity_m_s2, drag.y + up.y * share * self.gravity_m_s2];
        for (((v_hat, f_hat), v), a) in
            velocity_m_s.iter_mut().zip(acceleration_m_s2.iter_mut()).zip(measured).zip(known)
        {
            // A difference that arose while the velocity was not measured is no disturbance, so f_hat stays.
            if *held {
                *v_hat = v;
            } else if fresh {
                let off = v - *v_hat;
                if off.abs() <= JUMP_M_S {
                    let f = math::settled(*f_hat + self.acceleration * off);
                    *f_hat = math::limited(f, ACCELERATION_MAX_M_S2);
                    *v_hat += self.velocity * off;
                } else {
                    *v_hat = v;
                }
                *v_hat = math::settled(*v_hat + (a + *f_hat) * self.dt_s);
            }
        }
        *held = false;
        let [x, y] = *acceleration_m_s2;
        drag + Vector3::new(x, y, 0.0)
    }

    /// Stores the total thrust commanded in this step \[N\].
    #[inline]
    pub fn record_thrust(&self, observed: &mut Option<ForceObserverMemory>, thrust_n: f32) {
        if let Some(observed) = observed {
            observed.thrust_n = math::settled(observed.thrust_n + (thrust_n - observed.thrust_n) * self.lag);
        }
    }
}

/// Observer of the body rates, for moments other than the rotors', with g_i of (6):
///
/// ```text
/// dOmega_hat/dt = g U + d + f_hat + 2w (Omega - Omega_hat)      U: U1..U3 as carried out, behind the rotors' lag
/// df_hat/dt     = w^2 (Omega - Omega_hat)
/// ```
///
/// With f_hat in place of f, (16) commands what INDI does: the given input plus the missing acceleration, each behind
/// the same two poles.
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
        (tilt + yaw > 0.0).then(|| MomentObserver {
            rate: rest * 2.0,
            acceleration: rest.map(|rest| rest * rest / dt_s),
            lag: 1.0 - math::exp(-dt_s / lag_s),
            age: 1.0 - math::exp(-dt_s / AGE_S),
            dt_s,
            effectiveness,
            per_moment: vehicle.inertia_kg_m2.map(|inertia| vehicle.mass_kg / inertia),
            ineffectiveness: effectiveness.map(|g| -1.0 / g),
            acceleration_max,
            // A step of f moves Omega - Omega_hat by f t exp(-w t), which is at most f/(e w).
            jump: acceleration_max
                .zip_map(&bandwidth, |most, w| max(most / (core::f32::consts::E * max(w, W_MIN_RAD_S)), 1.0)),
        })
    }

    /// Returns f_hat of roll, pitch and yaw \[rad/s2\] for these rates, in addition to `known` \[rad/s2\]. Advances
    /// f_hat by one step if the rates are `fresh`. Returns zero while the vehicle touches the ground.
    #[inline]
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
        };
        let memory = memory.get_or_insert(start);
        if touches_ground {
            *memory = start;
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
        } = memory;
        // The known moments are delayed to the assumed age of the rates. Otherwise every change of them would be
        // observed as a disturbance.
        *known_rad_s2 = (*known_rad_s2 + (known - *known_rad_s2) * self.age).map(math::settled);
        let off = rates_rad_s - *omega_hat;
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
            let given = given.component_mul(&self.effectiveness) * (1.0 / effort);
            memory.given_rad_s2 = (memory.given_rad_s2 + (given - memory.given_rad_s2) * self.lag).map(math::settled);
        }
    }
}
