//! The tick of the guidance with a vehicle that is where the test puts it: orders with their bounds, times, home, and
//! gaps. What ends is in `endings.rs`.
#![allow(clippy::unwrap_used, reason = "tests")]

mod desk;

use afbc_flight_core::{Mode, Request, Stamped};
use afbc_guidance::*;
use afbc_types::State;
use desk::*;
use nalgebra::Vector3;

/// Numbers in their ranges only, to the ends of these.
#[test]
fn orders_take_numbers_within_their_ranges() {
    let desk = Desk::flying(Settings::DEFAULT);
    let mut ground = Desk::new(Settings::DEFAULT);
    ground.run(1100);
    let disarmed = ground.clone();
    ground.core = Mode::Flying;
    ground.run(10);
    for (height, expected) in [
        (0.0, Err(Declined::OutOfRange)),
        (-1.0, Err(Declined::OutOfRange)),
        (NAN, Err(Declined::OutOfRange)),
        (0.1, Ok(())),
        (1000.0, Ok(())),
        (1000.1, Err(Declined::OutOfRange)),
    ] {
        assert_eq!(ground.would(Order::TakeOff(Some(height))), expected, "{height} m");
        let unarmed = expected.and(Err(Declined::NotArmed));
        assert_eq!(disarmed.would(Order::TakeOff(Some(height))), unarmed, "{height} m");
    }
    assert_eq!(desk.would(Order::TakeOff(None)), Err(Declined::InFlight));
    for (speed, ok) in [(0.0, false), (-1.0, false), (NAN, false), (0.1, true), (1e3, true), (1001.0, false)] {
        let expected = if ok { Ok(()) } else { Err(Declined::OutOfRange) };
        assert_eq!(desk.would(Order::Speed(speed)), expected, "{speed} m/s");
        let order = Order::GoTo { position_m: Vector3::zeros(), yaw_rad: NAN, speed_m_s: Some(speed) };
        assert_eq!(desk.would(order), expected, "{speed} m/s");
    }
    for (yaw_rad, ok) in [(NAN, true), (1e3, true), (-1e3, true), (1001.0, false), (-1001.0, false)] {
        let order = Order::GoTo { position_m: Vector3::zeros(), yaw_rad, speed_m_s: None };
        assert_eq!(desk.would(order), if ok { Ok(()) } else { Err(Declined::OutOfRange) }, "{yaw_rad} rad");
    }
    for (value, place, home) in
        [(9e4, true, true), (-9e4, true, true), (9.01e4, false, false), (-9.01e4, false, false), (NAN, true, false)]
    {
        for axis in 0..3 {
            let position_m = Vector3::from_fn(|row, _| if row == axis { value } else { 1.0 });
            let of = |ok: bool| if ok { Ok(()) } else { Err(Declined::OutOfRange) };
            assert_eq!(desk.would(go(position_m.x, position_m.y, position_m.z)), of(place), "{position_m:?}");
            assert_eq!(desk.would(Order::Home(Some(position_m))), of(home), "{position_m:?}");
        }
    }
    assert_eq!(disarmed.would(go(0.0, 0.0, 5.0)), Err(Declined::NotArmed));
    assert_eq!(ground.would(go(0.0, 0.0, 5.0)), Err(Declined::OnGround));
    assert_eq!(desk.would(Order::Resume(3)), Err(Declined::NoMission));
    assert_eq!(Desk { state: None, ..desk.clone() }.order(Order::Home(None)), Err(Declined::NoPosition));
}

/// A take-off begins where the vehicle stands, and what would leave the fence is declined.
#[test]
fn takeoffs_end_inside_the_fence() {
    let mut desk = Desk::new(fenced(20.0, 6.0));
    desk.run(1100);
    desk.core = Mode::Flying;
    desk.run(10);
    assert_eq!(desk.would(Order::TakeOff(Some(5.9))), Ok(()));
    assert_eq!(desk.would(Order::TakeOff(Some(6.1))), Err(Declined::OutsideFence));
    // Home is at 3 m; from 1 m more, less is left.
    desk.state = Some(at(1.0, 2.0, 4.0));
    desk.run(10);
    assert_eq!(desk.would(Order::TakeOff(Some(4.9))), Ok(()));
    assert_eq!(desk.would(Order::TakeOff(Some(5.1))), Err(Declined::OutsideFence));
    assert_eq!(desk.would(Order::Select(FlightMode::Takeoff)), Ok(()), "2.5 m");
    desk.state = Some(at(1.0, 2.0, 7.0));
    desk.run(10);
    assert_eq!(desk.would(Order::Select(FlightMode::Takeoff)), Err(Declined::OutsideFence));
    assert_eq!(desk.would(Order::Select(FlightMode::Hold)), Ok(()), "no climb");
    assert_eq!(desk.order(Order::TakeOff(Some(1.5))), Ok(()));
    desk.airborne = true;
    desk.run(12_000);
    assert_eq!((desk.guidance.mode(), desk.place()), (FlightMode::Hold, Vector3::new(1.0, 2.0, 8.5)));
}

