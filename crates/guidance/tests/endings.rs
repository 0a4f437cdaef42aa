//! Tests how modes and flights end, what bars the next arming, and where the setpoint restarts. The test places the
//! vehicle.

use crate::fixture::*;
use afbc_flight_core::landing::LEFT_M;
use afbc_flight_core::{Mode, Refusal, Request, Stamped, Ticketed};
use afbc_guidance::*;
use afbc_types::{Setpoint, State};
use nalgebra::Vector3;

/// After disarming, an autonomous mode becomes hold, and orders are forgotten.
#[test]
fn after_a_flight_it_holds() {
    for (mode, becomes) in [
        (FlightMode::Hold, FlightMode::Hold),
        (FlightMode::Land, FlightMode::Hold),
        (FlightMode::Return, FlightMode::Hold),
        (FlightMode::Position, FlightMode::Position),
        (FlightMode::Stabilised, FlightMode::Stabilised),
    ] {
        let mut fixture = Fixture::flying(Settings::DEFAULT);
        fixture.orders.sticks = Some(Stamped { value: Sticks::default(), at_us: fixture.now_us + 1000 });
        fixture.select(mode).unwrap();
        fixture.said.clear();
        (fixture.core, fixture.airborne) = (Mode::Disarmed, false);
        let guided = fixture.tick();
        assert_eq!((guided.mode, guided.request), (becomes, None));
        let reported: &[GuidanceNotice] =
            if mode == becomes { &[] } else { &[GuidanceNotice::Mode(FlightMode::Hold, ModeReason::Disarmed)] };
        assert_eq!(fixture.said, reported, "{mode:?}");
    }
}

/// On the ground the guidance requests disarming: at once when landing, otherwise after a time, repeated ten times per
/// second until granted. It never does so in the air, nor if the time is zero.
#[test]
fn it_asks_to_disarm_on_the_ground() {
    let asks = |fixture: &mut Fixture, ticks: u32| -> Vec<u32> {
        (1..=ticks).filter(|_| fixture.tick().request == Some(Request::Disarm)).collect()
    };
    let armed = |settings: Settings| {
        let mut fixture = Fixture::new(settings);
        fixture.run(1100);
        fixture.core = Mode::Flying;
        fixture
    };
    let timed = |before: f32, after: f32| {
        let flying =
            FlightModeSettings { disarm_before_s: before, disarm_after_s: after, ..FlightModeSettings::DEFAULT };
        Settings { flying, ..Settings::DEFAULT }
    };
    let mut fixture = armed(timed(1.0, 0.5));
    let times = asks(&mut fixture, 1400);
    assert!(times.len() == 4 && (998..=1002).contains(times.first().unwrap()), "{times:?}");
    assert!(times.iter().zip(times.iter().skip(1)).all(|(one, next)| (99..=101).contains(&(next - one))), "{times:?}");
    assert_eq!(fixture.said, [GuidanceNotice::Disarms]);
    // After a flight, the guidance disarms after another time, counted from touchdown.
    fixture.airborne = true;
    assert_eq!(asks(&mut fixture, 3000), []);
    fixture.airborne = false;
    let times = asks(&mut fixture, 600);
    assert!((498..=502).contains(times.first().unwrap()), "{times:?}");
    assert_eq!(fixture.said, [GuidanceNotice::Disarms; 2]);
    assert_eq!(asks(&mut armed(timed(0.0, 0.0)), 5000), [], "never");
    // If the vehicle is disarmed meanwhile, the time until the guidance disarms it begins anew.
    let mut fixture = armed(timed(1.0, 0.5));
    assert_eq!(asks(&mut fixture, 900), []);
    fixture.core = Mode::Disarmed;
    assert_eq!(asks(&mut fixture, 2000), []);
    fixture.core = Mode::Flying;
    assert_eq!(asks(&mut fixture, 900), []);
    // A landing vehicle disarms at once.
    let mut fixture = Fixture::flying(timed(0.0, 0.0));
    fixture.select(FlightMode::Land).unwrap();
    assert_eq!(asks(&mut fixture, 500), []);
    fixture.airborne = false;
    assert_eq!(asks(&mut fixture, 150), [1, 101]);
    // A vehicle that is about to take off does not wait.
    let mut fixture = armed(timed(0.5, 0.5));
    fixture.run(10);
    fixture.order(Order::TakeOff(None)).unwrap();
    assert_eq!(asks(&mut fixture, 2000), []);
}

