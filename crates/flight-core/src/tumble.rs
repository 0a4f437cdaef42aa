//! Detection of a vehicle beyond recovery: on its side or back, or spinning, for too long and not recovering. Not in
//! the paper; similar to PX4's failure detector and the Crazyflie's supervisor.

use afbc_control::math;
use afbc_types::State;

/// Cosine of the tilt below which a vehicle is on its side or back: 80 degrees.
pub const TILT_COSINE_MIN: f32 = 0.17;
/// Combined rate about body x and y above which a vehicle is spinning \[rad/s\].
pub const SPIN_RAD_S: f32 = 10.0;
/// Increase of the cosine of the tilt from its lowest value that counts as recovering.
pub const RIGHTING: f32 = 0.2;
/// Longest time on the side or back, or spinning, without recovering \[us\].
pub const LOST_US: u64 = 1_000_000;
/// Time upright after which a vehicle counts as recovered; one that rolls continuously is upright for shorter times
/// \[us\].
pub const UPRIGHT_US: u64 = 800_000;

/// Detector of tumbling.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tumble {
    over: Option<Over>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Over {
    since_us: u64,
    /// Lowest cosine of the tilt since it began.
    lowest: f32,
    /// Time since which it has been upright again.
    upright_since_us: Option<u64>,
    /// True if it tipped over again before that: then coming up does not count as recovering.
    again: bool,
}

impl Tumble {
    /// Processes a fresh state.
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

    /// True if the vehicle is beyond recovery.
    pub fn is_lost(&self, now_us: u64) -> bool {
        self.over.is_some_and(|over| over.upright_since_us.is_none() && now_us.saturating_sub(over.since_us) > LOST_US)
    }
}
