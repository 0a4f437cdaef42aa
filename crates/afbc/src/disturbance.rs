//! Observer of unmodelled accelerations, from wind or rotors that are weaker than told, and the settings of all
//! observers. Not in the paper.
//!
//! (16) needs f, which the model takes as zero along x and y, and as gravity along z. Without an observer the rest must
//! be learnt from the error that it causes. But the vehicle measures its velocity v and knows its thrust:
//!
//! ```text
//! dv_hat/dt = T/T_h g (R e_z) - g e_z + a + f_hat + 2w (v - v_hat)
//! df_hat/dt = w^2 (v - v_hat)
//!
//! a: known drag     T: thrust behind the rotors' lag     T_h: learnt hover thrust, which follows f_hat along z
//! ```
//!
//! f_hat is f behind two poles at w. T is divided by the learnt hover thrust, as in (40), so weak rotors do not look
//! like wind. v_hat is corrected whenever the velocity has been measured, by the gains for the time since the last
//! correction. Beyond [`QUIET_M_S`], w falls in proportion to the noise of the velocity. White noise shows itself in
//! the product of successive changes of v - v_hat, whose mean is minus its variance; forces and motion make no such
//! product.
//!
//! This is the extended state observer of Han, *From PID to active disturbance rejection control*, IEEE TIE 56(3),
//! 2009, with both poles at the same place as in Gao, *Scaling and bandwidth-parameterization based controller tuning*,
//! ACC 2003, in exact discrete form.

use crate::age::AgeMemory;
use crate::force_map::{ForceMap, ForceMapWeights};
use afbc_control::Settings;
use afbc_control::drag::KnownDrag;
use afbc_control::math::{self, max};
use afbc_types::{OutOfRange, Parameters, State, parameters};
use nalgebra::Vector3;

/// Largest |f_hat| \[m/s2\], that of a wind of some 20 m/s.
pub const ACCELERATION_MAX_M_S2: f32 = 10.0;
/// Time for which a force may act unseen by a quick observer \[s\]. A difference that the largest force cannot cause in
/// this time, or since the last velocity if that is longer, is noise, or a jump of the state, as after an outage.
pub const UNSEEN_S: f32 = 0.01;
/// A velocity that is repeated for longer than this is constant \[s\].
const REPEATED_S: f32 = 0.12;
/// Longest time that a single velocity corrects for \[s\].
const LONG_S: f32 = 0.1;
/// Standard deviation of the velocity's noise up to which the observer keeps its bandwidth \[m/s\]. Beyond it the
/// bandwidth falls in proportion, so that the noise of f_hat does not grow.
pub const QUIET_M_S: f32 = 0.01;
/// Number of standard deviations of the noise beyond which a velocity is no noise.
const OUTLIER: f32 = 4.0;
/// Root of the largest product of changes of v - v_hat that counts as noise \[m/s\].
const CHANGE_MAX_M_S: f32 = 0.5;
/// Smallest cosine of the tilt at which the age is learnt: farther from level, an error of the tilt looks like age.
const UPRIGHT: f32 = 0.9;
/// Rate at which the hover thrust learns f_hat along z \[1/s\].
const LIFT_1_S: f32 = 5.0;
/// Largest |f_hat| along z that the hover thrust learns \[m/s2\]: the feet's force, until a touch of the ground is
/// detected, must not take the learnt thrust away.
const LIFT_MAX_M_S2: f32 = 2.0;
/// Smallest cosine of the tilt at which the hover thrust is learnt: upside down, it would be learnt the wrong way.
const LIFTS: f32 = 0.3;
/// Smallest and largest learnt hover thrust, as shares of the weight.
const HOVER_SHARE_MIN: f32 = 0.3;
const HOVER_SHARE_MAX: f32 = 3.0;
/// Share of the noise's mean square that is replaced by each measured velocity.
const NOISE_SHARE: f32 = 0.004;

