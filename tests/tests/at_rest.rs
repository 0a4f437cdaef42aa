//! Flies minutes at rest after a manoeuvre, under every law. Decaying values in a law's memory must end at zero:
//! numbers below 1.2e-38 are subnormal, and many processors take a hundred times as long to compute with them.

use afbc::integral::IntegralBackstepping;
use afbc::monitor::MonitorBounds;
use afbc::{Adaptive, Backstepping, Controller, Guarded, Profile};
use afbc_control::{FlightController, Settings, Trace, Validated};
use afbc_laws::{Dfbc, Geometric, Indi, L1, Pid, dfbc, geometric, indi, l1, pid};
use afbc_types::{Parameters, PerAxis, Setpoint, State};
use core::fmt::Debug;
use nalgebra::Vector3;

/// Settings of the other laws.
const SETTINGS: Settings = Profile::Flight.settings().common;

/// Step at which the setpoint moves by 1 m along each axis and by 1 rad.
const BEGIN: usize = 1_000;
/// Number of steps of the motion, after which the vehicle rests at its setpoint.
const MOTION: usize = 2_000;
const TEN_MINUTES: usize = 600_000;
/// The slowest averages, over one second, decay from 1 to 1e-38 in 87 s.
const TWO_MINUTES: usize = 120_000;
/// Number of first steps that are checked often, for values that decay within a second.
const EARLY: usize = 40_000;

/// Returns state and setpoint of a step from its number, the last state and the last step's trace.
type Motion = fn(usize, &State, &Trace) -> (State, Setpoint);

const MOTIONS: [(&str, Motion, usize); 5] = [
    ("smooth", smooth, TEN_MINUTES),
    ("late, at once", late, TWO_MINUTES),
    ("on the reference", follows, TWO_MINUTES),
    ("landed", landed, TWO_MINUTES),
    ("nothing at all", |_, _, _| (State::default(), Setpoint::default()), TWO_MINUTES),
];

fn setpoint(step: usize) -> Setpoint {
    let size = if step < BEGIN { 0.0 } else { 1.0 };
    Setpoint { position_m: Vector3::repeat(size), yaw_rad: size, ..Setpoint::default() }
}

/// Moves smoothly, and tilts as the acceleration needs.
fn smooth(step: usize, _: &State, _: &Trace) -> (State, Setpoint) {
    let seconds = MOTION as f32 * 1e-3;
    let t = (step.saturating_sub(BEGIN) as f32 / MOTION as f32).min(1.0);
    let x = t * t * t * (10.0 + t * (6.0 * t - 15.0));
    let v = 30.0 * t * t * (1.0 - t) * (1.0 - t) / seconds;
    let a = 60.0 * t * (1.0 - t) * (1.0 - 2.0 * t) / (seconds * seconds);
    let state = State {
        position_m: Vector3::repeat(x),
        velocity_m_s: Vector3::repeat(v),
        attitude_rad: Vector3::new(-0.1 * a, 0.1 * a, x),
        rates_rad_s: Vector3::new(0.0, 0.0, v),
    };
    (state, setpoint(step))
}

/// Stays at the old place, then jumps to the setpoint.
fn late(step: usize, _: &State, _: &Trace) -> (State, Setpoint) {
    let Setpoint { position_m, yaw_rad, .. } = setpoint(if step < BEGIN + MOTION { 0 } else { step });
    let state = State { position_m, attitude_rad: Vector3::new(0.0, 0.0, yaw_rad), ..State::default() };
    (state, setpoint(step))
}

/// Follows the law's reference, one step later.
fn follows(step: usize, last: &State, trace: &Trace) -> (State, Setpoint) {
    let (mut state, errors) = (*last, &trace.errors);
    state.position_m += Vector3::new(errors.x.e1, errors.y.e1, errors.z.e1);
    state.velocity_m_s += Vector3::new(errors.x.e1_dot, errors.y.e1_dot, errors.z.e1_dot);
    state.attitude_rad.z += errors.yaw.e1;
    state.rates_rad_s.z += errors.yaw.e1_dot;
    (state, setpoint(step))
}

/// Moves smoothly on the ground, with a setpoint below the ground at the end.
fn landed(step: usize, last: &State, trace: &Trace) -> (State, Setpoint) {
    let (mut state, mut setpoint) = smooth(step, last, trace);
    (state.position_m.z, state.velocity_m_s.z) = (0.0, 0.0);
    setpoint.position_m.z = if step < BEGIN + MOTION { setpoint.position_m.z } else { -1.0 };
    (state, setpoint)
}

/// True if the text contains a subnormal number. Debug output prints such numbers exactly, with an exponent.
fn found(text: &str) -> bool {
    text.split(|c: char| !c.is_ascii_alphanumeric() && !"+-.".contains(c))
        .any(|word| word.contains("e-") && word.parse::<f32>().is_ok_and(f32::is_subnormal))
}

/// Returns the paths of the subnormal fields in the memory's debug output, which prints every field.
fn subnormals(memory: &impl Debug) -> Vec<String> {
    if !found(&format!("{memory:?}")) {
        return Vec::new();
    }
    let (text, mut path, mut places) = (format!("{memory:#?}"), Vec::new(), Vec::new());
    for line in text.lines() {
        path.truncate((line.len() - line.trim_start().len()) / 4);
        path.push(line.trim());
        if found(line) {
            places.push(path.join(" "));
        }
    }
    places
}

