//! Flies a mission, item by item. The communication code holds the items: the guidance requests each by its number.

use crate::course::{Hold, Takeoff};
use crate::failsafe::FailsafeSettings;
use crate::limiter::LimiterTarget;
use crate::mode::FlightMode;
use crate::mode_io::{ModeInputs, ModeOutput, Shaping};
use crate::orbit::{self, Orbit, OrbitProgress};
use crate::order::{Item, OrbitHeading, OrderRefusal, RequestedItem};
use crate::place::{is_place, is_within};
use afbc_control::math::{max, min, wrap_angle};
use afbc_types::ResetDelta;
use core::f32::consts::{PI, TAU};
use nalgebra::{Vector2, Vector3};

/// Speed of the setpoint below which it counts as stopped at a waypoint \[m/s\].
const STOPPED_M_S: f32 = 0.3;
/// Remaining angle \[rad\] and rate \[rad/s\] below which a turn is complete.
const TURNED_RAD: f32 = 0.03;
const TURNED_RAD_S: f32 = 0.05;
/// Largest angle by which the commanded heading leads the present heading \[rad\]. Below half a turn, since the limiter
/// takes the shorter way.
const LED_RAD: f32 = 2.0;

/// Memory of a mission in progress.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct MissionMemory {
    /// Number of the requested item.
    pub(crate) wanted: u16,
    /// Item in progress.
    begun: Option<ItemInProgress>,
    upload: Option<u16>,
    /// Speed limit set by the last speed item \[m/s\].
    speed_m_s: Option<f32>,
    hold: Hold,
    /// Region of interest that the vehicle heads for \[m\].
    looks_at_m: Option<Vector2<f32>>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct ItemInProgress {
    number: u16,
    /// Heading at a waypoint, or the remaining angle of a turn \[rad\].
    yaw_rad: f32,
    course: ItemCourse,
    stayed_s: f32,
}

/// Course of the item in progress.
#[derive(Clone, Copy, Debug, PartialEq)]
enum ItemCourse {
    Straight,
    Takeoff(Takeoff),
    Circle(OrbitProgress),
}

impl ItemCourse {
    fn takeoff(&self) -> Option<Takeoff> {
        match self {
            ItemCourse::Takeoff(takeoff) => Some(*takeoff),
            _ => None,
        }
    }
}

/// Output of a mission in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MissionOutput {
    pub(crate) output: ModeOutput,
    /// Number of an item completed in this tick.
    pub(crate) reached: Option<u16>,
    /// Mode with which an item ends the mission, and the item's number, which counts as done once that mode has landed.
    pub(crate) then: Option<(FlightMode, u16)>,
    /// True if the item lies outside the geofence or is not plausible.
    pub(crate) refused: bool,
}

impl MissionMemory {
    /// Continues with the item `number`.
    pub(crate) fn resume(&mut self, number: u16) {
        (self.wanted, self.begun) = (number, None);
    }

    /// Pauses the mission. The present item restarts when the mode is selected again.
    pub(crate) fn pause(&mut self) {
        (self.begun, self.hold) = (None, Hold::default());
    }

    /// Shifts a climb in progress by an estimator reset. Places of items do not move.
    pub(crate) fn shift(&mut self, reset: &ResetDelta) {
        if let Some(ItemInProgress { course: ItemCourse::Takeoff(takeoff), .. }) = &mut self.begun {
            takeoff.shift(reset);
        }
    }

    /// Restarts at the first item if `upload` is another mission than before. Returns whether it is.
    pub(crate) fn begins_anew(&mut self, upload: u16) -> bool {
        let other = self.upload.is_some_and(|before| before != upload);
        if other {
            *self = MissionMemory::default();
        }
        self.upload = Some(upload);
        other
    }

