//! Detection of a frozen tracker, which keeps sending states that no longer follow the vehicle. Not in the paper.
//!
//! | states sent | detected by |
//! |---|---|
//! | the same state again, bit for bit | measurements never repeat exactly in the air |
//! | a constant pose with a changing twist | displacement compared with the twist's integral over 0.25 s |
//! | a vehicle at rest in the air without thrust | [`crate::landing`] |
//!
//! A repeated state does not count as a measurement, so the state's age increases. After either of the other two, the
//! tracker is distrusted for the rest of the flight. A constant pose with noise cannot be told from a hovering vehicle.

use afbc_control::math::abs_max;
use afbc_types::State;
use nalgebra::Vector3;

/// Time over which displacements are compared \[us\].
pub const WINDOW_US: u32 = 250_000;
/// Pose and twist are compared if the integrated velocity exceeds this along any axis \[m\].
pub const TRAVEL_M: f32 = 0.15;
/// Pose and twist are compared if the integrated rates exceed this about body x or y \[rad\].
pub const TURN_RAD: f32 = 0.15;
/// Share of the twist's displacement or rotation below which the pose counts as constant.
pub const STANDS_SHARE: f32 = 0.2;

/// Compares pose and twist over windows of [`WINDOW_US`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrozenTrackerCheck {
    /// Time of the last state \[us\].
    last_us: u64,
    /// Time since the start of the window \[us\].
    window_us: u32,
    /// Pose at the start of the window.
    position_m: Vector3<f32>,
    attitude_rad: Vector3<f32>,
    /// Integrals of velocity \[m\] and body rates \[rad\] over the window.
    travel_m: Vector3<f32>,
    turn_rad: Vector3<f32>,
}

impl FrozenTrackerCheck {
    /// Starts a window with a state measured at `at_us`.
    pub fn new(state: &State, at_us: u64) -> Self {
        let State { position_m, attitude_rad, .. } = *state;
        let zero = Vector3::zeros();
        FrozenTrackerCheck { last_us: at_us, window_us: 0, position_m, attitude_rad, travel_m: zero, turn_rad: zero }
    }

    /// Processes a state measured at `at_us`. Returns true if the pose is constant although the twist is not zero.
    #[inline]
    pub fn contradicts(&mut self, state: &State, at_us: u64) -> bool {
        // After a longer gap, the motion in between is unknown. For a state older than the last one, the difference
        // wraps to such a gap.
        let elapsed_us = u32::try_from(at_us.wrapping_sub(self.last_us)).unwrap_or(u32::MAX);
        if elapsed_us > WINDOW_US {
            *self = FrozenTrackerCheck::new(state, at_us);
            return false;
        }
        let elapsed_s = elapsed_us as f32 * 1e-6;
        self.last_us = at_us;
        self.window_us += elapsed_us;
        self.travel_m += state.velocity_m_s * elapsed_s;
        self.turn_rad += state.rates_rad_s * elapsed_s;
        if self.window_us < WINDOW_US {
            return false;
        }
        let contradicts = self.stands(state);
        *self = FrozenTrackerCheck::new(state, at_us);
        contradicts
    }

    /// True if the pose has not changed since the start of the window although the twist is not zero.
    fn stands(&self, state: &State) -> bool {
        let stands = |moved: Vector3<f32>, claimed: Vector3<f32>, least: f32| {
            let claimed = abs_max(&claimed);
            claimed > least && abs_max(&moved) < STANDS_SHARE * claimed
        };
        // Roll and pitch stay constant in a tilted vehicle that rotates about its own z axis.
        let level = |v: Vector3<f32>| Vector3::new(v.x, v.y, 0.0);
        let (moved_m, turned_rad) = (state.position_m - self.position_m, state.attitude_rad - self.attitude_rad);
        stands(moved_m, self.travel_m, TRAVEL_M)
            || self.turn_rad.z.abs() < TURN_RAD && stands(level(turned_rad), level(self.turn_rad), TURN_RAD)
    }
}
