//! Fuzzy basis: 3 Gaussians x 2 inputs = 9 rules, (17)-(19).
//!
//! The memberships of one input are three Gaussians of the same width s at -c, 0 and c. A product of memberships
//! factorises, and so does the sum in the denominator of (18). The nine weights are therefore the outer product of two
//! triples that each sum to one. Dividing a triple by its middle Gaussian gives, with k = c/s^2 and q = exp(-c^2 /
//! 2s^2),
//!
//! ```text
//! [q exp(-k x), 1, q exp(k x)]
//! ```
//!
//! Multiplying by t = exp(-k|x|), which cancels in the normalisation, gives \[q t^2, t, q\] for positive x: one
//! exponential per input, never with a positive exponent, and a sum of at least q. So no finite input overflows,
//! divides zero by zero or makes all weights vanish; (18) as printed does so above 1.7 rad/s in `f32`. The law does not
//! normalise the triples but divides once, by the product of both sums ([`FiringStrengths`]).

use afbc_control::math;
use afbc_types::{Declared, OutOfRange, Range, parameters};
use nalgebra::{Matrix3, Vector3};

/// Accepted ratio of centre to width. Above it neighbouring Gaussians do not overlap, and the basis becomes a switch.
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
        /// s: width of each of the three Gaussians, in the fuzzy inputs' unit.
        #[parameter(WIDTH, "fuzzy input", 1e-3..=1e3)]
        pub width: f32 = 0.1,
    }
    together(membership) {
        SPREAD.check(membership.centre / membership.width)
    }
}

/// Fuzzy basis of one subsystem; both inputs use the same [`Membership`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FuzzyBasis {
    /// k / ln 2, with k = c/s^2.
    k: f32,
    /// q = exp(-c^2 / 2s^2)
    q: f32,
}

impl FuzzyBasis {
    /// Creates the basis of `membership`.
    ///
    /// # Errors
    /// Returns the first of centre, width and [`SPREAD`] that is out of range.
    pub fn new(membership: Membership) -> Result<Self, OutOfRange> {
        membership.validate()?;
        let spread = membership.centre / membership.width;
        Ok(FuzzyBasis {
            k: spread / membership.width * core::f32::consts::LOG2_E,
            q: math::exp(-0.5 * spread * spread),
        })
    }

    /// Returns w(x) of (18), one weight per rule. The row is the first input's Gaussian and the column the second's,
    /// from -c to c. For any finite input every weight is within \[0, 1\], and they sum to one.
    pub fn weights(&self, inputs: [f32; 2]) -> Matrix3<f32> {
        // Each triple is divided by its own sum, so that no weight exceeds 1, including rounding.
        let [first, second] = inputs.map(|x| {
            let (memberships, sum) = self.memberships(x);
            memberships / sum
        });
        first * second.transpose()
    }

    /// Returns the firing strengths w(x) of the rules, in factors.
    #[inline]
    pub fn fire(&self, [x1, x2]: [f32; 2]) -> FiringStrengths {
        let ((first, first_sum), (second, second_sum)) = (self.memberships(x1), self.memberships(x2));
        // Each sum is at least q, and q is at least exp(-18) by SPREAD, so the product is never zero.
        FiringStrengths { first, second, share: 1.0 / (first_sum * second_sum) }
    }

    /// Returns the memberships of one input, scaled by t divided by the middle one, and their sum.
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
pub struct FiringStrengths {
    /// Memberships of the first input, up to a common factor.
    pub first: Vector3<f32>,
    /// Memberships of the second input, up to a common factor.
    pub second: Vector3<f32>,
    /// 1 divided by the sum of all products.
    pub share: f32,
}
