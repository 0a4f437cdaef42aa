//! Tests of the failsafes: every cause with every action, alone and in pairs; announcements; checks before arming.

use crate::bench::{Bench, motion, settings};
use afbc_flight_core::{Mode, Refusal};
use afbc_guidance::*;
use afbc_types::{Choice, Declared, State};
use nalgebra::Vector3;

/// Returns causes that a test can trigger in flight, each with its parameter's choices and the action of each choice.
fn causes() -> Vec<(FailsafeCause, Vec<(usize, FailsafeAction)>)> {
    use FailsafeAction::{Hold, Land, None, Return, Warn};
    vec![
        (FailsafeCause::Fence, vec![(0, None), (1, Warn), (2, Hold), (3, Return), (4, Land), (5, Land)]),
        (FailsafeCause::Station, vec![(0, None), (1, Hold), (2, Return), (3, Land)]),
        (FailsafeCause::Targets, vec![(0, Land), (1, Hold), (2, Return)]),
        (FailsafeCause::Sensors, vec![(0, None), (1, Warn), (2, Hold), (3, Return), (4, Land)]),
        (FailsafeCause::BatteryCritical, vec![(0, Warn), (1, Return), (2, Land), (3, Return)]),
        (FailsafeCause::BatteryEmergency, vec![(0, Warn), (1, Return), (2, Land), (3, Land)]),
    ]
}

fn with(mut settings: Settings, cause: FailsafeCause, number: usize) -> Settings {
    let failsafe = &mut settings.failsafe;
    match cause {
        FailsafeCause::Fence => failsafe.fence_action = Choice::ALL[number],
        FailsafeCause::Station => failsafe.station_action = Choice::ALL[number],
        FailsafeCause::Targets => failsafe.targets_action = Choice::ALL[number],
        FailsafeCause::Sensors => failsafe.sensors_action = Choice::ALL[number],
        _ => failsafe.battery_action = Choice::ALL[number],
    }
    settings
}

fn quiet() -> Settings {
    let mut settings = settings();
    settings.failsafe = FailsafeSettings { cells: 3, fence_radius_m: 30.0, station_lost_s: 1.0, ..settings.failsafe };
    settings
}

fn charge(charge: f32) -> Option<BatteryReading> {
    Some(BatteryReading { voltage_v: 3.0 * (3.6 + 0.45 * charge), current_a: 0.0, charge: None })
}

/// Returns a vehicle in offboard mode, far from the fence, without any cause for a failsafe.
fn offboard(settings: Settings) -> Bench {
    let mut bench = Bench::hovering(settings);
    bench.battery = charge(0.8);
    bench.aim(OffboardTarget::Motion(motion(Vector3::new(10.0, 0.0, 8.0))));
    bench.select(FlightMode::Offboard).unwrap();
    stream(&mut bench, 8.0);
    bench.said.clear();
    bench
}

/// Flies on while targets keep arriving.
fn stream(bench: &mut Bench, time_s: f32) {
    for tick in 0..(time_s * 1000.0) as u32 {
        if let (0, Some(target)) = (tick % 100, bench.orders.target) {
            bench.aim(target.value);
        }
        bench.tick();
    }
}

fn bring_about(bench: &mut Bench, cause: FailsafeCause) {
    match cause {
        FailsafeCause::Fence => bench.state.position_m.x = 31.0,
        FailsafeCause::Station => bench.heard = false,
        FailsafeCause::Targets => bench.orders.target = None,
        FailsafeCause::Sensors => bench.sensors.magnetometer = true,
        FailsafeCause::BatteryCritical => bench.battery = charge(0.06),
        _ => bench.battery = charge(0.01),
    }
}

/// Flies long enough for every cause to be found. Keeps the vehicle outside the fence if it was.
fn find(bench: &mut Bench) {
    let outside = bench.state.position_m.x > 30.5;
    for tick in 0..14_000 {
        if outside {
            bench.state.position_m.x = 31.0;
        }
        if let (0, Some(target)) = (tick % 100, bench.orders.target) {
            bench.aim(target.value);
        }
        bench.tick();
        if !bench.core.armed() {
            return;
        }
    }
}

