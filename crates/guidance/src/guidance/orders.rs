//! Carries out orders, or says why not.

use super::{Memory, Plan};
use crate::course::{Hold, Takeoff};
use crate::mode::FlightMode;
use crate::notice::{ModeReason, Notices};
use crate::orbit::{self, Orbit, Round};
use crate::order::{Order, OrderRefusal};
use crate::settings::Settings;
use crate::table::{self, TransitionInputs};
use afbc_control::math::min;
use afbc_types::State;
use nalgebra::Vector3;

/// Largest coordinate of a place that is flown to \[m\].
const PLACE_MAX_M: f32 = 9e4;

impl Memory {
    /// Carries out an order, or says why not.
    pub(super) fn order(
        &mut self,
        settings: &Settings,
        order: &Order,
        state: Option<&State>,
        seen: &TransitionInputs,
        notices: &mut Notices,
    ) -> Result<(), OrderRefusal> {
        let select = |mode: FlightMode| table::select(mode, seen);
        match *order {
            Order::Select(mode) => {
                select(mode)?;
                let height_m = Vector3::new(0.0, 0.0, settings.flying.takeoff_height_m);
                let climbs = state.filter(|_| mode == FlightMode::Takeoff);
                if climbs.is_some_and(|state| !self.is_inside(settings, &(state.position_m + height_m))) {
                    return Err(OrderRefusal::OutsideFence);
                }
                if mode != self.mode || mode == FlightMode::Hold {
                    self.ordered(mode, notices);
                }
                Ok(())
            }
            Order::TakeOff(height_m) => {
                let height_m = height_m.unwrap_or(settings.flying.takeoff_height_m);
                if !(height_m > 0.0 && height_m <= 1000.0) {
                    return Err(OrderRefusal::OutOfRange);
                }
                if !seen.armed {
                    return Err(OrderRefusal::NotArmed);
                }
                select(FlightMode::Takeoff)?;
                let state = state.ok_or(OrderRefusal::NoPosition)?;
                let to_m = state.position_m + Vector3::new(0.0, 0.0, height_m);
                if !self.is_inside(settings, &to_m) {
                    return Err(OrderRefusal::OutsideFence);
                }
                self.ordered(FlightMode::Takeoff, notices);
                self.limiter.rest(state);
                self.plan = Plan::Takeoff(Takeoff::above(state.position_m, height_m));
                Ok(())
            }
            Order::GoTo { position_m, yaw_rad, speed_m_s } => {
                let speed_ok = speed_m_s.is_none_or(|speed_m_s| speed_m_s > 0.0 && speed_m_s <= 1e3);
                if !speed_ok || !is_place(&position_m) || yaw_rad.abs() > 1e3 {
                    return Err(OrderRefusal::OutOfRange);
                }
                let kept = self.can_go(seen)?;
                let to_m = position_m.zip_map(&kept, |new, old| if new.is_nan() { old } else { new });
                if !self.is_inside(settings, &to_m) {
                    return Err(OrderRefusal::OutsideFence);
                }
                self.ordered(FlightMode::Hold, notices);
                let yaw_rad = (!yaw_rad.is_nan()).then_some(yaw_rad);
                self.plan = Plan::Hold(Hold { at_m: Some(to_m), yaw_rad, speed_m_s });
                Ok(())
            }
            Order::Orbit { centre_m, radius_m, speed_m_s, angle_deg, heading } => {
                let (left, radius_m) = (radius_m > 0.0, radius_m.abs());
                let most_m_s = orbit::speed_max_m_s(&settings.limits, radius_m);
                let usual_m_s = min(most_m_s, settings.flying.cruise_m_s);
                let speed_m_s = if speed_m_s.is_nan() { usual_m_s } else { speed_m_s };
                // False of NaN.
                let flown = orbit::RADIUS_M.contains(&radius_m) && (0.05..=most_m_s).contains(&speed_m_s);
                if !flown || !is_place(&centre_m) {
                    return Err(OrderRefusal::OutOfRange);
                }
                let speed_m_s = if left { speed_m_s } else { -speed_m_s };
                let present_m = self.can_go(seen)?;
                let centre_m = centre_m.zip_map(&present_m, |new, old| if new.is_nan() { old } else { new });
                let radius = Vector3::new(radius_m, 0.0, 0.0);
                // The cylinder around home: its farthest point.
                let away_m = self.home_m.map_or(radius, |home_m| {
                    let off_m = (centre_m - home_m).xy();
                    let far_m = off_m.try_normalize(1e-3).map_or(radius.xy(), |ahead| ahead * radius_m);
                    Vector3::new(far_m.x, far_m.y, 0.0)
                });
                if !self.is_inside(settings, &(centre_m + away_m)) {
                    return Err(OrderRefusal::OutsideFence);
                }
                self.ordered(FlightMode::Hold, notices);
                let angle_rad = if angle_deg == 0 { f32::INFINITY } else { f32::from(angle_deg).to_radians() };
                self.plan =
                    Plan::Orbit(Orbit { centre_m, radius_m, speed_m_s, heading, angle_rad, round: Round::default() });
                Ok(())
            }
            Order::Speed(speed_m_s) => {
                if !(speed_m_s > 0.0 && speed_m_s <= 1e3) {
                    return Err(OrderRefusal::OutOfRange);
                }
                self.speed_m_s = speed_m_s;
                Ok(())
            }
            Order::Home(place_m) => {
                let place_m = match (place_m, state) {
                    (Some(place_m), _) if place_m.iter().all(|value| value.abs() <= PLACE_MAX_M) => place_m,
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

    /// Returns the place that a flight to another one in mode hold begins at, or why there is none \[m\].
    fn can_go(&self, seen: &TransitionInputs) -> Result<Vector3<f32>, OrderRefusal> {
        if !seen.armed {
            return Err(OrderRefusal::NotArmed);
        }
        if !seen.airborne {
            return Err(OrderRefusal::OnGround);
        }
        table::select(FlightMode::Hold, seen)?;
        let present = self.limiter.setpoint().ok_or(OrderRefusal::NoPosition)?;
        Ok(match &self.plan {
            Plan::Hold(Hold { at_m: Some(at_m), .. }) if self.mode == FlightMode::Hold => *at_m,
            _ => present.position_m,
        })
    }

    fn ordered(&mut self, mode: FlightMode, notices: &mut Notices) {
        self.change(mode, ModeReason::Ordered, notices);
        self.failsafe = None;
    }

    pub(super) fn is_inside(&self, settings: &Settings, place_m: &Vector3<f32>) -> bool {
        self.home_m.is_none_or(|home_m| settings.net.encloses(&home_m, place_m, 0.0))
    }
}

/// True if every coordinate is a number that is flown to, or NaN.
fn is_place(place_m: &Vector3<f32>) -> bool {
    place_m.iter().all(|value| value.is_nan() || value.abs() <= PLACE_MAX_M)
}
