//! Adaptive fuzzy backstepping of one subsystem: the law (20)-(22) and its adaptation (32)-(34).

use crate::backstepping::{self, proportional};
use crate::fuzzy::{FiringStrengths, FuzzyBasis, Membership};
use crate::law::{StepContext, SubsystemLaw, SubsystemTracking};
use crate::model::ModelConstants;
use crate::safeguards::Safeguards;
use afbc_control::{Errors, math};
use afbc_types::{Axis, Declared, OutOfRange, PerAxis, parameters};
use nalgebra::{Matrix3, Vector3};

/// Smallest accepted estimate of the hover thrust, as a share of the weight.
const HOVER_SHARE_MIN: f32 = 0.3;

parameters! {
    /// Gains of one AFBC subsystem. The defaults are those of Section IV for attitude.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct Gains {
        /// alpha_1, alpha_2.
        #[group("")]
        pub backstepping: backstepping::Gains = backstepping::Gains::DEFAULT,
        /// gamma: adaptation gain of Theta_hat, the paper's equation 34.
        #[parameter(GAMMA, "input per m or rad", 0.0..=10000.0, tuned)]
        pub gamma: f32 = 1.2,
        /// eta: adaptation gain of delta_hat, the paper's equation 33.
        #[parameter(ETA, "input per m or rad", 0.0..=10000.0, tuned)]
        pub eta: f32 = 0.3,
        /// epsilon: width of the robust term's transition, the paper's equation 32.
        #[parameter(EPSILON, "m/s or rad/s", 1e-6..=100.0)]
        pub epsilon: f32 = 0.001,
        /// Gaussians over both inputs of the fuzzy system (22).
        #[group("")]
        pub membership: Membership = Membership::DEFAULT,
        /// Safeguards that bound the estimates.
        #[group("")]
        pub safeguards: Safeguards = Safeguards::NONE,
    }
}

impl Gains {
    /// Returns the gains for an input that must be `scale` times as large for the same effect.
    #[must_use]
    pub fn scaled(&self, scale: f32) -> Self {
        let Gains { backstepping, gamma, eta, safeguards, .. } = *self;
        // The profile `paper` has no bound, which is the end of the range. Scaled up, it would be refused.
        let bound = |bound: f32| math::min(bound * scale, Safeguards::THETAMAX.range.max as f32);
        Gains {
            backstepping: backstepping::Gains { alpha2: backstepping.alpha2 * scale, ..backstepping },
            gamma: gamma * scale,
            eta: eta * scale,
            safeguards: Safeguards {
                theta_max: bound(safeguards.theta_max),
                delta_max: bound(safeguards.delta_max),
                ..safeguards
            },
            ..*self
        }
    }

    /// Returns the gains of a subsystem that is `slowness` times slower: each gain is scaled by the power of time in
    /// its unit, so that errors follow the same curve, only slower. The bounds of the estimates stay, because
    /// disturbances do not slow down. epsilon grows, so that the robust term is softer. Not in the paper.
    pub fn slowed(&self, slowness: f32) -> Self {
        let Gains { backstepping, gamma, eta, epsilon, safeguards, .. } = *self;
        let backstepping::Gains { alpha1, alpha2, stiffness } = backstepping;
        let square = slowness * slowness;
        Gains {
            backstepping: backstepping::Gains {
                alpha1: alpha1 / slowness,
                alpha2: alpha2 / slowness,
                stiffness: stiffness / square,
            },
            gamma: gamma / square,
            eta: eta / square,
            // epsilon is multiplied, not divided. delta_max stays the same, so the gain of the robust term,
            // delta_max/epsilon, falls like alpha_2.
            epsilon: epsilon * slowness,
            safeguards: Safeguards { sigma: safeguards.sigma / slowness, ..safeguards },
            ..*self
        }
    }
}

/// Adaptive estimates of one subsystem, zero at the start.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AdaptiveEstimate {
    /// Theta_hat: one consequent parameter per fuzzy rule. The row is the Gaussian of the first input, the column that
    /// of the second. In the unit of the subsystem's input.
    pub theta: Matrix3<f32>,
    /// delta_hat: estimated bound of approximation error and disturbance, in the unit of the subsystem's input.
    pub delta: f32,
}

