//! Observer of the horizontal acceleration that the model does not know, mostly wind. Not in the paper.
//!
//! (16) wants f of x and y, which the model takes for zero: without more, all of it has to be learnt from the error
//! that it makes. But the vehicle measures its velocity v, and knows what its rotors do:
//!
//! ```text
//! dv_hat/dt = T/T_h g (R e_z) + f_hat + 2w (v - v_hat)      T: commanded thrust behind the rotors' lag
//! df_hat/dt = w^2 (v - v_hat)                               T_h: learnt hover thrust
//! ```
//!
//! so f_hat is f behind two poles at w. With T over the learnt hover thrust, as in (40), weak rotors are no wind.
//!
//! It is the extended state observer of Han, *From PID to active disturbance rejection control*, IEEE TIE 56(3), 2009,
//! with both poles at one place, by Gao, *Scaling and bandwidth-parameterization based controller tuning*, ACC 2003, in
//! the exact discrete form.

use crate::model::RollPitch;
use afbc_control::math::{self, max, min};
use afbc_types::{Parameters, State, parameters};

/// Largest f_hat \[m/s2\]: a wind of some 20 m/s.
pub const ACCELERATION_MAX_M_S2: f32 = 10.0;
/// Largest v - v_hat that is an effect of f, which makes f/(e w) of it at most \[m/s\]; a larger one is a jump of the
/// state, as after an outage.
pub const JUMP_M_S: f32 = 0.1;

parameters! {
    /// The observer. The default is none.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct DisturbanceObserver {
        /// w of the disturbance observer; 0 for none.
        #[parameter(DIST_XY, "rad/s", 0.0..=200.0, tuned)]
        pub disturbance_rad_s: f32 = 0.0,
        /// Lag of the rotors that the disturbance observer reckons with.
        #[parameter(DIST_LAG, "s", 0.0..=0.5)]
        pub disturbance_lag_s: f32 = 0.02,
    }
}

impl DisturbanceObserver {
    /// Returns the observer of a vehicle that is `slowness` times slower.
    #[must_use]
    pub(crate) fn slowed(self, slowness: f32) -> Self {
        DisturbanceObserver {
            disturbance_rad_s: self.disturbance_rad_s / slowness,
            disturbance_lag_s: self.disturbance_lag_s * slowness,
        }
    }
}

/// The observer with its constants; everything that changes in flight is in [`Observed`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observer {
    /// Corrections of v_hat \[1\] and f_hat \[1/s\] per step.
    velocity: f32,
    acceleration: f32,
    /// Share of the thrust that is replaced per step.
    lag: f32,
    dt_s: f32,
    gravity_m_s2: f32,
    weight_n: f32,
}

/// Memory of the observer: v_hat, f_hat along x and y, and T.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observed {
    velocity_m_s: [f32; 2],
    acceleration_m_s2: [f32; 2],
    thrust_n: f32,
    /// True if the next velocity is not measured.
    held: bool,
}

impl Observed {
    /// Keeps f_hat as it is in the next step.
    pub fn hold(&mut self) {
        self.held = true;
    }
}

impl Observer {
    /// Makes the observer from valid settings for a vehicle, advanced every `dt_s` seconds; none without a bandwidth.
    pub fn new(settings: &DisturbanceObserver, vehicle: &Parameters, dt_s: f32) -> Option<Self> {
        let DisturbanceObserver { disturbance_rad_s: bandwidth, disturbance_lag_s: lag_s } = *settings;
        // Two poles at exp(-w dt).
        let rest = 1.0 - math::exp(-bandwidth * dt_s);
        (bandwidth > 0.0).then(|| Observer {
            velocity: 2.0 * rest,
            acceleration: rest * rest / dt_s,
            lag: if lag_s > 0.0 { 1.0 - math::exp(-dt_s / lag_s) } else { 1.0 },
            dt_s,
            gravity_m_s2: vehicle.gravity_m_s2,
            weight_n: vehicle.weight_n(),
        })
    }

    /// Returns f_hat along x and y \[m/s2\] for a vehicle in this state, and advances it by one step if the state is
    /// `fresh`; zero of one that `stands` on the ground. `heading` is the sine and cosine of yaw.
    #[inline]
    pub fn advance(
        &self,
        observed: &mut Option<Observed>,
        state: &State,
        (at, [sin_psi, cos_psi]): (&RollPitch, [f32; 2]),
        hover_n: f32,
        [fresh, stands]: [bool; 2],
    ) -> [f32; 2] {
        let measured = [state.velocity_m_s.x, state.velocity_m_s.y];
        let start = |thrust_n| Observed { velocity_m_s: measured, acceleration_m_s2: [0.0; 2], thrust_n, held: false };
        let observed = observed.get_or_insert_with(|| start(self.weight_n));
        if stands {
            *observed = start(observed.thrust_n);
        }
        if observed.held {
            *observed = Observed { velocity_m_s: measured, held: false, ..*observed };
            return observed.acceleration_m_s2;
        }
        if !fresh {
            return observed.acceleration_m_s2;
        }
        let Observed { velocity_m_s, acceleration_m_s2, thrust_n, .. } = observed;
        let [ahead, aside] = at.leaning();
        let lift = *thrust_n / hover_n * self.gravity_m_s2;
        let leaning = [(cos_psi * ahead + sin_psi * aside) * lift, (sin_psi * ahead - cos_psi * aside) * lift];
        for (((v_hat, f_hat), v), a) in
            velocity_m_s.iter_mut().zip(acceleration_m_s2.iter_mut()).zip(measured).zip(leaning)
        {
            let off = v - *v_hat;
            if off.abs() <= JUMP_M_S {
                let f = math::settled(*f_hat + self.acceleration * off);
                *f_hat = min(max(f, -ACCELERATION_MAX_M_S2), ACCELERATION_MAX_M_S2);
                *v_hat += self.velocity * off;
            } else {
                *v_hat = v;
            }
            *v_hat = math::settled(*v_hat + (a + *f_hat) * self.dt_s);
        }
        *acceleration_m_s2
    }

    /// Notes the thrust of all rotors that is commanded in this step \[N\].
    #[inline]
    pub fn give(&self, observed: &mut Option<Observed>, thrust_n: f32) {
        if let Some(observed) = observed {
            observed.thrust_n = math::settled(observed.thrust_n + (thrust_n - observed.thrust_n) * self.lag);
        }
    }
}
