//! Tests of orbits, waits, turns and jumps, and of stops at the uploaded geofence.

use crate::bench::{Bench, motion, settings};
use afbc_flight_core::Mode;
use afbc_guidance::*;
use afbc_types::Choice;
use nalgebra::Vector3;
use std::f32::consts::{FRAC_PI_2, PI, TAU};

fn orbit(radius_m: f32, speed_m_s: f32, angle_deg: u16, heading: OrbitHeading) -> Order {
    Order::Orbit { centre_m: Vector3::new(20.0, 10.0, 6.0), radius_m, speed_m_s, angle_deg, heading }
}

fn turned(from_rad: f32, to_rad: f32) -> f32 {
    (to_rad - from_rad + 3.0 * PI).rem_euclid(TAU) - PI
}

/// An orbit keeps its radius, speed, height, direction and heading.
#[test]
fn a_circle_is_flown_as_ordered() {
    let centre = Vector3::new(20.0, 10.0, 6.0);
    for heading in [OrbitHeading::Centre, OrbitHeading::Along, OrbitHeading::Kept] {
        for (radius, speed) in [(10.0, 2.0), (-10.0, 3.0), (4.0, 1.0), (-30.0, 6.0)] {
            let mut bench = Bench::hovering(settings());
            bench.order(orbit(radius, speed, 0, heading)).unwrap();
            bench.run(30.0);
            let yaw = bench.state.attitude_rad.z;
            let mut gone = 0.0;
            for _ in 0..20_000 {
                let before = bench.state.position_m - centre;
                let guided = bench.tick();
                let off = bench.state.position_m - centre;
                assert!(guided.orbits && guided.mode == FlightMode::Hold);
                let most = 0.05 * radius.abs() + 0.1;
                assert!((off.xy().norm() - radius.abs()).abs() < most && off.z.abs() < 0.1, "{radius} {off}");
                assert!((bench.state.velocity_m_s.xy().norm() - speed).abs() < 0.1, "{}", bench.state.velocity_m_s);
                gone += turned(before.y.atan2(before.x), off.y.atan2(off.x));
                let at = off.y.atan2(off.x);
                let wanted = match heading {
                    OrbitHeading::Centre => at + PI,
                    OrbitHeading::Along => at + FRAC_PI_2 * radius.signum(),
                    OrbitHeading::Kept => yaw,
                };
                assert!(turned(wanted, bench.state.attitude_rad.z).abs() < 0.1, "{heading:?}");
            }
            assert!((gone - 20.0 * speed / radius).abs() < 0.1, "{gone}");
            // Any other order ends the orbit.
            bench.select(FlightMode::Hold).unwrap();
            assert!(!bench.tick().orbits);
        }
    }
}

#[test]
fn a_circle_ends_after_its_angle() {
    let mut bench = Bench::hovering(settings());
    bench.order(orbit(10.0, 2.0, 90, OrbitHeading::Centre)).unwrap();
    bench.run_until(60.0, |guided| guided.orbits);
    let took = bench.run_until(60.0, |guided| !guided.orbits);
    bench.run(5.0);
    // A quarter turn to the left, from the nearest point of the circle.
    let centre = Vector3::new(20.0, 10.0, 6.0);
    let near = -centre.xy().normalize();
    let end = centre.xy() + nalgebra::Vector2::new(-near.y, near.x) * 10.0;
    assert!(took > 7.0 && (bench.state.position_m.xy() - end).norm() < 0.3, "{took} s, {}", bench.state.position_m);
    assert!(
        bench.said.contains(&GuidanceNotice::Mode(FlightMode::Hold, ModeReason::Done))
            || bench.guidance.mode() == FlightMode::Hold
    );
}

