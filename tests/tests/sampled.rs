//! Flights with a realistic tracker that sends 100 states per second, each 10 ms late: through the flight core, and in
//! scenarios.

use afbc::Profile;
use afbc_control::FlightController;
use afbc_flight_core::{ArmingLimits, FlightCore, FlightCoreMemory, Inbox, Mode, Request, Stamped, Ticketed};
use afbc_plant::Sensing;
use afbc_scenario::contender::{Contender, ControllerKind};
use afbc_scenario::{Scenario, built_in};
use afbc_types::State;
use std::collections::VecDeque;

/// Time since power-up at which the vehicle is armed and released \[ms\].
const ARMED_MS: u64 = 1_100;

/// A tracker that sends a state every `period_ms`, each late by `late_ms`.
struct Tracker {
    period_ms: u64,
    late_ms: u64,
    under_way: VecDeque<Stamped<State>>,
}

impl Tracker {
    fn new(period_ms: u64, late_ms: u64) -> Self {
        Tracker { period_ms, late_ms, under_way: VecDeque::new() }
    }

    /// Returns the state that arrives at `now_ms`, given the vehicle's present state.
    fn turn(&mut self, now_ms: u64, state: State) -> Option<Stamped<State>> {
        if now_ms.is_multiple_of(self.period_ms) {
            self.under_way.push_back(Stamped { value: state, at_us: now_ms * 1000 });
        }
        let arrives = |state: &Stamped<State>| state.at_us + self.late_ms * 1000 <= now_ms * 1000;
        if self.under_way.front().is_some_and(arrives) { self.under_way.pop_front() } else { None }
    }
}

/// Returns the root mean square distance from the reference from 5 s on \[m\], and true if the flight was completed.
fn fly<C: FlightController<N>, const N: usize>(
    scenario: &Scenario,
    controller: C,
    mut tracker: Tracker,
) -> (f64, bool) {
    let vehicle = FlightCore::new(scenario.vehicle.to_f32(), ArmingLimits::NONE, controller).unwrap();
    let (mut memory, mut inbox) = (FlightCoreMemory::default(), Inbox::default());
    let mut plant = scenario.plant(0.001).unwrap();
    let (mut squares, mut count) = (0.0, 0);
    let mut outcome = None;
    for now_ms in 1..ARMED_MS + (scenario.duration_s * 1e3) as u64 {
        let reference = scenario.trajectory.at(plant.time_s());
        if let Some(state) = tracker.turn(now_ms, plant.motion().measure()) {
            inbox.put_state(state);
        }
        inbox.put_setpoint(Stamped { value: reference.setpoint(), at_us: now_ms * 1000 });
        if now_ms == ARMED_MS {
            inbox.request(Ticketed { value: Request::Arm, ticket: 0 });
        }
        let tick = vehicle.tick(&mut memory, now_ms * 1000, &inbox.take());
        if now_ms >= ARMED_MS {
            plant.step(&tick.motors, 0.001);
        }
        if plant.time_s() > 5.0 {
            squares += (plant.motion().position_m - reference.position_m).norm_squared();
            count += 1;
        }
        outcome = Some(tick);
    }
    ((squares / f64::from(count)).sqrt(), outcome.unwrap().mode == Mode::Flying)
}

fn flown(scenario: &Scenario, kind: ControllerKind, tracker: Tracker) -> (f64, bool) {
    let contender = Contender::of(kind, Profile::Flight).monitored();
    let controller = contender.controller::<4>(&scenario.vehicle, &scenario.rotors).unwrap();
    fly(scenario, controller, tracker)
}