/// Coordinates that are not given are kept: those of the place that is held, or where the setpoint is.
#[test]
fn a_place_keeps_what_is_not_given() {
    let mut desk = Desk::flying(Settings::DEFAULT);
    assert_eq!(desk.order(go(NAN, 30.0, NAN)), Ok(()));
    desk.run(500);
    assert_eq!(desk.order(go(NAN, NAN, 9.0)), Ok(()));
    desk.run(20_000);
    assert_eq!(desk.place(), Vector3::new(1.0, 30.0, 9.0), "the place that it was on its way to");
    // Not held any more once another mode has flown.
    desk.orders.target = None;
    assert_eq!(desk.select(FlightMode::Land), Ok(()));
    desk.run(1500);
    let here = desk.setpoint().position_m;
    assert_eq!(desk.order(go(NAN, NAN, 12.0)), Ok(()));
    desk.run(15_000);
    assert!((desk.place() - Vector3::new(here.x, here.y, 12.0)).norm() < 1e-3, "{:?}", desk.place());
    // Heading and speed of the order.
    let mut desk = Desk::flying(Settings::DEFAULT);
    let order = Order::GoTo { position_m: Vector3::new(60.0, 2.0, 8.0), yaw_rad: 0.7, speed_m_s: Some(2.0) };
    assert_eq!(desk.order(order), Ok(()));
    desk.run(6000);
    let setpoint = desk.setpoint();
    assert!((setpoint.yaw_rad - 0.7).abs() < 2e-3 && (setpoint.velocity_m_s.x - 1.96).abs() < 0.03, "{setpoint:?}");
    // A slower speed counts until the mode changes.
    assert_eq!(desk.order(Order::Speed(1.0)), Ok(()));
    desk.run(4000);
    assert!((desk.setpoint().velocity_m_s.x - 0.98).abs() < 0.02);
    assert_eq!(desk.order(go(90.0, 2.0, 8.0)), Ok(()));
    desk.run(6000);
    assert!(desk.setpoint().velocity_m_s.x > 4.5, "the cruise speed again");
}

/// The same mode again changes nothing, but for a hold: it holds where it is now.
#[test]
fn selecting_a_hold_again_stops() {
    let mut desk = Desk::flying(Settings::DEFAULT);
    desk.order(go(40.0, 2.0, 8.0)).unwrap();
    desk.run(3000);
    assert_eq!(desk.select(FlightMode::Hold), Ok(()));
    desk.run(8000);
    assert!(desk.place().x < 25.0, "{:?}", desk.place());
    assert_eq!(desk.said, [], "no other mode");
    // A failsafe's return stays one.
    let net = Net { station_lost_s: 1.0, station_action: 2.0, ..Net::DEFAULT };
    let mut desk = Desk::flying(Settings { net, ..Settings::DEFAULT });
    desk.orders.heard_us = Some(desk.now_us);
    let guided = desk.run(1100);
    assert_eq!((guided.mode, guided.failsafe), (FlightMode::Return, Some(Cause::Station)));
    assert_eq!(desk.select(FlightMode::Return), Ok(()));
    assert_eq!(desk.tick().failsafe, Some(Cause::Station));
    assert_eq!(desk.select(FlightMode::Land), Ok(()));
    assert_eq!(desk.tick().failsafe, None, "ordered");
}

/// Home is where it was first at rest for a second, and where it is armed, unless home was ordered.
#[test]
fn home_is_where_it_rests_and_is_armed() {
    let mut desk = Desk::new(Settings::DEFAULT);
    assert_eq!(desk.run(990).home_m, None);
    assert_eq!(desk.run(20).home_m, Some(Vector3::new(1.0, 2.0, 3.0)));
    desk.state = Some(at(7.0, 8.0, 9.0));
    assert_eq!(desk.run(3000).home_m, Some(Vector3::new(1.0, 2.0, 3.0)), "carried elsewhere");
    let mut ordered = desk.clone();
    desk.core = Mode::Flying;
    assert_eq!(desk.tick().home_m, Some(Vector3::new(7.0, 8.0, 9.0)), "armed there");
    desk.state = Some(at(1.0, 1.0, 1.0));
    assert_eq!(desk.run(2000).home_m, Some(Vector3::new(7.0, 8.0, 9.0)), "in flight");
    let place = Vector3::new(-5.0, 6.0, 2.0);
    assert_eq!(ordered.order(Order::Home(Some(place))), Ok(()));
    ordered.core = Mode::Flying;
    assert_eq!(ordered.run(10).home_m, Some(place));
    assert_eq!(ordered.order(Order::Home(None)), Ok(()));
    assert_eq!(ordered.tick().home_m, Some(Vector3::new(7.0, 8.0, 9.0)));
    // Never at rest: none before it is armed.
    let mut desk = Desk::new(Settings::DEFAULT);
    desk.state = Some(State { velocity_m_s: Vector3::new(1.0, 0.0, 0.0), ..at(1.0, 2.0, 3.0) });
    assert_eq!(desk.run(3000).home_m, None);
    desk.core = Mode::Flying;
    assert!(desk.tick().home_m.is_some());
}