#[test]
fn a_circle_that_cannot_be_flown_is_refused() {
    let mut bench = Bench::new(settings());
    bench.run(1.5);
    assert_eq!(bench.order(orbit(10.0, 2.0, 0, OrbitHeading::Centre)), Err(OrderRefusal::NotArmed));
    bench.arm();
    assert_eq!(bench.order(orbit(10.0, 2.0, 0, OrbitHeading::Centre)), Err(OrderRefusal::OnGround));
    let mut bench = Bench::hovering(settings());
    for (radius, speed) in
        [(0.5, 0.2), (1001.0, 2.0), (f32::NAN, 2.0), (10.0, 0.0), (10.0, -2.0), (10.0, 5.0), (2.0, 2.5)]
    {
        let refused = bench.order(orbit(radius, speed, 0, OrbitHeading::Centre));
        assert_eq!(refused, Err(OrderRefusal::OutOfRange), "{radius} m, {speed} m/s");
    }
    let Order::Orbit { radius_m, speed_m_s, angle_deg, heading, .. } = orbit(10.0, 2.0, 0, OrbitHeading::Kept) else {
        unreachable!()
    };
    let around = |centre_m| Order::Orbit { centre_m, radius_m, speed_m_s, angle_deg, heading };
    assert_eq!(bench.order(around(Vector3::new(2e5, 0.0, 5.0))), Err(OrderRefusal::OutOfRange));
    // The orbit is flown around the present place, at the default speed.
    let here = bench.state.position_m;
    assert_eq!(bench.order(around(Vector3::repeat(f32::NAN))), Ok(()));
    bench.run(20.0);
    assert!(((bench.state.position_m - here).xy().norm() - 10.0).abs() < 0.5);
    // The fence around home.
    let fenced =
        Settings { failsafe: FailsafeSettings { fence_radius_m: 25.0, ..FailsafeSettings::DEFAULT }, ..settings() };
    let mut bench = Bench::hovering(fenced);
    assert_eq!(bench.order(around(Vector3::new(16.0, 0.0, 5.0))), Err(OrderRefusal::OutsideFence));
    assert_eq!(bench.order(around(Vector3::new(14.0, 0.0, 5.0))), Ok(()));
}

fn waypoint(x: f32, y: f32) -> Item {
    Item::Waypoint {
        position_m: Vector3::new(x, y, 6.0),
        yaw_rad: f32::NAN,
        hold_s: 0.0,
        within_m: 0.0,
        fly_through: false,
    }
}

/// Returns a bench that flies a mission.
fn flying(items: Vec<Item>) -> Bench {
    let mut bench = Bench::hovering(settings());
    bench.items = items;
    bench.select(FlightMode::Mission).unwrap();
    bench
}

#[test]
fn a_mission_waits_where_it_is() {
    let mut bench = flying(vec![waypoint(10.0, 0.0), Item::Wait(4.0), waypoint(10.0, 10.0)]);
    bench.run_until(30.0, |guided| guided.reached == Some(0));
    let took = bench.run_until(30.0, |guided| guided.reached == Some(1));
    assert!((took - 4.0).abs() < 0.05, "{took}");
    assert!((bench.state.position_m.xy() - nalgebra::Vector2::new(10.0, 0.0)).norm() < 0.1);
    bench.run_until(30.0, |guided| guided.reached == Some(2));
}

/// Two and a half circles around a place, starting where the vehicle arrives.
#[test]
fn a_mission_flies_circles() {
    for radius_m in [8.0, -8.0, 0.0] {
        let centre_m = Vector3::new(20.0, 0.0, 6.0);
        let mut bench = flying(vec![Item::Turns { centre_m, radius_m, turns: 2.5 }, waypoint(0.0, 0.0)]);
        let (mut gone, mut last) = (0.0, None);
        while !bench.reached.contains(&0) {
            bench.tick();
            let off = bench.state.position_m - centre_m;
            if last.is_some() || (off.xy().norm() - 8.0).abs() < 0.1 {
                let at = off.y.atan2(off.x);
                gone += last.map_or(0.0, |last| turned(last, at));
                last = Some(at);
            }
            assert!(bench.now_us < 200_000_000);
        }
        let (left, radius) = (radius_m > 0.0, if radius_m == 0.0 { ORBIT_RADIUS_M } else { 8.0 });
        assert!((gone.abs() / TAU - 2.5).abs() < 0.1 || radius_m == 0.0, "{gone}");
        assert_eq!(gone > 0.0, left);
        let off = (bench.state.position_m - centre_m).xy().norm();
        assert!((off - radius).abs() < 0.5, "{off}");
    }
}

