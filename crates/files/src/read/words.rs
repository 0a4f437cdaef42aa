//! Units, numbers and suggestions in messages.

use afbc_types::{DeclaredValue, OutOfRange};

/// Smallest similarity of two words (Jaro-Winkler) for a suggestion "did you mean".
const LIKENESS: f64 = 0.8;

/// Units by the ending of the key, longest ending first.
const UNITS: [(&str, &str); 24] = [
    ("_kg_m3", "kilograms per cubic metre"),
    ("_n_s2_m", "newton seconds squared per metre"),
    ("_n_m_s2", "newton metre seconds squared"),
    ("_kg_m2", "kilogram square metres"),
    ("_rad_s2", "radians per second squared"),
    ("_n_s2", "newton seconds squared"),
    ("_m_s2", "metres per second squared"),
    ("_rad_s", "radians per second"),
    ("_m_s", "metres per second"),
    ("_1_s3", "1/s3"),
    ("_1_s2", "1/s2"),
    ("_1_s", "1/s"),
    ("_n_m", "newton metres"),
    ("_rad", "radians"),
    ("_kg", "kilograms"),
    ("_m2", "square metres"),
    ("_a_h", "ampere hours"),
    ("_ohm", "ohms"),
    ("_hz", "per second"),
    ("_m", "metres"),
    ("_n", "newtons"),
    ("_s", "seconds"),
    ("_v", "volts"),
    ("_w", "watts"),
];

/// Returns the unit of a key in words, such as ` (kilograms)` for `mass_kg`. A key without such an ending gets its
/// declared symbol, such as ` (1/s)`, if any.
pub fn unit(key: &str, symbol: &str) -> String {
    match UNITS.iter().find(|(ending, _)| key.ends_with(ending)) {
        Some((_, words)) => format!(" ({words})"),
        None if ["", "1"].contains(&symbol) => String::new(),
        None => format!(" ({symbol})"),
    }
}

/// Formats a number; in decimal notation from 1e-4 to 1e7.
pub fn number(value: f64) -> String {
    if value == 0.0 || (1e-4..1e7).contains(&value.abs()) { format!("{value}") } else { format!("{value:e}") }
}

/// Formats a declared value as in a file, exactly.
pub fn value(value: &DeclaredValue<'_>) -> String {
    match *value {
        DeclaredValue::Single([number]) => format!("{number:?}"),
        DeclaredValue::Double([number]) => format!("{number:?}"),
        DeclaredValue::Single(numbers) => format!("{numbers:?}"),
        DeclaredValue::Double(numbers) => format!("{numbers:?}"),
        DeclaredValue::Whole(number) => number.to_string(),
        DeclaredValue::Switch(on) => on.to_string(),
        DeclaredValue::Choice(index, words) => format!("{:?}", words.get(index).unwrap_or(&"")),
    }
}

/// Formats an out-of-range error of a controller or plant.
pub fn out_of_range(error: &OutOfRange) -> String {
    let OutOfRange { value, range } = error;
    // Uses f32 precision, since a decimal in a file may have been converted to f32.
    let (value, min, max) = (*value as f32, number(range.min), number(range.max));
    format!("{} = {value}, out of range: it must lie within {min} to {max}", range.name)
}

/// Returns the most similar word to `word`, if any is similar enough.
pub fn nearest<'w>(word: &str, words: impl Iterator<Item = &'w str>) -> Option<&'w str> {
    let rated = words.map(|other| (strsim::jaro_winkler(word, other), other));
    let (likeness, best) = rated.max_by(|(a, _), (b, _)| a.total_cmp(b))?;
    (likeness >= LIKENESS).then_some(best)
}

/// Returns a suggestion for a word that is not in `known`: the most similar known word, or else all of them.
pub fn cure<'w>(word: &str, known: impl Iterator<Item = &'w str> + Clone) -> String {
    match nearest(word, known.clone()) {
        Some(similar) => format!("did you mean {similar}?"),
        None => format!("there are {}", known.collect::<Vec<_>>().join(", ")),
    }
}

/// Formats a list such as `"step", "circle" or "hover"`.
pub fn one_of<T: Copy>(options: &[T], name: fn(T) -> &'static str) -> String {
    let quoted: Vec<_> = options.iter().map(|&option| format!("\"{}\"", name(option))).collect();
    match quoted.split_last() {
        Some((last, others)) if !others.is_empty() => format!("{} or {last}", others.join(", ")),
        _ => quoted.concat(),
    }
}
