//! Tests of the guidance's tick with a vehicle placed by the test: bounds of orders, timeouts, home, and gaps of the
//! state. `endings.rs` has the ends of modes and flights.

use crate::fixture::*;
use afbc_flight_core::{Mode, Request, Stamped};
use afbc_guidance::*;
use afbc_types::State;
use nalgebra::Vector3;

/// Orders accept numbers within their ranges, ends included.
#[test]
fn orders_take_numbers_within_their_ranges() {
    let fixture = Fixture::flying(Settings::DEFAULT);
    let mut ground = Fixture::new(Settings::DEFAULT);
    ground.run(1100);
    let disarmed = ground.clone();
    ground.core = Mode::Flying;
    ground.run(10);
    for (height, expected) in [
        (0.0, Err(OrderRefusal::OutOfRange)),
        (-1.0, Err(OrderRefusal::OutOfRange)),
        (NAN, Err(OrderRefusal::OutOfRange)),
        (0.1, Ok(())),
        (1000.0, Ok(())),
        (1000.1, Err(OrderRefusal::OutOfRange)),
    ] {
        assert_eq!(ground.would(Order::TakeOff(Some(height))), expected, "{height} m");
        let unarmed = expected.and(Err(OrderRefusal::NotArmed));
        assert_eq!(disarmed.would(Order::TakeOff(Some(height))), unarmed, "{height} m");
    }
    assert_eq!(fixture.would(Order::TakeOff(None)), Err(OrderRefusal::InFlight));
    for (speed, ok) in [(0.0, false), (-1.0, false), (NAN, false), (0.1, true), (1e3, true), (1001.0, false)] {
        let expected = if ok { Ok(()) } else { Err(OrderRefusal::OutOfRange) };
        assert_eq!(fixture.would(Order::Speed(speed)), expected, "{speed} m/s");
        let order = Order::GoTo { position_m: Vector3::zeros(), yaw_rad: NAN, speed_m_s: Some(speed) };
        assert_eq!(fixture.would(order), expected, "{speed} m/s");
    }
    for (yaw_rad, ok) in [(NAN, true), (1e3, true), (-1e3, true), (1001.0, false), (-1001.0, false)] {
        let order = Order::GoTo { position_m: Vector3::zeros(), yaw_rad, speed_m_s: None };
        assert_eq!(fixture.would(order), if ok { Ok(()) } else { Err(OrderRefusal::OutOfRange) }, "{yaw_rad} rad");
    }
    for (value, place, home) in
        [(9e4, true, true), (-9e4, true, true), (9.01e4, false, false), (-9.01e4, false, false), (NAN, true, false)]
    {
        for axis in 0..3 {
            let position_m = Vector3::from_fn(|row, _| if row == axis { value } else { 1.0 });
            let of = |ok: bool| if ok { Ok(()) } else { Err(OrderRefusal::OutOfRange) };
            assert_eq!(fixture.would(go(position_m.x, position_m.y, position_m.z)), of(place), "{position_m:?}");
            assert_eq!(fixture.would(Order::Home(Some(position_m))), of(home), "{position_m:?}");
        }
    }
    assert_eq!(disarmed.would(go(0.0, 0.0, 5.0)), Err(OrderRefusal::NotArmed));
    assert_eq!(ground.would(go(0.0, 0.0, 5.0)), Err(OrderRefusal::OnGround));
    assert_eq!(fixture.would(Order::Resume(3)), Err(OrderRefusal::NoMission));
    assert_eq!(Fixture { state: None, ..fixture.clone() }.order(Order::Home(None)), Err(OrderRefusal::NoPosition));
}

/// A take-off starts where the vehicle stands, and is refused if it would leave the fence.
#[test]
fn takeoffs_end_inside_the_fence() {
    let mut fixture = Fixture::new(fenced(20.0, 6.0));
    fixture.run(1100);
    fixture.core = Mode::Flying;
    fixture.run(10);
    assert_eq!(fixture.would(Order::TakeOff(Some(5.9))), Ok(()));
    assert_eq!(fixture.would(Order::TakeOff(Some(6.1))), Err(OrderRefusal::OutsideFence));
    // Home is at a height of 3 m. From 1 m higher, 1 m less is left.
    fixture.state = Some(at(1.0, 2.0, 4.0));
    fixture.run(10);
    assert_eq!(fixture.would(Order::TakeOff(Some(4.9))), Ok(()));
    assert_eq!(fixture.would(Order::TakeOff(Some(5.1))), Err(OrderRefusal::OutsideFence));
    assert_eq!(fixture.would(Order::Select(FlightMode::Takeoff)), Ok(()), "2.5 m");
    fixture.state = Some(at(1.0, 2.0, 7.0));
    fixture.run(10);
    assert_eq!(fixture.would(Order::Select(FlightMode::Takeoff)), Err(OrderRefusal::OutsideFence));
    assert_eq!(fixture.would(Order::Select(FlightMode::Hold)), Ok(()), "no climb");
    assert_eq!(fixture.order(Order::TakeOff(Some(1.5))), Ok(()));
    fixture.airborne = true;
    fixture.run(12_000);
    assert_eq!((fixture.guidance.mode(), fixture.place()), (FlightMode::Hold, Vector3::new(1.0, 2.0, 8.5)));
}