/// Headings may be absolute or relative, in both directions.
#[test]
fn a_mission_turns() {
    let yaw = |yaw_rad, relative, direction| Item::Yaw { yaw_rad, relative, direction };
    for (item, from, gone) in [
        (yaw(1.0, false, 0), 0.0, 1.0),
        (yaw(1.0, false, 1), 0.0, 1.0),
        (yaw(1.0, false, -1), 0.0, 1.0 - TAU),
        (yaw(-1.0, false, 1), 0.0, TAU - 1.0),
        (yaw(-3.0, false, 0), 3.0, TAU - 6.0),
        (yaw(FRAC_PI_2, true, 0), 1.0, FRAC_PI_2),
        (yaw(-FRAC_PI_2, true, 0), 1.0, -FRAC_PI_2),
        (yaw(FRAC_PI_2, true, -1), 1.0, -FRAC_PI_2),
        (yaw(3.0 * PI, true, 1), 0.0, 3.0 * PI),
    ] {
        let mut bench = flying(vec![yaw(from, false, 0), item, Item::Wait(1.0)]);
        while !bench.reached.contains(&0) {
            bench.tick();
        }
        let (mut seen, mut last) = (0.0, bench.state.attitude_rad.z);
        while !bench.reached.contains(&1) {
            bench.tick();
            seen += turned(last, bench.state.attitude_rad.z);
            last = bench.state.attitude_rad.z;
            assert!(bench.now_us < 100_000_000, "{item:?}");
        }
        assert!((seen - gone).abs() < 0.06, "{item:?}: {seen}");
        // The heading is kept.
        bench.run(0.9);
        assert!(turned(last, bench.state.attitude_rad.z).abs() < 0.05);
    }
}

/// The region of interest counts from its item until another one ends it.
#[test]
fn a_mission_looks_at_a_place() {
    let at_m = Vector3::new(10.0, 20.0, 0.0);
    let nowhere = Item::Look { at_m: Vector3::repeat(f32::NAN) };
    let items = vec![waypoint(5.0, 0.0), Item::Look { at_m }, waypoint(20.0, 0.0), nowhere, waypoint(30.0, 0.0)];
    let mut bench = flying(items);
    bench.run_until(30.0, |guided| guided.reached == Some(1));
    bench.run(2.0);
    while !bench.reached.contains(&2) {
        bench.tick();
        let off = at_m - bench.state.position_m;
        assert!(turned(off.y.atan2(off.x), bench.state.attitude_rad.z).abs() < 0.4, "{}", bench.state.position_m);
    }
    bench.run(3.0);
    assert!(bench.state.attitude_rad.z.abs() < 0.1, "towards the waypoint");
}

#[test]
fn a_mission_jumps() {
    let mut bench = flying(vec![waypoint(5.0, 0.0), Item::Jump(3), waypoint(50.0, 0.0), waypoint(5.0, 5.0)]);
    bench.run_until(40.0, |guided| guided.reached == Some(3));
    assert_eq!(bench.reached, [0, 1, 3]);
    assert_eq!(bench.guidance.mode(), FlightMode::Hold);
}

fn go(x: f32) -> Order {
    Order::GoTo { position_m: Vector3::new(x, 0.0, 5.0), yaw_rad: f32::NAN, speed_m_s: None }
}

