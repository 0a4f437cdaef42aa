//! Age of the measured state, found in flight, and the softness of z that follows from it. Not in the paper.
//!
//! A velocity that was measured a time tau ago does not show the newest changes of the thrust. Its difference from the
//! [force observer](crate::disturbance)'s v_hat, which does, is tau p, with p from the observer's own equations and the
//! known acceleration a:
//!
//! ```text
//! dp/dt = -da/dt - q - 2w p,   dq/dt = w^2 p
//! dtau_hat/dt = k p (v - v_hat - tau_hat p)/(p^2 + p_0^2)
//! ```
//!
//! This is a gradient estimate with normalisation (Ioannou and Sun, *Robust Adaptive Control*, 1996, section 4.3). Old
//! states make a stiff law oscillate, and nothing shows tau better than an oscillation. A rotor lag beyond the model's
//! has the same effect, and counts as age.

use afbc_control::math;

/// Age that the gains of the profile `flight` are tuned for \[s\].
pub const FREE_S: f32 = 0.01;
/// Age beyond [`FREE_S`] at which z is half as fast \[s\].
pub const HALF_S: f32 = 0.02;
/// Largest age that is believed \[s\].
pub const AGE_MAX_S: f32 = 0.05;
/// k: rate of tau_hat while p is large \[1/s\].
const RATE_1_S: f32 = 5.0;
/// Largest rate of tau_hat \[s/s\], so that a single disturbance, which may look like age, does not soften the law.
const CHANGE_MAX: f32 = 0.06;
/// Rate at which tau_hat is forgotten \[1/s\].
const FORGET_1_S: f32 = 0.05;
/// p_0: acceleration changes that this p stands for are enough to tell the age \[m/s2\].
const EXCITED_M_S2: f32 = 0.02;
/// Variance of p_0 per variance of the velocity's noise \[1/s2\].
const PER_NOISE_1_S2: f32 = 25.0;

/// Share of the mean interval that is replaced by each velocity.
const INTERVAL_SHARE: f32 = 0.1;

/// Memory of the estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AgeMemory {
    /// tau_hat \[s\].
    age_s: f32,
    /// p \[m/s2\] and q \[m/s3\].
    p: f32,
    q: f32,
    /// a of the last step \[m/s2\], `None` before the first one.
    last_m_s2: Option<f32>,
    /// Mean time between two velocities \[s\].
    interval_s: f32,
    /// Factor on the speed of z: 1 up to [`FREE_S`], falling towards 0 with the mean age of the state.
    pub softness: f32,
}

impl Default for AgeMemory {
    fn default() -> Self {
        AgeMemory { age_s: 0.0, p: 0.0, q: 0.0, last_m_s2: None, interval_s: 0.0, softness: 1.0 }
    }
}

impl AgeMemory {
    /// Returns the memory after a touch of the ground, where the age is kept.
    #[must_use]
    pub fn restarted(&self) -> Self {
        AgeMemory { p: 0.0, q: 0.0, last_m_s2: None, ..*self }
    }

    /// Continues with the known acceleration of this step \[m/s2\].
    #[inline(always)]
    pub fn predict(&mut self, known_m_s2: f32, dt_s: f32) {
        let change_m_s2 = self.last_m_s2.map_or(0.0, |last_m_s2| known_m_s2 - last_m_s2);
        self.p = math::settled(self.p - change_m_s2 - self.q * dt_s);
        self.last_m_s2 = Some(known_m_s2);
    }

    /// Learns from v - v_hat \[m/s\] of a velocity measured `since_s` after the last one, which corrects v_hat by twice
    /// `rest` of it. `noise_m2_s2` is the variance of its noise.
    #[inline(always)]
    pub fn correct(&mut self, off_m_s: f32, [since_s, rest]: [f32; 2], noise_m2_s2: f32) {
        let p = self.p;
        let normal = p * p + EXCITED_M_S2 * EXCITED_M_S2 + PER_NOISE_1_S2 * math::max(noise_m2_s2, 0.0);
        let gain = RATE_1_S * since_s * p / normal;
        let change = math::limited(gain * (off_m_s - self.age_s * p), CHANGE_MAX * since_s);
        let age_s = self.age_s + change - FORGET_1_S * since_s * self.age_s;
        self.age_s = math::settled(math::min(math::max(age_s, 0.0), AGE_MAX_S));
        self.p = math::settled(p - 2.0 * rest * p);
        self.q = math::settled(self.q + rest * rest / since_s * p);
        // Between two velocities, the state ages further.
        self.interval_s += (since_s - self.interval_s) * INTERVAL_SHARE;
        let mean_s = self.age_s + 0.5 * self.interval_s;
        self.softness = HALF_S / (HALF_S + math::max(mean_s - FREE_S, 0.0));
    }
}
