//! Tests that the request to engage reaches the controller once, only in flight, and is answered.

use afbc_control::{Action, FlightController, Mixer, Trace};
use afbc_flight_core::{
    ArmingLimits, FlightCore, FlightCoreMemory, Inbox, Mode, Refusal, Request, Stamped, TickOutcome, Ticketed,
};
use afbc_types::{Inputs, Parameters, RotorForces, RotorSpeeds, Setpoint, State};

/// A controller that counts its engagements, and gives the weight as thrust.
struct Counter(Mixer);

impl FlightController for Counter {
    type Memory = u32;

    fn dt_s(&self) -> f32 {
        0.001
    }

    fn mixer(&self) -> &Mixer {
        &self.0
    }

    fn trace(_: &u32) -> Trace {
        Trace::default()
    }

    fn decide(&self, _: &mut u32, _: &State, _: &Setpoint, _: bool) -> Action {
        let given = Inputs { thrust_n: 4.8, ..Inputs::default() };
        Action::new(RotorSpeeds::default(), RotorForces([1.2; 4].into()), given, false)
    }

    fn engage(&self, memory: &mut u32) -> bool {
        *memory += 1;
        true
    }
}

struct Bench {
    vehicle: FlightCore<Counter>,
    memory: FlightCoreMemory<u32>,
    now_us: u64,
}

impl Bench {
    fn new() -> Self {
        let parameters = Parameters::PAPER.to_f32();
        let counter = Counter(Mixer::new(parameters, 3.0).expect("valid"));
        let vehicle = FlightCore::new(parameters, ArmingLimits::default(), counter).expect("valid");
        Bench { vehicle, memory: FlightCoreMemory::default(), now_us: 0 }
    }

    fn tick(&mut self, tracked: bool, request: Option<Request>) -> TickOutcome {
        self.now_us += 1000;
        let at_us = self.now_us;
        let mut inbox = Inbox::EMPTY;
        if tracked {
            let mut value = State::default();
            value.position_m.z = if at_us.is_multiple_of(2000) { 1e-6 } else { -1e-6 };
            inbox.put_state(Stamped { value, at_us });
        }
        inbox.put_setpoint(Stamped { value: Setpoint::default(), at_us });
        if let Some(request) = request {
            assert!(inbox.request(Ticketed { value: request, ticket: 7 }));
        }
        self.vehicle.tick(&mut self.memory, at_us, &inbox)
    }

    fn wait(&mut self, ticks: u32, tracked: bool) {
        for _ in 0..ticks {
            self.tick(tracked, None);
        }
    }

    /// Requests engaging in this mode. Returns true if the controller was engaged.
    fn engages(&mut self, tracked: bool, mode: Mode) -> bool {
        let before = self.memory.control().copied();
        let outcome = self.tick(tracked, Some(Request::Engage));
        let answer = outcome.answer.expect("answered");
        let result = if mode.armed() { Ok(()) } else { Err(Refusal::NotArmed) };
        assert_eq!((outcome.mode, answer.request, answer.ticket, answer.result), (mode, Request::Engage, 7, result));
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
    bench.wait(600, true);
    assert_eq!(bench.memory.control(), Some(&1), "once");

    bench.wait(100, false);
    assert!(bench.engages(false, Mode::Coasting));
    bench.wait(200, false);
    assert!(bench.engages(false, Mode::Descending));

    assert_eq!(bench.tick(true, Some(Request::Kill)).mode, Mode::Disarmed);
    assert!(!bench.engages(true, Mode::Disarmed), "the flight is over");
}
