//! Applies the geofence to commands, the mission and the guidance.

use super::Comms;
use crate::services::fence::{FenceMotion, contains, holds, holds_circle, is_clear};
use crate::services::mission::Surroundings;
use afbc_control::math::sqrt;
use afbc_guidance::fence::StopPath;
use afbc_guidance::{FlightMode, Item, Order, RequestedItem};
use nalgebra::{Vector2, Vector3};

/// Time between two searches for the nearest rally point \[us\].
const SAFE_EVERY_US: u64 = 500_000;

impl Comms {
    /// Returns true if the guidance does not have the latest state of the geofence or of the safe place.
    pub(crate) fn has_fence_news(&self) -> bool {
        self.fence.view() != self.fence_given || self.safe_m != self.safe_given_m
    }

    /// Finds the nearest of home and the rally points, twice per second, except during a return.
    pub(super) fn find_safe_place(&mut self) {
        let rally = self.missions.rally();
        let returns = self.status.guided.mode == FlightMode::Return;
        if self.now_us.saturating_sub(self.safe_us) < SAFE_EVERY_US
            || returns
            || rally.is_empty() && self.safe_m.is_none()
        {
            return;
        }
        self.safe_us = self.now_us;
        let Surroundings { origin: Some(origin), here_m: Some(here_m), home_m: Some(home_m), .. } = self.surroundings()
        else {
            return;
        };
        let (chart, home_m) = (origin.chart(), home_m.xy());
        let off = |place_m: &Vector2<f32>| (place_m - here_m).norm_squared();
        let points = rally.iter().map(|item| chart.local([item.x, item.y]));
        // The search starts with home, which also replaces deleted rally points.
        self.safe_m = Some(points.fold(home_m, |best, point| if off(&point) < off(&best) { point } else { best }));
    }

    /// Returns the position data with which plans are checked.
    pub(super) fn surroundings(&self) -> Surroundings {
        let here_m = self.status.state.filter(|_| self.status.is_located()).map(|state| state.position_m.xy());
        let (origin, home_m) = (self.status.aux.origin, self.status.guided.home_m);
        Surroundings { origin, here_m, home_m, cylinder_m: self.cylinder_m }
    }

    /// Checks the next few boundaries of the fence.
    pub(super) fn watch_fence(&mut self) {
        let items = self.missions.fence();
        let (Some(origin), Some(state)) = (&self.status.aux.origin, &self.status.state) else { return };
        if items.is_empty() {
            return;
        }
        let setpoint = self.status.guided.setpoint.filter(|_| self.status.mode.armed());
        let (here_m, velocity_m_s) = (state.position_m.xy(), state.velocity_m_s.xy());
        let acceleration_m_s2 = setpoint.map_or(Vector2::zeros(), |setpoint| setpoint.acceleration_m_s2.xy());
        let vehicle = StopPath::of_vehicle(&self.braking, here_m, velocity_m_s, acceleration_m_s2);
        let planned = setpoint.map_or(vehicle, |setpoint| {
            let (position_m, velocity_m_s) = (setpoint.position_m.xy(), setpoint.velocity_m_s.xy());
            StopPath::of_setpoint(&self.braking, position_m, velocity_m_s, acceleration_m_s2)
        });
        let speed_m_s = sqrt(velocity_m_s.norm_squared());
        let motion = FenceMotion { here_m, speed_m_s, stops: [vehicle, planned] };
        self.fence.look(items, &origin.chart(), &motion);
    }

    /// Returns true if the order's destination and the straight path to it are inside the fence.
    pub(super) fn fence_allows(&self, order: &Order) -> bool {
        let items = self.missions.fence();
        let Surroundings { origin: Some(origin), here_m: Some(here_m), .. } = self.surroundings() else { return true };
        if items.is_empty() {
            return true;
        }
        let chart = origin.chart();
        let or_here =
            |place_m: &Vector3<f32>| place_m.xy().zip_map(&here_m, |to, here| if to.is_nan() { here } else { to });
        match order {
            Order::GoTo { position_m, .. } => {
                let to_m = or_here(position_m);
                holds(items, &chart, to_m) && is_clear(items, &chart, here_m, to_m)
            }
            Order::Orbit { centre_m, radius_m, .. } => holds_circle(items, &chart, or_here(centre_m), radius_m.abs()),
            Order::Select(FlightMode::Return) if self.status.is_airborne() => self
                .safe_m
                .or(self.status.guided.home_m.map(|home_m| home_m.xy()))
                .is_none_or(|home_m| contains(items, &chart, home_m) && is_clear(items, &chart, here_m, home_m)),
            _ => true,
        }
    }

    /// Returns a mission item. If its place is outside the fence, the place is made invalid, so that the guidance
    /// refuses it.
    pub(super) fn fenced(&self, mut leg: RequestedItem) -> RequestedItem {
        let items = self.missions.fence();
        let Some(chart) = self.status.aux.origin.filter(|_| !items.is_empty()).map(|origin| origin.chart()) else {
            return leg;
        };
        match &mut leg.item {
            Item::Waypoint { position_m: place_m, .. }
            | Item::TakeOffTo { position_m: place_m }
            | Item::Turns { centre_m: place_m, .. }
                if !holds(items, &chart, place_m.xy()) =>
            {
                *place_m = Vector3::repeat(f32::NAN);
            }
            // A NaN place would mean landing at the present position, so infinity marks this place as invalid.
            Item::Land { position_m } if !position_m.x.is_nan() && !holds(items, &chart, position_m.xy()) => {
                *position_m = Vector3::repeat(f32::INFINITY);
            }
            _ => (),
        }
        leg
    }
}
