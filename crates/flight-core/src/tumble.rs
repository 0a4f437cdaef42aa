//! Detects a vehicle beyond recovery: too long on its side or back, or spinning, without recovering. Not in the paper;
//! similar to PX4's failure detector and the Crazyflie's supervisor.

use afbc_control::math;
use afbc_types::State;

/// Cosine of the tilt below which a vehicle is on its side or back: 80 degrees.
pub const TILT_COSINE_MIN: f32 = 0.17;
/// Roll and pitch up to which the vehicle is certainly not on its side \[rad\]. The tilt's cosine is the product of the
/// cosines of roll and pitch, here at least cos(1.1)^2 = 0.206.
const UPRIGHT_RAD: f32 = 1.1;
/// Combined rate about body x and y above which a vehicle is spinning \[rad/s\].
pub const SPIN_RAD_S: f32 = 10.0;
/// Increase of the tilt's cosine from its lowest value that counts as recovering.
pub const RIGHTING: f32 = 0.2;
/// Longest time on the side or back, or spinning, without recovering \[us\].
pub const LOST_US: u32 = 1_000_000;
/// Time upright after which a vehicle counts as recovered \[us\]. A continuously rolling vehicle is upright for shorter
/// times.
pub const UPRIGHT_US: u32 = 800_000;

/// Detector of tumbling.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tumble {
    over: Option<Over>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Over {
    /// Time since the start of the tumble \[us\].
    for_us: u32,
    /// Lowest cosine of the tilt since then.
    lowest: f32,
    /// Time for which the vehicle has been upright again; `None` if it is not \[us\].
    upright_us: Option<u32>,
    /// True if it tipped over again after being upright for too short a time. Coming up then does not count as
    /// recovering.
    again: bool,
}

impl Tumble {
    /// Processes a fresh state, `gap_us` after the last state.
    #[inline]
    pub fn advance(&mut self, state: &State, gap_us: u32) {
        let (attitude, rates) = (&state.attitude_rad, &state.rates_rad_s);
        let spins = rates.xy().norm_squared() > SPIN_RAD_S * SPIN_RAD_S;
        // An upright vehicle does not need the cosine.
        let tilt_rad = math::max(attitude.x.abs(), attitude.y.abs());
        if self.over.is_some() || spins || tilt_rad > UPRIGHT_RAD {
            self.look(math::tilt_cosine(attitude.x, attitude.y), spins, gap_us);
        }
    }

    /// Processes a state that may be tumbling.
    fn look(&mut self, cosine: f32, spins: bool, gap_us: u32) {
        let upright = cosine >= TILT_COSINE_MIN && !spins;
        let new = Over { for_us: 0, lowest: cosine, upright_us: None, again: false };
        let Some(over) = &mut self.over else {
            self.over = (!upright).then_some(new);
            return;
        };
        over.for_us = over.for_us.saturating_add(gap_us);
        if upright {
            let upright_us = over.upright_us.map_or(0, |upright_us| upright_us.saturating_add(gap_us));
            over.upright_us = Some(upright_us);
            if upright_us >= UPRIGHT_US {
                self.over = None;
            }
            return;
        }
        // A continuously rolling vehicle passes upright in each turn, which must not count as recovering.
        over.again |= over.upright_us.take().is_some();
        if cosine > over.lowest + RIGHTING && !spins && !over.again {
            // A vehicle that slowly rights itself gets another second for each such step. One that stays down does not.
            *over = new;
        }
        over.lowest = math::min(over.lowest, cosine);
    }

    /// Processes a tick without a fresh state.
    pub fn advance_blind(&mut self, gap_us: u32) {
        if let Some(over) = &mut self.over {
            over.for_us = over.for_us.saturating_add(gap_us);
            over.upright_us = over.upright_us.map(|upright_us| upright_us.saturating_add(gap_us));
        }
    }

    /// True if the vehicle is beyond recovery.
    pub fn is_lost(&self) -> bool {
        self.over.is_some_and(|over| over.upright_us.is_none() && over.for_us > LOST_US)
    }
}
