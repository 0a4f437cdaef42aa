//! Outages of the state: afterwards the interrupted mode resumes, unless the vehicle has landed, and orders are
//! accepted again. The flight core's part comes from its own transition table.

use crate::bench::{Bench, motion, settings};
use afbc_flight_core::Mode;
use afbc_flight_core::supervisor::{RESUME_US, SupervisorInputs};
use afbc_guidance::*;
use nalgebra::Vector3;
use proptest::prelude::*;

/// Modes that last until another is selected.
const FLOWN: [FlightMode; 8] = [
    FlightMode::Hold,
    FlightMode::Takeoff,
    FlightMode::Return,
    FlightMode::Mission,
    FlightMode::Offboard,
    FlightMode::Position,
    FlightMode::Altitude,
    FlightMode::Stabilised,
];
/// Modes that may be ordered while the state is known.
const ORDERED: [FlightMode; 6] = [
    FlightMode::Hold,
    FlightMode::Return,
    FlightMode::Mission,
    FlightMode::Offboard,
    FlightMode::Position,
    FlightMode::Land,
];

/// A vehicle whose state comes and goes, with the flight core's transitions.
struct Flight {
    bench: Bench,
    age_us: u32,
    steady_us: u32,
    /// Mode expected while the state is known.
    wanted: FlightMode,
}

impl Flight {
    /// Flies 40 m above the ground, far from home, in a mode that does not end by itself.
    fn new(mode: FlightMode) -> Self {
        let mut bench = Bench::new(settings());
        bench.run(1.5);
        bench.order(Order::Home(Some(Vector3::new(5000.0, 0.0, 0.0)))).unwrap();
        bench.arm();
        bench.order(Order::TakeOff(Some(3.0))).unwrap();
        bench.run_until(20.0, |guided| guided.mode == FlightMode::Hold);
        bench.state.position_m.z = 40.0;
        bench.items = vec![Item::Waypoint {
            position_m: Vector3::new(0.0, 9000.0, 40.0),
            yaw_rad: f32::NAN,
            hold_s: 0.0,
            within_m: 0.0,
            fly_through: false,
        }];
        bench.tick();
        let mut flight = Flight { bench, age_us: 0, steady_us: 10_000_000, wanted: FlightMode::Hold };
        flight.aim();
        if mode != FlightMode::Takeoff {
            assert_eq!(flight.order(mode), Ok(()));
        }
        flight.run(2.0, true).unwrap();
        flight
    }

    /// Keeps targets and sticks fresh.
    fn aim(&mut self) {
        self.bench.aim(OffboardTarget::Motion(motion(Vector3::new(-9000.0, 0.0, 40.0))));
        let sticks = Sticks { roll: 0.0, pitch: 0.1, throttle: 0.0, yaw: 0.0 };
        self.bench.orders.sticks = Some(afbc_flight_core::Stamped { value: sticks, at_us: self.bench.now_us });
    }

    fn order(&mut self, mode: FlightMode) -> Result<(), OrderRefusal> {
        self.bench
            .orders
            .given
            .push_back(afbc_flight_core::Ticketed { value: Order::Select(mode), ticket: 7 })
            .unwrap();
        let answer = self.tick(true).answer.unwrap().1;
        if answer.is_ok() {
            self.wanted = mode;
        }
        answer
    }

    fn tick(&mut self, sees: bool) -> GuidanceOutputs {
        let bench = &mut self.bench;
        bench.sees = sees;
        (self.age_us, self.steady_us) = if sees { (0, self.steady_us + 1000) } else { (self.age_us + 1000, 0) };
        // The guidance sees the flight core's mode of the last tick.
        let guided = bench.tick();
        bench.core = bench.core.next(&SupervisorInputs {
            request: None,
            kill: false,
            ready: Ok(()),
            state_age_us: self.age_us,
            attitude_age_us: 0,
            steady_us: self.steady_us,
            airborne: bench.airborne(),
            stands: bench.landing.stands(),
            tumbled: false,
        });
        guided
    }