/// Coordinates that are not given are kept from the held place, or else from the setpoint.
#[test]
fn a_place_keeps_what_is_not_given() {
    let mut fixture = Fixture::flying(Settings::DEFAULT);
    assert_eq!(fixture.order(go(NAN, 30.0, NAN)), Ok(()));
    fixture.run(500);
    assert_eq!(fixture.order(go(NAN, NAN, 9.0)), Ok(()));
    fixture.run(20_000);
    assert_eq!(fixture.place(), Vector3::new(1.0, 30.0, 9.0), "the place that it was on its way to");
    // The place is forgotten once another mode has flown.
    fixture.orders.target = None;
    assert_eq!(fixture.select(FlightMode::Land), Ok(()));
    fixture.run(1500);
    let here = fixture.setpoint().position_m;
    assert_eq!(fixture.order(go(NAN, NAN, 12.0)), Ok(()));
    fixture.run(15_000);
    assert!((fixture.place() - Vector3::new(here.x, here.y, 12.0)).norm() < 1e-3, "{:?}", fixture.place());
    // The vehicle flies with the ordered heading and speed.
    let mut fixture = Fixture::flying(Settings::DEFAULT);
    let order = Order::GoTo { position_m: Vector3::new(60.0, 2.0, 8.0), yaw_rad: 0.7, speed_m_s: Some(2.0) };
    assert_eq!(fixture.order(order), Ok(()));
    fixture.run(6000);
    let setpoint = fixture.setpoint();
    assert!((setpoint.yaw_rad - 0.7).abs() < 2e-3 && (setpoint.velocity_m_s.x - 1.96).abs() < 0.03, "{setpoint:?}");
    // A slower speed counts until the mode changes.
    assert_eq!(fixture.order(Order::Speed(1.0)), Ok(()));
    fixture.run(4000);
    assert!((fixture.setpoint().velocity_m_s.x - 0.98).abs() < 0.02);
    assert_eq!(fixture.order(go(90.0, 2.0, 8.0)), Ok(()));
    fixture.run(6000);
    assert!(fixture.setpoint().velocity_m_s.x > 4.5, "the cruise speed again");
}

/// Selecting the same mode again changes nothing, except that hold stops at the present place.
#[test]
fn selecting_a_hold_again_stops() {
    let mut fixture = Fixture::flying(Settings::DEFAULT);
    fixture.order(go(40.0, 2.0, 8.0)).unwrap();
    fixture.run(3000);
    assert_eq!(fixture.select(FlightMode::Hold), Ok(()));
    fixture.run(8000);
    assert!(fixture.place().x < 25.0, "{:?}", fixture.place());
    assert_eq!(fixture.said, [], "no other mode");
    // A failsafe's return still counts as a failsafe when a return is selected.
    let failsafe =
        FailsafeSettings { station_lost_s: 1.0, station_action: StationAction::Return, ..FailsafeSettings::DEFAULT };
    let mut fixture = Fixture::flying(Settings { failsafe, ..Settings::DEFAULT });
    fixture.orders.heard_us = Some(fixture.now_us);
    let guided = fixture.run(1100);
    assert_eq!((guided.mode, guided.failsafe), (FlightMode::Return, Some(FailsafeCause::Station)));
    assert_eq!(fixture.select(FlightMode::Return), Ok(()));
    assert_eq!(fixture.tick().failsafe, Some(FailsafeCause::Station));
    assert_eq!(fixture.select(FlightMode::Land), Ok(()));
    assert_eq!(fixture.tick().failsafe, None, "ordered");
}

/// Home is where the vehicle first rested for a second, then where it is armed, unless home was ordered.
#[test]
fn home_is_where_it_rests_and_is_armed() {
    let mut fixture = Fixture::new(Settings::DEFAULT);
    assert_eq!(fixture.run(990).home_m, None);
    assert_eq!(fixture.run(20).home_m, Some(Vector3::new(1.0, 2.0, 3.0)));
    fixture.state = Some(at(7.0, 8.0, 9.0));
    assert_eq!(fixture.run(3000).home_m, Some(Vector3::new(1.0, 2.0, 3.0)), "carried elsewhere");
    let mut ordered = fixture.clone();
    fixture.core = Mode::Flying;
    assert_eq!(fixture.tick().home_m, Some(Vector3::new(7.0, 8.0, 9.0)), "armed there");
    fixture.state = Some(at(1.0, 1.0, 1.0));
    assert_eq!(fixture.run(2000).home_m, Some(Vector3::new(7.0, 8.0, 9.0)), "in flight");
    let place = Vector3::new(-5.0, 6.0, 2.0);
    assert_eq!(ordered.order(Order::Home(Some(place))), Ok(()));
    ordered.core = Mode::Flying;
    assert_eq!(ordered.run(10).home_m, Some(place));
    assert_eq!(ordered.order(Order::Home(None)), Ok(()));
    assert_eq!(ordered.tick().home_m, Some(Vector3::new(7.0, 8.0, 9.0)));
    // A vehicle that never rests gets its home at arming.
    let mut fixture = Fixture::new(Settings::DEFAULT);
    fixture.state = Some(State { velocity_m_s: Vector3::new(1.0, 0.0, 0.0), ..at(1.0, 2.0, 3.0) });
    assert_eq!(fixture.run(3000).home_m, None);
    fixture.core = Mode::Flying;
    assert!(fixture.tick().home_m.is_some());
}

