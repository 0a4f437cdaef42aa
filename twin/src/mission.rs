//! Mission of two minutes, uploaded over the link: a square with changes of height and speed, and a place to loiter.

use crate::check::check;
use afbc_ground::UploadEnd;
use afbc_mavlink::{MavCmd, MissionItem};
use std::error::Error;

/// MAV_FRAME_LOCAL_NED, whose origin is the vehicle's start.
const LOCAL_NED: u8 = 1;
const WAYPOINT: u16 = MavCmd::MAV_CMD_NAV_WAYPOINT as u16;
const LOITER_TIME: u16 = MavCmd::MAV_CMD_NAV_LOITER_TIME as u16;
const LAND: u16 = MavCmd::MAV_CMD_NAV_LAND as u16;
const TAKE_OFF: u16 = MavCmd::MAV_CMD_NAV_TAKEOFF as u16;
const CHANGE_SPEED: u16 = MavCmd::MAV_CMD_DO_CHANGE_SPEED as u16;

/// Item of the mission.
#[derive(Clone, Copy, Debug)]
enum MissionLeg {
    /// Take-off to this height [m].
    TakeOff(f32),
    /// Largest speed from here on [m/s].
    Speed(f32),
    /// Flight to a waypoint, north, west and up [m], and time to stay there [s].
    To([f32; 3], f32),
    /// Flight to a place to loiter, north, west and up [m], and duration [s].
    Loiter([f32; 3], f32),
    /// Landing at a place, north and west [m].
    Land([f32; 2]),
}

const LEGS: [MissionLeg; 11] = [
    MissionLeg::TakeOff(4.0),
    MissionLeg::Speed(2.0),
    MissionLeg::To([15.0, 0.0, 5.0], 0.0),
    MissionLeg::To([15.0, 15.0, 8.0], 0.0),
    MissionLeg::Loiter([0.0, 15.0, 8.0], 20.0),
    MissionLeg::Speed(3.0),
    MissionLeg::To([-15.0, 15.0, 5.0], 5.0),
    MissionLeg::To([-15.0, -15.0, 5.0], 0.0),
    MissionLeg::To([15.0, -15.0, 10.0], 5.0),
    MissionLeg::To([0.0, 0.0, 5.0], 0.0),
    MissionLeg::Land([0.0, 0.0]),
];

/// Largest distance of the true position from a place that the vehicle reports as reached [m]. It allows for the
/// acceptance radius, for the position error, and for the error of the first fix, which is the origin of the frame.
const OFF_M: f64 = 4.0;

impl MissionLeg {
    /// Returns the leg as a MAVLink mission item.
    fn item(self, number: u16) -> MissionItem {
        let (command, [north, west, up], parameters) = match self {
            MissionLeg::TakeOff(up) => (TAKE_OFF, [0.0, 0.0, up], [0.0; 4]),
            // The item sets the ground speed and leaves the throttle unchanged.
            MissionLeg::Speed(speed) => (CHANGE_SPEED, [0.0; 3], [1.0, speed, -1.0, 0.0]),
            // NaN means that the item has no heading of its own.
            MissionLeg::To(place, stay) => (WAYPOINT, place, [stay, 0.0, 0.0, f32::NAN]),
            MissionLeg::Loiter(place, stay) => (LOITER_TIME, place, [stay, 0.0, 0.0, f32::NAN]),
            MissionLeg::Land([north, west]) => (LAND, [north, west, 0.0], [0.0; 4]),
        };
        // MISSION_ITEM_INT has local positions in 1e-4 m.
        let [x, y] = [north, -west].map(|metres| (metres * 1e4) as i32);
        let goes_on = true;
        MissionItem { number, command, frame: LOCAL_NED, goes_on, parameters, x, y, z: -up, ..MissionItem::default() }
    }

    /// Returns the distance from a position to the end of this leg, if the leg has one [m].
    fn off_m(self, [x, y, z]: [f64; 3]) -> Option<f64> {
        let off_m = |place: [f32; 3]| {
            let [north, west, up] = place.map(f64::from);
            (x - north).hypot(y - west).hypot(z - up)
        };
        match self {
            MissionLeg::TakeOff(up) => Some((z - f64::from(up)).abs()),
            MissionLeg::Speed(_) => None,
            MissionLeg::To(place, _) | MissionLeg::Loiter(place, _) => Some(off_m(place)),
            MissionLeg::Land([north, west]) => Some(off_m([north, west, 0.0])),
        }
    }
}

/// Progress of the mission.
#[derive(Debug, Default)]
pub struct MissionProgress {
    /// Result of the upload.
    upload: Option<UploadEnd>,
    /// Reached items: number, time [ms], and distance of the vehicle from the item's place [m].
    reached: Vec<(u16, u64, Option<f64>)>,
}

impl MissionProgress {
    /// Creates a mission that is not uploaded yet.
    pub fn new() -> Self {
        MissionProgress::default()
    }

    /// Returns the mission's items.
    pub fn items() -> Vec<MissionItem> {
        (0..).zip(LEGS).map(|(number, leg)| leg.item(number)).collect()
    }

    /// True if the vehicle has accepted the mission.
    pub fn is_aboard(&self) -> bool {
        self.upload == Some(UploadEnd::Accepted)
    }

    /// Stores the result of the upload.
    pub fn end_upload(&mut self, end: UploadEnd) {
        self.upload = Some(end);
    }

    /// True if an item has been reached.
    pub fn has_begun(&self) -> bool {
        !self.reached.is_empty()
    }

    /// Stores that the vehicle reported an item as reached, at this true position [m].
    pub fn reach(&mut self, number: u16, now_ms: u64, position_m: [f64; 3]) {
        let off_m = LEGS.get(usize::from(number)).and_then(|leg| leg.off_m(position_m));
        self.reached.push((number, now_ms, off_m));
    }

    /// Prints the reached items, and returns a summary.
    pub fn summary(&self) -> String {
        let places: Vec<_> = self.reached.iter().filter_map(|(_, _, off_m)| *off_m).collect();
        let furthest_m = places.iter().copied().fold(0.0, f64::max);
        for (number, at_ms, off_m) in &self.reached {
            let off = off_m.map_or(String::new(), |off_m| format!(", off by {off_m:.2} m"));
            println!("{:7.3} s: item {number} of {} reached{off}", *at_ms as f64 * 1e-3, LEGS.len());
        }
        format!("{} of {} mission items reached, at most {furthest_m:.2} m off", self.reached.len(), LEGS.len())
    }

    /// Fails if an item was not reached, reached out of order, or too far from its place.
    pub fn verdict(&self) -> Result<(), Box<dyn Error>> {
        check(self.is_aboard(), &format!("the mission is accepted: {:?}", self.upload))?;
        let numbers = self.reached.iter().map(|(number, ..)| *number);
        check(numbers.eq(0..LEGS.len() as u16), "every item is reached, one after another")?;
        let are_near = self.reached.iter().all(|(_, _, off_m)| off_m.is_none_or(|off_m| off_m < OFF_M));
        check(are_near, &format!("waypoints are reached within {OFF_M} m"))
    }
}
