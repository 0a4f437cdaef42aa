//! Tests of the mission items.

use super::*;

fn leg(number: u16, item: Item) -> RequestedItem {
    RequestedItem { number, upload: 1, item, is_last: false }
}

fn waypoint(position_m: Vector3<f32>) -> Item {
    Item::Waypoint { position_m, yaw_rad: f32::NAN, hold_s: 0.0, within_m: 0.0, fly_through: false }
}

/// A fence of 1 km around home.
const NET: FailsafeSettings = FailsafeSettings { fence_radius_m: 1e3, ..FailsafeSettings::DEFAULT };

fn progress(mission: &mut MissionMemory, stage: &Stage, leg: &RequestedItem) -> mission::MissionOutput {
    stage.see(|inputs| mission.fly(Some(leg), inputs, &NET))
}

/// Returns a mission that requests this item.
fn wanting(number: u16) -> MissionMemory {
    let mut mission = MissionMemory::default();
    mission.resume(number);
    mission
}

/// A waypoint is reached within its own distance or the parameter's. The vehicle must be slow unless it flies through,
/// and leaves after the hold time.
#[test]
fn waypoints_are_reached_within_their_distance() {
    let place = here();
    let item = |within_m: f32, fly_through: bool, hold_s: f32| Item::Waypoint {
        position_m: place,
        yaw_rad: f32::NAN,
        hold_s,
        within_m,
        fly_through,
    };
    for (within_m, fly_through, off, speed, reached) in [
        (0.0, false, 0.69, 0.0, true),
        (0.0, false, 0.71, 0.0, false),
        (2.0, false, 1.99, 0.29, true),
        (2.0, false, 1.99, 0.31, false),
        (2.0, true, 1.99, 3.0, true),
        (2.0, true, 2.01, 0.0, false),
    ] {
        let stage = Stage::at(place + along(0, off)).moving(along(1, speed));
        let mut mission = wanting(3);
        let step = progress(&mut mission, &stage, &leg(3, item(within_m, fly_through, 0.0)));
        let case = (within_m, fly_through, off, speed);
        assert_eq!((step.reached, step.output.done, step.refused), (reached.then_some(3), false, false), "{case:?}");
        assert_eq!(mission.wanted, if reached { 4 } else { 3 }, "{case:?}");
        let aim = limited(&step.output);
        assert_eq!((aim.position_m, aim.speed_m_s), (place, 4.0));
        // The last item ends the mission, and the first is requested again.
        let mut mission = wanting(3);
        let last = RequestedItem { is_last: true, ..leg(3, item(within_m, fly_through, 0.0)) };
        assert_eq!(progress(&mut mission, &stage, &last).output.done, reached, "{case:?}");
        assert_eq!(mission.wanted, if reached { 0 } else { 3 }, "{case:?}");
    }
    // A vehicle that has reached a waypoint holds for the waypoint's time, even if it drifts away. At a fly-through
    // waypoint it does not hold.
    for (hold_s, fly_through, ticks) in [(0.05, false, 50), (0.05, true, 1), (0.0, false, 1)] {
        let mut mission = wanting(0);
        let one = leg(0, item(0.0, fly_through, hold_s));
        let mut stage = Stage::at(place);
        let steps = (1..200).find(|_| {
            let done = progress(&mut mission, &stage, &one).reached.is_some();
            stage = Stage::at(place + along(0, 5.0));
            done
        });
        assert!(steps.is_some_and(|steps| i32::abs(steps - ticks) <= 1), "{hold_s} s: {steps:?}");
    }
}

/// The heading is the waypoint's, or towards the waypoint from the start of the leg.
#[test]
fn the_heading_on_the_way_is_towards_the_waypoint() {
    let place = here() + Vector3::new(-30.0, 40.0, 0.0);
    let mut mission = wanting(0);
    let first = progress(&mut mission, &Stage::at(here()), &leg(0, waypoint(place)));
    assert!((limited(&first.output).yaw_rad - f32::atan2(40.0, -30.0)).abs() < 1e-5);
    let aside = Stage::at(here() + along(0, 60.0));
    let then = progress(&mut mission, &aside, &leg(0, waypoint(place)));
    assert_eq!(limited(&then.output).yaw_rad, limited(&first.output).yaw_rad, "as the leg began");
    // After a pause, the leg restarts.
    mission.pause();
    let anew = progress(&mut mission, &aside, &leg(0, waypoint(place)));
    assert!((limited(&anew.output).yaw_rad - f32::atan2(40.0, -90.0)).abs() < 1e-5);
    // Another item starts its own leg, too.
    mission.resume(5);
    let other = progress(&mut mission, &Stage::at(here()), &leg(5, waypoint(place)));
    assert_eq!(limited(&other.output).yaw_rad, limited(&first.output).yaw_rad);
    let stated = Item::Waypoint { position_m: place, yaw_rad: 0.3, hold_s: 0.0, within_m: 1.0, fly_through: true };
    assert_eq!(limited(&progress(&mut wanting(0), &aside, &leg(0, stated)).output).yaw_rad, 0.3);
}