/// Implausible time steps count as 1 ms, and long ones are shortened.
#[test]
fn strange_time_steps_are_replaced() {
    let asks_after = |dt_s: f32| {
        let flying = FlightModeSettings { disarm_before_s: 1.0, ..FlightModeSettings::DEFAULT };
        let mut fixture = Fixture { dt_s, ..Fixture::new(Settings { flying, ..Settings::DEFAULT }) };
        fixture.core = Mode::Flying;
        (1..20_000_i32).find(|_| fixture.tick().request == Some(Request::Disarm)).unwrap()
    };
    for (dt_s, ticks) in
        [(1e-3, 1000), (0.01, 100), (0.02, 50), (5.0, 50), (1e-6, 10_000), (0.0, 1000), (-0.01, 1000), (NAN, 1000)]
    {
        let found = asks_after(dt_s);
        assert!((found - ticks).abs() <= 1 + ticks / 500, "{dt_s} s: {found} ticks");
    }
}

/// Sticks and targets count if they are plausible and not too old.
#[test]
fn sticks_and_targets_age() {
    let sticks = |age_us: u64, roll: f32| {
        let mut fixture = Fixture::flying(Settings::DEFAULT);
        fixture.orders.sticks =
            Some(Stamped { value: Sticks { roll, ..Sticks::default() }, at_us: fixture.now_us + 1000 - age_us });
        fixture.select(FlightMode::Position)
    };
    assert_eq!((sticks(0, 0.0), sticks(499_000, 1.0)), (Ok(()), Ok(())));
    assert_eq!((sticks(501_000, 0.0), sticks(0, 1.1)), (Err(OrderRefusal::NoSticks), Err(OrderRefusal::NoSticks)));
    let target = |age_us: u64, x: f32| {
        let mut fixture = Fixture::flying(Settings::DEFAULT);
        let none = Vector3::repeat(NAN);
        let motion = MotionTarget {
            position_m: Vector3::new(x, 2.0, 8.0),
            velocity_m_s: none,
            acceleration_m_s2: none,
            yaw_rad: NAN,
            yaw_rate_rad_s: NAN,
            body: false,
        };
        fixture.orders.target =
            Some(Stamped { value: OffboardTarget::Motion(motion), at_us: fixture.now_us + 1000 - age_us });
        fixture.select(FlightMode::Offboard)
    };
    assert_eq!((target(0, 1.0), target(499_000, 1.0)), (Ok(()), Ok(())));
    assert_eq!((target(501_000, 1.0), target(0, 2e5)), (Err(OrderRefusal::NoTargets), Err(OrderRefusal::NoTargets)));
}

/// An implausible state counts as missing.
#[test]
fn an_implausible_state_is_none() {
    let mut fixture = Fixture::flying(Settings::DEFAULT);
    fixture.follows = false;
    fixture.state = Some(at(NAN, 0.0, 0.0));
    let guided = fixture.tick();
    assert_eq!((guided.setpoint, guided.idle_on_ground), (None, false));
    assert_eq!(fixture.select(FlightMode::Hold), Err(OrderRefusal::NoPosition));
    fixture.airborne = false;
    assert!(fixture.tick().idle_on_ground, "armed on the ground");
    fixture.core = Mode::Disarmed;
    assert!(!fixture.tick().idle_on_ground);
}

/// During a gap of the state, the motion continues in the air, but not on the ground.
#[test]
fn the_motion_goes_on_through_a_gap() {
    for airborne in [true, false] {
        let mut fixture = Fixture::flying(Settings::DEFAULT);
        fixture.order(go(60.0, 2.0, 8.0)).unwrap();
        fixture.run(6000);
        let before = fixture.setpoint();
        let seen = fixture.state.unwrap();
        (fixture.state, fixture.airborne) = (None, airborne);
        fixture.run(400);
        // Distance flown meanwhile.
        let gone = before.velocity_m_s * 0.4;
        let way = if airborne { gone } else { Vector3::zeros() };
        fixture.state = Some(State { position_m: seen.position_m + gone, ..seen });
        (fixture.airborne, fixture.follows) = (true, false);
        let after = fixture.setpoint();
        assert!((after.position_m - before.position_m - way).norm() < 0.05, "{after:?}");
        assert!((after.velocity_m_s - before.velocity_m_s).norm() < 0.1, "{after:?}");
    }
}
