//! A point mass flies every mode, and each ends where it should.

use crate::bench::{Bench, motion, settings};
use afbc_flight_core::Mode;
use afbc_guidance::*;
use nalgebra::{UnitQuaternion, Vector3};

#[test]
fn armed_on_the_ground_it_rests_and_is_disarmed() {
    let mut bench = Bench::new(settings());
    bench.run(1.5);
    bench.arm();
    assert!(bench.tick().idle_on_ground);
    bench.run(8.0);
    assert!(bench.core.armed());
    bench.run(3.0);
    assert_eq!(bench.core, Mode::Disarmed);
    assert_eq!(bench.said, [GuidanceNotice::Disarms]);
    assert_eq!(bench.highest_m, 0.0);
}

#[test]
fn takes_off_to_the_height_and_holds() {
    for height_m in [None, Some(1.0), Some(30.0)] {
        let mut bench = Bench::new(settings());
        bench.run(1.5);
        bench.arm();
        assert_eq!(bench.order(Order::TakeOff(height_m)), Ok(()));
        bench.run_until(60.0, |guided| guided.mode == FlightMode::Hold);
        bench.run(5.0);
        let expected_m = height_m.unwrap_or(settings().flying.takeoff_height_m);
        assert!((bench.state.position_m.z - expected_m).abs() < 0.05, "{:?}", bench.state);
        assert!(bench.highest_m < expected_m + 0.1);
        let said = [
            GuidanceNotice::Mode(FlightMode::Takeoff, ModeReason::Ordered),
            GuidanceNotice::Mode(FlightMode::Hold, ModeReason::Done),
        ];
        assert_eq!(bench.said, said);
    }
}

#[test]
fn lands_and_disarms_where_it_is() {
    let mut bench = Bench::hovering(settings());
    assert_eq!(
        bench.order(Order::GoTo { position_m: Vector3::new(8.0, -3.0, 20.0), yaw_rad: 1.0, speed_m_s: None }),
        Ok(())
    );
    bench.run(20.0);
    assert!((bench.state.position_m - Vector3::new(8.0, -3.0, 20.0)).norm() < 0.05, "{:?}", bench.state);
    assert!((bench.state.attitude_rad.z - 1.0).abs() < 1e-3);
    assert_eq!(bench.select(FlightMode::Land), Ok(()));
    while bench.core.armed() {
        let before = bench.state;
        bench.tick();
        if before.position_m.z < 1.0 {
            assert!(before.velocity_m_s.z > -settings().flying.land_m_s - 0.1, "{before:?}");
        }
        assert!(bench.now_us < 120_000_000, "{:?} {:?}", bench.state, bench.said);
    }
    bench.run(0.1);
    assert!((bench.state.position_m - Vector3::new(8.0, -3.0, 0.0)).norm() < 0.05);
    assert_eq!(bench.guidance.mode(), FlightMode::Hold, "may be armed again");
}

#[test]
fn returns_home_by_the_return_height() {
    let mut bench = Bench::hovering(settings());
    bench
        .order(Order::GoTo { position_m: Vector3::new(40.0, 30.0, f32::NAN), yaw_rad: f32::NAN, speed_m_s: None })
        .unwrap();
    bench.run(25.0);
    assert!(bench.highest_m < 3.0);
    assert_eq!(bench.select(FlightMode::Return), Ok(()));
    bench.run(15.0);
    assert!((bench.highest_m - settings().flying.return_height_m).abs() < 0.2, "{}", bench.highest_m);
    for _ in 0..90_000 {
        bench.tick();
    }
    assert_eq!(bench.core, Mode::Disarmed, "{:?}", bench.said);
    assert!(bench.state.position_m.norm() < 0.5, "{:?}", bench.state);
}

#[test]
fn near_home_it_returns_without_a_climb() {
    let mut bench = Bench::hovering(settings());
    bench
        .order(Order::GoTo { position_m: Vector3::new(3.0, 0.0, f32::NAN), yaw_rad: f32::NAN, speed_m_s: None })
        .unwrap();
    bench.run(8.0);
    assert_eq!(bench.select(FlightMode::Return), Ok(()));
    bench.run(25.0);
    assert_eq!(bench.core, Mode::Disarmed);
    assert!(bench.highest_m < 3.0 && bench.state.position_m.norm() < 0.3);
}

