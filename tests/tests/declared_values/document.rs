//! A file as tables of keys, with other values to try for each.

use afbc_files::read::words;
use afbc_types::{Declaration, Declared, DeclaredValue};
use core::convert::Infallible;
use core::fmt::{self, Write};
use std::collections::BTreeMap;

/// A file with its tables and keys.
#[derive(Default)]
pub(crate) struct Document {
    tables: Vec<(String, Vec<Entry>)>,
}

struct Entry {
    key: String,
    value: String,
    /// Declaration of the value; none if its key is read by hand.
    declaration: Option<Declaration>,
    cases: Vec<(Option<char>, Vec<String>)>,
}

/// A value to be changed: a number of a vector, or a whole value.
pub(crate) struct Case {
    table: usize,
    entry: usize,
    /// Header of the value's table, without brackets.
    pub(crate) header: String,
    pub(crate) key: String,
    pub(crate) coordinate: Option<char>,
    pub(crate) declaration: Option<Declaration>,
    /// Other values to try. Some may be refused.
    pub(crate) others: Vec<String>,
}

impl fmt::Display for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}", self.header, self.key)?;
        self.coordinate.map_or(Ok(()), |coordinate| write!(f, ".{coordinate}"))
    }
}

impl Document {
    /// Adds keys that are read by hand, with other values to try.
    pub(crate) fn plain(mut self, header: &str, entries: &[(&str, String, &[&str])]) -> Self {
        let entries = entries.iter().map(|(key, value, others)| {
            let others: Vec<_> = others.iter().map(|other| (*other).to_owned()).collect();
            let cases = if others.is_empty() { vec![] } else { vec![(None, others)] };
            Entry { key: (*key).into(), value: value.clone(), declaration: None, cases }
        });
        self.entries(header).extend(entries);
        self
    }

    /// Adds the parameters of this group, except those whose keys are `elsewhere`.
    pub(crate) fn group(mut self, header: &str, parameters: &impl Declared, group: &str, elsewhere: &[&str]) -> Self {
        let entries = self.entries(header);
        let Ok(()) = parameters.visit(&mut |declaration, value| {
            let key = declaration.range.name;
            if declaration.group == group && !elsewhere.contains(&key) {
                let (key, cases) = (key.into(), cases(declaration, &value));
                entries.push(Entry { key, value: words::value(&value), declaration: Some(*declaration), cases });
            }
            Ok::<(), Infallible>(())
        });
        self
    }

    fn entries(&mut self, header: &str) -> &mut Vec<Entry> {
        let is_list = header.starts_with("[[");
        if is_list || self.tables.last().is_none_or(|(last, _)| last != header) {
            self.tables.push((header.into(), Vec::new()));
        }
        &mut self.tables.last_mut().unwrap().1
    }

    pub(crate) fn text(&self) -> String {
        self.lines(|_, _| None)
    }

    /// Returns the text with another value.
    pub(crate) fn with(&self, case: &Case, other: &str) -> String {
        self.lines(|table, entry| (table == case.table && entry == case.entry).then_some(other))
    }

    fn lines<'a>(&self, other: impl Fn(usize, usize) -> Option<&'a str>) -> String {
        let mut text = String::new();
        for (table, (header, entries)) in self.tables.iter().enumerate() {
            writeln!(text, "{header}").unwrap();
            for (at, Entry { key, value, .. }) in entries.iter().enumerate() {
                writeln!(text, "{key} = {}", other(table, at).unwrap_or(value)).unwrap();
            }
        }
        text
    }

    /// Returns every declared value with its table, header and key.
    pub(crate) fn declared(&self) -> BTreeMap<(usize, String), String> {
        let tables = self.tables.iter().enumerate();
        let all = tables.flat_map(|(at, (header, entries))| entries.iter().map(move |entry| (at, header, entry)));
        let declared = all.filter(|(.., entry)| entry.declaration.is_some());
        declared
            .map(|(at, header, Entry { key, value, .. })| ((at, format!("{header} {key}")), value.clone()))
            .collect()
    }

    /// Returns the names and values of `other` that differ from this file's.
    pub(crate) fn differing(&self, other: &Document) -> Vec<(String, String)> {
        let (own, others) = (self.declared(), other.declared());
        assert_eq!(own.keys().collect::<Vec<_>>(), others.keys().collect::<Vec<_>>());
        let pairs = own.into_iter().zip(others.into_values());
        let differing = pairs.filter(|((_, one), other)| one != other);
        differing.map(|(((_, name), _), other)| (name, other)).collect()
    }

    /// Returns every value to be changed.
    pub(crate) fn cases(&self) -> Vec<Case> {
        let mut all = Vec::new();
        for (table, (header, entries)) in self.tables.iter().enumerate() {
            for (at, Entry { key, declaration, cases, .. }) in entries.iter().enumerate() {
                all.extend(cases.iter().map(|(coordinate, others)| Case {
                    table,
                    entry: at,
                    header: header.trim_matches(['[', ']']).into(),
                    key: key.clone(),
                    coordinate: *coordinate,
                    declaration: *declaration,
                    others: others.clone(),
                }));
            }
        }
        all
    }
}

/// Returns values to try in place of `value`, for each of its coordinates.
fn cases(declaration: &Declaration, value: &DeclaredValue<'_>) -> Vec<(Option<char>, Vec<String>)> {
    let range = declaration.range;
    let near = |number: f64| {
        let all = [number * 1.01, range.max, range.min, number * 0.5, number * 2.0, number * 0.99, number + 0.01];
        let all = all.into_iter().chain([number - 0.01]);
        all.filter(|other| range.check(*other).is_ok() && *other != number && other.is_finite()).collect::<Vec<_>>()
    };
    match *value {
        DeclaredValue::Single([number]) => {
            let near = near((*number).into()).into_iter().map(|other| other as f32).filter(|other| other != number);
            vec![(None, near.map(|other| format!("{other:?}")).collect())]
        }
        DeclaredValue::Double([number]) => {
            vec![(None, near(*number).iter().map(|other| format!("{other:?}")).collect())]
        }
        DeclaredValue::Single(numbers) => {
            vector(numbers, |number| near(number.into()).iter().map(|it| *it as f32).collect())
        }
        DeclaredValue::Double(numbers) => vector(numbers, near),
        DeclaredValue::Whole(number) => {
            let others = [number.wrapping_add(1), number.wrapping_sub(1), number * 2, number / 2];
            let others = others.into_iter().filter(|other| *other != number && range.check(*other).is_ok());
            vec![(None, others.map(|other| other.to_string()).collect())]
        }
        DeclaredValue::Switch(on) => vec![(None, vec![(!on).to_string()])],
        DeclaredValue::Choice(index, words) => {
            let others = words.iter().enumerate().filter(|(other, _)| *other != index);
            vec![(None, others.map(|(_, word)| format!("{word:?}")).collect())]
        }
    }
}

fn vector<T: Copy + fmt::Debug>(numbers: &[T], near: impl Fn(T) -> Vec<T>) -> Vec<(Option<char>, Vec<String>)> {
    let with = |at: usize, other: T| {
        let mut numbers = numbers.to_vec();
        numbers[at] = other;
        format!("{numbers:?}")
    };
    let coordinates = ['X', 'Y', 'Z'].into_iter().enumerate();
    coordinates
        .map(|(at, name)| (Some(name), near(numbers[at]).into_iter().map(|other| with(at, other)).collect()))
        .collect()
}
