//! The tick of the guidance with a vehicle that is where the test puts it: orders with their bounds, times, home,
//! checks, and where the setpoint begins.
#![allow(clippy::unwrap_used, reason = "tests")]

use afbc_flight_core::landing::LEFT_M;
use afbc_flight_core::{ArmingLimits, Mode, Refusal, Request, Stamped};
use afbc_guidance::*;
use afbc_types::{Setpoint, State};
use nalgebra::Vector3;

const G: f32 = 9.81;
const NAN: f32 = f32::NAN;

/// A vehicle that does as the setpoint says, or stays as it is.
#[derive(Clone)]
struct Desk {
    guidance: Guidance,
    orders: Orders,
    state: Option<State>,
    core: Mode,
    airborne: bool,
    follows: bool,
    now_us: u64,
    dt_s: f32,
    /// Time at rest, as the flight core counts it \[s\].
    rest_s: f32,
    battery: Option<Reading>,
    sensors: Sensors,
    lift: Lift,
    said: Vec<Notice>,
}

fn at(x: f32, y: f32, z: f32) -> State {
    State { position_m: Vector3::new(x, y, z), ..State::default() }
}

fn fenced(radius: f32, height: f32) -> Settings {
    let net = Net { fence_radius_m: radius, fence_height_m: height, ..Net::DEFAULT };
    Settings { net, ..Settings::DEFAULT }
}

impl Desk {
    fn new(settings: Settings) -> Self {
        Desk {
            guidance: Guidance::new(settings).unwrap(),
            orders: Orders::default(),
            state: Some(at(1.0, 2.0, 3.0)),
            core: Mode::Disarmed,
            airborne: false,
            follows: true,
            now_us: 5_000_000,
            dt_s: 1e-3,
            rest_s: 0.0,
            battery: None,
            sensors: Sensors::default(),
            lift: Lift { most_m_s2: 2.0 * G, gravity_m_s2: G, given_m_s2: Some(G) },
            said: Vec::new(),
        }
    }

    /// A vehicle that holds in the air at (1, 2, 8), above a home at (1, 2, 3).
    fn flying(settings: Settings) -> Self {
        let mut desk = Desk::new(settings);
        desk.run(1100);
        desk.core = Mode::Flying;
        desk.run(10);
        desk.state = Some(at(1.0, 2.0, 8.0));
        desk.run(10);
        desk.airborne = true;
        desk.run(100);
        desk.said.clear();
        desk
    }

    fn tick(&mut self) -> Guided {
        self.now_us += 1000;
        let rests = self.state.as_ref().is_some_and(|state| ArmingLimits::DEFAULT.at_rest(state));
        self.rest_s = if rests { self.rest_s + 1e-3 } else { 0.0 };
        let sight = Sight {
            now_us: self.now_us,
            dt_s: self.dt_s,
            state: self.state.as_ref(),
            core: self.core,
            airborne: self.airborne,
            rested: self.rest_s >= 1.0,
            battery: self.battery,
            sensors: self.sensors,
            lift: self.lift,
        };
        let guided = self.guidance.tick(&sight, &self.orders.take());
        self.said.extend(guided.notices.iter());
        if let (true, Some(setpoint), Some(state)) = (self.follows && self.airborne, guided.setpoint, &mut self.state) {
            (state.position_m, state.velocity_m_s) = (setpoint.position_m, setpoint.velocity_m_s);
        }
        guided
    }

    fn run(&mut self, ticks: u32) -> Guided {
        let mut guided = self.tick();
        for _ in 1..ticks {
            guided = self.tick();
        }
        guided
    }

    fn order(&mut self, order: Order) -> Result<(), Declined> {
        self.orders.give(Given { order, ticket: 7 });
        let (ticket, answer) = self.tick().answer.unwrap();
        assert_eq!(ticket, 7);
        answer
    }

    /// Returns the answer to an order that leaves no trace.
    fn would(&self, order: Order) -> Result<(), Declined> {
        self.clone().order(order)
    }

    fn select(&mut self, mode: FlightMode) -> Result<(), Declined> {
        self.order(Order::Select(mode))
    }

    fn setpoint(&mut self) -> Setpoint {
        self.tick().setpoint.unwrap()
    }

    fn place(&self) -> Vector3<f32> {
        self.state.unwrap().position_m
    }
}

fn go(x: f32, y: f32, z: f32) -> Order {
    Order::GoTo { position_m: Vector3::new(x, y, z), yaw_rad: NAN, speed_m_s: None }
}

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
    // With thrust to spare, or off the ground, it flies.
    assert_eq!(takes_off(true, Some(1.7 * G), 0.0).0, None);
    assert_eq!(takes_off(true, None, 0.0).0, None);
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
