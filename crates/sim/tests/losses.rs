//! Flights that count as lost because the vehicle does not fly although it should, and those that do not.
#![allow(clippy::panic, clippy::unwrap_used, missing_docs)] // tests

use afbc_control::{Action, FlightController, Mixer, Trace};
use afbc_scenario::contender::{Contender, ControllerKind};
use afbc_scenario::{Scenario, parse};
use afbc_sim::flight::{GROUNDED_S, LawOnly, Lost, OFF_S, World, fly, lockstep};
use afbc_sim::run::Run;
use afbc_types::{Inputs, Parameters, Setpoint, State};
use core::ops::{ControlFlow, Range};

/// Rotors and ground of every flight here.
const VEHICLE: &str = "rotors = { time_constant_s = 0.02, force_max_n = 3.0 }\nground = {}\nprofile = \"flight\"\n";
const HOVER: &str = "[trajectory]\nkind = \"hover\"\nposition_m = [0, 0, 1]\n";
/// Standing on its feet.
const STANDING: &str = "[initial]\nposition_m = [0, 0, 0.075]\n";

fn scenario(text: &str) -> Scenario {
    parse("losses", &format!("{VEHICLE}{text}"), "losses").unwrap()
}

/// Flies under AFBC and under PID, which come to the same end.
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

/// A vehicle that never has a state never starts its motors, with and without a flight core: it falls, and stands.
#[test]
fn never_armed() {
    let blind = "duration_s = 9.0\n[[outage]]\nstart_s = 0.0\n";
    for core in ["", "flight_core = true\n"] {
        let flight = |rest: &str| format!("{core}{blind}{rest}");
        // From 1 m it is on the ground after 0.43 s.
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
    // A lighter one is lifted.
    assert_eq!(end(&flight.replace("1.0", "0.1")), None);
}

#[test]
fn on_the_ground_below_its_reference() {
    let flight = format!("duration_s = 12.0\n{HOVER}[[payload]]\nmass_kg = 1.0\nstart_s = 5.0\n");
    assert_lost(&flight, "on the ground below its reference", 5.0 + GROUNDED_S..7.5 + GROUNDED_S);
    // Not where the reference is hardly higher than the vehicle on its feet.
    assert_eq!(end(&flight.replace("[0, 0, 1]", "[0, 0, 0.3]")), None);
    // Nor where it ends before it counts.
    assert_eq!(end(&flight.replace("12.0", "7.5")), None);
}

/// A flight core that brings the vehicle down since the scenario takes its measurements away does what it is for; on
/// measurements that are too rare without any fault it is of no use.
#[test]
fn a_failsafe_lands_after_a_fault_only() {
    let core = format!("flight_core = true\nduration_s = 15.0\n{HOVER}");
    assert_eq!(end(&format!("{core}[[outage]]\nstart_s = 5.0\n")), None);
    assert_eq!(end(&format!("{core}[[outage]]\nstart_s = 5.0\nduration_s = 0.24\n")), None);
    let lost = end(&format!("{core}[sensors]\nperiod_s = 0.5\n")).unwrap();
    assert_eq!(lost.reason, "on the ground below its reference");
    // A fault that comes later is no excuse.
    let lost = end(&format!("{core}[sensors]\nperiod_s = 0.5\n[[outage]]\nstart_s = 14.0\n")).unwrap();
    assert_eq!(lost.reason, "on the ground below its reference");
}

/// Down to the ground, on it for longer than it counts, and up again.
#[test]
fn a_landing_is_no_loss() {
    let waypoints = [(1.0, 1.0), (4.0, 0.05), (12.0, 0.05), (15.0, 1.0)];
    let waypoint = |(time_s, height_m): (f64, f64)| {
        format!("[[trajectory.waypoint]]\ntime_s = {time_s:?}\nposition_m = [0, 0, {height_m:?}]\n")
    };
    let waypoints: String = waypoints.map(waypoint).concat();
    assert_eq!(end(&format!("duration_s = 20.0\n[trajectory]\nkind = \"waypoints\"\n{waypoints}")), None);
}

/// Carries the weight, but for some steps with its motors off, and does nothing else.
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

/// Motors that are off where the vehicle has to rise are a loss; where it has to sink, or as long as it rises, or for a
/// moment, they are a matter of the law.
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
    // Above its reference, and on its way up to it.
    assert_eq!(flown(&hover(10.0), 0.0, 1000..2500), None);
    assert_eq!(flown(&hover(60.0), 10.0, 1000..1900), None);
}

/// Errors count from 5 s on: a flight that is over before has no figures, and not figures of zero.
#[test]
fn a_flight_over_before_errors_count_has_no_figures() {
    for (duration_s, settled) in [(4.0, false), (6.0, true)] {
        let scenario = scenario(&format!("duration_s = {duration_s:?}\n{HOVER}[initial]\nposition_m = [0, 0, 1]\n"));
        let run = Run::fly(&scenario, &Contender::of(ControllerKind::Afbc, afbc::Profile::Flight), 1).unwrap();
        assert_eq!((run.is_settled(), run.metrics.measured(1.0)), (settled, settled.then_some(1.0)), "{duration_s} s");
    }
}
