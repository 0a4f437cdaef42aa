//! Land detector, from the vehicle's motion and its thrust, similar to that of other autopilots. Not in the paper.
//!
//! An armed vehicle is on the ground until it moves away or its rotors have carried it for a moment. It has landed if
//! it was seen to descend and then stays at rest for a second without being carried by its rotors. A vehicle that
//! appears to be at rest all the time while its thrust decreases has not landed: its tracker has frozen. With an
//! inertial sensor, [`crate::fall_check`] detects the ground sooner.
//!
//! `afbc::standstill` is a separate detector that stops the law's adaptation. It uses the thrust demanded by the law,
//! and is faster, since it does not stop the motors.

use afbc_control::math::abs_max;
use afbc_types::State;
use nalgebra::Vector3;

/// Distance from its resting place beyond which a vehicle is in the air \[m\].
pub const LEFT_M: f32 = 0.15;
/// Speed along any axis above which a vehicle is in the air \[m/s\].
pub const LEFT_M_S: f32 = 0.5;
/// Speed along each axis up to which a vehicle is at rest \[m/s\].
pub const STILL_M_S: f32 = 0.1;
/// Downward speed above which a vehicle is descending \[m/s\].
pub const SINKS_M_S: f32 = 0.2;
/// Share of the usual thrust up to which the rotors do not carry the vehicle.
pub const CARRY_SHARE: f32 = 0.6;
/// Time constant of the mean thrust, called the usual thrust \[s\].
pub const USUAL_S: f32 = 5.0;
/// Time for which the rotors must carry a vehicle for it to be in the air \[us\].
pub const CARRIED_US: u32 = 500_000;
/// Time at rest without being carried after which a vehicle has landed \[us\].
pub const STILL_US: u32 = 1_000_000;
/// Time at rest after which a vehicle that should sink counts as standing \[us\].
pub const STANDS_US: u32 = 250_000;
/// Time at rest, not carried and without a preceding descent, after which the tracker is distrusted \[us\].
pub const FROZEN_US: u32 = 500_000;
/// Time of hovering after which an earlier descent no longer counts \[us\].
pub const HOVER_US: u32 = 2_000_000;

/// Detects whether the vehicle is in the air, and when it has landed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LandDetector {
    airborne: bool,
    /// True if the vehicle has moved away from its resting place.
    left: bool,
    /// True if a descent was seen since the vehicle last hovered.
    sank: bool,
    /// Resting place \[m\].
    stood_m: Vector3<f32>,
    /// Mean thrust in the air \[N\].
    usual_n: f32,
    /// Times for which the vehicle has been at rest, carried, and not carried \[us\].
    still_us: u32,
    carried_us: u32,
    uncarried_us: u32,
}

impl LandDetector {
    /// Starts the detector for a vehicle of this weight, armed in this state.
    pub fn new(state: &State, weight_n: f32) -> Self {
        LandDetector {
            airborne: false,
            left: false,
            sank: false,
            stood_m: state.position_m,
            usual_n: weight_n,
            still_us: 0,
            carried_us: 0,
            uncarried_us: 0,
        }
    }

    /// Processes a tick with a fresh state, `gap_us` after the last tick, in which the rotors gave `thrust_n`.
    pub fn advance(&mut self, state: &State, thrust_n: f32, gap_us: u32, dt_s: f32) {
        let faster = |speed_m_s: f32| state.velocity_m_s.iter().any(|velocity_m_s| velocity_m_s.abs() > speed_m_s);
        self.wait(gap_us);
        if faster(STILL_M_S) {
            self.still_us = 0;
        }
        if thrust_n > CARRY_SHARE * self.usual_n {
            self.uncarried_us = 0;
        } else {
            self.carried_us = 0;
        }
        self.sank |= state.velocity_m_s.z < -SINKS_M_S;
        self.left = self.left || faster(LEFT_M_S) || abs_max(&(state.position_m - self.stood_m)) > LEFT_M;
        self.airborne |= self.left || self.carried_us >= CARRIED_US;
        if self.airborne {
            self.usual_n += dt_s / USUAL_S * (thrust_n - self.usual_n);
        }

        if self.still_us >= HOVER_US && self.uncarried_us == 0 {
            self.sank = false;
        }
        // A vehicle that never left its resting place need not have descended to stand there.
        if self.stands_for_us() > STILL_US && (self.sank || !self.left) {
            let usual_n = self.usual_n;
            // Keep the usual thrust, which has adapted to load and battery.
            *self = LandDetector { usual_n, ..LandDetector::new(state, usual_n) };
        }
    }

    /// Returns the thrust as a share of the usual one.
    pub fn thrust_share(&self, thrust_n: f32) -> f32 {
        thrust_n / self.usual_n
    }

    /// Records a touchdown: a vehicle that was seen to descend has landed.
    pub fn touch_down(&mut self, state: &State) {
        if self.sank {
            let usual_n = self.usual_n;
            *self = LandDetector { usual_n, ..LandDetector::new(state, usual_n) };
        }
    }

    /// Processes a tick of a vehicle idling on the ground. It counts as standing, whatever its tracker reports.
    pub fn rest(&mut self, state: Option<&State>) {
        let stood_m = state.map_or(self.stood_m, |state| state.position_m);
        *self = LandDetector {
            airborne: false,
            left: false,
            sank: false,
            stood_m,
            usual_n: self.usual_n,
            still_us: 0,
            carried_us: 0,
            uncarried_us: 0,
        };
    }

    /// Processes a tick of a descending vehicle without a known velocity. It has landed once its rotors have not
    /// carried it for long enough.
    pub fn advance_adrift(&mut self, state: &State, thrust_n: f32, gap_us: u32, dt_s: f32) {
        self.sank = true;
        self.advance(&State { velocity_m_s: Vector3::zeros(), ..*state }, thrust_n, gap_us, dt_s);
        // States that come back may show only the end of the descent, so count it. The vehicle has not hovered either.
        self.sank |= self.airborne;
        self.still_us = self.still_us.min(STILL_US.saturating_add(1));
    }

    /// Processes a tick without a fresh state.
    pub fn advance_blind(&mut self, gap_us: u32) {
        self.wait(gap_us);
        self.still_us = 0;
    }

    fn wait(&mut self, gap_us: u32) {
        for time_us in [&mut self.still_us, &mut self.carried_us, &mut self.uncarried_us] {
            *time_us = time_us.saturating_add(gap_us);
        }
    }

    /// True if the vehicle is in the air.
    pub fn airborne(&self) -> bool {
        self.airborne
    }

    /// True if the state is at rest in the air without thrust, which only a frozen tracker reports.
    pub fn contradicts(&self) -> bool {
        self.left && !self.sank && self.stands_for_us() > FROZEN_US
    }

    /// True if the vehicle has not moved for [`STANDS_US`], carried or not.
    pub fn stands(&self) -> bool {
        self.still_us >= STANDS_US
    }

    /// Returns the time for which it has been at rest and not carried \[us\].
    fn stands_for_us(&self) -> u32 {
        self.still_us.min(self.uncarried_us)
    }
}
