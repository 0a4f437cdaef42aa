//! A tracker that has frozen: it goes on sending, but what it sends has nothing to do with the vehicle any more. Ours.
//!
//! | what it sends | is told from |
//! |---|---|
//! | the same state again, to the last bit | a measurement never repeats itself in the air |
//! | a pose that stands, with a twist that says it moves | displacement against the integral of velocity and rates over a quarter of a second |
//! | a vehicle that hangs still without thrust | [`crate::landing`] |
//!
//! A repeated state is no measurement: its age goes on. After either of the others the tracker is not believed for the rest
//! of the flight. A pose that stands within noise while the vehicle hovers cannot be told from a vehicle that does.

use afbc_control::math::abs_max;
use afbc_types::State;
use nalgebra::Vector3;

/// Time over which displacements are compared \[us\].
pub const WINDOW_US: u64 = 250_000;
/// Least displacement that the twist has to tell of, along any axis \[m\].
pub const TRAVEL_M: f32 = 0.15;
/// Least turn that the twist has to tell of, about body x or y \[rad\].
pub const TURN_RAD: f32 = 0.15;
/// Share of it up to which a pose stands.
pub const STANDS_SHARE: f32 = 0.2;

/// Compares pose and twist over windows of [`WINDOW_US`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Witness {
    since_us: u64,
    last_us: u64,
    first: State,
    /// Integral of the velocity \[m\] and of the rates \[rad\] over the window.
    travel_m: Vector3<f32>,
    turn_rad: Vector3<f32>,
}

impl Witness {
    /// Begins a window with a state measured at `at_us`.
    pub fn new(state: &State, at_us: u64) -> Self {
        let zero = Vector3::zeros();
        Witness { since_us: at_us, last_us: at_us, first: *state, travel_m: zero, turn_rad: zero }
    }

    /// Takes a state measured at `at_us` into account; true if the pose stands although the twist says it moves.
    pub fn contradicts(&mut self, state: &State, at_us: u64) -> bool {
        let elapsed_us = at_us.saturating_sub(self.last_us);
        // Nobody knows what it did in a longer gap.
        if elapsed_us > WINDOW_US {
            *self = Witness::new(state, at_us);
            return false;
        }
        let elapsed_s = elapsed_us as f32 * 1e-6;
        self.last_us = at_us;
        self.travel_m += state.velocity_m_s * elapsed_s;
        self.turn_rad += state.rates_rad_s * elapsed_s;
        if at_us.saturating_sub(self.since_us) < WINDOW_US {
            return false;
        }
        let stands = |moved: Vector3<f32>, told: Vector3<f32>, least: f32| {
            let told = abs_max(&told);
            told > least && abs_max(&moved) < STANDS_SHARE * told
        };
        // Roll and pitch stand in a tilted vehicle that spins about its own z.
        let level = |v: Vector3<f32>| Vector3::new(v.x, v.y, 0.0);
        let (moved_m, turned_rad) =
            (state.position_m - self.first.position_m, state.attitude_rad - self.first.attitude_rad);
        let contradicts = stands(moved_m, self.travel_m, TRAVEL_M)
            || self.turn_rad.z.abs() < TURN_RAD && stands(level(turned_rad), level(self.turn_rad), TURN_RAD);
        *self = Witness::new(state, at_us);
        contradicts
    }
}