/// Derivatives of an [`AdaptiveEstimate`]. The derivative of Theta_hat, gamma e_2 w(x), is stored in factors
/// ([`FiringStrengths`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdaptationRate {
    first: Vector3<f32>,
    second: Vector3<f32>,
    /// gamma e_2 divided by the sum of the firing strengths.
    theta: f32,
    delta: f32,
}

impl AdaptationRate {
    /// Returns (34): gamma e_2 w(x).
    pub fn theta(&self) -> Matrix3<f32> {
        self.first * self.second.transpose() * self.theta
    }

    /// Returns (33): eta e_2 s, with s = tanh(e_2/epsilon) as printed.
    pub fn delta(&self) -> f32 {
        self.delta
    }
}

/// Returns the estimate that gives u_a = `input` for any errors, because the weights of the rules sum to one.
pub fn even(input: f32) -> AdaptiveEstimate {
    AdaptiveEstimate { theta: Matrix3::repeat(input), delta: 0.0 }
}

/// Returns an estimate that gives u_a = `input` for these weights. It is as even over the rules as |Theta_hat| <=
/// `norm_max` allows, but exceeds `norm_max` if the input requires it.
fn spread(input: f32, weights: &Matrix3<f32>, norm_max: f32) -> AdaptiveEstimate {
    // `least` is the smallest such Theta_hat, and `rest`, the rest of the even one, is orthogonal to the weights. Nine
    // weights that sum to one have a norm of at least a third, so the division is safe.
    let least = weights * (input / weights.norm_squared());
    let rest = Matrix3::repeat(input) - least;
    let room = math::max(norm_max * norm_max - least.norm_squared(), 0.0);
    let square = rest.norm_squared();
    // `room` is never negative, so `square` is positive where it divides.
    let share = if square > room { math::sqrt(room / square) } else { 1.0 };
    AdaptiveEstimate { theta: least + rest * share, delta: 0.0 }
}

/// Advances the estimate by one explicit Euler step, with projection onto its bounds.
#[inline]
fn advance(estimate: &mut AdaptiveEstimate, rate: &AdaptationRate, safeguards: &Safeguards, dt_s: f32) {
    let Safeguards { sigma, theta_max, delta_max } = *safeguards;
    // At least 0.8 by the ranges of sigma and of the time step.
    let keep = 1.0 - sigma * dt_s;
    let theta = estimate.theta * keep + rate.first * (rate.theta * dt_s) * rate.second.transpose();
    let square = theta.norm_squared();
    estimate.theta = if square > theta_max * theta_max { theta * (theta_max / math::sqrt(square)) } else { theta };
    // delta_hat never falls below zero: it grows by the product of e and s, which have the same sign.
    estimate.delta = math::min(estimate.delta * keep + rate.delta * dt_s, delta_max);
}

/// The three terms of (20).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ControlTerms {
    /// u_a (22)
    pub fuzzy: f32,
    /// u_r (32)
    pub robust: f32,
    /// u_pd (21)
    pub proportional: f32,
}

impl ControlTerms {
    /// Returns u (20).
    #[inline]
    pub fn sum(&self) -> f32 {
        self.fuzzy + self.robust + self.proportional
    }
}

/// Conditions of a step that the cascade sets for a subsystem, besides its errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SubsystemConditions {
    /// Part of the input that the last step could not allocate.
    pub unallocated: f32,
    /// Factor on gamma, below 1 for old states.
    pub learning: f32,
    /// True for the law as printed, whose robust term has tanh(e_2/epsilon). With feed-forward it is e_2/(|e_2| +
    /// epsilon), which has the same slope at zero and takes a fifth of the instructions.
    pub printed: bool,
}

impl Default for SubsystemConditions {
    fn default() -> Self {
        SubsystemConditions { unallocated: 0.0, learning: 1.0, printed: true }
    }
}

/// One AFBC subsystem.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Subsystem {
    gains: Gains,
    basis: FuzzyBasis,
    inverse_epsilon: f32,
}

impl Subsystem {
    /// Creates the subsystem with these gains.
    ///
    /// # Errors
    /// Returns the first gain that is out of range.
    pub fn new(gains: Gains) -> Result<Self, OutOfRange> {
        gains.validate()?;
        Ok(Subsystem { gains, basis: FuzzyBasis::new(gains.membership)?, inverse_epsilon: 1.0 / gains.epsilon })
    }

