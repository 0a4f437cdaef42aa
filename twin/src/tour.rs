//! A mission of two minutes, uploaded over the link: a square with changes of height and speed, and a place to stay at.

use crate::check::check;
use afbc_ground::UploadEnd;
use afbc_link::{MavCmd, MissionItem};
use std::error::Error;

/// MAV_FRAME_LOCAL_NED, whose origin is where the vehicle stood.
const LOCAL_NED: u8 = 1;
const WAYPOINT: u16 = MavCmd::MAV_CMD_NAV_WAYPOINT as u16;
const LOITER_TIME: u16 = MavCmd::MAV_CMD_NAV_LOITER_TIME as u16;
const LAND: u16 = MavCmd::MAV_CMD_NAV_LAND as u16;
const TAKE_OFF: u16 = MavCmd::MAV_CMD_NAV_TAKEOFF as u16;
const CHANGE_SPEED: u16 = MavCmd::MAV_CMD_DO_CHANGE_SPEED as u16;

/// What is flown.
#[derive(Clone, Copy, Debug)]
enum Leg {
    /// Climbs to this height [m].
    TakeOff(f32),
    /// Flies at most so fast from here on [m/s].
    Speed(f32),
    /// Flies to a place, north, west and up [m], and stays there [s].
    To([f32; 3], f32),
    /// The same as a place to loiter at.
    Loiter([f32; 3], f32),
    /// Lands there, north and west [m].
    Land([f32; 2]),
}

const LEGS: [Leg; 11] = [
    Leg::TakeOff(4.0),
    Leg::Speed(2.0),
    Leg::To([15.0, 0.0, 5.0], 0.0),
    Leg::To([15.0, 15.0, 8.0], 0.0),
    Leg::Loiter([0.0, 15.0, 8.0], 20.0),
    Leg::Speed(3.0),
    Leg::To([-15.0, 15.0, 5.0], 5.0),
    Leg::To([-15.0, -15.0, 5.0], 0.0),
    Leg::To([15.0, -15.0, 10.0], 5.0),
    Leg::To([0.0, 0.0, 5.0], 0.0),
    Leg::Land([0.0, 0.0]),
];

/// What the vehicle may be off, by the truth, when it says that it has reached a place [m]: the distance at which it
/// counts as reached, and what position and its frame are off, of which the first fix is the origin.
const OFF_M: f64 = 4.0;

impl Leg {
    /// Returns the leg as it crosses the wire.
    fn item(self, number: u16) -> MissionItem {
        let (command, [north, west, up], parameters) = match self {
            Leg::TakeOff(up) => (TAKE_OFF, [0.0, 0.0, up], [0.0; 4]),
            // Over ground, and no change of the throttle.
            Leg::Speed(speed) => (CHANGE_SPEED, [0.0; 3], [1.0, speed, -1.0, 0.0]),
            // No heading of its own: not a number.
            Leg::To(place, stay) => (WAYPOINT, place, [stay, 0.0, 0.0, f32::NAN]),
            Leg::Loiter(place, stay) => (LOITER_TIME, place, [stay, 0.0, 0.0, f32::NAN]),
            Leg::Land([north, west]) => (LAND, [north, west, 0.0], [0.0; 4]),
        };
        // MISSION_ITEM_INT has local places in 1e-4 m.
        let [x, y] = [north, -west].map(|metres| (metres * 1e4) as i32);
        let goes_on = true;
        MissionItem { number, command, frame: LOCAL_NED, goes_on, parameters, x, y, z: -up, ..MissionItem::default() }
    }

    /// Returns how far it is from a place to where this leg ends, if it has a place [m].
    fn off_m(self, [x, y, z]: [f64; 3]) -> Option<f64> {
        let off_m = |place: [f32; 3]| {
            let [north, west, up] = place.map(f64::from);
            (x - north).hypot(y - west).hypot(z - up)
        };
        match self {
            Leg::TakeOff(up) => Some((z - f64::from(up)).abs()),
            Leg::Speed(_) => None,
            Leg::To(place, _) | Leg::Loiter(place, _) => Some(off_m(place)),
            Leg::Land([north, west]) => Some(off_m([north, west, 0.0])),
        }
    }
}

/// A mission on its way.
#[derive(Debug, Default)]
pub struct Tour {
    /// How the upload has ended.
    upload: Option<UploadEnd>,
    /// Numbers of the items that are done, when [ms], and how far from there the vehicle was [m].
    reached: Vec<(u16, u64, Option<f64>)>,
}

impl Tour {
    /// Not aboard yet.
    pub fn new() -> Self {
        Tour::default()
    }

    /// Returns the mission.
    pub fn items() -> Vec<MissionItem> {
        (0..).zip(LEGS).map(|(number, leg)| leg.item(number)).collect()
    }

    /// True if the vehicle has all of it.
    pub fn is_aboard(&self) -> bool {
        self.upload == Some(UploadEnd::Accepted)
    }

    /// The upload has ended like this.
    pub fn end_upload(&mut self, end: UploadEnd) {
        self.upload = Some(end);
    }

    /// True if an item is done.
    pub fn has_begun(&self) -> bool {
        !self.reached.is_empty()
    }

    /// The vehicle says that it has reached an item, at this place [m].
    pub fn reach(&mut self, number: u16, now_ms: u64, position_m: [f64; 3]) {
        let off_m = LEGS.get(usize::from(number)).and_then(|leg| leg.off_m(position_m));
        self.reached.push((number, now_ms, off_m));
    }

    /// Says how it went.
    pub fn told(&self) -> String {
        let places: Vec<_> = self.reached.iter().filter_map(|(_, _, off_m)| *off_m).collect();
        let furthest_m = places.iter().copied().fold(0.0, f64::max);
        for (number, at_ms, off_m) in &self.reached {
            let off = off_m.map_or(String::new(), |off_m| format!(", off by {off_m:.2} m"));
            println!("{:7.3} s: item {number} of {} reached{off}", *at_ms as f64 * 1e-3, LEGS.len());
        }
        format!("{} items of {} reached, off by {furthest_m:.2} m at most", self.reached.len(), LEGS.len())
    }

    /// Fails if an item was not reached, or out of turn, or far from its place.
    pub fn verdict(&self) -> Result<(), Box<dyn Error>> {
        check(self.is_aboard(), &format!("the mission is accepted: {:?}", self.upload))?;
        let numbers = self.reached.iter().map(|(number, ..)| *number);
        check(numbers.eq(0..LEGS.len() as u16), "every item is reached, one after another")?;
        let are_near = self.reached.iter().all(|(_, _, off_m)| off_m.is_none_or(|off_m| off_m < OFF_M));
        check(are_near, &format!("places are reached within {OFF_M} m"))
    }
}