/// A vehicle about to leave the fence stops in every mode that would go on. With a warning only, it flies on.
#[test]
fn the_uploaded_fence_stops_what_would_leave_it() {
    let leaves = Some(FenceStatus { leaves: true, outside: false });
    for (action, stops) in FenceAction::ALL.iter().map(|action| (*action, action.action() >= FailsafeAction::Hold)) {
        let with =
            Settings { failsafe: FailsafeSettings { fence_action: action, ..FailsafeSettings::DEFAULT }, ..settings() };
        let mut bench = Bench::hovering(with);
        bench.order(go(80.0)).unwrap();
        bench.run(6.0);
        bench.orders.fence = leaves;
        bench.run(8.0);
        let x = bench.state.position_m.x;
        let mode = bench.guidance.mode();
        assert_eq!(bench.state.velocity_m_s.x.abs() < 1.0 || x < 45.0, stops, "{action:?}: {x} m");
        if action.action() == FailsafeAction::Hold {
            assert_eq!((mode, bench.state.velocity_m_s.norm() < 0.05), (FlightMode::Hold, true));
            assert_eq!(bench.said, [GuidanceNotice::Found(FailsafeCause::Fence)]);
            // A vehicle that holds outside the fence may be ordered back inside.
            bench.order(go(5.0)).unwrap();
            bench.orders.fence = Some(FenceStatus::default());
            bench.run(15.0);
            assert!((bench.state.position_m.x - 5.0).abs() < 0.1);
        }
        // An orbit stops, too.
        let mut bench = Bench::hovering(with);
        bench.order(orbit(10.0, 2.0, 0, OrbitHeading::Centre)).unwrap();
        bench.run(5.0);
        bench.orders.fence = leaves;
        assert_eq!(bench.tick().orbits, !stops, "{action:?}");
        // The failsafe replaces a mission.
        bench.orders.fence = None;
        let mut bench = flying(vec![waypoint(80.0, 0.0)]);
        bench.guidance.set(with).unwrap();
        bench.run(5.0);
        bench.orders.fence = leaves;
        assert_eq!(bench.tick().mode != FlightMode::Mission, stops);
    }
}

/// A return that would cross the fence lands, if it has stopped and climbed. One that still stops does not.
#[test]
fn a_return_across_the_fence_lands() {
    for (wait_s, lands) in [(0.5, false), (12.0, true)] {
        let mut bench = Bench::hovering(settings());
        bench.order(go(60.0)).unwrap();
        bench.run(20.0);
        bench.select(FlightMode::Return).unwrap();
        bench.run(wait_s);
        bench.orders.fence = Some(FenceStatus { leaves: true, outside: false });
        bench.run(0.5);
        assert_eq!(bench.guidance.mode() == FlightMode::Land, lands, "{wait_s} s");
        bench.orders.fence = Some(FenceStatus::default());
        bench.run(60.0);
        assert_eq!((bench.core, bench.state.position_m.x > 20.0), (Mode::Disarmed, lands));
    }
}

#[test]
fn outside_the_uploaded_fence_nothing_takes_off() {
    let mut bench = Bench::new(settings());
    bench.orders.fence = Some(FenceStatus { leaves: true, outside: true });
    bench.run(1.5);
    assert!(bench.guidance.arming_refusals().iter().any(|reason| reason == afbc_flight_core::Refusal::OutsideFence));
    bench.orders.fence = Some(FenceStatus { leaves: true, outside: false });
    bench.run(0.1);
    assert!(bench.guidance.arming_refusals().iter().count() == 0);
    bench.aim(OffboardTarget::Motion(motion(Vector3::new(1.0, 0.0, 5.0))));
}

/// A return lands at the safe place that was nearest when it began.
#[test]
fn a_return_lands_at_the_nearest_safe_place() {
    let mut bench = Bench::hovering(settings());
    bench.order(go(40.0)).unwrap();
    bench.run(20.0);
    bench.orders.safe_m = Some(nalgebra::Vector2::new(50.0, 10.0));
    bench.select(FlightMode::Return).unwrap();
    bench.run(1.0);
    bench.orders.safe_m = Some(nalgebra::Vector2::new(0.0, 0.0));
    bench.run(80.0);
    assert_eq!(bench.core, Mode::Disarmed);
    assert!(
        (bench.state.position_m.xy() - nalgebra::Vector2::new(50.0, 10.0)).norm() < 0.3,
        "{}",
        bench.state.position_m
    );
}
