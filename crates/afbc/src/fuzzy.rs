//! Fuzzy basis: 3 Gaussians x 2 inputs = 9 rules, (17)-(19).
//!
//! The memberships of one input are three Gaussians of one width s at -c, 0 and c. A product of memberships factorises,
//! and so does the sum in the denominator of (18): the nine weights are the outer product of two triples that each sum
//! to one. Dividing a triple by its middle Gaussian gives, with k = c/s^2 and q = exp(-c^2 / 2s^2),
//!
//! ```text
//! [q exp(-k x), 1, q exp(k x)]
//! ```
//!
//! and multiplying by t = exp(-k|x|), which the normalisation cancels, gives \[q t^2, t, q\] for positive x: one
//! exponential per input, with an exponent that is never positive, over a sum of at least q. So no finite input
//! overflows, divides zero by zero or makes all weights vanish, as (18) as printed does above 1.7 rad/s in `f32`. The
//! law leaves the triples as they are, and divides once, by the product of both sums ([`Firing`]).

use afbc_control::math;
use afbc_types::{Declared, OutOfRange, Range, parameters};
use nalgebra::{Matrix3, Vector3};

/// Accepted centre / width. Above it neighbouring Gaussians do not overlap, and the basis becomes a switch.
pub const SPREAD: Range = Range::new("centre / width", 0.1, 6.0);

parameters! {
    /// Three Gaussians of one width over one input: exp(-1/2 ((x - c_j)/s)^2), c_j in {-c, 0, c}. The defaults are
    /// those of Section IV for attitude.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct Membership {
        /// c: distance of the outer Gaussians from zero, in the fuzzy inputs' unit.
        #[parameter(CENTRE, "fuzzy input", 1e-3..=1e3)]
        pub centre: f32 = 0.26,
        /// s: common width, in the fuzzy inputs' unit.
        #[parameter(WIDTH, "fuzzy input", 1e-3..=1e3)]
        pub width: f32 = 0.1,
    }
    together(membership) {
        SPREAD.check(membership.centre / membership.width)
    }
}

/// The basis of one subsystem, with constants computed from a [`Membership`] shared by both inputs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Basis {
    /// k / ln 2, k = c/s^2
    k: f32,
    /// q = exp(-c^2 / 2s^2)
    q: f32,
}

impl Basis {
    /// Creates the basis of `membership`.
    ///
    /// # Errors
    /// The first of centre, width and [`SPREAD`] out of range.
    pub fn new(membership: Membership) -> Result<Self, OutOfRange> {
        membership.validate()?;
        let spread = membership.centre / membership.width;
        Ok(Basis { k: spread / membership.width * core::f32::consts::LOG2_E, q: math::exp(-0.5 * spread * spread) })
    }

    /// Returns w(x) of (18), one weight per rule: row = the first input's Gaussian, column = the second's, from -c to
    /// c. Every weight is within \[0, 1\] and they sum to one, for every finite input.
    pub fn weights(&self, inputs: [f32; 2]) -> Matrix3<f32> {
        // Each divided by its own sum, so that no weight exceeds 1, rounding included.
        let [first, second] = inputs.map(|x| {
            let (memberships, sum) = self.memberships(x);
            memberships / sum
        });
        first * second.transpose()
    }

    /// Returns the firing strengths of the rules, w(x) in factors.
    #[inline]
    pub fn fire(&self, [x1, x2]: [f32; 2]) -> Firing {
        let ((first, first_sum), (second, second_sum)) = (self.memberships(x1), self.memberships(x2));
        // Each sum is at least q, and q at least exp(-18) by SPREAD: the product is never zero.
        Firing { first, second, share: 1.0 / (first_sum * second_sum) }
    }

    /// Returns the memberships of one input, over the middle one times t, and their sum.
    #[inline]
    fn memberships(&self, x: f32) -> (Vector3<f32>, f32) {
        let t = math::exp2(-self.k * x.abs());
        let (near, middle, far) = (self.q, t, self.q * t * t);
        let (left, right) = if x < 0.0 { (near, far) } else { (far, near) };
        (Vector3::new(left, middle, right), near + middle + far)
    }
}

/// Firing strengths of the nine rules: w(x) = `first` `second`^T `share`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Firing {
    /// Memberships of the first input, times any number.
    pub first: Vector3<f32>,
    /// Memberships of the second input, times any number.
    pub second: Vector3<f32>,
    /// 1 over the sum of their products.
    pub share: f32,
}
