//! The request to engage: it reaches the controller once, in flight only, and is answered.
#![allow(clippy::expect_used, reason = "a test that cannot go on should say why")]

use afbc::{Command, FlightController, Profile};
use airframe::{Parameters, Setpoint, State};
use vehicle::{ArmingLimits, Inbox, Memory, Mode, Outcome, Request, Stamped, Vehicle};

/// Counts how often it is engaged.
struct Counter;

impl FlightController for Counter {
    type Memory = u32;

    fn decide(&self, _: &mut u32, _: &State, _: &Setpoint, _: bool) -> Command {
        Command::default()
    }

    fn engage(&self, memory: &mut u32) -> bool {
        *memory += 1;
        true
    }
}

struct Bench {
    vehicle: Vehicle<Counter>,
    memory: Memory<u32>,
    now_us: u64,
}

impl Bench {
    fn new() -> Self {
        let (airframe, settings) = (Parameters::PAPER.to_f32(), Profile::Flight.settings());
        let vehicle = Vehicle::new(airframe, settings, ArmingLimits::default(), Counter).expect("valid");
        Bench { vehicle, memory: Memory::default(), now_us: 0 }
    }

    fn tick(&mut self, tracked: bool, request: Option<Request>) -> Outcome {
        self.now_us += 1000;
        let at_us = self.now_us;
        let mut inbox = Inbox::EMPTY;
        if tracked {
            inbox.measure(Stamped { value: State::default(), at_us });
        }
        inbox.aim(Stamped { value: Setpoint::default(), at_us });
        if let Some(request) = request {
            inbox.ask(request);
        }
        self.vehicle.tick(&mut self.memory, at_us, &inbox)
    }

    fn wait(&mut self, ticks: u32, tracked: bool) {
        for _ in 0..ticks {
            self.tick(tracked, None);
        }
    }

    /// Asks to engage in this mode; true if that reached the controller.
    fn engages(&mut self, tracked: bool, mode: Mode) -> bool {
        let before = self.memory.control().copied();
        let outcome = self.tick(tracked, Some(Request::Engage));
        assert_eq!((outcome.mode, outcome.answer), (mode, Some(Ok(Request::Engage))));
        self.memory.control().copied() != before
    }
}

#[test]
fn engaging_reaches_the_controller_in_flight_only() {
    let mut bench = Bench::new();
    bench.wait(1001, true);
    assert!(!bench.engages(true, Mode::Disarmed));
    assert_eq!(bench.tick(true, Some(Request::Arm)).mode, Mode::Flying);
    assert_eq!(bench.memory.control(), Some(&0));
    assert!(bench.engages(true, Mode::Flying));
    bench.wait(10, true);
    assert_eq!(bench.memory.control(), Some(&1), "once");

    bench.wait(100, false);
    assert!(bench.engages(false, Mode::Riding));
    bench.wait(200, false);
    assert!(bench.engages(false, Mode::Descending));

    assert_eq!(bench.tick(true, Some(Request::Disarm)).mode, Mode::Disarmed);
    assert!(!bench.engages(true, Mode::Disarmed), "the flight is over");
}
