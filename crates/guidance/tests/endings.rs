//! How modes and flights end, what bars the next one, and where the setpoint begins: with a vehicle that is where the
//! test puts it.
#![allow(clippy::unwrap_used, reason = "tests")]

mod desk;

use afbc_flight_core::landing::LEFT_M;
use afbc_flight_core::{Mode, Refusal, Request, Stamped};
use afbc_guidance::*;
use afbc_types::{Setpoint, State};
use desk::*;
use nalgebra::Vector3;

/// When the motors stop, a mode that flies by itself becomes hold, and what was ordered is forgotten.
#[test]
fn after_a_flight_it_holds() {
    for (mode, becomes) in [
        (FlightMode::Hold, FlightMode::Hold),
        (FlightMode::Land, FlightMode::Hold),
        (FlightMode::Return, FlightMode::Hold),
        (FlightMode::Position, FlightMode::Position),
        (FlightMode::Stabilised, FlightMode::Stabilised),
    ] {
        let mut desk = Desk::flying(Settings::DEFAULT);
        desk.orders.sticks = Some(Stamped { value: Sticks::default(), at_us: desk.now_us + 1000 });
        desk.select(mode).unwrap();
        desk.said.clear();
        (desk.core, desk.airborne) = (Mode::Disarmed, false);
        let guided = desk.tick();
        assert_eq!((guided.mode, guided.request), (becomes, None));
        let told: &[Notice] = if mode == becomes { &[] } else { &[Notice::Mode(FlightMode::Hold, Reason::Disarmed)] };
        assert_eq!(desk.said, told, "{mode:?}");
    }
}

/// On the ground it asks for the motors to stop: at once when it lands, after a while otherwise, and ten times per
/// second until they do; never in the air, nor if the time is zero.
#[test]
fn it_asks_to_disarm_on_the_ground() {
    let asks = |desk: &mut Desk, ticks: u32| -> Vec<u32> {
        (1..=ticks).filter(|_| desk.tick().request == Some(Request::Disarm)).collect()
    };
    let armed = |settings: Settings| {
        let mut desk = Desk::new(settings);
        desk.run(1100);
        desk.core = Mode::Flying;
        desk
    };
    let timed = |before: f32, after: f32| {
        let flying = Flying { disarm_before_s: before, disarm_after_s: after, ..Flying::DEFAULT };
        Settings { flying, ..Settings::DEFAULT }
    };
    let mut desk = armed(timed(1.0, 0.5));
    let times = asks(&mut desk, 1400);
    assert!(times.len() == 4 && (998..=1002).contains(times.first().unwrap()), "{times:?}");
    assert!(times.iter().zip(times.iter().skip(1)).all(|(one, next)| (99..=101).contains(&(next - one))), "{times:?}");
    assert_eq!(desk.said, [Notice::Disarms]);
    // After a flight it is another time, from the touch-down on.
    desk.airborne = true;
    assert_eq!(asks(&mut desk, 3000), []);
    desk.airborne = false;
    let times = asks(&mut desk, 600);
    assert!((498..=502).contains(times.first().unwrap()), "{times:?}");
    assert_eq!(desk.said, [Notice::Disarms; 2]);
    assert_eq!(asks(&mut armed(timed(0.0, 0.0)), 5000), [], "never");
    // Disarmed in between, the time begins anew.
    let mut desk = armed(timed(1.0, 0.5));
    assert_eq!(asks(&mut desk, 900), []);
    desk.core = Mode::Disarmed;
    assert_eq!(asks(&mut desk, 2000), []);
    desk.core = Mode::Flying;
    assert_eq!(asks(&mut desk, 900), []);
    // A landing vehicle disarms at once.
    let mut desk = Desk::flying(timed(0.0, 0.0));
    desk.select(FlightMode::Land).unwrap();
    assert_eq!(asks(&mut desk, 500), []);
    desk.airborne = false;
    assert_eq!(asks(&mut desk, 150), [1, 101]);
    // One that shall take off does not wait.
    let mut desk = armed(timed(0.5, 0.5));
    desk.run(10);
    desk.order(Order::TakeOff(None)).unwrap();
    assert_eq!(asks(&mut desk, 2000), []);
}