parameters! {
    /// Disturbance observer. By default there is none.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct DisturbanceObserver {
        /// w: bandwidth of the disturbance observer along x and y; 0 for none.
        #[parameter(DIST_XY, "rad/s", 0.0..=200.0, tuned)]
        pub disturbance_rad_s: f32 = 0.0,
        /// w: bandwidth of the disturbance observer along z; 0 for none.
        #[parameter(DIST_Z, "rad/s", 0.0..=200.0, tuned)]
        pub disturbance_z_rad_s: f32 = 0.0,
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
    /// Returns the observer for a vehicle that is `slowness` times slower. Along z, the age that the observer finds, of
    /// which the rotors' lag is a part, makes the law slower.
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
    /// Rates r of x and y, and of z: a correction after the time t leaves both poles at 1/(1 + r t) \[1/s\].
    rates_1_s: [f32; 2],
    /// 1 where the rate is positive, 0 where it is 0.
    observes: [f32; 2],
    /// Share of the filtered thrust that is replaced per step.
    lag: f32,
    /// Time for which a force may act unseen \[s\].
    unseen_s: f32,
    dt_s: f32,
    drag: KnownDrag,
    memory: Option<ForceMap>,
    gravity_m_s2: f32,
    weight_n: f32,
    inverse_mass: f32,
    /// Change of T_h per step and f_hat along z \[kg\].
    lift_kg: f32,
}

/// Conditions of a tick that decide whether an observer advances.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ObserverConditions {
    /// True if the state has been measured since the last tick.
    pub fresh: bool,
    /// True if the vehicle touches the ground, whose forces are no disturbance.
    pub touches_ground: bool,
}

/// Memory of the force observer: v_hat, f_hat and T.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceObserverMemory {
    velocity_m_s: Vector3<f32>,
    acceleration_m_s2: Vector3<f32>,
    /// v - v_hat after the last correction, and the change of v - v_hat before it \[m/s\].
    off_m_s: Vector3<f32>,
    change_m_s: Vector3<f32>,
    /// Variance of the velocity's noise, the mean of x, y and z \[m2/s2\].
    noise_m2_s2: f32,
    /// True if the last velocity was too far off to be caused by a force.
    is_outlier: bool,
    /// Last velocity that v_hat was compared with \[m/s\], and the time since then \[s\].
    last_m_s: Vector3<f32>,
    since_s: f32,
    thrust_n: f32,
    /// Learnt hover thrust T_h \[N\].
    hover_n: f32,
    age: AgeMemory,
    /// Learnt relation between velocity and force.
    pub remembered: ForceMapWeights,
    /// True if the next velocity along x and y is not measured.
    held: bool,
}

impl ForceObserverMemory {
    /// Keeps f_hat along x and y unchanged in the next step.
    pub fn hold(&mut self) {
        self.held = true;
    }

    /// Returns f_hat along z \[m/s2\].
    #[inline]
    pub fn pushed_m_s2(&self) -> f32 {
        self.acceleration_m_s2.z
    }

    /// Returns the factor on the speed of z for the age of the state.
    #[inline]
    pub fn softness(&self) -> f32 {
        self.age.softness
    }

    /// Returns the memory at the start of a flight with this velocity, thrust and hover thrust.
    #[cold]
    #[inline(never)]
    fn begin(measured_m_s: &Vector3<f32>, [thrust_n, hover_n]: [f32; 2]) -> Self {
        ForceObserverMemory {
            velocity_m_s: *measured_m_s,
            acceleration_m_s2: Vector3::zeros(),
            off_m_s: Vector3::zeros(),
            change_m_s: Vector3::zeros(),
            noise_m2_s2: 0.0,
            is_outlier: false,
            last_m_s: *measured_m_s,
            since_s: 0.0,
            thrust_n,
            hover_n,
            age: AgeMemory::default(),
            remembered: ForceMapWeights::default(),
            held: false,
        }
    }

    /// Forgets what was observed, but not what was learnt.
    #[cold]
    #[inline(never)]
    fn forget(&mut self, measured_m_s: &Vector3<f32>) {
        let ForceObserverMemory { noise_m2_s2, age, remembered, thrust_n, hover_n, .. } = *self;
        let begun = Self::begin(measured_m_s, [thrust_n, hover_n]);
        *self = ForceObserverMemory { noise_m2_s2, age: age.restarted(), remembered, ..begun };
    }

    /// Takes over a measured velocity; f_hat stays.
    #[inline(always)]
    fn restart(&mut self, measured_m_s: &Vector3<f32>) {
        (self.velocity_m_s, self.off_m_s) = (*measured_m_s, Vector3::zeros());
    }

    /// Follows the noise of v - v_hat, and returns its standard deviation, at least [`QUIET_M_S`] \[m/s\].
    #[inline(always)]
    fn follow_noise(&mut self, off_m_s: &Vector3<f32>) -> f32 {
        let change = off_m_s - self.off_m_s;
        let product = math::limited(change.dot(&self.change_m_s), CHANGE_MAX_M_S * CHANGE_MAX_M_S);
        let square = product * (-1.0 / 3.0);
        self.noise_m2_s2 = math::settled(self.noise_m2_s2 + (square - self.noise_m2_s2) * NOISE_SHARE);
        (self.change_m_s, self.off_m_s) = (change, *off_m_s);
        math::sqrt(math::max(self.noise_m2_s2, QUIET_M_S * QUIET_M_S))
    }
}