    /// Advances by a tick. Refuses items outside the cylinder of `failsafe`.
    pub(crate) fn fly(
        &mut self,
        leg: Option<&RequestedItem>,
        inputs: &ModeInputs<'_>,
        failsafe: &FailsafeSettings,
    ) -> MissionOutput {
        if let Some(leg) = leg {
            self.begins_anew(leg.upload);
        }
        let inputs =
            &ModeInputs { speed_m_s: min(inputs.speed_m_s, self.speed_m_s.unwrap_or(f32::INFINITY)), ..*inputs };
        let none = MissionOutput { output: ModeOutput::fly(inputs.stop()), reached: None, then: None, refused: false };
        let Some(leg) = leg.filter(|leg| leg.number == self.wanted) else {
            // Stay in place until the requested item arrives. The mission is over if there is none any more.
            let done = leg.is_none();
            return MissionOutput { output: ModeOutput { done, ..ModeOutput::fly(self.hold.fly(inputs)) }, ..none };
        };
        if leg.item.check(failsafe, Some(&inputs.home_m)).is_err() {
            return MissionOutput { refused: true, ..none };
        }
        let mut progress = self.fly_item(leg, inputs, none);
        if let (Some(at_m), Shaping::Limited(aim)) = (self.looks_at_m, &mut progress.output.shaping)
            && !matches!(leg.item, Item::Yaw { .. })
        {
            (aim.yaw_rad, aim.yaw_rate_rad_s) = (inputs.towards(&Vector3::new(at_m.x, at_m.y, 0.0)), f32::NAN);
        }
        progress
    }

    /// Flies an item that is plausible and inside the geofence.
    fn fly_item(&mut self, leg: &RequestedItem, inputs: &ModeInputs<'_>, none: MissionOutput) -> MissionOutput {
        match leg.item {
            Item::TakeOff { height_m } => self.take_off(leg, height_m, inputs, none),
            Item::TakeOffTo { position_m } => {
                let begun = self.begin(leg, inputs, |inputs| climb_to(position_m.z, inputs));
                if let Some(output) = begun.climb(inputs) {
                    return MissionOutput { output, ..none };
                }
                let done = inputs.is_at(&position_m, inputs.flying.within_m) && is_slow(inputs);
                let output = ModeOutput { done, ..ModeOutput::fly(inputs.to(position_m)) };
                self.go_on(leg, output, Some(position_m), none)
            }
            Item::Waypoint { position_m, yaw_rad, hold_s, within_m, fly_through } => {
                let begun = self.begin(leg, inputs, from_ground);
                if let Some(output) = begun.climb(inputs) {
                    return MissionOutput { output, ..none };
                }
                let yaw_rad = if yaw_rad.is_nan() { begun.yaw_rad } else { yaw_rad };
                let aim = LimiterTarget { yaw_rad, ..inputs.to(position_m) };
                let within_m = if within_m > 0.0 { within_m } else { inputs.flying.within_m };
                // The waypoint stays reached: wind that pushes the vehicle away does not restart the time.
                if begun.stayed_s > 0.0 || inputs.is_at(&position_m, within_m) && (fly_through || is_slow(inputs)) {
                    begun.stayed_s += inputs.dt_s;
                }
                let done = begun.stayed_s > 0.0 && (fly_through || begun.stayed_s >= hold_s);
                self.go_on(leg, ModeOutput { done, ..ModeOutput::fly(aim) }, Some(position_m), none)
            }
            Item::Land { position_m } => self.land(leg, &position_m, inputs, none),
            Item::Return => MissionOutput { then: Some((FlightMode::Return, leg.number)), ..none },
            Item::Speed(speed_m_s) => {
                self.speed_m_s = Some(speed_m_s);
                self.stay(leg, inputs, true, none)
            }
            Item::Wait(time_s) => {
                let begun = self.begin(leg, inputs, |_| ItemCourse::Straight);
                begun.stayed_s += inputs.dt_s;
                let done = begun.stayed_s >= time_s;
                self.stay(leg, inputs, done, none)
            }
            Item::Turns { centre_m, radius_m, turns } => self.circle(leg, centre_m, [radius_m, turns], inputs, none),
            Item::Yaw { yaw_rad, relative, direction } => {
                let to_turn_rad = to_turn(yaw_rad, relative, direction, inputs.present.yaw_rad);
                self.turn(leg, to_turn_rad, inputs, none)
            }
            Item::Look { at_m } => {
                self.looks_at_m = Some(at_m.xy()).filter(|at_m| !at_m.x.is_nan());
                self.stay(leg, inputs, true, none)
            }
            Item::Jump(number) => {
                let progress = self.stay(leg, inputs, true, none);
                if !leg.is_last {
                    self.wanted = number;
                }
                progress
            }
            // Unreachable: a cleared mission is not flown.
            Item::None => none,
        }
    }