/// What speaks against arming besides what the flight core sees: a battery that is not known or low, sensors, the
/// fence.
#[test]
fn what_bars_arming_has_its_limits() {
    let bars = |change: &dyn Fn(&mut Desk)| {
        let net = Net { cells: 3.0, fence_radius_m: 10.0, ..Net::DEFAULT };
        let mut desk = Desk::new(Settings { net, ..Settings::DEFAULT });
        desk.battery = Some(Reading { voltage_v: 11.7, current_a: 0.0 });
        desk.run(1100);
        change(&mut desk);
        desk.tick().against.iter().collect::<Vec<_>>()
    };
    assert_eq!(bars(&|_| ()), []);
    assert_eq!(bars(&|desk| desk.state.as_mut().unwrap().position_m.x = 10.9), [], "10 m from home, at x = 1 m");
    assert_eq!(bars(&|desk| desk.state.as_mut().unwrap().position_m.x = 11.1), [Refusal::OutsideFence]);
    assert_eq!(bars(&|desk| desk.battery = None), [Refusal::BatteryLow]);
    assert_eq!(bars(&|desk| desk.sensors.tracker = true), [Refusal::SensorFailed]);
    let low = bars(&|desk| {
        desk.battery = Some(Reading { voltage_v: 10.8, current_a: 0.0 });
        desk.run(9000);
    });
    assert_eq!(low, [Refusal::BatteryLow]);
    let both = bars(&|desk| {
        desk.sensors.tracker = true;
        desk.state.as_mut().unwrap().position_m.y = 15.0;
    });
    assert_eq!(both, [Refusal::SensorFailed, Refusal::OutsideFence]);
    // Not watched without cells, and never known before the first reading.
    assert!(Desk::new(Settings::DEFAULT).run(1100).against.is_empty());
    let net = Net { cells: 3.0, ..Net::DEFAULT };
    let mut desk = Desk::new(Settings { net, ..Settings::DEFAULT });
    desk.battery = Some(Reading { voltage_v: NAN, current_a: 0.0 });
    assert!(desk.run(1100).against.iter().eq([Refusal::BatteryLow]));
}

/// The setpoint begins anew at a vehicle that is farther from it than its leash, or than a short one when the mode
/// changes or the state returns, both longer by a second's way; likewise at one that then moves otherwise. One that
/// passes unchanged, as a place that is held, does not.
#[test]
fn the_setpoint_keeps_to_the_vehicle() {
    // A vehicle beside its setpoint by this and a second's way, times a share, at another velocity by this.
    let begins_anew = |off: Vector3<f32>, share: f32, other_m_s: Vector3<f32>, change: &dyn Fn(&mut Desk)| {
        let mut desk = Desk::flying(Settings::DEFAULT);
        let order = Order::GoTo { position_m: Vector3::new(1.0, 90.0, 8.0), yaw_rad: NAN, speed_m_s: Some(0.5) };
        desk.order(order).unwrap();
        desk.run(4000);
        let Setpoint { position_m, velocity_m_s, .. } = desk.setpoint();
        assert!((velocity_m_s.y - 0.49).abs() < 0.01 && velocity_m_s.x == 0.0);
        desk.follows = false;
        let there = position_m + (off + off.normalize() * velocity_m_s.y) * share;
        desk.state = Some(State { velocity_m_s: velocity_m_s + other_m_s, ..at(there.x, there.y, there.z) });
        change(&mut desk);
        let setpoint = desk.setpoint();
        (setpoint.position_m - there).norm() < 0.01
    };
    let (x, y, z, none) = (Vector3::x(), Vector3::y(), Vector3::z(), Vector3::zeros());
    let both = |off: Vector3<f32>, change: &dyn Fn(&mut Desk)| {
        let within = begins_anew(off, 0.99, none, change);
        let beyond = begins_anew(off, 1.01, none, change);
        assert!(!within && beyond, "{off:?}: {within}, {beyond}");
    };
    let goes_on = |_: &mut Desk| ();
    let gap = |desk: &mut Desk| {
        let state = desk.state.take();
        let _ = desk.tick();
        desk.state = state;
    };
    let lands = |desk: &mut Desk| {
        desk.orders.give(Given { order: Order::Select(FlightMode::Land), ticket: 1 });
    };
    for axis in [x, -x, y, -y, z, -z] {
        both(axis * 5.0, &goes_on);
        both(axis, &gap);
        assert!(!begins_anew(x * 0.5, 1.0, axis * 9.0, &goes_on));
        for change in [&gap as &dyn Fn(&mut Desk), &lands] {
            assert!(!begins_anew(x * 0.3, 1.0, axis * 1.49, change) && begins_anew(x * 0.3, 1.0, axis * 1.51, change));
        }
        if axis.z <= 0.0 {
            both(axis, &lands);
        } else {
            // A setpoint below a landing vehicle presses it onto the ground.
            assert!(!begins_anew(axis * 4.0, 1.0, none, &lands));
        }
    }
    let mut desk = Desk::flying(Settings::DEFAULT);
    desk.run(3000);
    (desk.follows, desk.state) = (false, Some(at(90.0, 2.0, 8.0)));
    assert!((desk.setpoint().position_m - Vector3::new(1.0, 2.0, 8.0)).norm() < 0.01, "a place that is held");
}

