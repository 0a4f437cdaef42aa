//! Execution of a mission, item by item. The items themselves are the link's: the guidance names the one that it wants.

use crate::course::{Hold, Takeoff};
use crate::limiter::Aim;
use crate::mode::FlightMode;
use crate::order::{Item, Leg};
use crate::scene::{Scene, Wish};
use afbc_control::math::{max, min};
use nalgebra::Vector3;

/// Speed of the setpoint at which it has stopped at a waypoint \[m/s\].
const STOPPED_M_S: f32 = 0.3;

/// A mission in progress.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Mission {
    /// Number of the item that is wanted.
    pub(crate) wanted: u16,
    /// The item in progress, by number and upload.
    begun: Option<Begun>,
    upload: Option<u16>,
    /// Speed of the last item that changes it \[m/s\].
    speed_m_s: Option<f32>,
    hold: Hold,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Begun {
    number: u16,
    yaw_rad: f32,
    takeoff: Option<Takeoff>,
    stayed_s: f32,
}

/// What a mission does in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Progress {
    pub(crate) wish: Wish,
    /// Number of an item that is done.
    pub(crate) reached: Option<u16>,
    /// Mode that an item ends the mission with; its number counts as done when that mode has landed.
    pub(crate) then: Option<(FlightMode, u16)>,
    /// True if the item lies outside the geofence, or makes no sense.
    pub(crate) refused: bool,
}

impl Mission {
    /// Goes on with the item `number`.
    pub(crate) fn resume(&mut self, number: u16) {
        (self.wanted, self.begun) = (number, None);
    }

    /// Pauses: the item begins anew when the mode is selected again.
    pub(crate) fn pause(&mut self) {
        (self.begun, self.hold) = (None, Hold::default());
    }

    /// Advances by a tick; `inside` tells whether a place is inside the geofence.
    pub(crate) fn fly(
        &mut self,
        leg: Option<&Leg>,
        scene: &Scene<'_>,
        inside: impl Fn(&Vector3<f32>) -> bool,
    ) -> Progress {
        if let Some(leg) = leg {
            // Another mission begins at its first item.
            if self.upload.is_some_and(|upload| upload != leg.upload) {
                *self = Mission::default();
            }
            self.upload = Some(leg.upload);
        }
        let scene = &Scene { speed_m_s: min(scene.speed_m_s, self.speed_m_s.unwrap_or(f32::INFINITY)), ..*scene };
        let none = Progress { wish: Wish::fly(scene.stop()), reached: None, then: None, refused: false };
        let Some(leg) = leg.filter(|leg| leg.number == self.wanted) else {
            // Until it comes, it stays where it is; a mission that is no more is over.
            let done = leg.is_none();
            return Progress { wish: Wish { done, ..Wish::fly(self.hold.fly(scene)) }, ..none };
        };
        if !is_plausible(&leg.item) {
            return Progress { refused: true, ..none };
        }
        match leg.item {
            Item::TakeOff { height_m } => {
                if !inside(&Vector3::new(scene.home_m.x, scene.home_m.y, height_m)) {
                    return Progress { refused: true, ..none };
                }
                let begun = self.begin(leg, scene, |scene| {
                    Some(Takeoff::new(scene, max(height_m - scene.present.position_m.z, 0.0)))
                });
                let wish = begun.takeoff.map_or(none.wish, |takeoff| takeoff.fly(scene));
                let at_m = begun.takeoff.map(|takeoff| takeoff.to_m);
                self.go_on(leg, wish, at_m, none)
            }
            Item::Waypoint { position_m, yaw_rad, hold_s, within_m, fly_through } => {
                if !inside(&position_m) {
                    return Progress { refused: true, ..none };
                }
                let on_ground = !scene.airborne;
                let room_m = max(scene.ceiling_m - scene.present.position_m.z, 0.0);
                let height_m = min(scene.flying.takeoff_height_m, room_m);
                let begun = self.begin(leg, scene, |scene| on_ground.then(|| Takeoff::new(scene, height_m)));
                // From the ground it climbs first.
                if let Some(takeoff) = begun.takeoff {
                    let wish = takeoff.fly(scene);
                    if wish.done {
                        begun.takeoff = None;
                    }
                    return Progress { wish: Wish { done: false, ..wish }, ..none };
                }
                let yaw_rad = if yaw_rad.is_nan() { begun.yaw_rad } else { yaw_rad };
                let aim = Aim { yaw_rad, ..scene.to(position_m) };
                let within_m = if within_m > 0.0 { within_m } else { scene.flying.within_m };
                let slow = scene.present.velocity_m_s.norm_squared() < STOPPED_M_S * STOPPED_M_S;
                if begun.stayed_s > 0.0 || scene.is_at(&position_m, within_m) && (fly_through || slow) {
                    begun.stayed_s += scene.dt_s;
                }
                let done = begun.stayed_s > 0.0 && (fly_through || begun.stayed_s >= hold_s);
                self.go_on(leg, Wish { done, ..Wish::fly(aim) }, Some(position_m), none)
            }
            Item::Land { position_m } => {
                let here = position_m.x.is_nan() || position_m.y.is_nan();
                if here {
                    return Progress { then: Some((FlightMode::Land, leg.number)), ..none };
                }
                if !inside(&Vector3::new(position_m.x, position_m.y, scene.home_m.z)) {
                    return Progress { refused: true, ..none };
                }
                let height_m = scene.present.position_m.z;
                let begun = self.begin(leg, scene, |scene| Some(Takeoff::new(scene, 0.0)));
                let height_m = begun.takeoff.map_or(height_m, |start| start.to_m.z);
                let over_m = Vector3::new(position_m.x, position_m.y, height_m);
                let slow = scene.present.velocity_m_s.norm_squared() < STOPPED_M_S * STOPPED_M_S;
                let there = scene.is_at(&over_m, 1.0) && slow;
                let then = there.then_some((FlightMode::Land, leg.number));
                Progress { wish: Wish::fly(scene.to(over_m)), then, ..none }
            }
            Item::Return => Progress { then: Some((FlightMode::Return, leg.number)), ..none },
            Item::Speed(speed_m_s) => {
                self.speed_m_s = Some(speed_m_s);
                let wish = Wish { done: true, ..Wish::fly(self.hold.fly(scene)) };
                let at_m = self.hold.at_m;
                self.go_on(leg, wish, at_m, none)
            }
        }
    }