    /// Climbs straight up to a height of the local frame.
    fn take_off(
        &mut self,
        leg: &RequestedItem,
        height_m: f32,
        inputs: &ModeInputs<'_>,
        none: MissionOutput,
    ) -> MissionOutput {
        let begun = self.begin(leg, inputs, |inputs| climb_to(height_m, inputs));
        let takeoff = begun.course.takeoff();
        let output = takeoff.map_or(none.output, |takeoff| takeoff.fly(inputs));
        let at_m = takeoff.map(|takeoff| takeoff.to_m);
        self.go_on(leg, output, at_m, none)
    }

    /// Flies over the place at the present height, then lands. Lands where the vehicle is if the place is NaN.
    fn land(
        &mut self,
        leg: &RequestedItem,
        position_m: &Vector3<f32>,
        inputs: &ModeInputs<'_>,
        none: MissionOutput,
    ) -> MissionOutput {
        let lands = Some((FlightMode::Land, leg.number));
        if is_here(position_m) {
            return MissionOutput { then: lands, ..none };
        }
        let height_m = inputs.present.position_m.z;
        // A take-off of zero height stores the height at which the item began.
        let begun = self.begin(leg, inputs, |inputs| ItemCourse::Takeoff(Takeoff::new(inputs, 0.0)));
        let height_m = begun.course.takeoff().map_or(height_m, |start| start.to_m.z);
        let over_m = Vector3::new(position_m.x, position_m.y, height_m);
        let then = lands.filter(|_| inputs.is_at(&over_m, 1.0) && is_slow(inputs));
        MissionOutput { output: ModeOutput::fly(inputs.to(over_m)), then, ..none }
    }

    /// Flies circles around a centre at the highest allowed speed; counter-clockwise if the radius is positive.
    fn circle(
        &mut self,
        leg: &RequestedItem,
        centre_m: Vector3<f32>,
        [radius_m, turns]: [f32; 2],
        inputs: &ModeInputs<'_>,
        none: MissionOutput,
    ) -> MissionOutput {
        let radius = if radius_m == 0.0 { orbit::ORBIT_RADIUS_M } else { radius_m.abs() };
        let fast_m_s = min(orbit::speed_max_m_s(inputs.limits, radius), inputs.stop().speed_m_s);
        let begun = self.begin(leg, inputs, from_ground);
        if let Some(output) = begun.climb(inputs) {
            return MissionOutput { output, ..none };
        }
        let round = if let ItemCourse::Circle(round) = begun.course { round } else { OrbitProgress::default() };
        let mut orbit = Orbit {
            centre_m,
            radius_m: radius,
            speed_m_s: if radius_m > 0.0 { fast_m_s } else { -fast_m_s },
            heading: OrbitHeading::Centre,
            angle_rad: turns * TAU,
            round,
        };
        let output = orbit.fly(inputs);
        begun.course = ItemCourse::Circle(orbit.round);
        self.go_on(leg, output, None, none)
    }