/// A take-off that does not leave the ground is given up after ten seconds: on the ground it rests, and one that the
/// flight core believes in the air without having left, with rotors that give all they can, lands.
#[test]
fn a_takeoff_without_lift_is_given_up() {
    let takes_off = |airborne: bool, given_m_s2: Option<f32>, up_m: f32| {
        let mut desk = Desk::new(Settings::DEFAULT);
        (desk.follows, desk.lift.given_m_s2) = (false, given_m_s2);
        desk.run(1100);
        desk.core = Mode::Flying;
        desk.run(10);
        desk.order(Order::TakeOff(None)).unwrap();
        (desk.airborne, desk.state) = (airborne, Some(at(1.0, 2.0, 3.0 + up_m)));
        desk.said.clear();
        let gives_up = (1..12_000).find(|_| desk.tick().notices.iter().next().is_some());
        (gives_up, desk.guidance.mode(), desk.said.clone(), desk.tick().rests)
    };
    let exhausted = Some(2.0 * G);
    let (after, mode, said, rests) = takes_off(false, None, 0.0);
    assert!(after.is_some_and(|ticks| (9_990..10_010).contains(&ticks)), "{after:?}");
    assert_eq!((mode, rests), (FlightMode::Hold, true));
    assert_eq!(said, [Notice::Mode(FlightMode::Hold, Reason::NoLift)]);
    let (after, mode, said, rests) = takes_off(true, exhausted, 0.9 * LEFT_M);
    assert!(after.is_some_and(|ticks| (9_990..10_010).contains(&ticks)), "{after:?}");
    assert_eq!((mode, rests), (FlightMode::Land, false));
    assert_eq!(said, [Notice::Mode(FlightMode::Land, Reason::NoLift)]);
    // With thrust to spare it flies, unless it does not follow: the setpoint is a metre away a second later.
    for given_m_s2 in [Some(1.7 * G), None] {
        let (after, mode, ..) = takes_off(true, given_m_s2, 0.0);
        assert!(after.is_some_and(|ticks| (10_500..12_000).contains(&ticks)), "{after:?}");
        assert_eq!(mode, FlightMode::Land);
    }
    // Off the ground it flies.
    assert_eq!(takes_off(true, exhausted, 1.1 * LEFT_M).0, None);
    // Not in the air it has not left, wherever its tracker says that it is.
    assert!(takes_off(false, None, 1.1 * LEFT_M).0.is_some());
}

/// A landing vehicle that stays above its setpoint stands on the ground: for a while it is asked for less thrust, as it
/// stands. Without an inertial sensor its motion follows from its thrust, and this is left out.
#[test]
fn a_touch_settles_a_landing_vehicle() {
    // Ticks after which it settles and after which this ends, of a vehicle that stops sinking and then has this
    // velocity.
    let settles = |inertial: bool, velocity_z: f32, mode: FlightMode| {
        let mut desk = Desk::flying(Settings::DEFAULT);
        desk.sensors.inertial = inertial;
        desk.select(mode).unwrap();
        desk.run(4000);
        desk.follows = false;
        let mut state = desk.state.unwrap();
        state.velocity_m_s = Vector3::new(0.1, 0.2, velocity_z);
        state.attitude_rad.z = 0.3;
        desk.state = Some(state);
        let settled = Setpoint {
            position_m: state.position_m,
            velocity_m_s: state.velocity_m_s,
            acceleration_m_s2: Vector3::new(0.0, 0.0, -0.7 * G),
            yaw_rad: 0.3,
            ..Setpoint::default()
        };
        let is_settled: Vec<bool> = (0..5000)
            .map(|_| {
                let found = desk.setpoint();
                let off_m_s2 = (found.acceleration_m_s2 - settled.acceleration_m_s2).norm();
                off_m_s2 < 1e-5 && Setpoint { acceleration_m_s2: settled.acceleration_m_s2, ..found } == settled
            })
            .collect();
        let first = is_settled.iter().position(|settled| *settled);
        (first, is_settled.iter().filter(|settled| **settled).count())
    };
    // It falls behind by 0.1 m within some 0.15 s at 0.7 m/s, and 0.1 s count.
    let (first, count) = settles(false, 0.0, FlightMode::Land);
    assert!(first.is_some_and(|first| (150..400).contains(&first)), "{first:?}");
    assert!((2990..=3010).contains(&count), "{count}");
    assert!(settles(false, -0.24, FlightMode::Land).0.is_some());
    assert_eq!(settles(false, -0.26, FlightMode::Land).0, None, "it sinks");
    assert_eq!(settles(true, 0.0, FlightMode::Land).0, None, "without the sensor");
    assert_eq!(settles(false, 0.0, FlightMode::Hold).0, None, "no landing");
}