/// From the ground, a waypoint begins with a climb to the take-off height, or up to the ceiling.
#[test]
fn a_waypoint_on_the_ground_begins_with_a_climb() {
    let ground = Vector3::new(2.0, 3.0, 1.0);
    for (ceiling_m, top) in [(f32::INFINITY, 1.0 + flying().takeoff_height_m), (2.5, 2.5), (0.5, 1.0)] {
        let mut mission = wanting(0);
        let one = leg(
            0,
            Item::Waypoint { position_m: ground, yaw_rad: f32::NAN, hold_s: 0.0, within_m: 100.0, fly_through: true },
        );
        let stage = Stage { airborne: false, ceiling_m, ..Stage::at(ground) };
        let begins = progress(&mut mission, &stage, &one);
        assert!(begins.output.lifts && begins.reached.is_none());
        assert!((limited(&begins.output).position_m - Vector3::new(2.0, 3.0, top)).norm() < 1e-6, "{begins:?}");
        // At the top the climb is done, and the next tick flies to the waypoint.
        let climbed = Stage { ceiling_m, ..Stage::at(Vector3::new(2.0, 3.0, top)) };
        let step = progress(&mut mission, &climbed, &one);
        assert_eq!((step.reached, step.output.done), (None, false));
        assert_eq!(progress(&mut mission, &climbed, &one).reached, Some(0));
    }
    // In the air there is no climb.
    let step = progress(&mut wanting(0), &Stage::at(ground), &leg(0, waypoint(ground + along(0, 50.0))));
    assert!(!step.output.lifts);
}

/// A take-off item climbs vertically to its height and is reached there. A vehicle that is already higher does not
/// climb.
#[test]
fn a_takeoff_item_climbs_to_its_height() {
    for (z, top) in [(1.0, 6.0), (9.0, 9.0)] {
        let mut mission = wanting(0);
        let stage = Stage { airborne: false, ..Stage::at(Vector3::new(2.0, 3.0, z)) };
        let item = Item::TakeOff { height_m: 6.0 };
        let step = progress(&mut mission, &stage, &leg(0, item));
        assert!(step.output.lifts && step.reached.is_none() && limited(&step.output).position_m.z == top, "{step:?}");
        let there = Stage::at(Vector3::new(2.0, 3.0, top));
        assert_eq!(progress(&mut mission, &there, &leg(0, item)).reached, Some(0));
        // The place is held until the next item arrives.
        let waits = progress(&mut mission, &Stage::at(here()), &leg(0, item));
        assert_eq!((waits.reached, limited(&waits.output).position_m), (None, Vector3::new(2.0, 3.0, top)));
    }
}

/// A landing item begins to land when the vehicle is slow and within 1 m of its place. Without a place, it begins at
/// once.
#[test]
fn a_landing_item_flies_over_its_place() {
    let place = Vector3::new(20.0, 30.0, -7.0);
    let over = |off: Vector3<f32>, speed: f32| {
        let mut mission = wanting(2);
        let item = leg(2, Item::Land { position_m: place });
        let begins = progress(&mut mission, &Stage::at(here()), &item);
        assert!(begins.then.is_none() && limited(&begins.output).position_m == Vector3::new(20.0, 30.0, here().z));
        let stage = Stage::at(Vector3::new(20.0, 30.0, here().z) + off).moving(along(0, speed));
        let step = progress(&mut mission, &stage, &item);
        assert_eq!(limited(&step.output).position_m, Vector3::new(20.0, 30.0, here().z), "the height stays");
        assert!(step.then.is_none_or(|then| then == (FlightMode::Land, 2)));
        step.then.is_some()
    };
    assert!(over(Vector3::zeros(), 0.0) && over(along(1, 0.99), 0.29));
    assert!(!over(along(1, 1.01), 0.0) && !over(along(2, 1.01), 0.0) && !over(Vector3::zeros(), 0.31));
    for missing in 0..2 {
        let mut position_m = place;
        position_m.iter_mut().nth(missing).into_iter().for_each(|value| *value = f32::NAN);
        let step = progress(&mut wanting(2), &Stage::at(here()), &leg(2, Item::Land { position_m }));
        assert_eq!(step.then, Some((FlightMode::Land, 2)));
    }
    let step = progress(&mut wanting(2), &Stage::at(here()), &leg(2, Item::Return));
    assert_eq!(step.then, Some((FlightMode::Return, 2)));
}