    /// Returns the item in progress, begun if it was another one.
    fn begin(
        &mut self,
        leg: &Leg,
        scene: &Scene<'_>,
        takeoff: impl FnOnce(&Scene<'_>) -> Option<Takeoff>,
    ) -> &mut Begun {
        if self.begun.is_some_and(|begun| begun.number != leg.number) {
            self.begun = None;
        }
        self.begun.get_or_insert_with(|| {
            let yaw_rad = match leg.item {
                Item::Waypoint { position_m, .. } => scene.towards(&position_m),
                _ => f32::NAN,
            };
            Begun { number: leg.number, yaw_rad, takeoff: takeoff(scene), stayed_s: 0.0 }
        })
    }

    /// Wants the next item, if this one is done; the mission is done with its last one.
    fn go_on(&mut self, leg: &Leg, wish: Wish, at_m: Option<Vector3<f32>>, none: Progress) -> Progress {
        let done = wish.done && leg.is_last;
        let reached = wish.done.then_some(leg.number);
        if wish.done {
            (self.begun, self.hold) = (None, Hold { at_m, ..Hold::default() });
            self.wanted = if leg.is_last { 0 } else { leg.number.saturating_add(1) };
        }
        Progress { wish: Wish { done, ..wish }, reached, ..none }
    }
}

/// Largest coordinate of a place that is flown to \[m\].
const PLACE_MAX_M: f32 = 9e4;

/// True if every number of an item can be flown; NaN only where that means something.
fn is_plausible(item: &Item) -> bool {
    let within = |value: f32| value.abs() <= PLACE_MAX_M;
    match item {
        Item::TakeOff { height_m } => within(*height_m),
        Item::Waypoint { position_m, yaw_rad, hold_s, within_m, .. } => {
            position_m.iter().all(|value| within(*value))
                && (yaw_rad.is_nan() || yaw_rad.abs() <= 1e3)
                && !hold_s.is_nan()
                && !within_m.is_nan()
        }
        Item::Land { position_m } => position_m.xy().iter().all(|value| value.is_nan() || within(*value)),
        Item::Return => true,
        Item::Speed(speed_m_s) => *speed_m_s > 0.0,
    }
}
