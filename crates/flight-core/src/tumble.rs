//! A vehicle that is past recovery: on its side or its back, or spinning, for too long and not on its way back. Ours, after
//! the tumble checks of autopilots (PX4's failure detector, the Crazyflie's supervisor).

use afbc_control::math;
use afbc_types::State;

/// Cosine of the tilt below which a vehicle lies on its side or its back: 80 degrees.
pub const TILT_COSINE_MIN: f32 = 0.17;
/// Rate about body x and y together above which a vehicle spins \[rad/s\].
pub const SPIN_RAD_S: f32 = 10.0;
/// How far a vehicle has to come up from where it lay lowest, in cosine of the tilt, to be on its way back.
pub const RIGHTING: f32 = 0.2;
/// Longest that a vehicle may lie or spin without coming back \[us\].
pub const LOST_US: u64 = 1_000_000;
/// How long a vehicle has to be upright before it counts as recovered: one that rolls over and over is upright for
/// shorter \[us\].
pub const UPRIGHT_US: u64 = 800_000;

/// Since when a vehicle has not been upright.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tumble {
    over: Option<Over>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Over {
    since_us: u64,
    /// Least cosine of the tilt in this time.
    lowest: f32,
    /// Since when it has been upright again.
    upright_since_us: Option<u64>,
    /// True if it went over again before that was long enough: coming up is no way back then.
    again: bool,
}

impl Tumble {
    /// Takes a fresh state into account.
    pub fn advance(&mut self, state: &State, now_us: u64) {
        let cosine = math::tilt_cosine(state.attitude_rad.x, state.attitude_rad.y);
        let spins = state.rates_rad_s.xy().norm_squared() > SPIN_RAD_S * SPIN_RAD_S;
        let upright = cosine >= TILT_COSINE_MIN && !spins;
        let new = Over { since_us: now_us, lowest: cosine, upright_since_us: None, again: false };
        let Some(over) = &mut self.over else {
            self.over = (!upright).then_some(new);
            return;
        };
        if upright {
            let since_us = *over.upright_since_us.get_or_insert(now_us);
            if now_us.saturating_sub(since_us) >= UPRIGHT_US {
                self.over = None;
            }
            return;
        }
        over.again |= over.upright_since_us.take().is_some();
        if cosine > over.lowest + RIGHTING && !spins && !over.again {
            *over = new;
        }
        over.lowest = math::min(over.lowest, cosine);
    }

    /// True if the vehicle is past recovery.
    pub fn is_lost(&self, now_us: u64) -> bool {
        self.over.is_some_and(|over| over.upright_since_us.is_none() && now_us.saturating_sub(over.since_us) > LOST_US)
    }
}