#[test]
fn flies_a_mission() {
    let waypoint = |x, y, hold_s, fly_through| Item::Waypoint {
        position_m: Vector3::new(x, y, 6.0),
        yaw_rad: f32::NAN,
        hold_s,
        within_m: 0.0,
        fly_through,
    };
    let mut bench = Bench::new(settings());
    let land = Item::Land { position_m: Vector3::new(0.0, 20.0, 0.0) };
    bench.items = vec![
        Item::TakeOff { height_m: 4.0 },
        Item::Speed(3.0),
        waypoint(20.0, 0.0, 0.0, true),
        waypoint(20.0, 20.0, 2.0, false),
        land,
    ];
    bench.run(1.5);
    assert_eq!(bench.select(FlightMode::Mission), Ok(()));
    bench.arm();
    let (mut fastest_m_s, mut landed_ticks) = (0.0_f32, 0);
    for _ in 0..90_000 {
        bench.tick();
        fastest_m_s = fastest_m_s.max(bench.state.velocity_m_s.xy().norm());
        let guided = bench.last.unwrap();
        // The last item stays requested until the landing: 0 would tell stations that the mission restarts.
        if guided.mode == FlightMode::Land && !bench.reached.contains(&4) {
            assert_eq!(guided.wanted, 4);
            landed_ticks += 1;
        }
    }
    assert!(landed_ticks > 1000, "{landed_ticks}");
    assert_eq!(bench.core, Mode::Disarmed, "{:?}", bench.said);
    assert_eq!(bench.reached, [0, 1, 2, 3, 4]);
    assert!((bench.state.position_m - Vector3::new(0.0, 20.0, 0.0)).norm() < 0.3, "{:?}", bench.state);
    assert!(fastest_m_s < 3.1 && fastest_m_s > 2.5, "{fastest_m_s}");
    assert_eq!(bench.last.unwrap().wanted, 0);
}

#[test]
fn a_mission_without_take_off_climbs_first_and_ends_in_hold() {
    let mut bench = Bench::new(settings());
    bench.items = vec![Item::Waypoint {
        position_m: Vector3::new(10.0, 0.0, 1.0),
        yaw_rad: 0.5,
        hold_s: 0.0,
        within_m: 0.5,
        fly_through: false,
    }];
    bench.run(1.5);
    bench.arm();
    assert_eq!(bench.select(FlightMode::Mission), Ok(()));
    bench.run_until(30.0, |guided| guided.reached == Some(0));
    bench.run(5.0);
    assert_eq!(bench.guidance.mode(), FlightMode::Hold);
    assert!((bench.state.position_m - Vector3::new(10.0, 0.0, 1.0)).norm() < 0.05);
    assert!(bench.highest_m > 2.0);
}

#[test]
fn offboard_takes_off_follows_and_holds_when_targets_end() {
    let mut bench = Bench::new(settings());
    bench.run(1.5);
    bench.arm();
    assert_eq!(bench.select(FlightMode::Offboard), Err(OrderRefusal::NoTargets));
    let send = |bench: &mut Bench, target: MotionTarget, time_s: f32| {
        for tick in 0..(time_s * 1000.0) as u32 {
            if tick % 50 == 0 {
                bench.aim(OffboardTarget::Motion(target));
            }
            bench.tick();
        }
    };
    let target = motion(Vector3::new(5.0, 5.0, 3.0));
    bench.aim(OffboardTarget::Motion(target));
    assert_eq!(bench.select(FlightMode::Offboard), Ok(()));
    send(&mut bench, target, 15.0);
    assert!((bench.state.position_m - target.position_m).norm() < 0.01, "{:?}", bench.state);
    // Body-frame velocity, turned by the heading.
    let none = Vector3::repeat(f32::NAN);
    let velocity = MotionTarget { velocity_m_s: Vector3::new(2.0, 0.0, 0.0), yaw_rad: 0.0, body: true, ..motion(none) };
    send(&mut bench, velocity, 4.0);
    assert!((bench.state.velocity_m_s - velocity.velocity_m_s).norm() < 0.05, "{:?}", bench.state);
    bench.said.clear();
    bench.run(5.0);
    assert_eq!(bench.guidance.mode(), FlightMode::Hold);
    assert_eq!(bench.said, [GuidanceNotice::Mode(FlightMode::Hold, ModeReason::Failsafe(FailsafeCause::Targets))]);
    assert!(bench.state.velocity_m_s.norm() < 0.01);
}