fn announced(bench: &Bench, cause: FailsafeCause) -> usize {
    let of = |notice: &&GuidanceNotice| match notice {
        GuidanceNotice::Mode(_, ModeReason::Failsafe(found)) | GuidanceNotice::Found(found) => *found == cause,
        _ => false,
    };
    bench.said.iter().filter(of).count()
}

#[test]
fn every_cause_does_what_its_parameter_says_and_is_announced_once() {
    for (cause, actions) in causes() {
        for (number, action) in actions {
            let mut bench = offboard(with(quiet(), cause, number));
            bring_about(&mut bench, cause);
            find(&mut bench);
            let what = format!("{cause:?} {number}: {:?} {:?}", bench.guidance.mode(), bench.said);
            let expected = action.mode().unwrap_or(FlightMode::Offboard);
            let landed = !bench.core.armed() && action >= FailsafeAction::Return;
            assert!(bench.guidance.mode() == expected || landed, "{what}");
            assert_eq!(announced(&bench, cause), usize::from(action > FailsafeAction::None), "{what}");
            if !landed && action >= FailsafeAction::Hold {
                assert!(bench.last.unwrap().failsafe.is_some(), "{what}");
            }
        }
    }
}

/// Of two causes, the stronger action wins in either order.
#[test]
fn of_every_pair_the_stronger_action_counts() {
    for (first, of_first) in causes() {
        for (second, of_second) in causes() {
            let one_parameter =
                |cause| matches!(cause, FailsafeCause::BatteryCritical | FailsafeCause::BatteryEmergency);
            // Targets can be lost in offboard mode only, which the first cause may have ended.
            if first == second || one_parameter(first) && one_parameter(second) || second == FailsafeCause::Targets {
                continue;
            }
            for (number, action) in [of_first[1], of_first[of_first.len() - 1]] {
                for (other, stronger) in [of_second[1], of_second[of_second.len() - 1]] {
                    let mut bench = offboard(with(with(quiet(), first, number), second, other));
                    bring_about(&mut bench, first);
                    bench.tick();
                    bring_about(&mut bench, second);
                    find(&mut bench);
                    let expected = action.max(stronger).mode().unwrap_or(FlightMode::Offboard);
                    let landed = !bench.core.armed() && action.max(stronger) >= FailsafeAction::Return;
                    assert!(
                        bench.guidance.mode() == expected || landed,
                        "{first:?} {number}, {second:?} {other}: {:?} {:?}",
                        bench.guidance.mode(),
                        bench.said
                    );
                }
            }
        }
    }
}

#[test]
fn a_failsafe_yields_to_stronger_modes_only_until_its_cause_is_over() {
    let mut bench = offboard(with(quiet(), FailsafeCause::Station, 2));
    bring_about(&mut bench, FailsafeCause::Station);
    stream(&mut bench, 2.0);
    assert_eq!(bench.guidance.mode(), FlightMode::Return);
    assert_eq!(bench.select(FlightMode::Hold), Err(OrderRefusal::Failsafe));
    assert_eq!(bench.select(FlightMode::Offboard), Err(OrderRefusal::Failsafe));
    assert_eq!(bench.last.unwrap().failsafe, Some(FailsafeCause::Station));
    bench.heard = true;
    bench.run(0.1);
    assert_eq!(bench.guidance.mode(), FlightMode::Return, "the mode stays");
    assert!(bench.said.contains(&GuidanceNotice::Over(FailsafeCause::Station)));
    assert_eq!(bench.select(FlightMode::Hold), Ok(()));
    assert_eq!(bench.last.unwrap().failsafe, None);
    bring_about(&mut bench, FailsafeCause::Station);
    bench.run(2.0);
    assert_eq!(bench.select(FlightMode::Land), Ok(()), "a stronger one may be selected");
}