/// The guidance has its own reasons against arming: the battery is unknown or low, sensors have failed, or the vehicle
/// is outside the fence.
#[test]
fn what_bars_arming_has_its_limits() {
    let bars = |change: &dyn Fn(&mut Fixture)| {
        let failsafe = FailsafeSettings { cells: 3, fence_radius_m: 10.0, ..FailsafeSettings::DEFAULT };
        let mut fixture = Fixture::new(Settings { failsafe, ..Settings::DEFAULT });
        fixture.battery = Some(BatteryReading { voltage_v: 11.7, current_a: 0.0, charge: None });
        fixture.run(1100);
        change(&mut fixture);
        fixture.tick();
        fixture.guidance.arming_refusals().iter().collect::<Vec<_>>()
    };
    assert_eq!(bars(&|_| ()), []);
    assert_eq!(bars(&|fixture| fixture.state.as_mut().unwrap().position_m.x = 10.9), [], "10 m from home, at x = 1 m");
    assert_eq!(bars(&|fixture| fixture.state.as_mut().unwrap().position_m.x = 11.1), [Refusal::OutsideFence]);
    assert_eq!(bars(&|fixture| fixture.battery = None), [Refusal::BatteryLow]);
    assert_eq!(bars(&|fixture| fixture.sensors.tracker = true), [Refusal::SensorFailed]);
    let low = bars(&|fixture| {
        fixture.battery = Some(BatteryReading { voltage_v: 10.8, current_a: 0.0, charge: None });
        fixture.run(9000);
    });
    assert_eq!(low, [Refusal::BatteryLow]);
    let both = bars(&|fixture| {
        fixture.sensors.tracker = true;
        fixture.state.as_mut().unwrap().position_m.y = 15.0;
    });
    assert_eq!(both, [Refusal::SensorFailed, Refusal::OutsideFence]);
    // A battery without cells is not monitored. With cells, its charge is unknown before the first plausible reading.
    let mut fixture = Fixture::new(Settings::DEFAULT);
    fixture.run(1100);
    assert!(fixture.guidance.arming_refusals().is_empty());
    let failsafe = FailsafeSettings { cells: 3, ..FailsafeSettings::DEFAULT };
    let mut fixture = Fixture::new(Settings { failsafe, ..Settings::DEFAULT });
    fixture.battery = Some(BatteryReading { voltage_v: NAN, current_a: 0.0, charge: None });
    fixture.run(1100);
    assert!(fixture.guidance.arming_refusals().iter().eq([Refusal::BatteryLow]));
}

/// The setpoint restarts at a vehicle farther away than a limit, which is tighter when the mode changes or the state
/// returns, and grows by the distance flown in a second. On such a change it also restarts if the velocity differs. A
/// setpoint that passes the limiter unchanged, such as a held place, does not restart.
#[test]
fn the_setpoint_keeps_to_the_vehicle() {
    // Returns true if the setpoint restarts at a vehicle that is away from it. The distance is `off` plus the distance
    // of a second, times `share`. The velocity differs by `other_m_s`.
    let begins_anew = |off: Vector3<f32>, share: f32, other_m_s: Vector3<f32>, change: &dyn Fn(&mut Fixture)| {
        let mut fixture = Fixture::flying(Settings::DEFAULT);
        let order = Order::GoTo { position_m: Vector3::new(1.0, 90.0, 8.0), yaw_rad: NAN, speed_m_s: Some(0.5) };
        fixture.order(order).unwrap();
        fixture.run(4000);
        let Setpoint { position_m, velocity_m_s, .. } = fixture.setpoint();
        assert!((velocity_m_s.y - 0.49).abs() < 0.01 && velocity_m_s.x == 0.0);
        fixture.follows = false;
        let there = position_m + (off + off.normalize() * velocity_m_s.y) * share;
        fixture.state = Some(State { velocity_m_s: velocity_m_s + other_m_s, ..at(there.x, there.y, there.z) });
        change(&mut fixture);
        let setpoint = fixture.setpoint();
        (setpoint.position_m - there).norm() < 0.01
    };
    let (x, y, z, none) = (Vector3::x(), Vector3::y(), Vector3::z(), Vector3::zeros());
    let both = |off: Vector3<f32>, change: &dyn Fn(&mut Fixture)| {
        let within = begins_anew(off, 0.99, none, change);
        let beyond = begins_anew(off, 1.01, none, change);
        assert!(!within && beyond, "{off:?}: {within}, {beyond}");
    };
    let goes_on = |_: &mut Fixture| ();
    let gap = |fixture: &mut Fixture| {
        let state = fixture.state.take();
        let _ = fixture.tick();
        fixture.state = state;
    };
    let lands = |fixture: &mut Fixture| {
        fixture.orders.given.push_back(Ticketed { value: Order::Select(FlightMode::Land), ticket: 1 }).unwrap();
    };
    for axis in [x, -x, y, -y, z, -z] {
        both(axis * 5.0, &goes_on);
        both(axis, &gap);
        assert!(!begins_anew(x * 0.5, 1.0, axis * 9.0, &goes_on));
        for change in [&gap as &dyn Fn(&mut Fixture), &lands] {
            assert!(!begins_anew(x * 0.3, 1.0, axis * 1.49, change) && begins_anew(x * 0.3, 1.0, axis * 1.51, change));
        }
        if axis.z <= 0.0 {
            both(axis, &lands);
        } else {
            // A setpoint below a landing vehicle presses it onto the ground.
            assert!(!begins_anew(axis * 4.0, 1.0, none, &lands));
        }
    }
    let mut fixture = Fixture::flying(Settings::DEFAULT);
    fixture.run(3000);
    (fixture.follows, fixture.state) = (false, Some(at(90.0, 2.0, 8.0)));
    assert!((fixture.setpoint().position_m - Vector3::new(1.0, 2.0, 8.0)).norm() < 0.01, "a place that is held");
}

