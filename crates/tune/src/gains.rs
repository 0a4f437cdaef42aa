//! A contender's gains as coordinates of a search, and as text for a scenario file.

use afbc::Profile;
use afbc::limits::{ACCELERATION, CLIMB, SPEED, TILT, TILT_RATE};
use afbc_control::command_filter::BANDWIDTH;
use afbc_control::mixer::FORCE_MAX;
use afbc_sim::contender::ControllerKind;
use afbc_sim::contender::{Contender, Law};
use afbc_types::{Axis, PerAxis, Range, Value};
use core::convert::Infallible;
use core::fmt::Write;

/// Axes that share their gains: the vehicle flies along y as along x, and turns about them alike.
const GROUPS: [&[Axis]; 4] = [&[Axis::Z], &[Axis::X, Axis::Y], &[Axis::Roll, Axis::Pitch], &[Axis::Yaw]];

/// Where a gain stands, and what it may be.
type Visit<'a> = &'a mut dyn FnMut(&str, &Range, &mut f32);

/// Shows every gain of `contender` that is a matter of taste and not 0. At 0 it switches a part of its law off, which is
/// another law; it stays there.
fn each_tunable(contender: &mut Contender, visit: Visit) {
    let mut visit = |place: &str, (range, gain): (&Range, &mut f32)| {
        if *gain > 0.0 {
            visit(place, range, gain);
        }
    };
    match &mut contender.law {
        Law::Afbc(gains) | Law::Guarded(gains) => {
            each_group(gains, &mut |place, gains| {
                let before = gains.safeguards.delta_max;
                gains.tunables().into_iter().for_each(|knob| visit(place, knob));
                // By rule, epsilon goes with the bound on delta_hat: their ratio is all that a limit cycle depends on.
                if before > 0.0 {
                    gains.epsilon *= gains.safeguards.delta_max / before;
                }
            });
        }
        Law::Backstepping(gains) => {
            each_group(gains, &mut |place, gains| gains.tunables().into_iter().for_each(|knob| visit(place, knob)));
        }
        peer => {
            let Ok(()) = peer.each_gain(&mut |declaration, value| {
                if let (true, Value::Single([gain])) = (declaration.tuned, value) {
                    visit("", (&declaration.range, gain));
                }
                Ok::<(), Infallible>(())
            });
            return;
        }
    }
    visit("cascade", (&BANDWIDTH, &mut contender.settings.command_filter_rad_s));
}

/// Shows the gains of the first axis of each group, then gives them to the whole group.
fn each_group<G: Copy>(gains: &mut PerAxis<G>, visit: &mut dyn FnMut(&str, &mut G)) {
    for group in GROUPS {
        let [first, ..] = group else { continue };
        let mut shared = gains[*first];
        visit(&group.iter().map(|axis| axis.name()).collect::<Vec<_>>().join(", "), &mut shared);
        for axis in group {
            gains[*axis] = shared;
        }
    }
}

/// The gains of `contender` as a point: the logarithm of each.
pub(super) fn point(contender: &Contender) -> Vec<f64> {
    let mut logarithms = Vec::new();
    each_tunable(&mut contender.clone(), &mut |_, _, gain| logarithms.push(libm::log(f64::from(*gain))));
    logarithms
}

/// `start` with the gains of `point`, which moves to the nearest place where all are in range. To four digits: what is
/// flown is what is written down.
pub(super) fn contender(start: &Contender, point: &mut [f64]) -> Contender {
    let mut contender = start.clone();
    let mut coordinates = point.iter_mut();
    each_tunable(&mut contender, &mut |_, range, gain| {
        let Some(x) = coordinates.next() else { return };
        // log(0) is -inf, which limits nothing.
        *x = x.clamp(libm::log(range.min), libm::log(range.max));
        *gain = four_digits(libm::exp(*x).clamp(range.min, range.max));
    });
    contender
}

fn four_digits(value: f64) -> f32 {
    format!("{value:.3e}").parse().unwrap_or(value as f32)
}

/// A gain before and after.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// Axes and key: `x, y alpha1`; of a peer, the key alone.
    pub name: String,
    /// Before.
    pub from: f32,
    /// After.
    pub to: f32,
}

/// Every gain that was searched, as it was in `start` and is in `found`.
pub(super) fn changes(start: &Contender, found: &Contender) -> Vec<Change> {
    let mut changes = Vec::new();
    each_tunable(&mut start.clone(), &mut |place, range, gain| {
        let name = format!("{place} {}", range.name).trim_start().to_owned();
        changes.push(Change { name, from: *gain, to: *gain });
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
struct Key {
    table: String,
    key: &'static str,
    value: String,
}

/// `contender` as `[[contender]]` of a scenario file: what its profile does not say already.
pub fn fragment(contender: &Contender) -> String {
    let profiles = Profile::ALL.map(|profile| {
        let keys = keys(&Contender::of(contender.kind(), profile));
        (profile, keys)
    });
    let own = keys(contender);
    let differing = |base: &[Key]| own.iter().filter(|key| !base.contains(key)).count();
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
        let _ = writeln!(text, "monitor = {}", matches!(contender.law, Law::Guarded(_)));
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

/// A TOML string: names hold no control characters.
fn quoted(name: &str) -> String {
    format!("\"{}\"", name.replace('\\', "\\\\").replace('"', "\\\""))
}

/// Everything that a scenario file can say of a contender, but the time step, which is the file's.
fn keys(contender: &Contender) -> Vec<Key> {
    let mut keys = Vec::new();
    let mut put = |table: &str, key, value: String| keys.push(Key { table: table.into(), key, value });
    let mut law = contender.law;
    match &mut law {
        Law::Afbc(gains) | Law::Guarded(gains) => {
            for axis in Axis::ALL {
                let (table, gains) = (format!("gains.{}", axis.name()), &mut gains[axis]);
                for (range, gain) in gains.tunables() {
                    put(&table, range.name, gain.to_string());
                }
                for (range, gain) in gains.others() {
                    put(&table, range.name, gain.to_string());
                }
            }
        }
        Law::Backstepping(gains) => {
            for axis in Axis::ALL {
                for (range, gain) in gains[axis].tunables() {
                    put(&format!("gains.{}", axis.name()), range.name, gain.to_string());
                }
            }
        }
        peer => {
            let Ok(()) = peer.each_gain(&mut |declaration, value| {
                if let Value::Single([gain]) = value {
                    put("gains", declaration.range.name, gain.to_string());
                }
                Ok::<(), Infallible>(())
            });
        }
    }
    let settings = &contender.settings;
    put("settings", BANDWIDTH.name, settings.command_filter_rad_s.to_string());
    put("settings", FORCE_MAX.name, settings.common.rotor_force_max_n.to_string());
    put("settings", "tilt_by_thrust", settings.tilt_by_thrust.to_string());
    put("settings", "freeze_on_ground", settings.freeze_on_ground.to_string());
    put("settings", "bumpless", settings.bumpless.to_string());
    put("settings", "anti_windup", settings.anti_windup.to_string());
    let limits = &settings.limits;
    for (range, limit) in [
        (&TILT, limits.tilt_max_rad),
        (&TILT_RATE, limits.tilt_rate_max_rad_s),
        (&ACCELERATION, limits.acceleration_max_m_s2),
        (&SPEED, limits.speed_max_m_s),
        (&CLIMB, limits.climb_max_m_s),
    ] {
        put("limits", range.name, limit.to_string());
    }
    keys
}