/// Returns the vector with x and y multiplied by the first factor, and z by the second.
#[inline(always)]
fn scaled(vector: &Vector3<f32>, [xy, z]: [f32; 2]) -> Vector3<f32> {
    Vector3::new(vector.x * xy, vector.y * xy, vector.z * z)
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
        let DisturbanceObserver { disturbance_rad_s, disturbance_z_rad_s, disturbance_lag_s: lag_s, .. } = *settings;
        let Settings { dt_s, drag, .. } = *common;
        // Corrected once per step, the observer has two poles at exp(-w dt).
        let rate_1_s = |bandwidth: f32| (math::exp(bandwidth * dt_s) - 1.0) / dt_s;
        let bandwidths = [disturbance_rad_s, disturbance_z_rad_s];
        // A step of f moves v - v_hat by f t exp(-w t), which is at most f/(e w).
        let unseen_s = bandwidths
            .into_iter()
            .filter(|bandwidth| *bandwidth > 0.0)
            .fold(UNSEEN_S, |most, w| max(most, 1.0 / (core::f32::consts::E * w)));
        let memory = ForceMap::new(settings.memory_1_s, settings.memory_speed_m_s, dt_s)?;
        Ok((disturbance_rad_s + disturbance_z_rad_s > 0.0).then(|| ForceObserver {
            rates_1_s: bandwidths.map(rate_1_s),
            observes: bandwidths.map(|bandwidth| if bandwidth > 0.0 { 1.0 } else { 0.0 }),
            lag: if lag_s > 0.0 { 1.0 - math::exp(-dt_s / lag_s) } else { 1.0 },
            unseen_s,
            dt_s,
            drag,
            memory,
            gravity_m_s2: vehicle.gravity_m_s2,
            weight_n: vehicle.weight_n(),
            inverse_mass: 1.0 / vehicle.mass_kg,
            lift_kg: LIFT_1_S * dt_s * vehicle.mass_kg,
        }))
    }

    /// Returns f \[m/s2\] for this state with the thrust along `up`: known drag, the remembered force along x and y,
    /// and f_hat, less the acceleration by the learnt hover thrust beyond the weight. `hover_n` is the learnt hover
    /// thrust within what the rotors can give. Corrects f_hat if the state is `fresh` and its velocity new. Returns
    /// zero while the vehicle touches the ground.
    // One copy for both laws and any number of rotors, which keeps the image small.
    #[inline(never)]
    pub fn advance(
        &self,
        observed: &mut Option<ForceObserverMemory>,
        state: &State,
        up: &Vector3<f32>,
        hover_n: f32,
        ObserverConditions { fresh, touches_ground }: ObserverConditions,
    ) -> Vector3<f32> {
        let measured = &state.velocity_m_s;
        // A flight that begins in the air is assumed to hover, with a thrust equal to the weight.
        let observed = observed.get_or_insert_with(|| ForceObserverMemory::begin(measured, [self.weight_n, hover_n]));
        if touches_ground {
            // The thrust and what was learnt survive a touch of the ground.
            observed.forget(measured);
            return Vector3::zeros();
        }
        let share = observed.thrust_n / hover_n;
        let mut drag = self.drag.acceleration(measured, up, share);
        if let Some(memory) = &self.memory {
            let weights = memory.weights([measured.x, measured.y]);
            if fresh && !observed.held {
                let f_hat = &observed.acceleration_m_s2;
                memory.learn(&mut observed.remembered, &weights, [f_hat.x, f_hat.y]);
            }
            let [x, y] = observed.remembered.recall(&weights);
            (drag.x, drag.y) = (drag.x + x, drag.y + y);
        }
        let mut known = drag + up * (share * self.gravity_m_s2);
        known.z -= self.gravity_m_s2;
        if observed.held {
            // A difference that arose while the velocity was not measured is no disturbance, so f_hat stays. The
            // velocity along z is measured all the same.
            (observed.velocity_m_s.x, observed.velocity_m_s.y) = (measured.x, measured.y);
            observed.held = false;
        }
        if fresh && (*measured != observed.last_m_s || observed.since_s > REPEATED_S) {
            // A velocity that is older than the rates is repeated until it is measured again.
            self.correct(observed, measured, up.z > UPRIGHT);
        }
        observed.since_s += self.dt_s;
        observed.age.predict(known.z, self.dt_s);
        let predicted = observed.velocity_m_s + (known + observed.acceleration_m_s2) * self.dt_s;
        observed.velocity_m_s = predicted.map(math::settled);
        let mut force = drag + observed.acceleration_m_s2;
        if let Some(more_n) = self.more_hover_thrust_n(observed) {
            if fresh && up.z > LIFTS {
                let hover_n = hover_n - math::limited(observed.acceleration_m_s2.z, LIFT_MAX_M_S2) * self.lift_kg;
                let [least, most] = [HOVER_SHARE_MIN, HOVER_SHARE_MAX].map(|share| share * self.weight_n);
                observed.hover_n = math::min(math::max(hover_n, least), most);
            }
            force.z -= more_n * self.inverse_mass;
        }
        force
    }

    /// Corrects v_hat and f_hat by a measured velocity, and learns its age if the vehicle is `upright`.
    #[inline(always)]
    fn correct(&self, observed: &mut ForceObserverMemory, measured: &Vector3<f32>, upright: bool) {
        let since_s = math::min(math::max(observed.since_s, self.dt_s), LONG_S);
        (observed.last_m_s, observed.since_s) = (*measured, 0.0);
        let [rate_xy_1_s, rate_z_1_s] = self.rates_1_s;
        // An axis without an observer is not compared.
        let off = scaled(&(measured - observed.velocity_m_s), self.observes);
        let noise_m_s = observed.follow_noise(&off);
        // A slower observer sees a force later.
        let unseen_s = self.unseen_s * noise_m_s / (QUIET_M_S * observed.age.softness);
        let most_m_s = ACCELERATION_MAX_M_S2 * math::max(since_s, unseen_s) + OUTLIER * (noise_m_s - QUIET_M_S);
        if off.norm_squared() > most_m_s * most_m_s {
            // One such velocity is noise; a second one shows a jump.
            if observed.is_outlier {
                observed.restart(measured);
            }
            observed.is_outlier = true;
            return;
        }
        observed.is_outlier = false;
        let turn = since_s * QUIET_M_S / noise_m_s;
        let rest = |rate_1_s: f32| rate_1_s * turn / (1.0 + rate_1_s * turn);
        let (xy, z) = (rest(rate_xy_1_s), rest(rate_z_1_s * observed.age.softness));
        if upright && z > 0.0 {
            observed.age.correct(off.z, [since_s, z], observed.noise_m2_s2);
        }
        let (corrects, learns) = ([2.0 * xy, 2.0 * z], [xy * xy / since_s, z * z / since_s]);
        let f_hat = observed.acceleration_m_s2 + scaled(&off, learns);
        let square = f_hat.norm_squared();
        let share = if square > ACCELERATION_MAX_M_S2 * ACCELERATION_MAX_M_S2 {
            ACCELERATION_MAX_M_S2 / math::sqrt(square)
        } else {
            1.0
        };
        observed.acceleration_m_s2 = (f_hat * share).map(math::settled);
        let correction = scaled(&off, corrects);
        observed.velocity_m_s += correction;
        observed.off_m_s = off - correction;
    }

    /// Returns the learnt hover thrust beyond the weight \[N\], `None` if it is not learnt here, without an observer
    /// along z.
    #[inline(always)]
    fn more_hover_thrust_n(&self, observed: &ForceObserverMemory) -> Option<f32> {
        let [_, rate_z_1_s] = self.rates_1_s;
        (rate_z_1_s > 0.0).then_some(observed.hover_n - self.weight_n)
    }

    /// Returns the learnt hover thrust T_h \[N\], `None` if it is not learnt here, without an observer along z.
    #[inline]
    pub fn hover_thrust_n(&self, observed: &Option<ForceObserverMemory>) -> Option<f32> {
        self.more_hover_thrust_n(observed.as_ref()?).map(|more_n| self.weight_n + more_n)
    }

    /// Stores the total thrust commanded in this step \[N\].
    #[inline]
    pub fn record_thrust(&self, observed: &mut Option<ForceObserverMemory>, thrust_n: f32) {
        if let Some(observed) = observed {
            observed.thrust_n = math::settled(observed.thrust_n + (thrust_n - observed.thrust_n) * self.lag);
        }
    }
}
