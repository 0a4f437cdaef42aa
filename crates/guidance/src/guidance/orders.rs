//! Carries out orders or refuses them.

use super::{Memory, ModeMemory};
use crate::course::{Hold, Takeoff};
use crate::mode::FlightMode;
use crate::notice::{GuidanceNotices, ModeReason};
use crate::orbit::{self, Orbit, OrbitProgress};
use crate::order::{Order, OrderRefusal};
use crate::place::{is_place, is_within};
use crate::settings::Settings;
use crate::table::{self, TransitionInputs};
use afbc_control::math::min;
use afbc_types::State;
use nalgebra::Vector3;

impl Memory {
    /// Carries out an order, or returns the reason for refusing it.
    pub(super) fn order(
        &mut self,
        settings: &Settings,
        order: &Order,
        state: Option<&State>,
        seen: &TransitionInputs,
        notices: &mut GuidanceNotices,
    ) -> Result<(), OrderRefusal> {
        match *order {
            Order::Select(mode) => self.select(settings, mode, state, seen, notices),
            Order::TakeOff(height_m) => self.take_off(settings, height_m, state, seen, notices),
            Order::GoTo { position_m, yaw_rad, speed_m_s } => {
                let to = Hold { at_m: Some(position_m), yaw_rad: (!yaw_rad.is_nan()).then_some(yaw_rad), speed_m_s };
                self.go_to(settings, &position_m, to, seen, notices)
            }
            Order::Orbit { centre_m, radius_m, speed_m_s, angle_deg, heading } => {
                let angle_rad = if angle_deg == 0 { f32::INFINITY } else { f32::from(angle_deg).to_radians() };
                let wanted =
                    Orbit { centre_m, radius_m, speed_m_s, heading, angle_rad, round: OrbitProgress::default() };
                self.orbit(settings, wanted, seen, notices)
            }
            Order::Speed(speed_m_s) => {
                if !is_speed(speed_m_s) {
                    return Err(OrderRefusal::OutOfRange);
                }
                self.speed_m_s = speed_m_s;
                Ok(())
            }
            Order::Home(place_m) => {
                let place_m = match (place_m, state) {
                    (Some(place_m), _) if place_m.iter().all(|value| is_within(*value)) => place_m,
                    (Some(_), _) => return Err(OrderRefusal::OutOfRange),
                    (None, Some(state)) => state.position_m,
                    (None, None) => return Err(OrderRefusal::NoPosition),
                };
                (self.home_m, self.home_ordered) = (Some(place_m), true);
                Ok(())
            }
            Order::Resume(number) => {
                if !seen.mission {
                    return Err(OrderRefusal::NoMission);
                }
                self.mission.resume(number);
                self.lands_item = None;
                Ok(())
            }
        }
    }

    fn select(
        &mut self,
        settings: &Settings,
        mode: FlightMode,
        state: Option<&State>,
        seen: &TransitionInputs,
        notices: &mut GuidanceNotices,
    ) -> Result<(), OrderRefusal> {
        table::select(mode, seen)?;
        let height_m = Vector3::new(0.0, 0.0, settings.flying.takeoff_height_m);
        if let Some(state) = state.filter(|_| mode == FlightMode::Takeoff) {
            self.must_be_inside(settings, &(state.position_m + height_m))?;
        }
        // Selecting the present mode again changes nothing, except that hold restarts, which ends a flight or an orbit
        // in it.
        if mode != self.mode || mode == FlightMode::Hold {
            self.ordered(mode, notices);
        }
        // A landing that began with a loss of the state now counts as ordered.
        if self.interrupted.take().is_some() {
            self.failsafe = None;
        }
        Ok(())
    }

    fn take_off(
        &mut self,
        settings: &Settings,
        height_m: Option<f32>,
        state: Option<&State>,
        seen: &TransitionInputs,
        notices: &mut GuidanceNotices,
    ) -> Result<(), OrderRefusal> {
        let height_m = height_m.unwrap_or(settings.flying.takeoff_height_m);
        if !(height_m > 0.0 && height_m <= 1000.0) {
            return Err(OrderRefusal::OutOfRange);
        }
        if !seen.armed {
            return Err(OrderRefusal::NotArmed);
        }
        table::select(FlightMode::Takeoff, seen)?;
        let state = state.ok_or(OrderRefusal::NoPosition)?;
        self.must_be_inside(settings, &(state.position_m + Vector3::new(0.0, 0.0, height_m)))?;
        self.ordered(FlightMode::Takeoff, notices);
        self.limiter.rest(state);
        self.mode_memory = ModeMemory::Takeoff(Takeoff::above(state.position_m, height_m));
        Ok(())
    }