    /// Returns the terms of (20) and the derivatives of the estimate by (33), (34) with the [`Safeguards`], both from
    /// the present estimate.
    #[inline]
    pub fn law(
        &self,
        errors: &Errors,
        inputs: [f32; 2],
        estimate: &AdaptiveEstimate,
        conditions: &SubsystemConditions,
    ) -> (ControlTerms, AdaptationRate) {
        let Gains { gamma, eta, .. } = &self.gains;
        let SubsystemConditions { unallocated, learning, printed } = *conditions;
        let e2 = errors.e2;
        let FiringStrengths { first, second, share } = self.basis.fire(inputs);
        let s = if printed {
            math::tanh(e2 * self.inverse_epsilon)
        } else {
            // epsilon is positive by its range.
            e2 / (e2.abs() + self.gains.epsilon)
        };
        let terms = ControlTerms {
            fuzzy: first.dot(&(estimate.theta * second)) * share,
            robust: estimate.delta * s,
            proportional: proportional(self.gains.backstepping.alpha2, errors),
        };
        let error = Safeguards::adaptation_error(e2, unallocated);
        let (theta, delta) = (gamma * learning * error * share, eta * error * s);
        (terms, AdaptationRate { first, second, theta, delta })
    }

    /// Returns u_a + u_r, and advances the estimate if it `adapts`. The part of the input that the last step could not
    /// allocate and the factor on gamma are those of [`SubsystemConditions`].
    // One copy for all six subsystems, not inlined, so that it can use all registers. Numbers are passed in registers,
    // structs in memory.
    #[inline(never)]
    fn step(
        &self,
        e2: f32,
        inputs: [f32; 2],
        [unallocated, learning]: [f32; 2],
        context: &StepContext,
        adapts: bool,
        estimate: &mut AdaptiveEstimate,
    ) -> f32 {
        let conditions = SubsystemConditions { unallocated, learning, printed: context.known.is_none() };
        let (terms, rate) = self.law(&Errors { e2, ..Errors::default() }, inputs, estimate, &conditions);
        if adapts {
            advance(estimate, &rate, &self.gains.safeguards, context.dt_s);
        }
        terms.fuzzy + terms.robust
    }
}

/// Returns the inputs of the fuzzy system (22), Section IV: angle and rate for attitude; error and its derivative for
/// position.
fn fuzzy_inputs(axis: Axis, x: [f32; 2], errors: &Errors) -> [f32; 2] {
    match axis {
        Axis::Roll | Axis::Pitch | Axis::Yaw => x,
        Axis::Z | Axis::X | Axis::Y => [errors.e1, errors.e1_dot],
    }
}

/// AFBC for the six subsystems.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Adaptive {
    subsystems: PerAxis<Subsystem>,
}

impl Adaptive {
    /// Creates the law with these gains.
    ///
    /// # Errors
    /// Returns the first gain that is out of range.
    pub fn new(gains: PerAxis<Gains>) -> Result<Self, OutOfRange> {
        let PerAxis { roll, pitch, yaw, z, x, y } = gains;
        Ok(Adaptive {
            subsystems: PerAxis {
                roll: Subsystem::new(roll)?,
                pitch: Subsystem::new(pitch)?,
                yaw: Subsystem::new(yaw)?,
                z: Subsystem::new(z)?,
                x: Subsystem::new(x)?,
                y: Subsystem::new(y)?,
            },
        })
    }

    /// Returns u_pd (21) of the subsystem.
    pub(crate) fn proportional(&self, axis: Axis, errors: &Errors) -> f32 {
        proportional(self.subsystems[axis].gains.backstepping.alpha2, errors)
    }

    /// Returns u_a (22) of the subsystem. `x` is x_1, x_2, used for attitude only.
    pub(crate) fn fuzzy(&self, axis: Axis, x: [f32; 2], errors: &Errors, estimate: &AdaptiveEstimate) -> f32 {
        self.subsystems[axis].basis.weights(fuzzy_inputs(axis, x, errors)).dot(&estimate.theta)
    }

    /// Returns the estimate with u_a = `fuzzy` at these errors, spread over the rules. `x` is x_1, x_2, used for
    /// attitude only.
    pub(crate) fn resumed(
        &self,
        axis: Axis,
        fuzzy: f32,
        x: [f32; 2],
        errors: &Errors,
        norm_max: f32,
    ) -> AdaptiveEstimate {
        spread(fuzzy, &self.subsystems[axis].basis.weights(fuzzy_inputs(axis, x, errors)), norm_max)
    }
}

