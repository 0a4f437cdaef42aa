//! An armed vehicle idles on the ground: its motors idle, it counts as on the ground, and the law restarts at take-off.

use afbc::reference::ReferenceModel;
use afbc::{Adaptive, Controller, Profile, Settings};
use afbc_control::{FlightController, Validated};
use afbc_flight_core::landing::CARRIED_US;
use afbc_flight_core::supervisor::{COAST_US, DESCEND_US};
use afbc_flight_core::tumble::LOST_US;
use afbc_flight_core::{
    ArmingLimits, EndReason, FlightCore, FlightCoreMemory, Inbox, Mode, RateTarget, Refusal, Request, Stamped,
    TickOutcome, Ticketed,
};
use afbc_types::{Inputs, Parameters, Setpoint, State};
use nalgebra::Vector3;

type Adapted = afbc::CascadeMemory<afbc::AdaptiveEstimate>;

fn controller() -> Controller<Adaptive> {
    let settings = Settings { reference: ReferenceModel::DEFAULT, ..Profile::Flight.settings() };
    let law = Adaptive::new(Profile::Flight.gains()).expect("valid");
    Controller::new(Parameters::PAPER.to_f32(), settings, law).expect("valid")
}

struct Bench {
    vehicle: FlightCore<Controller<Adaptive>>,
    memory: FlightCoreMemory<Adapted>,
    now_us: u64,
    inbox: Inbox,
    state: State,
    rates: Option<RateTarget>,
}

impl Bench {
    /// Returns an armed vehicle, one tick after arming.
    fn armed(rests: bool) -> Self {
        let limits = ArmingLimits::default();
        let vehicle = FlightCore::new(Parameters::PAPER.to_f32(), limits, controller()).expect("valid");
        let (memory, inbox, state) = (FlightCoreMemory::default(), Inbox::default(), State::default());
        let mut bench = Bench { vehicle, memory, now_us: 0, inbox, state, rates: None };
        bench.inbox.set_idle_on_ground(rests);
        bench.run(1001);
        assert_eq!(bench.ask(Request::Arm).answer.map(|answer| answer.result), Some(Ok(())));
        bench
    }

    fn ask(&mut self, request: Request) -> TickOutcome {
        assert!(self.inbox.request(Ticketed { value: request, ticket: 3 }));
        self.tick(true)
    }

    fn tick(&mut self, seen: bool) -> TickOutcome {
        self.now_us += 1000;
        let at_us = self.now_us;
        if seen {
            self.inbox.put_state(Stamped { value: self.state, at_us });
        }
        self.inbox.put_setpoint(Stamped { value: target(), at_us });
        let mut inbox = self.inbox.take();
        inbox.command_rates(self.rates.as_ref());
        self.vehicle.tick(&mut self.memory, self.now_us, &inbox)
    }

    fn run(&mut self, ticks: u32) -> TickOutcome {
        for _ in 1..ticks {
            let _ = self.tick(true);
        }
        self.tick(true)
    }

    /// Flies on, and compares every bit with the law alone, starting from this memory.
    fn flies_as(&mut self, mut memory: Validated<Adapted>, case: &str) {
        let controller = controller();
        for tick in 0..200 {
            self.state.attitude_rad.x = 0.02 * (tick as f32 * 0.1).sin();
            self.state.rates_rad_s.x = 0.002 * (tick as f32 * 0.1).cos();
            let expected = controller.step(&mut memory, Some(&self.state), &target());
            let outcome = self.tick(true);
            assert_eq!((outcome.mode, outcome.forces), (Mode::Flying, expected.forces), "tick {tick}, {case}");
            assert_eq!(outcome.motors.0.map(f32::to_bits), expected.speeds.0.map(f32::to_bits), "tick {tick}, {case}");
        }
    }
}

fn target() -> Setpoint {
    Setpoint { position_m: Vector3::new(0.3, -0.2, 0.5), ..Setpoint::default() }
}

/// The estimate of a standing vehicle may drift by metres without a take-off.
#[test]
fn motors_idle_and_it_stays_on_the_ground() {
    let mut bench = Bench::armed(true);
    let idle = controller().mixer().action(&Inputs::default());
    for tick in 0..5000 {
        bench.state.position_m += Vector3::new(0.7e-3, 0.3e-3, -0.2e-3);
        bench.state.velocity_m_s.x = if tick % 2 == 0 { 0.7 } else { -0.6 };
        let outcome = bench.tick(true);
        assert_eq!((outcome.mode, outcome.ended, outcome.health.control.saturated), (Mode::Flying, None, false));
        assert_eq!((outcome.motors, outcome.forces), (idle.speeds, idle.forces));
        assert!(!bench.memory.airborne());
        assert_eq!(bench.memory.trace::<Controller<Adaptive>, 4>().inputs, Inputs::default());
    }
    let outcome = bench.ask(Request::Disarm);
    assert_eq!((outcome.mode, outcome.ended), (Mode::Disarmed, Some(EndReason::Disarmed)));
}

