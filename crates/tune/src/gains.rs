//! A contender's gains as coordinates of a search, and as text for scenario and vehicle files.

use afbc::Profile;
use afbc_files::read::words;
use afbc_scenario::Scenario;
use afbc_scenario::contender::{Contender, ControllerKind, Law};
use afbc_types::{Axis, Declaration, Declared, DeclaredValue, DeclaredValueMut, Range};
use afbc_vehicles::{CASCADE, Vehicle};
use core::convert::Infallible;
use core::fmt::Write;

/// Axes that share their gains, since they behave alike: x and y, roll and pitch.
const GROUPS: [&[Axis]; 4] = [&[Axis::Z], &[Axis::X, Axis::Y], &[Axis::Roll, Axis::Pitch], &[Axis::Yaw]];

/// Function that is called with the place, range and value of a gain.
type GainVisitor<'a> = &'a mut dyn FnMut(&str, &Range, &mut f32);

/// Visits every tuned gain of `contender` except those that are 0. A gain of 0 switches a part of its law off, and
/// stays 0.
fn each_tunable(contender: &mut Contender, visit: GainVisitor) {
    let law = &mut contender.law;
    if !law.kind().in_cascade() {
        return each_tuned("", law, |_| true, visit);
    }
    for group in GROUPS {
        each_of_group(law, group, visit);
    }
    each_tuned("cascade", &mut contender.settings, |_| true, visit);
}

/// Visits the gains of the first axis of `group`, then copies them to the others.
fn each_of_group(law: &mut Law, group: &[Axis], visit: GainVisitor) {
    let [first, others @ ..] = group else { return };
    let place = group.iter().map(|axis| axis.name()).collect::<Vec<_>>().join(", ");
    let delta_max = |law: &Law| if let Law::Afbc(gains) = law { gains[*first].safeguards.delta_max } else { 0.0 };
    let before = delta_max(law);
    each_tuned(&place, law, |declaration| declaration.group == first.name(), visit);
    // epsilon is by rule proportional to the bound on delta_hat: only their ratio determines the limit cycle.
    if let (Law::Afbc(gains), true) = (&mut *law, before > 0.0) {
        gains[*first].epsilon *= gains[*first].safeguards.delta_max / before;
    }
    let mut shared = Vec::new();
    each_of_axis(law, *first, |gain| shared.push(*gain));
    for axis in others {
        let mut shared = shared.iter();
        each_of_axis(law, *axis, |gain| *gain = shared.next().copied().unwrap_or(*gain));
    }
}

/// Visits every gain of one axis.
fn each_of_axis(law: &mut Law, axis: Axis, mut show: impl FnMut(&mut f32)) {
    let Ok(()) = law.visit_mut(&mut |declaration, value| {
        if let (true, DeclaredValueMut::Single([gain])) = (declaration.group == axis.name(), value) {
            show(gain);
        }
        Ok::<(), Infallible>(())
    });
}

/// Visits every parameter that is `wanted`, may be tuned, and is not 0.
fn each_tuned(place: &str, parameters: &mut impl Declared, wanted: impl Fn(&Declaration) -> bool, visit: GainVisitor) {
    let Ok(()) = parameters.visit_mut(&mut |declaration, value| {
        if let (true, DeclaredValueMut::Single([gain])) = (declaration.tuned && wanted(declaration), value)
            && *gain > 0.0
        {
            visit(place, &declaration.range, gain);
        }
        Ok::<(), Infallible>(())
    });
}

/// Returns the gains of `contender` as a point, whose coordinates are the gains' logarithms.
pub(super) fn point(contender: &Contender) -> Vec<f64> {
    let mut logarithms = Vec::new();
    each_tunable(&mut contender.clone(), &mut |_, _, gain| logarithms.push(libm::log(f64::from(*gain))));
    logarithms
}

/// Returns `start` with the gains of `point`, which is first clamped to the gains' ranges. Gains are rounded to four
/// digits, so that the gains flown equal the gains written.
pub(super) fn contender(start: &Contender, point: &mut [f64]) -> Contender {
    let mut contender = start.clone();
    let mut coordinates = point.iter_mut();
    each_tunable(&mut contender, &mut |_, range, gain| {
        let Some(x) = coordinates.next() else { return };
        // A lower bound of log(0) = -inf does not limit the coordinate.
        *x = x.clamp(libm::log(range.min), libm::log(range.max));
        *gain = four_digits(libm::exp(*x).clamp(range.min, range.max));
    });
    contender
}

fn four_digits(value: f64) -> f32 {
    format!("{value:.3e}").parse().unwrap_or(value as f32)
}

/// A gain before and after a search.
#[derive(Clone, Debug, PartialEq)]
pub struct GainChange {
    /// Axes and key, as in `x, y alpha1`. For a law with one controller for all axes, the key alone.
    pub name: String,
    /// Value before the search.
    pub from: f32,
    /// Value after the search.
    pub to: f32,
}

