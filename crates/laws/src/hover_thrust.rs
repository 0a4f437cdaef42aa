//! Estimates the hover thrust, like PX4's `ZeroOrderHoverThrustEkf`.
//!
//! A Kalman filter with one state h, the hover thrust as a share of the nominal weight, modelled as a random walk. The
//! measurement is the vertical acceleration a_z under the vertical thrust t, also a share of the nominal weight:
//!
//! ```text
//! a_z = g (t / h - 1) + noise of 1 m/s2,   H = d a_z / d h = -g t / h^2
//! P += (w dt / g)^2
//! K = P H / (H^2 P + 1),   h += K sat(a_z - g (t / h - 1)),   P = (1 - K H) P,   0.4 <= h <= 2.5
//! ```
//!
//! In hover K H settles at w dt: a low-pass filter with the bandwidth w. PX4's default (`HTE_HT_NOISE` at half
//! throttle) is w = 0.07 1/s.
//!
//! Differences from PX4: the noise is constant at PX4's minimum, where PX4 estimates it. An innovation beyond three
//! standard deviations is cut to three, where PX4 rejects it and, after some rejections, raises P. h starts with P = 0.

use afbc_control::math;

/// Smallest h.
const SHARE_MIN: f32 = 0.4;
/// Largest h.
const SHARE_MAX: f32 = 2.5;
/// Standard deviation of the noise \[m/s2\].
const NOISE_M_S2: f32 = 1.0;
/// Largest innovation in its standard deviations, PX4's `HTE_ACC_GATE`.
const GATE: f32 = 3.0;

/// Estimator with its constants. Everything that changes in flight is in [`HoverThrust`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct HoverThrustEstimator {
    gravity_m_s2: f32,
    /// (w dt / g)^2
    growth: f32,
}

/// Estimate of the hover thrust, which starts at the nominal weight.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct HoverThrust {
    /// h - 1
    excess: f32,
    /// P
    variance: f32,
}

impl HoverThrust {
    /// Returns h: the hover thrust as a share of the nominal weight.
    #[inline]
    pub(crate) fn share(&self) -> f32 {
        1.0 + self.excess
    }
}

impl HoverThrustEstimator {
    /// Creates an estimator with this w, advanced every `dt_s` seconds; with w = 0, h stays 1.
    pub(crate) fn new(bandwidth_1_s: f32, gravity_m_s2: f32, dt_s: f32) -> Self {
        let step = bandwidth_1_s * dt_s / gravity_m_s2 * NOISE_M_S2;
        HoverThrustEstimator { gravity_m_s2, growth: step * step }
    }

    /// Fuses a_z under the thrust t = `thrust_share`.
    #[inline]
    pub(crate) fn advance(&self, estimate: &mut HoverThrust, acceleration_m_s2: f32, thrust_share: f32) {
        let (g, h) = (self.gravity_m_s2, estimate.share());
        let slope = -g * thrust_share / (h * h);
        let variance = estimate.variance + self.growth;
        let innovation_variance = slope * slope * variance + NOISE_M_S2 * NOISE_M_S2;
        let gain = variance * slope / innovation_variance;
        let most = GATE * math::sqrt(innovation_variance);
        let innovation = (acceleration_m_s2 - g * (thrust_share / h - 1.0)).max(-most).min(most);
        let share = math::min(math::max(h + gain * innovation, SHARE_MIN), SHARE_MAX);
        // K H is at least 0 and below 1, so the variance never falls below zero.
        *estimate = HoverThrust { excess: share - 1.0, variance: (1.0 - gain * slope) * variance };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const G: f32 = 9.81;
    const DT_S: f32 = 0.001;

    /// Returns a_z of a vehicle with the hover thrust `h` under the thrust `t`.
    fn measured(h: f32, t: f32) -> f32 {
        G * (t / h - 1.0)
    }

    #[test]
    fn the_hover_thrust_is_found_within_the_time_that_the_bandwidth_says() {
        let estimator = HoverThrustEstimator::new(0.5, G, DT_S);
        for h in [0.5_f32, 0.8, 1.0, 1.3, 1.7, 2.2] {
            for t in [h, 0.8 * h, 1.2 * h] {
                let mut estimate = HoverThrust::default();
                let mut error_at = |time_s: f32| {
                    (0..(time_s / DT_S) as usize).for_each(|_| estimator.advance(&mut estimate, measured(h, t), t));
                    (estimate.share() - h).abs()
                };
                // K H = w dt |H| / g after P has grown for some 1/w: fast for a small h, slow for a large one.
                let (early, late) = (error_at(1.0), error_at(29.0));
                assert!(h == 1.0 || early > 0.2 * (1.0 - h).abs(), "{early} of {h} after 1 s");
                assert!(late < 0.005 * h, "{late} of {h} after 30 s");
            }
        }
        // At a bandwidth of 0, the estimate stays at the nominal weight.
        let mut estimate = HoverThrust::default();
        let none = HoverThrustEstimator::new(0.0, G, DT_S);
        (0..1000).for_each(|_| none.advance(&mut estimate, measured(1.5, 1.0), 1.0));
        assert!(estimate.share() == 1.0);
    }

    #[test]
    fn a_blow_hardly_counts() {
        let estimator = HoverThrustEstimator::new(0.5, G, DT_S);
        let mut estimate = HoverThrust::default();
        (0..20_000).for_each(|_| estimator.advance(&mut estimate, measured(1.0, 1.0), 1.0));
        (0..20).for_each(|_| estimator.advance(&mut estimate, 100.0, 1.0));
        assert!((estimate.share() - 1.0).abs() < 0.005, "{}", estimate.share());
        // Without thrust nothing is learnt: every h explains a free fall.
        (0..1000).for_each(|_| estimator.advance(&mut estimate, 5.0, 0.0));
        assert!((estimate.share() - 1.0).abs() < 0.005, "{}", estimate.share());
    }
}