/// A take-off that does not leave the ground is given up after 10 s. On the ground the vehicle then idles. If the
/// flight core reports it in the air, but it has not moved and the rotors are exhausted, it lands.
#[test]
fn a_takeoff_without_lift_is_given_up() {
    let takes_off = |airborne: bool, given_m_s2: Option<f32>, up_m: f32| {
        let mut fixture = Fixture::new(Settings::DEFAULT);
        (fixture.follows, fixture.lift.given_m_s2) = (false, given_m_s2);
        fixture.run(1100);
        fixture.core = Mode::Flying;
        fixture.run(10);
        fixture.order(Order::TakeOff(None)).unwrap();
        (fixture.airborne, fixture.state) = (airborne, Some(at(1.0, 2.0, 3.0 + up_m)));
        fixture.said.clear();
        let gives_up = (1..12_000).find(|_| fixture.tick().notices.iter().next().is_some());
        (gives_up, fixture.guidance.mode(), fixture.said.clone(), fixture.tick().idle_on_ground)
    };
    let exhausted = Some(2.0 * G);
    let (after, mode, said, rests) = takes_off(false, None, 0.0);
    assert!(after.is_some_and(|ticks| (9_990..10_010).contains(&ticks)), "{after:?}");
    assert_eq!((mode, rests), (FlightMode::Hold, true));
    assert_eq!(said, [GuidanceNotice::Mode(FlightMode::Hold, ModeReason::NoLift)]);
    let (after, mode, said, rests) = takes_off(true, exhausted, 0.9 * LEFT_M);
    assert!(after.is_some_and(|ticks| (9_990..10_010).contains(&ticks)), "{after:?}");
    assert_eq!((mode, rests), (FlightMode::Land, false));
    assert_eq!(said, [GuidanceNotice::Mode(FlightMode::Land, ModeReason::NoLift)]);
    // With thrust in reserve the vehicle counts as flying, unless it does not follow: the setpoint is 1 m away after
    // about a second.
    for given_m_s2 in [Some(1.7 * G), None] {
        let (after, mode, ..) = takes_off(true, given_m_s2, 0.0);
        assert!(after.is_some_and(|ticks| (10_500..12_000).contains(&ticks)), "{after:?}");
        assert_eq!(mode, FlightMode::Land);
    }
    // Off the ground, the vehicle counts as flying.
    assert_eq!(takes_off(true, exhausted, 1.1 * LEFT_M).0, None);
    // If the flight core reports it on the ground, a position change alone does not count as leaving.
    assert!(takes_off(false, None, 1.1 * LEFT_M).0.is_some());
}

