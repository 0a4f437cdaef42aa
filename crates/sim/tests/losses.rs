//! Tests which flights count as lost because the vehicle does not fly although it should.
#![allow(clippy::panic, clippy::unwrap_used, missing_docs)] // tests

use afbc_control::{Action, FlightController, Mixer, Trace};
use afbc_scenario::contender::{Contender, ControllerKind};
use afbc_scenario::{Scenario, parse};
use afbc_sim::flight::{GROUNDED_S, LawOnly, Lost, OFF_S, World, fly, lockstep};
use afbc_sim::run::FlightResult;
use afbc_types::{Inputs, Parameters, Setpoint, State};
use core::ops::{ControlFlow, Range};

/// Rotors and ground of every flight in this file.
const VEHICLE: &str = "rotors = { time_constant_s = 0.02, force_max_n = 3.0 }\nground = {}\nprofile = \"flight\"\n";
const HOVER: &str = "[trajectory]\nkind = \"hover\"\nposition_m = [0, 0, 1]\n";
/// Start with the feet on the ground.
const STANDING: &str = "[initial]\nposition_m = [0, 0, 0.075]\n";

fn scenario(text: &str) -> Scenario {
    parse("losses", &format!("{VEHICLE}{text}"), "losses").unwrap()
}

/// Flies under AFBC and under PID and checks that both flights end for the same reason.
fn end(text: &str) -> Option<Lost> {
    let scenario = scenario(text);
    let end = |kind| fly(&scenario, &Contender::of(kind, afbc::Profile::Flight), |_| {}).unwrap();
    let (afbc, pid) = (end(ControllerKind::Afbc), end(ControllerKind::Pid));
    assert_eq!(afbc.map(|lost| lost.reason), pid.map(|lost| lost.reason), "{text}");
    afbc
}

fn assert_lost(text: &str, reason: &str, between_s: Range<f64>) {
    let lost = end(text).unwrap_or_else(|| panic!("kept: {text}"));
    assert!(lost.reason == reason && between_s.contains(&lost.time_s), "{lost:?}: {text}");
}

/// A vehicle that never gets a state never starts its motors, with and without a flight core: it falls or stays on the
/// ground.
#[test]
fn never_armed() {
    let blind = "duration_s = 9.0\n[[outage]]\nstart_s = 0.0\n";
    for core in ["", "flight_core = true\n"] {
        let flight = |rest: &str| format!("{core}{blind}{rest}");
        // From 1 m the vehicle reaches the ground after 0.43 s.
        assert_lost(&flight(HOVER), "never armed", GROUNDED_S + 0.3..GROUNDED_S + 0.6);
        assert_lost(&flight(&format!("{HOVER}{STANDING}")), "never armed", GROUNDED_S..GROUNDED_S + 0.1);
        let high = "[trajectory]\nkind = \"hover\"\nposition_m = [0, 0, 20]\n";
        assert_lost(&flight(high), "never armed", OFF_S..OFF_S + 0.1);
    }
}

#[test]
fn never_left_the_ground() {
    let flight = format!("duration_s = 9.0\n{HOVER}{STANDING}[[payload]]\nmass_kg = 1.0\nstart_s = 0.0\n");
    assert_lost(&flight, "never left the ground", GROUNDED_S..GROUNDED_S + 0.2);
    // A lighter payload is lifted.
    assert_eq!(end(&flight.replace("1.0", "0.1")), None);
}

#[test]
fn on_the_ground_below_its_reference() {
    let flight = format!("duration_s = 12.0\n{HOVER}[[payload]]\nmass_kg = 1.0\nstart_s = 5.0\n");
    assert_lost(&flight, "on the ground below its reference", 5.0 + GROUNDED_S..7.5 + GROUNDED_S);
    // The vehicle does not count as lost if the reference is hardly higher than the standing vehicle.
    assert_eq!(end(&flight.replace("[0, 0, 1]", "[0, 0, 0.3]")), None);
    // The vehicle does not count as lost if the flight ends before the time limit.
    assert_eq!(end(&flight.replace("12.0", "7.5")), None);
}