/// What a mode has reached, hold keeps: the end of a take-off, or the last waypoint.
#[test]
fn what_is_reached_is_held() {
    let mut desk = Desk::new(Settings::DEFAULT);
    desk.run(1100);
    desk.core = Mode::Flying;
    desk.run(10);
    desk.order(Order::TakeOff(Some(4.0))).unwrap();
    desk.airborne = true;
    desk.run(15_000);
    assert_eq!((desk.guidance.mode(), desk.place()), (FlightMode::Hold, Vector3::new(1.0, 2.0, 7.0)));
    let end = Vector3::new(6.0, 2.0, 7.0);
    let item = Item::Waypoint { position_m: end, yaw_rad: NAN, hold_s: 0.0, within_m: 1.5, fly_through: true };
    desk.orders.leg = Some(Leg { number: 0, upload: 1, item, is_last: true });
    desk.select(FlightMode::Mission).unwrap();
    desk.run(12_000);
    assert_eq!((desk.guidance.mode(), desk.place()), (FlightMode::Hold, end), "not where it was within 1.5 m");
    // An item that cannot be flown ends a mission where it is.
    desk.orders.leg = Some(Leg { number: 0, upload: 2, item: Item::Speed(NAN), is_last: true });
    desk.said.clear();
    desk.select(FlightMode::Mission).unwrap();
    desk.run(3000);
    assert_eq!((desk.guidance.mode(), desk.place()), (FlightMode::Hold, end));
    assert!(desk.said.contains(&Notice::ItemRefused), "{:?}", desk.said);
    // On the ground a hold is where the vehicle stands.
    desk.airborne = false;
    desk.state = Some(at(3.0, 3.0, 3.0));
    desk.run(10);
    desk.airborne = true;
    desk.run(2000);
    assert_eq!(desk.place(), Vector3::new(3.0, 3.0, 3.0));
}

/// An ending of a mission in the air leaves the setpoint where it is; on the ground it stays there.
#[test]
fn a_mission_may_end_in_another_mode() {
    for airborne in [true, false] {
        let mut desk = Desk::flying(Settings::DEFAULT);
        desk.airborne = airborne;
        desk.orders.leg = Some(Leg { number: 0, upload: 1, item: Item::Return, is_last: true });
        desk.said.clear();
        desk.select(FlightMode::Mission).unwrap();
        assert_eq!(desk.guidance.mode(), FlightMode::Return);
        let modes = [FlightMode::Mission, FlightMode::Return];
        let reasons = [Reason::Ordered, Reason::Mission];
        let expected = modes.into_iter().zip(reasons).map(|(mode, reason)| Notice::Mode(mode, reason));
        let told: Vec<_> = desk.said.iter().filter(|notice| **notice != Notice::Disarms).copied().collect();
        assert_eq!(told, expected.collect::<Vec<_>>());
    }
}

/// With the sticks in altitude mode position and velocity are the vehicle's horizontally, the height is held, and the
/// lean is what the sticks say.
#[test]
fn leaning_keeps_to_the_vehicle_horizontally() {
    let mut desk = Desk::flying(Settings::DEFAULT);
    desk.follows = false;
    let value = Sticks { pitch: 0.5, ..Sticks::default() };
    let mut found = None;
    for tick in 0..2000 {
        desk.orders.sticks = Some(Stamped { value, at_us: desk.now_us });
        let x = 1.0 + tick as f32 * 2e-3;
        let mut state = State { velocity_m_s: Vector3::new(2.0, 0.1, 0.0), ..at(x, 2.0, 8.1) };
        // As the sticks want.
        state.attitude_rad.y = 0.3;
        desk.state = Some(state);
        if tick == 0 {
            desk.select(FlightMode::Altitude).unwrap();
        }
        found = desk.tick().setpoint.map(|setpoint| (setpoint, state));
    }
    let (setpoint, state) = found.unwrap();
    assert_eq!(setpoint.position_m.xy(), state.position_m.xy());
    assert_eq!(setpoint.velocity_m_s, Vector3::new(2.0, 0.1, 0.0));
    assert!((setpoint.position_m.z - 8.1).abs() < 0.11, "{setpoint:?}");
    let lean = G * f32::tan(0.3);
    assert!((setpoint.acceleration_m_s2 - Vector3::new(lean, 0.0, 0.0)).norm() < 0.05, "{setpoint:?}");
}