/// A landing vehicle that stays above its setpoint has touched the ground: its motors idle for a while, unless it
/// falls. The check is off without an inertial sensor, since the motion then follows from the thrust, and while the
/// flight core descends.
#[test]
fn a_touch_idles_the_motors_of_a_landing_vehicle() {
    // Returns the first tick with idle motors and their number. The vehicle stops following its setpoint, and sinks
    // with one velocity until the motors idle, and another afterwards.
    let idles = |inertial: bool, core: Mode, [before, after]: [f32; 2], mode: FlightMode| {
        let mut fixture = Fixture::flying(Settings::DEFAULT);
        fixture.sensors.inertial = inertial;
        fixture.select(mode).unwrap();
        fixture.run(4000);
        fixture.core = core;
        fixture.follows = false;
        let mut state = fixture.state.unwrap();
        state.attitude_rad = Vector3::new(0.4, -0.3, 0.3);
        state.velocity_m_s = Vector3::new(0.1, 0.2, before);
        let (mut first, mut count) = (None, 0);
        for tick in 0..5000 {
            state.velocity_m_s.z = if first.is_some() { after } else { before };
            fixture.state = Some(state);
            let guided = fixture.tick();
            if guided.idle_on_ground {
                first.get_or_insert(tick);
                count += 1;
            }
        }
        (first, count)
    };
    let land = |velocities: [f32; 2]| idles(false, Mode::Flying, velocities, FlightMode::Land);
    // At 0.7 m/s, it falls behind by 0.3 m within about 0.4 s, and the check takes 0.1 s.
    let (first, count) = land([0.0; 2]);
    assert!(first.is_some_and(|first| (450..700).contains(&first)), "{first:?}");
    assert!((2990..=3010).contains(&count), "{count}");
    assert!(land([-0.55; 2]).0.is_some());
    assert_eq!(land([-0.57; 2]).0, None, "it sinks");
    assert!(land([0.0, -0.95]).1 > 2990, "it drops from an edge");
    assert_eq!(land([0.0, -1.05]).1, 1, "it falls");
    assert_eq!(idles(true, Mode::Flying, [0.0; 2], FlightMode::Land).0, None, "without the sensor");
    assert_eq!(idles(false, Mode::Descending, [0.0; 2], FlightMode::Land).0, None, "another descent");
    assert_eq!(idles(false, Mode::Flying, [0.0; 2], FlightMode::Hold).0, None, "no landing");
}

/// Hold keeps the place that a mode has reached: the end of a take-off, or the last waypoint.
#[test]
fn what_is_reached_is_held() {
    let mut fixture = Fixture::new(Settings::DEFAULT);
    fixture.run(1100);
    fixture.core = Mode::Flying;
    fixture.run(10);
    fixture.order(Order::TakeOff(Some(4.0))).unwrap();
    fixture.airborne = true;
    fixture.run(15_000);
    assert_eq!((fixture.guidance.mode(), fixture.place()), (FlightMode::Hold, Vector3::new(1.0, 2.0, 7.0)));
    let end = Vector3::new(6.0, 2.0, 7.0);
    let item = Item::Waypoint { position_m: end, yaw_rad: NAN, hold_s: 0.0, within_m: 1.5, fly_through: true };
    fixture.orders.leg = Some(RequestedItem { number: 0, upload: 1, item, is_last: true });
    fixture.select(FlightMode::Mission).unwrap();
    fixture.run(12_000);
    assert_eq!((fixture.guidance.mode(), fixture.place()), (FlightMode::Hold, end), "not where it was within 1.5 m");
    // An item that cannot be flown ends the mission at the present place.
    fixture.orders.leg = Some(RequestedItem { number: 0, upload: 2, item: Item::Speed(NAN), is_last: true });
    fixture.said.clear();
    fixture.select(FlightMode::Mission).unwrap();
    fixture.run(3000);
    assert_eq!((fixture.guidance.mode(), fixture.place()), (FlightMode::Hold, end));
    assert!(fixture.said.contains(&GuidanceNotice::ItemRefused), "{:?}", fixture.said);
    // On the ground, hold is where the vehicle stands.
    fixture.airborne = false;
    fixture.state = Some(at(3.0, 3.0, 3.0));
    fixture.run(10);
    fixture.airborne = true;
    fixture.run(2000);
    assert_eq!(fixture.place(), Vector3::new(3.0, 3.0, 3.0));
}