/// Returns every searched gain with its values in `start` and `found`.
pub(super) fn changes(start: &Contender, found: &Contender) -> Vec<GainChange> {
    let mut changes = Vec::new();
    each_tunable(&mut start.clone(), &mut |place, range, gain| {
        let name = format!("{place} {}", range.name).trim_start().to_owned();
        changes.push(GainChange { name, from: *gain, to: *gain });
    });
    let mut to = changes.iter_mut();
    each_tunable(&mut found.clone(), &mut |_, _, gain| {
        if let Some(change) = to.next() {
            change.to = *gain;
        }
    });
    changes
}

/// One key of a scenario file.
#[derive(PartialEq)]
struct GainKey {
    table: String,
    key: &'static str,
    value: String,
    /// True if a search may change the key's value.
    tuned: bool,
}

/// Formats `contender` as `[[contender]]` of a scenario file, without keys that its profile implies.
pub fn fragment(contender: &Contender) -> String {
    let profiles = Profile::ALL.map(|profile| {
        let keys = keys(&Contender::of(contender.kind(), profile));
        (profile, keys)
    });
    let own = keys(contender);
    let differing = |base: &[GainKey]| own.iter().filter(|key| !base.contains(key)).count();
    let (profile, base) = profiles
        .iter()
        .min_by_key(|(_, base)| differing(base))
        .map_or((Profile::Flight, &[][..]), |(profile, base)| (*profile, base.as_slice()));
    let mut text = format!(
        "[[contender]]\nname = {}\ncontroller = \"{}\"\nprofile = \"{}\"\n",
        quoted(&contender.name),
        contender.kind().name(),
        profile.name()
    );
    if contender.kind() == ControllerKind::Afbc {
        let _ = writeln!(text, "monitor = {}", contender.monitored);
    }
    let mut table = "";
    for key in own.iter().filter(|key| !base.contains(key)) {
        if table != key.table {
            table = &key.table;
            let _ = writeln!(text, "\n[contender.{table}]");
        }
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{} = {}", key.key, key.value);
    }
    text
}

/// Formats the gains of `contender`, found on these flights: for the vehicle's file if the flights are on a vehicle
/// from a file, or else as `[[contender]]` for a scenario file.
pub fn found_text(contender: &Contender, training: &[Scenario]) -> String {
    match training.first().and_then(|scenario| scenario.vehicle_file.as_ref()) {
        Some(vehicle) => vehicle_fragment(contender, vehicle),
        None => fragment(contender),
    }
}

/// Formats gains of `contender` as `[gains.flight]` of the file of `vehicle`. Includes every gain that a search may
/// change, so that a later change of the rule does not change the gains found, and every other gain that differs from
/// the rule.
pub(super) fn vehicle_fragment(contender: &Contender, vehicle: &Vehicle) -> String {
    let kind = contender.kind();
    let rule = Contender::of(kind, Profile::Flight).by_rule(vehicle);
    let base = keys(&rule);
    let (mut text, mut table) = (String::new(), String::new());
    for key in keys(contender).iter().filter(|key| key.tuned || !base.contains(key)) {
        let place = match key.table.strip_prefix("gains") {
            Some(axis) => format!("gains.flight.{}{axis}", kind.name()),
            // Only AFBC writes the cascade's settings.
            None if kind == ControllerKind::Afbc => format!("gains.flight.{CASCADE}"),
            None => continue,
        };
        if table != place {
            let _ = writeln!(text, "{}[{place}]", if table.is_empty() { "" } else { "\n" });
            table = place;
        }
        let _ = writeln!(text, "{} = {}", key.key, key.value);
    }
    text
}

/// Formats a TOML string. Names have no control characters.
fn quoted(name: &str) -> String {
    format!("\"{}\"", name.replace('\\', "\\\\").replace('"', "\\\""))
}

/// Returns all keys of a contender in a scenario file. The time step is left out, since it belongs to the whole file.
fn keys(contender: &Contender) -> Vec<GainKey> {
    let mut keys = Vec::new();
    // Groups of a law's gains are subtables of `gains`. The settings are tables beside it.
    let mut put = |table: String, key, value: DeclaredValue<'_>, tuned| {
        keys.push(GainKey { table, key, value: words::value(&value), tuned });
        Ok::<(), Infallible>(())
    };
    let Ok(()) = contender.law.visit(&mut |Declaration { group, range, tuned, .. }, value| {
        put(if group.is_empty() { "gains".into() } else { format!("gains.{group}") }, range.name, value, *tuned)
    });
    let Ok(()) = contender.settings.visit(&mut |declaration, value| {
        let Declaration { group, range, tuned, .. } = declaration;
        if range.name == afbc_control::Settings::DT.range.name {
            return Ok(());
        }
        put(if group.is_empty() { "settings" } else { group }.into(), range.name, value, *tuned)
    });
    keys
}