impl SubsystemLaw for Adaptive {
    /// The gyroscopic effect of the rotors is learnt like any other unknown.
    const USES_ROTOR_RESIDUAL: bool = false;

    const OBSERVES: bool = true;

    type Estimate = AdaptiveEstimate;

    #[inline(always)]
    fn input(
        &self,
        axis: Axis,
        tracking: &SubsystemTracking,
        context: &StepContext,
        estimate: &mut AdaptiveEstimate,
    ) -> (f32, Errors) {
        let subsystem = &self.subsystems[axis];
        let (softness, tracking) = context.softened(axis, tracking);
        let gains = subsystem.gains.backstepping.slowed(softness);
        let errors = tracking.errors(gains.alpha1);
        let inputs = fuzzy_inputs(axis, [tracking.x1, tracking.x2], &errors);
        let known = match context.known {
            Some(model) => {
                let dynamics = context.observed(model, axis);
                backstepping::known(&gains, &tracking, &errors, &dynamics)
            }
            None => 0.0,
        };
        let conditions = [context.unallocated[axis], softness * softness];
        let learnt = subsystem.step(errors.e2, inputs, conditions, context, context.adapts(axis), estimate);
        (known + (learnt + proportional(gains.alpha2, &errors)), errors)
    }

    fn approach(&self, axis: Axis, known: Option<&ModelConstants>) -> f32 {
        let gains = &self.subsystems[axis].gains.backstepping;
        // Without a known model, u_pd is zero where the approach speed is alpha_1 e_1.
        known.map_or(gains.alpha1, |model| gains.approach(model.hover_gain(axis)))
    }

    fn start(&self, estimates: &mut PerAxis<AdaptiveEstimate>, weight_n: f32) {
        estimates.z = even(weight_n);
    }

    fn hover_thrust_n(&self, z: &AdaptiveEstimate, weight_n: f32, known_n: f32) -> f32 {
        // The hover thrust is Theta_hat of the rule for zero error and zero speed. It is kept away from zero, because
        // (40), drag and the force observer divide by it.
        math::max(known_n + z.theta.m22, HOVER_SHARE_MIN * weight_n)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "what cannot be built must stop the test")]
mod tests {
    use super::*;

    /// Returns u_a of the estimate for these weights.
    fn fuzzy(estimate: &AdaptiveEstimate, weights: &Matrix3<f32>) -> f32 {
        weights.dot(&estimate.theta)
    }

    /// A resumed estimate gives exactly the requested input. It is even if that fits the bound, otherwise as even as
    /// fits, and never larger than the smallest estimate with that input.
    #[test]
    fn an_input_is_spread_as_evenly_as_fits() {
        let basis = FuzzyBasis::new(Membership { centre: 3.0, width: 1.2 }).unwrap();
        for inputs in [[0.0, 0.0], [0.4, -0.9], [2.0, 1.0], [-1.5, 4.0], [-6.0, 0.1]] {
            let weights = basis.weights(inputs);
            let least_norm = |input: f32| input.abs() / weights.norm();
            for input in [-8.0_f32, -1.0, 0.0, 0.3, 2.5, 12.0] {
                for norm_max in [0.0_f32, 1.0, 3.0, 10.0, 40.0] {
                    let estimate = spread(input, &weights, norm_max);
                    let (theta, size) = (estimate.theta, input.abs() + 1.0);
                    assert!((fuzzy(&estimate, &weights) - input).abs() < 1e-5 * size, "{input} N by {theta}");
                    assert!(theta.norm() <= norm_max.max(least_norm(input)) * 1.0001 + 1e-6, "{input}: {theta}");
                    assert!(estimate.delta == 0.0);
                    if 3.0 * input.abs() <= norm_max {
                        assert!((theta - even(input).theta).norm() < 1e-5 * size, "{input} N by {theta}");
                    } else if least_norm(input) < norm_max {
                        // The bound is used up; a more even estimate would exceed it.
                        assert!(theta.norm() > 0.999 * norm_max, "{input} N by {theta} with {norm_max}");
                    }
                }
            }
        }
    }
}