#[test]
fn on_the_ground_a_failsafe_disarms() {
    for (number, disarms) in [(1, false), (2, true), (3, true)] {
        let mut bench = Bench::new(with(quiet(), FailsafeCause::Station, number));
        bench.battery = charge(0.8);
        bench.run(1.5);
        bench.arm();
        bench.heard = false;
        bench.run(2.0);
        assert_eq!(bench.core == Mode::Disarmed, disarms);
        assert_eq!(bench.highest_m, 0.0);
    }
}

/// The announcement comes once, also if the vehicle has stood armed for a while.
#[test]
fn a_disarming_is_announced_once_however_long_it_has_stood() {
    for waits_s in [0.05, 3.0] {
        let mut bench = Bench::new(quiet());
        bench.run(1.5);
        bench.arm();
        bench.run(waits_s);
        bench.heard = false;
        bench.run_until(3.0, |guided| guided.request.is_some());
        bench.run(1.0);
        let reported = bench.said.iter().filter(|notice| **notice == GuidanceNotice::Disarms).count();
        assert_eq!((reported, bench.core), (1, Mode::Disarmed), "{:?}", bench.said);
    }
}

/// No take-off, and no climb of a mission or return, leaves the fence.
#[test]
fn climbs_stay_below_the_fence() {
    let mut settings = quiet();
    (settings.failsafe.fence_height_m, settings.flying.takeoff_height_m) = (6.0, 9.0);
    settings.flying.return_height_m = 15.0;
    let mut bench = Bench::new(settings);
    bench.run(1.5);
    assert_eq!(bench.select(FlightMode::Takeoff), Err(OrderRefusal::OutsideFence));
    bench.arm();
    assert_eq!(bench.order(Order::TakeOff(None)), Err(OrderRefusal::OutsideFence));
    bench.items = vec![Item::TakeOff { height_m: 9.0 }];
    bench.run(0.01);
    bench.select(FlightMode::Mission).unwrap();
    bench.run(0.1);
    assert!(bench.said.contains(&GuidanceNotice::ItemRefused) && !bench.airborne());
    let away = |x: f32| Item::Waypoint {
        position_m: Vector3::new(x, 0.0, 4.0),
        yaw_rad: f32::NAN,
        hold_s: 0.0,
        within_m: 0.0,
        fly_through: false,
    };
    bench.items = vec![away(12.0), Item::Return];
    bench.select(FlightMode::Mission).unwrap();
    bench.run_until(60.0, |guided| guided.mode == FlightMode::Return);
    bench.run_until(60.0, |guided| guided.request.is_some());
    assert!(bench.highest_m > 4.5 && bench.highest_m < 5.5, "{}", bench.highest_m);
}

/// A station that was never heard is not lost: pilots may fly with sticks or a companion computer only.
#[test]
fn a_station_that_never_was_is_not_lost() {
    let mut bench = Bench::new(quiet());
    bench.heard = false;
    bench.run(1.5);
    bench.arm();
    bench.order(Order::TakeOff(None)).unwrap();
    bench.run(12.0);
    assert!(bench.core.armed() && bench.guidance.mode() == FlightMode::Hold);
}

/// A loaded battery's voltage sags over its resistance, which does not count as a lower charge.
#[test]
fn the_charge_is_that_without_load() {
    let settings = quiet();
    for current_a in [0.0, 10.0, 30.0] {
        let mut bench = offboard(settings);
        let sag_v = 3.0 * settings.failsafe.resistance_ohm * current_a;
        let voltage_v = 3.0 * (3.6 + 0.45 * 0.3) - sag_v;
        bench.battery = Some(BatteryReading { voltage_v, current_a, charge: None });
        stream(&mut bench, 15.0);
        let charge = bench.last.unwrap().charge.unwrap();
        assert!((charge - 0.3).abs() < 0.01, "{charge}");
        assert!(bench.said.is_empty(), "{:?}", bench.said);
    }
    // Neither a brief voltage drop nor an invalid reading counts as an empty battery.
    let mut bench = offboard(settings);
    bench.battery = Some(BatteryReading { voltage_v: f32::NAN, current_a: 0.0, charge: None });
    stream(&mut bench, 2.0);
    bench.battery = charge(0.0);
    stream(&mut bench, 0.3);
    bench.battery = charge(0.5);
    stream(&mut bench, 10.0);
    assert!(bench.said.is_empty(), "{:?}", bench.said);
}