/// A speed item counts until another mission begins, up to the ordered speed. Another mission starts at its first item,
/// without the speed.
#[test]
fn a_speed_counts_until_the_mission_is_another() {
    let mut mission = wanting(0);
    let stands = Stage::at(here());
    let step = progress(&mut mission, &stands, &leg(0, Item::Speed(2.5)));
    assert_eq!((step.reached, mission.wanted, limited(&step.output).position_m), (Some(0), 1, here()));
    let far = waypoint(here() + along(0, 50.0));
    let speed = |mission: &mut MissionMemory, ordered: f32, leg: &RequestedItem| {
        limited(&progress(mission, &Stage { speed_m_s: ordered, ..stands }, leg).output).speed_m_s
    };
    assert_eq!(speed(&mut mission, f32::INFINITY, &leg(1, far)), 2.5);
    assert_eq!(speed(&mut mission, 2.0, &leg(1, far)), 2.0);
    let other = RequestedItem { upload: 2, ..leg(1, far) };
    let waits = progress(&mut mission, &stands, &other);
    assert_eq!((mission.wanted, waits.reached, waits.output.done), (0, None, false), "not the item that is wanted");
    assert_eq!(speed(&mut mission, f32::INFINITY, &RequestedItem { upload: 2, ..leg(0, far) }), 4.0);
}

/// Without the requested item the vehicle holds its place. Without a mission, the mode is done.
#[test]
fn without_its_item_a_mission_waits_or_is_over() {
    let mut mission = wanting(4);
    let waits = progress(&mut mission, &Stage::at(here()), &leg(3, waypoint(Vector3::zeros())));
    assert_eq!((waits.output.done, waits.reached, waits.refused, waits.then), (false, None, false, None));
    assert_eq!(limited(&waits.output).position_m, here());
    let over = Stage::at(here()).see(|inputs| mission.fly(None, inputs, &FailsafeSettings::DEFAULT));
    assert!(over.output.done && over.reached.is_none());
}

/// Items outside the fence or with implausible numbers are refused.
#[test]
fn items_that_cannot_be_flown_are_refused() {
    let v = Vector3::new;
    let nan = f32::NAN;
    let waypoint = |position_m, yaw_rad, hold_s, within_m| Item::Waypoint {
        position_m,
        yaw_rad,
        hold_s,
        within_m,
        fly_through: false,
    };
    let ok = v(100.0, 2.0, 3.0);
    let cases = [
        (waypoint(ok, nan, 0.0, 0.0), false),
        (waypoint(ok, 1e3, 0.0, 0.0), false),
        (waypoint(ok, -1.1e3, 0.0, 0.0), true),
        (waypoint(ok, 0.0, nan, 0.0), true),
        (waypoint(ok, 0.0, 0.0, nan), true),
        (waypoint(v(1.0, 9.1e4, 3.0), 0.0, 0.0, 0.0), true),
        (waypoint(v(1.0, 2.0, nan), 0.0, 0.0, 0.0), true),
        (waypoint(v(1e4, 0.0, 3.0), 0.0, 0.0, 0.0), true),
        (Item::TakeOff { height_m: 5.0 }, false),
        (Item::TakeOff { height_m: nan }, true),
        (Item::TakeOff { height_m: 9.1e4 }, true),
        (Item::TakeOffTo { position_m: ok }, false),
        (Item::TakeOffTo { position_m: v(1e4, 0.0, 3.0) }, true),
        (Item::TakeOffTo { position_m: v(nan, 0.0, 3.0) }, true),
        (Item::Land { position_m: v(nan, nan, nan) }, false),
        (Item::Land { position_m: v(5.0, 5.0, nan) }, false),
        (Item::Land { position_m: v(5.0, -9.1e4, 0.0) }, true),
        (Item::Land { position_m: v(1e4, 5.0, 0.0) }, true),
        (Item::Return, false),
        (Item::Speed(0.1), false),
        (Item::Speed(0.0), true),
        (Item::Speed(nan), true),
    ];
    for (item, refused) in cases {
        let mut mission = wanting(0);
        let step = progress(&mut mission, &Stage::at(here()), &leg(0, item));
        assert_eq!(step.refused, refused, "{item:?}");
        assert!(!refused || step.reached.is_none() && step.then.is_none() && mission.wanted == 0);
    }
    // Without a fence, places are limited by the range of setpoints only.
    for (y_m, flown) in [(8.9e4, Ok(())), (9.1e4, Err(OrderRefusal::OutOfRange))] {
        let far = waypoint(v(1.0, y_m, 3.0), 0.0, 0.0, 0.0);
        assert_eq!(far.check(&FailsafeSettings::DEFAULT, Some(&here())), flown);
        assert_eq!(far.check(&NET, Some(&here())), flown.and(Err(OrderRefusal::OutsideFence)));
        assert_eq!(far.check(&NET, None), flown, "nobody knows where the cylinder is");
    }
    // A take-off is over home: only its height can be outside.
    let low = FailsafeSettings { fence_height_m: 4.0, ..NET };
    for (height_m, refused) in [(4.4, false), (4.6, true)] {
        let take_off = Item::TakeOff { height_m };
        assert_eq!(take_off.check(&low, Some(&v(2e3, 0.0, 0.5))).is_err(), refused, "{height_m}");
    }
}
