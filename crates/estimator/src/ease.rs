//! Corrections that a controller shall not feel as a jump.

use crate::estimate::Estimate;
use afbc_control::math::{max, min, sqrt};
use afbc_types::State;
use nalgebra::Vector3;

/// Share of a standard deviation below which it falls in a step only if something was found again.
const FALLS: f32 = 0.9;
/// Jump of the position that is hidden in any case \[m\].
const JUMP_M: f32 = 0.05;
/// Time in which what was hidden decays to 1/e \[s\].
const DECAY_S: f32 = 0.3;
/// Fastest approach of position \[m/s\] and velocity \[m/s2\]: a receiver that jumps by metres must not look like a
/// gale.
const MOST_M_S: f32 = 1.0;
const MOST_M_S2: f32 = 3.0;

/// Hides the jumps of position and velocity when an aid comes back: the state begins where it was, and approaches the
/// estimate within a second, or at 1 m/s and 3 m/s2 from further away. Corrections of usual size pass as they are, and
/// so do attitude and rates.
///
/// The default is that before the first estimate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Easing {
    last: Option<Seen>,
    /// Estimate less the state told.
    position_m: Vector3<f32>,
    velocity_m_s: Vector3<f32>,
}

/// What of the last estimate is needed.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Seen {
    at_us: u64,
    position_m: Vector3<f32>,
    velocity_m_s: Vector3<f32>,
    position_sigma_m: Vector3<f32>,
    velocity_sigma_m_s: Vector3<f32>,
    /// Resets of position and velocity.
    resets: (u32, u32),
}

impl Seen {
    fn of(estimate: &Estimate) -> Self {
        let Estimate { at_us, state, sigmas, resets, .. } = estimate;
        Seen {
            at_us: *at_us,
            position_m: state.position_m,
            velocity_m_s: state.velocity_m_s,
            position_sigma_m: sigmas.position_m,
            velocity_sigma_m_s: sigmas.velocity_m_s,
            resets: (resets.position, resets.velocity),
        }
    }
}

impl Easing {
    /// Returns the state to tell for this estimate; to be called with every one. Nothing is hidden of an estimate whose
    /// position has not been valid before.
    #[must_use = "the state is its result"]
    #[inline]
    pub fn step(&mut self, estimate: &Estimate) -> State {
        let mut state = estimate.state;
        if !estimate.validity.position {
            *self = Easing::default();
            return state;
        }
        let seen = Seen::of(estimate);
        let Some(last) = &mut self.last else {
            *self = Easing { last: Some(seen), ..Easing::default() };
            return state;
        };
        // 32 bits, which the processor converts by itself; longer times count as DECAY_S too.
        let since_us = u32::try_from(seen.at_us.saturating_sub(last.at_us)).unwrap_or(u32::MAX);
        let dt_s = min(since_us as f32 * 1e-6, DECAY_S);
        let stays = |hidden: &Vector3<f32>, most: f32| 1.0 - dt_s / max(DECAY_S, sqrt(hidden.norm_squared()) / most);
        self.position_m *= stays(&self.position_m, MOST_M_S);
        self.velocity_m_s *= stays(&self.velocity_m_s, MOST_M_S2);
        let jump_m = state.position_m - last.position_m - last.velocity_m_s * dt_s;
        if jump_m.norm_squared() > JUMP_M * JUMP_M || found(last, &seen) {
            self.position_m += jump_m;
            self.velocity_m_s += state.velocity_m_s - last.velocity_m_s;
        }
        *last = seen;
        state.position_m -= self.position_m;
        state.velocity_m_s -= self.velocity_m_s;
        state
    }
}

/// True if this estimate is much surer than the last, or was set anew.
fn found(last: &Seen, now: &Seen) -> bool {
    let falls = |now: &Vector3<f32>, before: &Vector3<f32>| {
        now.x < FALLS * before.x || now.y < FALLS * before.y || now.z < FALLS * before.z
    };
    falls(&now.position_sigma_m, &last.position_sigma_m)
        || falls(&now.velocity_sigma_m_s, &last.velocity_sigma_m_s)
        || now.resets != last.resets
}

#[cfg(test)]
mod tests {
    use super::Easing;
    use crate::estimate::{Estimate, Sigmas, Validity};
    use nalgebra::Vector3;

    /// An estimate of a vehicle at 1 m/s whose position is off by `error_m`.
    fn estimate(ms: u64, error_m: f32, sigma_m: f32) -> Estimate {
        let sigmas = Sigmas { position_m: Vector3::repeat(sigma_m), ..Sigmas::default() };
        let mut estimate = Estimate { at_us: 1000 * ms, sigmas, ..Estimate::default() };
        estimate.validity = Validity { position: true, ..Validity::default() };
        estimate.state.velocity_m_s.x = 1.0;
        estimate.state.position_m.x = 1e-3 * ms as f32 + error_m;
        estimate
    }

    #[test]
    fn a_return_is_eased_and_then_forgotten() {
        let mut easing = Easing::default();
        for ms in 0..3000 {
            let back = ms >= 1000;
            let (error_m, sigma_m) = if back { (0.0, 1e-3) } else { (0.2, 0.1) };
            let told = easing.step(&estimate(ms, error_m, sigma_m)).position_m.x - 1e-3 * ms as f32;
            let expected = if back { 0.2 * (-1e-3 * (ms - 1000) as f32 / 0.3).exp() } else { 0.2 };
            assert!((told - expected).abs() < 2e-3, "{ms} ms: {told} m, not {expected} m");
        }
    }

    /// A vehicle that accelerates and usual corrections are told as they are.
    #[test]
    fn nothing_else_is_eased() {
        let mut easing = Easing::default();
        for ms in 0..100 {
            let mut estimate = estimate(ms, 1e-3 * (ms % 7) as f32, if ms % 10 == 0 { 0.95e-3 } else { 1e-3 });
            estimate.state.velocity_m_s.z = 0.1 * ms as f32;
            assert_eq!(easing.step(&estimate), estimate.state);
        }
    }

    /// The first fix, and the first after the position was lost, are told at once.
    #[test]
    fn the_first_position_is_not_eased() {
        let mut easing = Easing::default();
        for ms in 0..100 {
            let mut estimate = estimate(ms, if ms < 50 { 5.0 } else { 0.0 }, if ms < 50 { 9.0 } else { 1e-3 });
            estimate.validity.position = ms >= 50;
            assert_eq!(easing.step(&estimate), estimate.state);
        }
    }
}