    /// Turns by an angle, counted from the start of the item.
    fn turn(
        &mut self,
        leg: &RequestedItem,
        to_turn_rad: f32,
        inputs: &ModeInputs<'_>,
        none: MissionOutput,
    ) -> MissionOutput {
        let first = self.begun.is_none_or(|begun| begun.number != leg.number);
        let present = inputs.present;
        let begun = self.begin(leg, inputs, |_| ItemCourse::Straight);
        // The remaining turn is reduced by the setpoint's own rotation, because a difference of headings cannot show
        // more than half a turn.
        begun.yaw_rad = if first { to_turn_rad } else { begun.yaw_rad - present.yaw_rate_rad_s * inputs.dt_s };
        let left_rad = begun.yaw_rad;
        let turned = left_rad.abs() < TURNED_RAD && present.yaw_rate_rad_s.abs() < TURNED_RAD_S;
        // On the ground the vehicle cannot turn, and the item would never finish.
        let mut progress = self.stay(leg, inputs, turned || !inputs.airborne, none);
        if let Shaping::Limited(aim) = &mut progress.output.shaping {
            aim.yaw_rad = wrap_angle(present.yaw_rad + min(max(left_rad, -LED_RAD), LED_RAD));
        }
        progress
    }

    /// Holds the present place until `done`.
    fn stay(&mut self, leg: &RequestedItem, inputs: &ModeInputs<'_>, done: bool, none: MissionOutput) -> MissionOutput {
        let output = ModeOutput { done, ..ModeOutput::fly(self.hold.fly(inputs)) };
        let at_m = self.hold.at_m;
        self.go_on(leg, output, at_m, none)
    }

    /// Returns the item in progress. Starts `leg` if another item was in progress.
    fn begin(
        &mut self,
        leg: &RequestedItem,
        inputs: &ModeInputs<'_>,
        course: impl FnOnce(&ModeInputs<'_>) -> ItemCourse,
    ) -> &mut ItemInProgress {
        if self.begun.is_some_and(|begun| begun.number != leg.number) {
            self.begun = None;
        }
        self.begun.get_or_insert_with(|| {
            let yaw_rad = match leg.item {
                Item::Waypoint { position_m, .. } => inputs.towards(&position_m),
                _ => f32::NAN,
            };
            ItemInProgress { number: leg.number, yaw_rad, course: course(inputs), stayed_s: 0.0 }
        })
    }

    /// Requests the next item if the present item is done. The mission is done with its last item.
    fn go_on(
        &mut self,
        leg: &RequestedItem,
        output: ModeOutput,
        at_m: Option<Vector3<f32>>,
        none: MissionOutput,
    ) -> MissionOutput {
        let done = output.done && leg.is_last;
        let reached = output.done.then_some(leg.number);
        if output.done {
            (self.begun, self.hold) = (None, Hold { at_m, ..Hold::default() });
            self.wanted = if leg.is_last { 0 } else { leg.number.saturating_add(1) };
        }
        MissionOutput { output: ModeOutput { done, ..output }, reached, ..none }
    }
}

impl ItemInProgress {
    /// Climbs, if the item began on the ground. Returns `None` once the climb is done.
    fn climb(&mut self, inputs: &ModeInputs<'_>) -> Option<ModeOutput> {
        let output = self.course.takeoff()?.fly(inputs);
        if output.done {
            self.course = ItemCourse::Straight;
        }
        Some(ModeOutput { done: false, ..output })
    }
}

/// Returns a straight course, preceded by a climb if the vehicle is on the ground.
fn from_ground(inputs: &ModeInputs<'_>) -> ItemCourse {
    if inputs.airborne {
        return ItemCourse::Straight;
    }
    // This take-off, which no item asks for, must not leave the geofence.
    let room_m = max(inputs.ceiling_m - inputs.present.position_m.z, 0.0);
    ItemCourse::Takeoff(Takeoff::new(inputs, min(inputs.flying.takeoff_height_m, room_m)))
}

/// Returns a climb straight up to a height of the local frame, or of zero height if the vehicle is higher.
fn climb_to(height_m: f32, inputs: &ModeInputs<'_>) -> ItemCourse {
    ItemCourse::Takeoff(Takeoff::new(inputs, max(height_m - inputs.present.position_m.z, 0.0)))
}

/// Returns the angle to turn from `present_rad`, positive to the left \[rad\].
fn to_turn(yaw_rad: f32, relative: bool, direction: i8, present_rad: f32) -> f32 {
    if relative {
        return match direction {
            0 => yaw_rad,
            _ => yaw_rad.abs() * f32::from(direction.signum()),
        };
    }
    let shorter_rad = wrap_angle(yaw_rad - present_rad);
    // Half a degree in the wrong direction must not become a whole turn.
    match direction {
        1.. if shorter_rad < -PI / 360.0 => shorter_rad + TAU,
        ..=-1 if shorter_rad > PI / 360.0 => shorter_rad - TAU,
        _ => shorter_rad,
    }
}

/// True if the setpoint has stopped.
fn is_slow(inputs: &ModeInputs<'_>) -> bool {
    inputs.present.velocity_m_s.norm_squared() < STOPPED_M_S * STOPPED_M_S
}

/// True if the place is NaN, which means "where the vehicle is".
fn is_here(position_m: &Vector3<f32>) -> bool {
    position_m.x.is_nan() || position_m.y.is_nan()
}

impl Item {
    /// Checks that the item can be flown: its numbers are plausible and, if home is known, its place is inside the
    /// cylinder of `failsafe` around home.
    ///
    /// # Errors
    /// [`OrderRefusal::OutOfRange`] or [`OrderRefusal::OutsideFence`].
    pub fn check(&self, failsafe: &FailsafeSettings, home_m: Option<&Vector3<f32>>) -> Result<(), OrderRefusal> {
        if !self.is_plausible() {
            return Err(OrderRefusal::OutOfRange);
        }
        let inside = |home_m| self.place(home_m).is_none_or(|place_m| failsafe.encloses(home_m, &place_m, 0.0));
        if home_m.is_none_or(inside) { Ok(()) } else { Err(OrderRefusal::OutsideFence) }
    }