/// Time steps that make no sense count as a millisecond, and long ones are cut.
#[test]
fn strange_time_steps_are_replaced() {
    let asks_after = |dt_s: f32| {
        let flying = Flying { disarm_before_s: 1.0, ..Flying::DEFAULT };
        let mut desk = Desk { dt_s, ..Desk::new(Settings { flying, ..Settings::DEFAULT }) };
        desk.core = Mode::Flying;
        (1..20_000_i32).find(|_| desk.tick().request == Some(Request::Disarm)).unwrap()
    };
    for (dt_s, ticks) in
        [(1e-3, 1000), (0.01, 100), (0.02, 50), (5.0, 50), (1e-6, 10_000), (0.0, 1000), (-0.01, 1000), (NAN, 1000)]
    {
        let found = asks_after(dt_s);
        assert!((found - ticks).abs() <= 1 + ticks / 500, "{dt_s} s: {found} ticks");
    }
}

/// Sticks and targets count until they are too old, and if they are plausible.
#[test]
fn sticks_and_targets_age() {
    let sticks = |age_us: u64, roll: f32| {
        let mut desk = Desk::flying(Settings::DEFAULT);
        desk.orders.sticks =
            Some(Stamped { value: Sticks { roll, ..Sticks::default() }, at_us: desk.now_us + 1000 - age_us });
        desk.select(FlightMode::Position)
    };
    assert_eq!((sticks(0, 0.0), sticks(499_000, 1.0)), (Ok(()), Ok(())));
    assert_eq!((sticks(501_000, 0.0), sticks(0, 1.1)), (Err(Declined::NoSticks), Err(Declined::NoSticks)));
    let target = |age_us: u64, x: f32| {
        let mut desk = Desk::flying(Settings::DEFAULT);
        let none = Vector3::repeat(NAN);
        let motion = MotionTarget {
            position_m: Vector3::new(x, 2.0, 8.0),
            velocity_m_s: none,
            acceleration_m_s2: none,
            yaw_rad: NAN,
            yaw_rate_rad_s: NAN,
            body: false,
        };
        desk.orders.target = Some(Stamped { value: Target::Motion(motion), at_us: desk.now_us + 1000 - age_us });
        desk.select(FlightMode::Offboard)
    };
    assert_eq!((target(0, 1.0), target(499_000, 1.0)), (Ok(()), Ok(())));
    assert_eq!((target(501_000, 1.0), target(0, 2e5)), (Err(Declined::NoTargets), Err(Declined::NoTargets)));
}

/// A state that is not plausible is none.
#[test]
fn an_implausible_state_is_none() {
    let mut desk = Desk::flying(Settings::DEFAULT);
    desk.follows = false;
    desk.state = Some(at(NAN, 0.0, 0.0));
    let guided = desk.tick();
    assert_eq!((guided.setpoint, guided.rests), (None, false));
    assert_eq!(desk.select(FlightMode::Hold), Err(Declined::NoPosition));
    desk.airborne = false;
    assert!(desk.tick().rests, "armed on the ground");
    desk.core = Mode::Disarmed;
    assert!(!desk.tick().rests);
}

/// Through a gap of the state the motion goes on as it was, in the air only.
#[test]
fn the_motion_goes_on_through_a_gap() {
    for airborne in [true, false] {
        let mut desk = Desk::flying(Settings::DEFAULT);
        desk.order(go(60.0, 2.0, 8.0)).unwrap();
        desk.run(6000);
        let before = desk.setpoint();
        let seen = desk.state.unwrap();
        (desk.state, desk.airborne) = (None, airborne);
        desk.run(400);
        // As far as it has gone meanwhile.
        let gone = before.velocity_m_s * 0.4;
        let way = if airborne { gone } else { Vector3::zeros() };
        desk.state = Some(State { position_m: seen.position_m + gone, ..seen });
        (desk.airborne, desk.follows) = (true, false);
        let after = desk.setpoint();
        assert!((after.position_m - before.position_m - way).norm() < 0.05, "{after:?}");
        assert!((after.velocity_m_s - before.velocity_m_s).norm() < 0.1, "{after:?}");
    }
}