/// Because of extrapolation, flights are nearly as accurate as with a state every millisecond. Without it, PID and AFBC
/// lose the vehicle.
#[test]
fn a_tracker_of_100_hz_that_is_10_ms_late_is_flown_on() {
    let mut scenario = built_in("hardware").unwrap().read().unwrap();
    scenario.duration_s = 20.0;
    for kind in ControllerKind::ALL {
        let (best_m, flies) = flown(&scenario, kind, Tracker::new(1, 0));
        assert!(flies, "{}", kind.name());
        for (period_ms, late_ms) in [(10, 0), (10, 5), (10, 10), (5, 10), (1, 10)] {
            let (rms_m, flies) = flown(&scenario, kind, Tracker::new(period_ms, late_ms));
            println!("{}: every {period_ms} ms, {late_ms} ms late: {rms_m:.4} m ({best_m:.4} m)", kind.name());
            assert!(flies && rms_m < best_m + 0.003, "{}: {rms_m} m instead of {best_m} m", kind.name());
        }
    }
}

/// Flies `hardware` for 8 s with states every `period_s`, late by `delay_s`. Returns true and measured states, and the
/// root mean square distance from the reference from 5 s on \[m\]; none if the vehicle is lost.
fn sampled(
    kind: ControllerKind,
    [period_s, delay_s]: [f64; 2],
    gyro: bool,
    core: bool,
) -> (Vec<[State; 2]>, Option<f64>) {
    let mut scenario = built_in("hardware").unwrap().read().unwrap();
    scenario.sensing = Sensing { period_s, delay_s, gyro, ..Sensing::DEFAULT };
    (scenario.duration_s, scenario.flight_core) = (8.0, core);
    followed(&scenario, kind)
}

/// Flies a whole scenario and returns the same results.
fn followed(scenario: &Scenario, kind: ControllerKind) -> (Vec<[State; 2]>, Option<f64>) {
    let (mut seen, mut squares, mut count) = (Vec::new(), 0.0, 0.0);
    let lost = afbc_sim::flight::fly(scenario, &Contender::of(kind, Profile::Flight).monitored(), |sample| {
        seen.push([sample.motion.measure(), sample.measurement.map_or(State::default(), |m| m.state)]);
        assert!(!sample.action.health.state_rejected, "a state between samples is none that was rejected");
        if sample.time_s > 5.0 {
            squares += (sample.motion.position_m - sample.reference.position_m).norm_squared();
            count += 1.0;
        }
    });
    (seen, lost.unwrap().is_none().then(|| (squares / count).sqrt()))
}

/// In every step, a law gets the state of 10 to 19 ms ago, and with a gyroscope the present rates.
#[test]
fn a_scenario_says_sampled_and_late_states_with_a_gyro() {
    for gyro in [false, true] {
        let (seen, _) = sampled(ControllerKind::Geometric, [0.01, 0.01], gyro, false);
        for (k, [now, measured]) in seen.iter().enumerate().skip(20) {
            let [taken, _] = seen[(k - 10) / 10 * 10];
            let rates_rad_s = if gyro { now.rates_rad_s } else { taken.rates_rad_s };
            assert_eq!(*measured, State { rates_rad_s, ..taken }, "step {k}");
        }
    }
}

/// The flight core gets a state when one arrives, and extrapolates between states. PID alone, which holds each state
/// for 60 ms, loses the vehicle within 8 s.
#[test]
fn the_flight_core_extrapolates_between_the_samples_of_a_scenario() {
    let flown = |core| sampled(ControllerKind::Pid, [0.06, 0.0], false, core).1;
    assert_eq!(flown(false), None);
    assert!(flown(true).is_some_and(|rms_m| rms_m < 0.015));
}

/// AFBC flies all of `hardware` on 50 states per second without a gyroscope, in the flight core and alone. On 30, the
/// flight core loses the vehicle where the thrust falls by 40 %, and so do INDI and MPC.
#[test]
fn afbc_flies_on_50_states_per_second() {
    for core in [true, false] {
        for seed in 1..=3 {
            let mut scenario = built_in("hardware").unwrap().read().unwrap();
            scenario.sensing = Sensing { period_s: 0.02, ..Sensing::DEFAULT };
            (scenario.flight_core, scenario.seed) = (core, seed);
            let rms_m = followed(&scenario, ControllerKind::Afbc).1;
            assert!(rms_m.is_some_and(|rms_m| rms_m < 0.01), "core: {core}, seed {seed}: {rms_m:?} m");
        }
    }
}