    /// Returns the place that the item flies to \[m\], if it has one.
    fn place(&self, home_m: &Vector3<f32>) -> Option<Vector3<f32>> {
        match *self {
            Item::TakeOff { height_m } => Some(Vector3::new(home_m.x, home_m.y, height_m)),
            Item::TakeOffTo { position_m } | Item::Waypoint { position_m, .. } => Some(position_m),
            Item::Land { position_m } => {
                (!is_here(&position_m)).then_some(Vector3::new(position_m.x, position_m.y, home_m.z))
            }
            Item::Turns { centre_m, .. } => Some(centre_m),
            _ => None,
        }
    }

    /// True if every number can be flown. NaN is accepted where it has a meaning.
    fn is_plausible(&self) -> bool {
        let is_whole = |place_m: &Vector3<f32>| place_m.iter().all(|value| is_within(*value));
        // The height of a landing or of a region of interest is not used.
        let is_flat = |place_m: &Vector3<f32>| is_place(&Vector3::new(place_m.x, place_m.y, f32::NAN));
        match self {
            Item::TakeOff { height_m } => is_within(*height_m),
            Item::TakeOffTo { position_m } => is_whole(position_m),
            Item::Waypoint { position_m, yaw_rad, hold_s, within_m, .. } => {
                is_whole(position_m)
                    && (yaw_rad.is_nan() || yaw_rad.abs() <= 1e3)
                    && !hold_s.is_nan()
                    && !within_m.is_nan()
            }
            Item::Land { position_m } => is_flat(position_m),
            Item::Return | Item::Jump(_) | Item::None => true,
            Item::Speed(speed_m_s) => *speed_m_s > 0.0,
            Item::Wait(time_s) => !time_s.is_nan(),
            Item::Turns { centre_m, radius_m, turns } => {
                let round = *radius_m == 0.0 || orbit::RADIUS_M.contains(&radius_m.abs());
                is_whole(centre_m) && round && *turns >= 0.0
            }
            Item::Yaw { yaw_rad, .. } => yaw_rad.abs() <= 1e3,
            Item::Look { at_m } => is_flat(at_m),
        }
    }
}
