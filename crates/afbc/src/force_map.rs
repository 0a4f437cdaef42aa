//! Memory of the air: a fuzzy system over the velocity that keeps the observer's findings for the next flight at the
//! same velocity. Not in the paper, whose fuzzy systems over errors forget when the error vanishes.
//!
//! ```text
//! f = Theta' w(v_x, v_y) + f_hat        dTheta/dt = gamma f_hat w(v_x, v_y),  |Theta| <= Theta_max
//! ```
//!
//! x and y have nine rules each, as in (22) and (34) with the prediction error in place of e_2: f_hat is what the
//! memory still lacks, because the observer knows the memory. With f = Theta*' w, and f_hat behind the observer's poles
//! (much faster than gamma), V = |Theta* - Theta|^2/2 gamma falls by (Theta* - Theta)' w f_hat, about f_hat^2. This is
//! the part of composite adaptation that learns from prediction: Slotine and Li, *Composite adaptive control of robot
//! manipulators*, Automatica 25(4), 1989; used so by O'Connell et al., *Neural-Fly*, Science Robotics 7(66), 2022. The
//! part that learns from e_2 stays in the fuzzy systems over the errors; here the observer would undo it.

use crate::fuzzy::{FiringStrengths, FuzzyBasis, Membership};
use afbc_control::math;
use afbc_types::OutOfRange;
use nalgebra::Matrix3;

/// Largest |Theta| of x and of y \[m/s2\]: 10 m/s2, a wind of some 20 m/s, at each of the nine rules.
pub const THETA_MAX_M_S2: f32 = 30.0;
/// Width of the Gaussians divided by their distance.
const WIDTH: f32 = 0.6;

/// Memory with its constants. The learnt parameters are in [`ForceMapWeights`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceMap {
    basis: FuzzyBasis,
    /// gamma times two time steps, since x and y learn in turn.
    share: f32,
}

/// Learnt parameters Theta of x and y \[m/s2\].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ForceMapWeights {
    /// Theta.
    pub theta: [Matrix3<f32>; 2],
    /// True if y learns in the next step, not x.
    y_learns: bool,
}

/// Smaller f_hat is not learnt \[m/s2\].
const SETTLED_M_S2: f32 = 1e-9;

impl ForceMap {
    /// Creates the memory with the rate `gamma_1_s` (valid), the step `dt_s` and outer rules at `speed_m_s` along each
    /// axis. `None` if gamma is 0.
    ///
    /// # Errors
    /// Returns an error if the speed is out of range.
    pub fn new(gamma_1_s: f32, speed_m_s: f32, dt_s: f32) -> Result<Option<Self>, OutOfRange> {
        let basis = FuzzyBasis::new(Membership { centre: speed_m_s, width: WIDTH * speed_m_s })?;
        Ok((gamma_1_s > 0.0).then_some(ForceMap { basis, share: 2.0 * gamma_1_s * dt_s }))
    }

    /// Returns the weights of the rules at a velocity \[m/s\].
    #[inline]
    pub fn weights(&self, velocity_m_s: [f32; 2]) -> Matrix3<f32> {
        let FiringStrengths { first, second, share } = self.basis.fire(velocity_m_s);
        first * (second * share).transpose()
    }

    /// Learns f_hat \[m/s2\] at these weights: x and y in turn, which takes half the time.
    #[inline]
    pub fn learn(&self, remembered: &mut ForceMapWeights, weights: &Matrix3<f32>, [x, y]: [f32; 2]) {
        let ForceMapWeights { theta: [theta_x, theta_y], y_learns } = remembered;
        let (theta, f_hat) = if *y_learns { (theta_y, y) } else { (theta_x, x) };
        *y_learns = !*y_learns;
        // Settled here, f_hat keeps subnormal numbers out of Theta in fewer instructions than Theta itself.
        *theta += weights * (self.share * if f_hat.abs() < SETTLED_M_S2 { 0.0 } else { f_hat });
        let square = theta.norm_squared();
        if square > THETA_MAX_M_S2 * THETA_MAX_M_S2 {
            *theta *= THETA_MAX_M_S2 / math::sqrt(square);
        }
    }
}

impl ForceMapWeights {
    /// Returns Theta' w of x and y \[m/s2\].
    #[inline]
    pub fn recall(&self, weights: &Matrix3<f32>) -> [f32; 2] {
        self.theta.map(|theta| theta.dot(weights))
    }
}
