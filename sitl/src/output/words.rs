//! Names and numbers for people, the same wherever they appear.

use crate::paper::{Reading, Sign};
use crate::run::Tripped;
use crate::scenario::{Contender, Scenario};
use afbc::Profile;
use airframe::Axis;
use plant::{Gust, GustKind, ParameterChange, Payload, Quantity, Realism, RotorFault, Rotors, Sensing, Wind};

/// A file name without its ending: letters, digits, `-` and `_` of `name`, anything else as `-`.
pub(super) fn slug(name: &str) -> String {
    let keep = |c: char| if c.is_ascii_alphanumeric() || c == '_' { c } else { '-' };
    let slug: String = name.chars().take(80).map(keep).collect();
    if slug.is_empty() { "flight".into() } else { slug }
}

/// What may tell scenarios of one name apart, as parts of a file name: reading, signs, plant, profile.
pub(super) fn case_words(scenario: &Scenario) -> [String; 4] {
    let reading = scenario.case.and_then(|case| case.reading).map_or("still-air", Reading::name);
    let sign = |sign| match sign {
        Sign::Plus => "plus",
        Sign::Minus => "minus",
    };
    let signs = scenario.case.and_then(|case| case.uncertainty).map_or("certain".into(), |uncertainty| {
        format!("inertia-{}-thrust-{}", sign(uncertainty.inertia), sign(uncertainty.thrust))
    });
    [reading.into(), signs, scenario.model.name().into(), profile(scenario).map_or("tuned", Profile::name).into()]
}

/// The profile that all contenders share, if there is one.
fn profile(scenario: &Scenario) -> Option<Profile> {
    let mut profiles = scenario.contenders.iter().map(Contender::profile);
    let first = profiles.next()?;
    profiles.all(|profile| profile == first).then_some(first)?
}

/// One line that says what was flown: "rigid-body plant, persistent gusts, inertia +75 %, thrust factor -40 %, 60 s".
pub(super) fn conditions(scenario: &Scenario) -> String {
    let mut words = vec![format!("{} plant", scenario.model.name())];
    match (scenario.case.and_then(|case| case.reading), scenario.environment.gusts().len()) {
        (_, 0) => {}
        (Some(Reading::Persistent), _) => words.push("persistent gusts".into()),
        (Some(Reading::Pulses), _) => words.push("gusts of 1 s".into()),
        (Some(Reading::Forces), _) => words.push("gusts as forces and moments".into()),
        (None, 1) => words.push("1 gust".into()),
        (None, count) => words.push(format!("{count} gusts")),
    }
    words.extend(scenario.environment.changes().iter().map(change));
    words.extend(real(scenario).into_iter().map(Into::into));
    words.extend(profile(scenario).map(|profile| format!("{} profile", profile.name())));
    words.push(format!("{} s", scenario.duration_s));
    words.join(", ")
}

/// What is real about the flight, word by word: "rotors", "battery", "drag", "wind", "ground", "payload", "sensors", "outages".
fn real(scenario: &Scenario) -> Vec<&'static str> {
    let Realism { rotors, drag, wind, contact, ground_effect, .. } = &scenario.realism;
    let (faults, battery) = (!rotors.faults.is_empty(), rotors.battery.is_some());
    let ideal = Rotors { faults: rotors.faults.clone(), battery: rotors.battery, ..Rotors::default() };
    let words = [
        (*rotors != ideal, "real rotors"),
        (faults, "rotor fault"),
        (battery, "battery"),
        (drag.is_some(), "drag"),
        (*wind != Wind::default(), "wind"),
        (contact.is_some() || ground_effect.is_some(), "ground"),
        (!scenario.environment.payloads().is_empty(), "payload"),
        (scenario.sensing != Sensing::default(), "real sensors"),
        (!scenario.outages.is_empty(), "outages"),
    ];
    words.into_iter().filter_map(|(there, word)| there.then_some(word)).collect()
}

/// "+0.2 kg"
pub(super) fn payload(payload: &Payload) -> String {
    format!("{:+} kg", payload.mass_kg)
}

/// "rotor 1 at 80 %"
pub(super) fn fault(fault: &RotorFault) -> String {
    format!("rotor {} at {} %", fault.rotor, (fault.efficiency * 1000.0).round() / 10.0)
}

/// "inertia +75 %"
pub(super) fn change(change: &ParameterChange) -> String {
    let quantity = match change.quantity {
        Quantity::Mass => "mass",
        Quantity::Inertia => "inertia",
        Quantity::ThrustFactor => "thrust factor",
        Quantity::DragFactor => "drag factor",
    };
    // Tenths of a percent.
    let percent = ((change.factor - 1.0) * 1000.0).round() / 10.0;
    format!("{quantity} {percent:+} %")
}

/// Letter and index of a gust: ("A", "x") for an acceleration, ("F", "x") for a force, ("T", "φ") for a moment.
pub(super) fn gust(gust: &Gust) -> (&'static str, &'static str) {
    let letter = match (gust.kind, gust.axis) {
        (GustKind::Acceleration, _) => "A",
        (GustKind::Force, Axis::X | Axis::Y | Axis::Z) => "F",
        (GustKind::Force, _) => "T",
    };
    (letter, symbol(gust.axis))
}

/// Unit of a gust's size.
pub(super) fn gust_unit(gust: &Gust) -> &'static str {
    match (gust.kind, gust.axis) {
        (GustKind::Acceleration, Axis::X | Axis::Y | Axis::Z) => "m/s²",
        (GustKind::Acceleration, _) => "rad/s²",
        (GustKind::Force, Axis::X | Axis::Y | Axis::Z) => "N",
        (GustKind::Force, _) => "N m",
    }
}

/// The paper's letter for the coordinate of `axis`.
pub(super) const fn symbol(axis: Axis) -> &'static str {
    match axis {
        Axis::Roll => "φ",
        Axis::Pitch => "θ",
        Axis::Yaw => "ψ",
        Axis::Z => "z",
        Axis::X => "x",
        Axis::Y => "y",
    }
}

/// "lost at t = 15.625 s: tilted beyond 90 degrees"
pub(super) fn lost(lost: &crate::flight::Lost) -> String {
    format!("lost at t = {:.3} s: {}", lost.time_s, lost.reason)
}

/// "the monitor put backstepping in AFBC's place at t = 15.625 s: rotors stay saturated"
pub(super) fn tripped(tripped: &Tripped) -> String {
    let reason = tripped.trip.reason();
    let reason = reason.strip_prefix("AFBC off: ").unwrap_or(reason);
    format!("the monitor put backstepping in AFBC's place at t = {:.3} s: {reason}", tripped.time_s)
}
