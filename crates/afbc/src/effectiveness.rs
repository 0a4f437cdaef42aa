//! Control effectiveness of roll and pitch, learnt in flight as a share of the model's g. Not in the paper.
//!
//! A vehicle with more inertia than its file says, or with weaker rotors, turns less than the model by the same
//! moments. The [moment observer](crate::moments) compensates the difference as a disturbance, but late: with three
//! times the inertia the vehicle swings until it falls. If g is lambda times the model's, the rates differ from the
//! observer's by (lambda - lambda_hat) p, with p from the observer's own equations and the model's g U:
//!
//! ```text
//! dp/dt = g U - q - 2w p,   dq/dt = w^2 p
//! dlambda_hat/dt = k e/(p^2 + p_0^2),   e = p (Omega - Omega_hat)
//! ```
//!
//! This is a gradient estimate with normalisation, as that of the [age](crate::age), with p and e summed over roll and
//! pitch. Smeur, Chu and de Croon, *Adaptive incremental nonlinear dynamic inversion for attitude control of micro air
//! vehicles*, JGCD 39(3), 2016, learn the effectiveness from increments.
//!
//! Old rates also lag behind the model. An age of tau beyond the assumed one adds -tau dp/dt to Omega - Omega_hat, and
//! so -(tau dp/dt)^2/2 to the mean of e. That much of a negative e does not count, for [`AGED_S`] and again for the tau
//! that (Omega - Omega_hat) dp/dt shows. Otherwise old rates would raise the gain of a loop that swings because of
//! their age. Nor does lambda_hat exceed 1, since turbulence may raise it, too, and smaller gains lose fast flights.

use afbc_control::math;

/// Smallest lambda_hat.
pub const SHARE_MIN: f32 = 0.25;
/// Largest lambda_hat.
pub const SHARE_MAX: f32 = 1.0;
/// Age of the rates, beyond the assumed one, that does not count as missing effectiveness \[s\].
pub const AGED_S: f32 = 0.03;
/// k: rate of lambda_hat while p is large \[1/s\].
const RATE_1_S: f32 = 6.0;
/// Largest rate of lambda_hat \[1/s\].
const CHANGE_MAX_1_S: f32 = 3.0;
/// Rate at which lambda_hat returns to 1 \[1/s\].
const FORGET_1_S: f32 = 0.02;
/// p_0 as a share of the largest difference of rates that a disturbance can cause.
const EXCITED: f32 = 0.1;
/// Time constant of the lambda_hat that a touch of the ground restores \[s\], longer than it takes to detect one.
pub const LASTS_S: f32 = 2.0;
/// Smallest sum of squares that is divided by, far below that of any motion \[rad2/s2\].
const TINY: f32 = 1e-12;

/// Estimator of the effectiveness with its constants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effectiveness {
    /// Corrections of Omega_hat \[1\] and f_hat \[1/s\] per step and rate difference, those of the observer.
    rate: f32,
    acceleration_1_s: f32,
    dt_s: f32,
    /// p_0^2 \[rad2/s2\].
    excited: f32,
    /// (tau/dt)^2/2.
    aged: f32,
}

/// Memory of the estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EffectivenessMemory {
    /// lambda_hat.
    pub share: f32,
    /// lambda_hat behind a lag of [`LASTS_S`].
    lasting: f32,
    /// p \[rad/s\] and q \[rad/s2\] of roll and pitch.
    p: [f32; 2],
    q: [f32; 2],
}

impl Default for EffectivenessMemory {
    fn default() -> Self {
        EffectivenessMemory { share: 1.0, lasting: 1.0, p: [0.0; 2], q: [0.0; 2] }
    }
}

impl EffectivenessMemory {
    /// Returns the memory after a touch of the ground, with lambda_hat from before it: on its feet, a vehicle hardly
    /// turns by any moment.
    #[must_use]
    pub fn restarted(&self) -> Self {
        EffectivenessMemory { share: self.lasting, lasting: self.lasting, ..Self::default() }
    }
}

impl Effectiveness {
    /// Creates the estimator for an observer with these corrections per step of `dt_s`. A disturbance moves its rates
    /// by at most `jump_rad_s`.
    pub fn new([rate, acceleration_1_s]: [f32; 2], jump_rad_s: f32, dt_s: f32) -> Self {
        let (p_0, ticks) = (EXCITED * jump_rad_s, AGED_S / dt_s);
        Effectiveness { rate, acceleration_1_s, dt_s, excited: p_0 * p_0, aged: 0.5 * ticks * ticks }
    }

    /// Learns from Omega - Omega_hat of roll and pitch \[rad/s\], with lambda_hat g U as the observer has it
    /// \[rad/s2\].
    #[inline(always)]
    pub fn learn(&self, memory: &mut EffectivenessMemory, off_rad_s: [f32; 2], given_rad_s2: [f32; 2]) {
        let EffectivenessMemory { share, lasting, p, q } = memory;
        let inverse = 1.0 / *share;
        let (mut error, mut square, mut late, mut turned) = (0.0, self.excited, 0.0, TINY);
        for (((p, q), off), given) in p.iter_mut().zip(q).zip(off_rad_s).zip(given_rad_s2) {
            let change = (given * inverse - *q) * self.dt_s - self.rate * *p;
            (error, square) = (error + off * *p, square + *p * *p);
            (late, turned) = (late + off * change, turned + change * change);
            *q = math::settled(*q + self.acceleration_1_s * *p);
            *p = math::settled(*p + change);
        }
        let counted =
            if error < 0.0 { math::min(error + self.aged * turned + 0.5 * late * late / turned, 0.0) } else { error };
        let change_1_s = math::limited(RATE_1_S * counted / square, CHANGE_MAX_1_S) + FORGET_1_S * (1.0 - *share);
        *share = math::min(math::max(*share + change_1_s * self.dt_s, SHARE_MIN), SHARE_MAX);
        *lasting += (*share - *lasting) * (self.dt_s * (1.0 / LASTS_S));
    }
}