/// When the mark is cleared, the law takes its first step like a new law on the ground, bit for bit. It does so, too,
/// after idling between two flights.
#[test]
fn the_law_begins_afresh_when_it_takes_off() {
    for flown in [0, 300] {
        let mut bench = Bench::armed(flown == 0);
        bench.run(flown + 1);
        bench.inbox.set_idle_on_ground(true);
        bench.state.position_m = Vector3::new(0.05, 0.0, 0.0);
        bench.run(50);
        bench.inbox.set_idle_on_ground(false);
        let mut memory = Validated::default();
        controller().on_ground(&mut memory.control);
        bench.flies_as(memory, &format!("after {flown}"));
    }
}

/// After a take-off in acro mode, the law starts in the air, like one that was never told to be on the ground.
#[test]
fn after_a_take_off_at_rates_the_law_begins_in_the_air() {
    let mut bench = Bench::armed(true);
    bench.run(50);
    bench.inbox.set_idle_on_ground(false);
    bench.rates = Some(RateTarget { rates_rad_s: Vector3::zeros(), thrust: 0.6 });
    for tick in 0..3000 {
        let height_m = 0.0002 * tick as f32;
        (bench.state.position_m.z, bench.state.velocity_m_s.z) = (height_m, 0.2);
        assert_eq!(bench.tick(true).mode, Mode::Flying);
    }
    bench.rates = None;
    bench.flies_as(Validated::default(), "in the air");
}

/// A vehicle that counts as airborne, but touches the ground according to the guidance, idles its motors. Afterwards
/// its law continues with its memory.
#[test]
fn in_the_air_the_mark_idles_the_motors() {
    let (mut bench, idle) = (Bench::armed(false), controller().mixer().action(&Inputs::default()));
    for tick in 0..3000 {
        let t = tick as f32 * 1e-3;
        bench.state.position_m = Vector3::new(0.1 * t, 0.0, 0.5 + 1e-6 * (tick % 2) as f32);
        bench.state.attitude_rad.y = 0.1 * (3.0 * t).sin();
        let marked = tick > 1000 && tick % 500 < 100;
        let before = bench.memory.control().copied();
        bench.inbox.set_idle_on_ground(marked);
        let outcome = bench.tick(true);
        assert_eq!(outcome.mode, Mode::Flying);
        if tick > CARRIED_US / 1000 + 10 {
            assert!(bench.memory.airborne(), "tick {tick}");
        }
        if marked {
            assert_eq!((outcome.motors, outcome.forces), (idle.speeds, idle.forces), "tick {tick}");
            assert_eq!(bench.memory.control().copied(), before, "what it has learnt stays");
        } else if tick > 1 {
            assert_ne!(outcome.motors, idle.speeds, "tick {tick}");
        }
    }
    let refused = bench.ask(Request::Disarm).answer.map(|answer| answer.result);
    assert_eq!(refused, Some(Err(Refusal::InFlight)));
}

/// Supervision continues: kills, tumbles and outages of the state end the idling.
#[test]
fn a_resting_vehicle_is_supervised() {
    assert_eq!(Bench::armed(true).ask(Request::Kill).ended, Some(EndReason::Killed));

    let mut bench = Bench::armed(true);
    bench.state.attitude_rad.x = 2.0;
    assert_eq!(bench.run(LOST_US / 1000).ended, None);
    assert!((0..3).any(|_| bench.tick(true).ended == Some(EndReason::Tumbled)));

    let mut bench = Bench::armed(true);
    let idle = bench.run(10).motors;
    for age_us in (1000..DESCEND_US).step_by(1000) {
        let outcome = bench.tick(false);
        assert_eq!(outcome.mode, if age_us > COAST_US { Mode::Coasting } else { Mode::Flying });
        assert_eq!(outcome.motors, idle, "it does not coast on the ground");
    }
    assert!((0..5).any(|_| bench.tick(false).ended == Some(EndReason::Landed)));
    assert_eq!(bench.memory.mode(), Mode::Disarmed);
    assert!(!bench.memory.airborne());
}

#[test]
fn the_mark_stays_until_it_is_changed() {
    let (mut inbox, mut news) = (Inbox::EMPTY, Inbox::EMPTY);
    assert!(!inbox.idle_on_ground());
    inbox.set_idle_on_ground(true);
    inbox.merge(&news);
    assert!(
        inbox.idle_on_ground() && inbox.take().idle_on_ground() && inbox.idle_on_ground(),
        "news without a mark change nothing"
    );
    news.set_idle_on_ground(false);
    inbox.merge(&news);
    assert!(!inbox.idle_on_ground() && !inbox.take().idle_on_ground());
    let mut taken = Inbox::EMPTY;
    taken.set_idle_on_ground(true);
    inbox.take_into(&mut taken);
    assert!(!taken.idle_on_ground(), "the copy of the last tick is replaced");
}