#[test]
fn attitude_and_thrust_become_an_acceleration() {
    let mut bench = Bench::hovering(settings());
    let attitude = UnitQuaternion::from_euler_angles(0.0, 0.2, 0.0);
    let thrust = 0.5 / 0.2_f32.cos();
    bench.aim(OffboardTarget::Attitude(AttitudeTarget { attitude, yaw_rate_rad_s: f32::NAN, thrust }));
    assert_eq!(bench.select(FlightMode::Offboard), Ok(()));
    let setpoint = bench.tick().setpoint.unwrap();
    let expected = Vector3::new(9.81 * 0.2_f32.tan(), 0.0, 0.0);
    assert!((setpoint.acceleration_m_s2 - expected).norm() < 1e-3, "{setpoint:?}");
    bench.run(0.3);
    let velocity_m_s = bench.state.velocity_m_s;
    assert!(velocity_m_s.x > 0.3 && velocity_m_s.z.abs() < 0.03, "{velocity_m_s:?} {:?}", bench.said);
    bench.run(5.0);
    assert_eq!(bench.guidance.mode(), FlightMode::Hold);
    assert!(bench.state.velocity_m_s.norm() < 0.05, "{:?}", bench.state);
}

/// Body rates are commanded in acro mode only.
#[test]
fn acro_commands_rates() {
    let mut bench = Bench::hovering(settings());
    let sticks = Sticks { pitch: 0.5, roll: -1.0, throttle: 0.0, yaw: 0.25 };
    let fly = |bench: &mut Bench, ticks: u32| {
        for _ in 0..ticks {
            bench.orders.sticks = Some(afbc_flight_core::Stamped { value: sticks, at_us: bench.now_us });
            bench.tick();
        }
    };
    fly(&mut bench, 10);
    assert_eq!(bench.guidance.rates(), None);
    assert_eq!(bench.select(FlightMode::Acro), Ok(()));
    fly(&mut bench, 10);
    let target = *bench.guidance.rates().unwrap();
    let expected = Vector3::new(-100.0f32, 50.0, -25.0).map(f32::to_radians);
    assert!((target.rates_rad_s - expected).norm() < 1e-4, "{target:?}");
    assert_eq!(bench.select(FlightMode::Position), Ok(()));
    fly(&mut bench, 1);
    assert_eq!(bench.guidance.rates(), None);
    assert_eq!(bench.select(FlightMode::Acro), Ok(()));
    // When the sticks are lost, the vehicle holds its position by a setpoint again.
    bench.run(1.0);
    assert_eq!((bench.guidance.mode(), bench.guidance.rates()), (FlightMode::Hold, None));
}

#[test]
fn sticks_fly_the_manual_modes() {
    for mode in [FlightMode::Position, FlightMode::Altitude, FlightMode::Stabilised] {
        let mut bench = Bench::hovering(settings());
        assert_eq!(bench.select(mode), Err(OrderRefusal::NoSticks));
        let mut sticks = Sticks { pitch: 0.3, roll: 0.0, throttle: 0.0, yaw: 0.0 };
        for tick in 0..2000 {
            if tick == 1 {
                assert_eq!(bench.select(mode), Ok(()));
            }
            bench.orders.sticks = Some(afbc_flight_core::Stamped { value: sticks, at_us: bench.now_us });
            bench.tick();
        }
        assert!(
            bench.state.velocity_m_s.x > 1.0 && bench.state.velocity_m_s.y.abs() < 0.1,
            "{mode:?} {:?}",
            bench.state
        );
        sticks = Sticks { pitch: 0.0, roll: 0.4, throttle: 0.5, yaw: 0.0 };
        for _ in 0..2000 {
            bench.orders.sticks = Some(afbc_flight_core::Stamped { value: sticks, at_us: bench.now_us });
            bench.tick();
        }
        assert!(bench.state.velocity_m_s.y < -1.0 && bench.state.velocity_m_s.z > 1.0, "{mode:?} {:?}", bench.state);
        bench.run(10.0);
        assert_eq!(bench.guidance.mode(), FlightMode::Hold, "{mode:?}");
        assert!(bench.state.velocity_m_s.norm() < 0.05, "{:?}", bench.state);
    }
}