/// Flies every motion and checks that no number in the controller's memory becomes subnormal.
fn leaves_nothing_subnormal<C: FlightController>(name: &str, controller: &C)
where
    C::Memory: PartialEq,
{
    for (motion_name, motion, steps) in MOTIONS {
        let (mut memory, mut trace) = (Validated::<C::Memory>::default(), Trace::default());
        let (mut state, mut setpoint) = (State::default(), Setpoint::default());
        for step in 0..steps {
            let before = (memory, state, setpoint);
            (state, setpoint) = motion(step, &state, &trace);
            let _ = controller.step(&mut memory, Some(&state), &setpoint);
            trace = C::trace(&memory.control);
            // Values that decay in less than 0.1 s decay before the vehicle rests, so early steps are checked often.
            if step % if step < EARLY { 7 } else { 97 } == 0 {
                let places = subnormals(&memory.control);
                assert!(places.is_empty(), "{name}, {motion_name}, step {step}:\n{}", places.join("\n"));
            }
            // Stops as soon as nothing changes any more.
            if step > BEGIN + MOTION && (memory, state, setpoint) == before {
                break;
            }
        }
    }
}

#[test]
fn afbc() {
    for profile in Profile::ALL {
        let law = Adaptive::new(profile.gains()).unwrap();
        let controller = Controller::new(Parameters::PAPER.to_f32(), profile.settings(), law).unwrap();
        leaves_nothing_subnormal(&format!("AFBC, {}", profile.name()), &controller);
    }
}

#[test]
fn backstepping() {
    let vehicle = Parameters::PAPER.to_f32();
    for profile in Profile::ALL {
        let gains = profile.gains();
        let law = Backstepping::new(&vehicle, PerAxis::from_fn(|axis| gains[axis].backstepping)).unwrap();
        let controller = Controller::new(vehicle, profile.settings(), law).unwrap();
        leaves_nothing_subnormal(&format!("backstepping, {}", profile.name()), &controller);
    }
}

#[test]
fn integral_backstepping() {
    let vehicle = Parameters::PAPER.to_f32();
    for profile in Profile::ALL {
        let law = IntegralBackstepping::new(&vehicle, profile.gains().map(|gains| gains.into())).unwrap();
        let controller = Controller::new(vehicle, profile.settings(), law).unwrap();
        leaves_nothing_subnormal(&format!("integral backstepping, {}", profile.name()), &controller);
    }
}

#[test]
fn monitor() {
    let (vehicle, gains, settings) = (Parameters::PAPER.to_f32(), Profile::Flight.gains(), Profile::Flight.settings());
    let guarded = |bounds| Guarded::new(vehicle, settings, gains, bounds).unwrap();
    let bounds = MonitorBounds::new(&gains, &vehicle, &settings);
    leaves_nothing_subnormal("under its monitor", &guarded(bounds));
    let hasty = MonitorBounds { error: PerAxis { z: 0.01, ..bounds.error }, ..bounds };
    leaves_nothing_subnormal("under a hasty monitor", &guarded(hasty));
    let lax = MonitorBounds { error: PerAxis::from_fn(|_| 1e9), ..bounds };
    leaves_nothing_subnormal("under a lax monitor", &guarded(lax));
}

#[test]
fn pid() {
    for (name, gains) in [("PID by hand", pid::Gains::PAPER_VEHICLE), ("PID, tuned", pid::Gains::TUNED)] {
        leaves_nothing_subnormal(name, &Pid::new(Parameters::PAPER.to_f32(), SETTINGS, gains).unwrap());
    }
}

#[test]
fn geometric() {
    use geometric::Gains;
    for (name, gains) in
        [("Lee", Gains::LEE_2010), ("Goodarzi", Gains::GOODARZI_2013), ("geometric, tuned", Gains::TUNED)]
    {
        leaves_nothing_subnormal(name, &Geometric::new(Parameters::PAPER.to_f32(), SETTINGS, gains).unwrap());
    }
}

#[test]
fn indi() {
    for (name, gains) in [("INDI by hand", indi::Gains::PAPER_VEHICLE), ("INDI, tuned", indi::Gains::TUNED)] {
        leaves_nothing_subnormal(name, &Indi::new(Parameters::PAPER.to_f32(), SETTINGS, gains).unwrap());
    }
}

#[test]
fn l1() {
    for (name, gains) in [("L1 by hand", l1::Gains::BY_HAND), ("L1, tuned", l1::Gains::TUNED)] {
        leaves_nothing_subnormal(name, &L1::new(Parameters::PAPER.to_f32(), SETTINGS, gains).unwrap());
    }
}

#[test]
fn dfbc() {
    for (name, gains) in [("DFBC by hand", dfbc::Gains::PAPER_VEHICLE), ("DFBC, tuned", dfbc::Gains::TUNED)] {
        leaves_nothing_subnormal(name, &Dfbc::new(Parameters::PAPER.to_f32(), SETTINGS, gains).unwrap());
    }
}