/// A mission may end in another mode, in the air and on the ground.
#[test]
fn a_mission_may_end_in_another_mode() {
    for airborne in [true, false] {
        let mut fixture = Fixture::flying(Settings::DEFAULT);
        fixture.airborne = airborne;
        fixture.orders.leg = Some(RequestedItem { number: 0, upload: 1, item: Item::Return, is_last: true });
        fixture.said.clear();
        fixture.select(FlightMode::Mission).unwrap();
        assert_eq!(fixture.guidance.mode(), FlightMode::Return);
        let modes = [FlightMode::Mission, FlightMode::Return];
        let reasons = [ModeReason::Ordered, ModeReason::Mission];
        let expected = modes.into_iter().zip(reasons).map(|(mode, reason)| GuidanceNotice::Mode(mode, reason));
        let reported: Vec<_> =
            fixture.said.iter().filter(|notice| **notice != GuidanceNotice::Disarms).copied().collect();
        assert_eq!(reported, expected.collect::<Vec<_>>());
    }
}

/// In altitude mode, the setpoint has the vehicle's own horizontal position and velocity. The height is held, and the
/// sticks command the tilt.
#[test]
fn leaning_keeps_to_the_vehicle_horizontally() {
    let mut fixture = Fixture::flying(Settings::DEFAULT);
    fixture.follows = false;
    let value = Sticks { pitch: 0.5, ..Sticks::default() };
    let mut found = None;
    for tick in 0..2000 {
        fixture.orders.sticks = Some(Stamped { value, at_us: fixture.now_us });
        let x = 1.0 + tick as f32 * 2e-3;
        let mut state = State { velocity_m_s: Vector3::new(2.0, 0.1, 0.0), ..at(x, 2.0, 8.1) };
        // The tilt that the sticks command.
        state.attitude_rad.y = 0.3;
        fixture.state = Some(state);
        if tick == 0 {
            fixture.select(FlightMode::Altitude).unwrap();
        }
        found = fixture.tick().setpoint.map(|setpoint| (setpoint, state));
    }
    let (setpoint, state) = found.unwrap();
    assert_eq!(setpoint.position_m.xy(), state.position_m.xy());
    assert_eq!(setpoint.velocity_m_s, Vector3::new(2.0, 0.1, 0.0));
    assert!((setpoint.position_m.z - 8.1).abs() < 0.11, "{setpoint:?}");
    let lean = G * f32::tan(0.3);
    assert!((setpoint.acceleration_m_s2 - Vector3::new(lean, 0.0, 0.0)).norm() < 0.05, "{setpoint:?}");
}

/// A cleared mission ends in hold, in the air and on the ground, and cannot be selected any more.
#[test]
fn a_mission_that_is_cleared_is_not_flown_on() {
    for airborne in [true, false] {
        let mut fixture = Fixture::flying(Settings::DEFAULT);
        fixture.airborne = airborne;
        let item = Item::Waypoint {
            position_m: Vector3::new(60.0, 2.0, 7.0),
            yaw_rad: NAN,
            hold_s: 0.0,
            within_m: 0.0,
            fly_through: false,
        };
        fixture.orders.leg = Some(RequestedItem { number: 0, upload: 1, item, is_last: true });
        fixture.select(FlightMode::Mission).unwrap();
        fixture.run(3000);
        assert_eq!(fixture.guidance.mode(), FlightMode::Mission);
        fixture.orders.leg = Some(RequestedItem { number: 0, upload: 2, item: Item::None, is_last: true });
        fixture.said.clear();
        fixture.run(5000);
        assert_eq!(fixture.guidance.mode(), FlightMode::Hold);
        assert_eq!(fixture.said.first(), Some(&GuidanceNotice::Mode(FlightMode::Hold, ModeReason::Cleared)));
        assert!(fixture.place().x < 50.0, "{}", fixture.place());
        assert_eq!(fixture.select(FlightMode::Mission), Err(OrderRefusal::NoMission));
        assert_eq!(fixture.would(Order::Resume(0)), Err(OrderRefusal::NoMission));
    }
}

/// An item selected in a new mission is flown, whatever was flown before.
#[test]
fn an_item_is_chosen_of_the_mission_that_there_is() {
    let mut fixture = Fixture::flying(Settings::DEFAULT);
    let leg = |upload| Some(RequestedItem { number: 2, upload, item: Item::Wait(60.0), is_last: true });
    fixture.orders.leg = leg(1);
    fixture.order(Order::Resume(2)).unwrap();
    fixture.select(FlightMode::Mission).unwrap();
    fixture.run(100);
    fixture.select(FlightMode::Hold).unwrap();
    fixture.orders.leg = leg(2);
    fixture.order(Order::Resume(2)).unwrap();
    fixture.select(FlightMode::Mission).unwrap();
    assert_eq!(fixture.tick().wanted, 2);
}