/// A failsafe's descent is no loss if the scenario has taken away the measurements. It is a loss if the measurements
/// are just too rare, without any fault.
#[test]
fn a_failsafe_lands_after_a_fault_only() {
    let core = format!("flight_core = true\nduration_s = 15.0\n{HOVER}");
    assert_eq!(end(&format!("{core}[[outage]]\nstart_s = 5.0\n")), None);
    assert_eq!(end(&format!("{core}[[outage]]\nstart_s = 5.0\nduration_s = 0.24\n")), None);
    let lost = end(&format!("{core}[sensors]\nperiod_s = 0.5\n")).unwrap();
    assert_eq!(lost.reason, "on the ground below its reference");
    // A later fault is no excuse.
    let lost = end(&format!("{core}[sensors]\nperiod_s = 0.5\n[[outage]]\nstart_s = 14.0\n")).unwrap();
    assert_eq!(lost.reason, "on the ground below its reference");
}

/// The vehicle descends to the ground, stays there for longer than the time limit, and climbs again.
#[test]
fn a_landing_is_no_loss() {
    let waypoints = [(1.0, 1.0), (4.0, 0.05), (12.0, 0.05), (15.0, 1.0)];
    let waypoint = |(time_s, height_m): (f64, f64)| {
        format!("[[trajectory.waypoint]]\ntime_s = {time_s:?}\nposition_m = [0, 0, {height_m:?}]\n")
    };
    let waypoints: String = waypoints.map(waypoint).concat();
    assert_eq!(end(&format!("duration_s = 20.0\n[trajectory]\nkind = \"waypoints\"\n{waypoints}")), None);
}

/// A law that carries the weight, switches the motors off for some steps, and does nothing else.
struct Floats {
    mixer: Mixer,
    off: Range<u32>,
}

impl FlightController for Floats {
    type Memory = u32;

    fn dt_s(&self) -> f32 {
        0.001
    }

    fn mixer(&self) -> &Mixer {
        &self.mixer
    }

    fn decide(&self, step: &mut u32, _: &State, _: &Setpoint, _fresh: bool) -> Action {
        *step += 1;
        let thrust_n = if self.off.contains(step) { 0.0 } else { Parameters::PAPER.to_f32().weight_n() };
        self.mixer.action(&Inputs { thrust_n, ..Inputs::default() })
    }

    fn trace(_: &u32) -> Trace {
        Trace::default()
    }
}

/// Motors off are a loss if the vehicle should rise. They are no loss if it should sink, still rises, or has them off
/// only briefly.
#[test]
fn motors_off_in_the_air() {
    let flown = |trajectory: &str, climb_m_s: f64, off_ms: Range<u32>| {
        let text = format!(
            "duration_s = 4.0\n{trajectory}[initial]\nposition_m = [0, 0, 40]\nvelocity_m_s = [0, 0, {climb_m_s:?}]\n"
        );
        let scenario = scenario(&text);
        let mixer = Mixer::new(scenario.vehicle.to_f32(), 3.0).unwrap();
        let mut world = World::new(&scenario, 0.001).unwrap();
        let mut pilot = LawOnly::new(Floats { mixer, off: off_ms });
        let Ok(end) = lockstep(&mut world, &mut pilot, scenario.duration_s, |_| ControlFlow::Continue(()));
        end.lost
    };
    let hover = |height_m: f64| format!("[trajectory]\nkind = \"hover\"\nposition_m = [0, 0, {height_m:?}]\n");
    let lost = flown(&hover(40.0), 0.0, 1000..4000).unwrap();
    assert_eq!(lost.reason, "motors off in the air");
    assert!((1.0 + OFF_S..1.1 + OFF_S).contains(&lost.time_s), "{lost:?}");
    assert_eq!(flown(&hover(40.0), 0.0, 1000..1450), None);
    // Above its reference, and while it rises to its reference.
    assert_eq!(flown(&hover(10.0), 0.0, 1000..2500), None);
    assert_eq!(flown(&hover(60.0), 10.0, 1000..1900), None);
}

/// Errors count from 5 s on: a flight that ends before has no figures, instead of figures of zero.
#[test]
fn a_flight_over_before_errors_count_has_no_figures() {
    for (duration_s, settled) in [(4.0, false), (6.0, true)] {
        let scenario = scenario(&format!("duration_s = {duration_s:?}\n{HOVER}[initial]\nposition_m = [0, 0, 1]\n"));
        let run = FlightResult::fly(&scenario, &Contender::of(ControllerKind::Afbc, afbc::Profile::Flight), 1).unwrap();
        assert_eq!((run.is_settled(), run.metrics.measured(1.0)), (settled, settled.then_some(1.0)), "{duration_s} s");
    }
}