#[test]
fn a_battery_does_not_recover_in_flight() {
    let mut bench = offboard(with(quiet(), FailsafeCause::BatteryCritical, 0));
    bench.battery = charge(0.06);
    stream(&mut bench, 15.0);
    bench.battery = charge(0.9);
    stream(&mut bench, 15.0);
    assert_eq!(
        bench.said,
        [GuidanceNotice::Found(FailsafeCause::BatteryLow), GuidanceNotice::Found(FailsafeCause::BatteryCritical)]
    );
}

#[test]
fn places_outside_the_fence_are_declined_and_missions_to_them_end() {
    let mut settings = quiet();
    settings.failsafe.fence_height_m = 20.0;
    let mut bench = Bench::hovering(settings);
    bench.battery = charge(0.8);
    let go = |x, z| Order::GoTo { position_m: Vector3::new(x, 0.0, z), yaw_rad: f32::NAN, speed_m_s: None };
    assert_eq!(bench.order(go(30.5, 5.0)), Err(OrderRefusal::OutsideFence));
    assert_eq!(bench.order(go(0.0, 20.5)), Err(OrderRefusal::OutsideFence));
    assert_eq!(bench.order(go(29.0, 19.0)), Ok(()));
    bench.items = vec![Item::Waypoint {
        position_m: Vector3::new(40.0, 0.0, 5.0),
        yaw_rad: f32::NAN,
        hold_s: 0.0,
        within_m: 0.0,
        fly_through: false,
    }];
    bench.tick();
    bench.select(FlightMode::Mission).unwrap();
    bench.run(0.1);
    assert_eq!(bench.guidance.mode(), FlightMode::Hold);
    assert!(bench.said.contains(&GuidanceNotice::ItemRefused));
}

#[test]
fn the_flight_cores_descent_is_a_landing_that_no_order_ends() {
    let mut bench = offboard(quiet());
    (bench.core, bench.sees) = (Mode::Descending, false);
    let guided = bench.tick();
    assert_eq!((guided.mode, guided.setpoint, guided.failsafe), (FlightMode::Land, None, Some(FailsafeCause::Descent)));
    assert_eq!(bench.said, [GuidanceNotice::Mode(FlightMode::Land, ModeReason::Failsafe(FailsafeCause::Descent))]);
    for mode in FlightMode::ALL {
        let expected = if mode == FlightMode::Land { Ok(()) } else { Err(OrderRefusal::Failsafe) };
        assert_eq!(bench.select(mode), expected);
    }
}

/// After an outage of the state, the setpoint starts at the vehicle, not at the old setpoint.
#[test]
fn after_an_outage_the_setpoint_begins_at_the_vehicle() {
    let mut bench = offboard(quiet());
    bench.sees = false;
    bench.run(0.2);
    bench.state.position_m = Vector3::new(-3.0, 4.0, 6.0);
    bench.sees = true;
    let setpoint = bench.tick().setpoint.unwrap();
    assert!((setpoint.position_m - Vector3::new(-3.0, 4.0, 6.0)).norm() < 0.05, "{setpoint:?}");
}