    /// Flies to a place and holds there. A NaN coordinate keeps its present value.
    fn go_to(
        &mut self,
        settings: &Settings,
        position_m: &Vector3<f32>,
        to: Hold,
        seen: &TransitionInputs,
        notices: &mut GuidanceNotices,
    ) -> Result<(), OrderRefusal> {
        let turns = to.yaw_rad.is_none_or(|yaw_rad| yaw_rad.abs() <= 1e3);
        if !to.speed_m_s.is_none_or(is_speed) || !is_place(position_m) || !turns {
            return Err(OrderRefusal::OutOfRange);
        }
        let to_m = or_kept(position_m, &self.can_go(seen)?);
        self.must_be_inside(settings, &to_m)?;
        self.ordered(FlightMode::Hold, notices);
        self.mode_memory = ModeMemory::Hold(Hold { at_m: Some(to_m), ..to });
        Ok(())
    }

    /// Flies an orbit. Checks the ordered speed and radius first.
    fn orbit(
        &mut self,
        settings: &Settings,
        wanted: Orbit,
        seen: &TransitionInputs,
        notices: &mut GuidanceNotices,
    ) -> Result<(), OrderRefusal> {
        let (left, radius_m) = (wanted.radius_m > 0.0, wanted.radius_m.abs());
        let most_m_s = orbit::speed_max_m_s(&settings.limits, radius_m);
        let usual_m_s = min(most_m_s, settings.flying.cruise_m_s);
        let speed_m_s = if wanted.speed_m_s.is_nan() { usual_m_s } else { wanted.speed_m_s };
        // The comparison is false for NaN.
        let flown = orbit::RADIUS_M.contains(&radius_m) && (0.05..=most_m_s).contains(&speed_m_s);
        if !flown || !is_place(&wanted.centre_m) {
            return Err(OrderRefusal::OutOfRange);
        }
        let centre_m = or_kept(&wanted.centre_m, &self.can_go(seen)?);
        let radius = Vector3::new(radius_m, 0.0, 0.0);
        // Check the orbit's farthest point from home against the fence's cylinder.
        let away_m = self.home_m.map_or(radius, |home_m| {
            let off_m = (centre_m - home_m).xy();
            // Around home itself, every point is equally far.
            let far_m = off_m.try_normalize(1e-3).map_or(radius.xy(), |ahead| ahead * radius_m);
            Vector3::new(far_m.x, far_m.y, 0.0)
        });
        self.must_be_inside(settings, &(centre_m + away_m))?;
        self.ordered(FlightMode::Hold, notices);
        let speed_m_s = if left { speed_m_s } else { -speed_m_s };
        self.mode_memory = ModeMemory::Orbit(Orbit { centre_m, radius_m, speed_m_s, ..wanted });
        Ok(())
    }

    /// Returns the start of a flight to another place in mode hold \[m\], or the reason why none is possible.
    fn can_go(&self, seen: &TransitionInputs) -> Result<Vector3<f32>, OrderRefusal> {
        if !seen.armed {
            return Err(OrderRefusal::NotArmed);
        }
        if !seen.airborne {
            return Err(OrderRefusal::OnGround);
        }
        table::select(FlightMode::Hold, seen)?;
        let present = self.limiter.setpoint().ok_or(OrderRefusal::NoPosition)?;
        Ok(match &self.mode_memory {
            // Coordinates that an order leaves out are kept from the place ordered before, even if not yet reached.
            ModeMemory::Hold(Hold { at_m: Some(at_m), .. }) if self.mode == FlightMode::Hold => *at_m,
            _ => present.position_m,
        })
    }

    fn ordered(&mut self, mode: FlightMode, notices: &mut GuidanceNotices) {
        self.change(mode, ModeReason::Ordered, notices);
        self.failsafe = None;
    }

    fn must_be_inside(&self, settings: &Settings, place_m: &Vector3<f32>) -> Result<(), OrderRefusal> {
        if self.is_inside(settings, place_m) { Ok(()) } else { Err(OrderRefusal::OutsideFence) }
    }

    pub(super) fn is_inside(&self, settings: &Settings, place_m: &Vector3<f32>) -> bool {
        self.home_m.is_none_or(|home_m| settings.failsafe.encloses(&home_m, place_m, 0.0))
    }
}

/// Returns `place_m` with its NaN coordinates taken from `kept_m`.
fn or_kept(place_m: &Vector3<f32>, kept_m: &Vector3<f32>) -> Vector3<f32> {
    place_m.zip_map(kept_m, |new, kept| if new.is_nan() { kept } else { new })
}

/// True if this is a valid horizontal speed; false for NaN \[m/s\].
fn is_speed(speed_m_s: f32) -> bool {
    speed_m_s > 0.0 && speed_m_s <= 1e3
}