    fn run(&mut self, time_s: f32, sees: bool) -> Result<(), TestCaseError> {
        for tick in 0..(time_s * 1e3) as u32 {
            if tick % 100 == 0 {
                self.aim();
            }
            let guided = self.tick(sees);
            if self.bench.core == Mode::Disarmed {
                prop_assert!(self.bench.state.position_m.z < 0.2, "{:?}", self.bench.state);
                return Ok(());
            }
            // Above the ground, a steady vehicle flies in the wanted mode. On the ground, the vehicle may be about to
            // be disarmed.
            if sees && self.steady_us > RESUME_US + 2000 && self.bench.state.position_m.z > 0.2 {
                prop_assert_eq!(self.bench.core, Mode::Flying);
                prop_assert_eq!(guided.mode, self.wanted, "{:?}", self.bench.said);
                prop_assert_eq!(guided.failsafe, None);
            }
        }
        Ok(())
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    /// The state fails repeatedly for 0.2 to 60 s, and orders arrive in between.
    #[test]
    fn what_was_flown_goes_on_after_every_outage(
        flown in proptest::sample::select(FLOWN.to_vec()),
        outages in proptest::collection::vec(
            (prop_oneof![3 => 0.2_f32..4.0, 1 => 4.0_f32..60.0], 0.05_f32..4.0,
             proptest::option::of((0.0_f32..1.0, proptest::sample::select(ORDERED.to_vec())))),
            1..6,
        ),
    ) {
        let flown = if flown == FlightMode::Takeoff { FlightMode::Hold } else { flown };
        let mut flight = Flight::new(flown);
        for (length_s, between_s, order) in outages {
            flight.run(length_s, false)?;
            let before_s = order.map_or(0.0, |(share, _)| share * between_s);
            flight.run(before_s, true)?;
            if let Some((_, mode)) = order.filter(|_| flight.bench.core.armed() && flight.bench.airborne()) {
                prop_assert_eq!(flight.order(mode), Ok(()), "{:?}", flight.bench.core);
            }
            flight.run(between_s - before_s, true)?;
        }
        flight.run(2.0, true)?;
    }
}

/// The vehicle announces an outage of 6 s during a mission.
#[test]
fn an_outage_is_announced_from_its_beginning_to_its_end() {
    let mut flight = Flight::new(FlightMode::Mission);
    flight.bench.said.clear();
    flight.run(6.0, false).unwrap();
    flight.run(2.0, true).unwrap();
    let descent = GuidanceNotice::Mode(FlightMode::Land, ModeReason::Failsafe(FailsafeCause::Descent));
    let back = GuidanceNotice::Mode(FlightMode::Mission, ModeReason::Back);
    assert_eq!(flight.bench.said, [descent, GuidanceNotice::Over(FailsafeCause::Descent), back]);
}

/// A landing ordered during the outage, or during the descent after it, is not replaced by the interrupted mode.
#[test]
fn a_landing_that_was_ordered_stays_one() {
    for sees in [false, true] {
        let mut flight = Flight::new(FlightMode::Mission);
        flight.run(6.0, false).unwrap();
        flight.bench.sees = sees;
        flight.bench.select(FlightMode::Land).unwrap();
        flight.wanted = FlightMode::Land;
        flight.run(4.0, true).unwrap();
        assert_eq!(flight.bench.guidance.mode(), FlightMode::Land);
    }
}

/// A flight to a place at an ordered speed, and a failsafe return, resume unchanged.
#[test]
fn what_is_resumed_is_what_it_was() {
    let mut flight = Flight::new(FlightMode::Hold);
    let to_m = Vector3::new(60.0, -20.0, 40.0);
    flight.bench.order(Order::GoTo { position_m: to_m, yaw_rad: f32::NAN, speed_m_s: Some(4.0) }).unwrap();
    flight.run(2.0, true).unwrap();
    flight.run(3.0, false).unwrap();
    flight.run(40.0, true).unwrap();
    assert!((flight.bench.state.position_m - to_m).norm() < 0.5, "{:?}", flight.bench.state);

    let mut flight = Flight::new(FlightMode::Mission);
    flight.bench.heard = false;
    flight.bench.run(30.0);
    let before = flight.bench.last.unwrap();
    assert_eq!((before.mode, before.failsafe), (FlightMode::Return, Some(FailsafeCause::Station)));
    for sees in [false, true] {
        (0..3000).for_each(|_| {
            flight.tick(sees);
        });
    }
    let after = flight.bench.last.unwrap();
    assert_eq!((after.mode, after.failsafe), (FlightMode::Return, Some(FailsafeCause::Station)));
}