/// Conditions that the flight core checks are not among the guidance's reasons.
#[test]
fn the_guidance_bars_arming_for_its_own_reasons_only() {
    let here = State::default();
    let well = GuidanceInputs {
        now_us: 2_000_000,
        dt_s: 1e-3,
        state: Some(&here),
        reset: None,
        core: Mode::Disarmed,
        airborne: false,
        rested: true,
        battery: charge(0.8),
        sensors: FailedSensors::default(),
        available_thrust: AvailableThrust { most_m_s2: 20.0, gravity_m_s2: 9.81, given_m_s2: None },
    };
    let mut bench = Bench::new(quiet());
    bench.battery = charge(0.8);
    bench.run(1.5);
    let against = |bench: &Bench, sight: &GuidanceInputs<'_>| {
        let mut guidance = bench.guidance;
        let _ = guidance.tick(sight, &Orders::default());
        guidance.arming_refusals().iter().collect::<Vec<_>>()
    };
    let far = State { position_m: Vector3::new(1e3, 0.0, 0.0), ..here };
    let tilted = State { attitude_rad: Vector3::new(0.0, 0.8, 0.0), velocity_m_s: Vector3::new(9.0, 0.0, 0.0), ..here };
    let gnss = FailedSensors { gnss: true, ..FailedSensors::default() };
    for (sight, expected) in [
        (well, vec![]),
        (GuidanceInputs { state: None, rested: false, ..well }, vec![]),
        (GuidanceInputs { state: Some(&tilted), rested: false, ..well }, vec![]),
        (GuidanceInputs { battery: None, ..well }, vec![Refusal::BatteryLow]),
        (GuidanceInputs { sensors: gnss, ..well }, vec![Refusal::SensorFailed]),
        (GuidanceInputs { state: Some(&far), ..well }, vec![Refusal::OutsideFence]),
        (
            GuidanceInputs { state: Some(&far), sensors: gnss, battery: None, ..well },
            vec![Refusal::BatteryLow, Refusal::SensorFailed, Refusal::OutsideFence],
        ),
    ] {
        assert_eq!(against(&bench, &sight), expected, "{sight:?}");
    }
    // Once the vehicle is armed, the reasons against arming stay as they were.
    let armed = GuidanceInputs { core: Mode::Flying, sensors: gnss, ..well };
    assert_eq!(against(&bench, &armed), []);
}

/// Home is set once the flight core reports the vehicle at rest, and not before.
#[test]
fn home_is_where_the_vehicle_has_rested() {
    let mut guidance = Guidance::new(quiet()).unwrap();
    let at = |x: f32| State { position_m: Vector3::new(x, 0.0, 0.0), ..State::default() };
    for (tick, x, rested, home) in
        [(1, 1.0, false, None), (2, 2.0, false, None), (3, 3.0, true, Some(3.0)), (4, 4.0, true, Some(3.0))]
    {
        let state = at(x);
        let sight = GuidanceInputs {
            now_us: tick * 1000,
            dt_s: 1e-3,
            state: Some(&state),
            reset: None,
            core: Mode::Disarmed,
            airborne: false,
            rested,
            battery: None,
            sensors: FailedSensors::default(),
            available_thrust: AvailableThrust { most_m_s2: 20.0, gravity_m_s2: 9.81, given_m_s2: None },
        };
        let guided = guidance.tick(&sight, &Orders::default());
        assert_eq!(guided.home_m.map(|home| home.x), home);
    }
}

#[test]
fn parameters_are_validated_by_name() {
    assert_eq!(Settings::DEFAULT.validate(), Ok(()));
    let failsafe = FailsafeSettings::DEFAULT;
    for (failsafe, name) in [
        (FailsafeSettings { cells: 25, ..failsafe }, "cells"),
        (FailsafeSettings { empty_v: 4.05, ..failsafe }, "empty_v"),
        (FailsafeSettings { critical: 0.2, ..failsafe }, "critical"),
        (FailsafeSettings { emergency: 0.08, ..failsafe }, "emergency"),
    ] {
        let error = Guidance::new(Settings { failsafe, ..Settings::DEFAULT }).unwrap_err();
        assert_eq!(error.range.name, name);
        let mut guidance = Guidance::new(Settings::DEFAULT).unwrap();
        assert!(guidance.set(Settings { failsafe, ..Settings::DEFAULT }).is_err());
        assert_eq!(guidance.settings(), &Settings::DEFAULT, "what is refused changes nothing");
    }
}
