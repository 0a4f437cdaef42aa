//! Reading on after a mistake, so that one error reports every mistake of a file.

use super::error::{FileError, FileLocation, MistakeKind, SourceFile};
use super::inheritance::LIKE;
use super::table::{Overlooked, Table};
use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue};

/// Keys that decide which other keys a table has.
const DECIDING: [&str; 6] = ["kind", LIKE, "controller", "axis", "parameter", "failure"];
/// Largest number of mistakes reported.
const MOST: usize = 50;
/// Largest number of times that a file is read.
const READINGS: usize = 10 * MOST;
/// Largest number of readings for rating one option.
const TRIALS: usize = 12;

/// Reads `document`. After each mistake it mends the document and reads again, to find the next mistake.
///
/// - A misspelt key is renamed.
/// - A wrong value of a key that decides the kind of its table becomes the option that fits best.
/// - Anything else is removed. A key that is missing then gets any value, or its value in `template`, a valid file;
///   failing both, its table is removed, too.
///
/// # Errors
/// All mistakes in the order of the file, without those that only follow from mending another.
pub(crate) fn read_all<'d, T>(
    source: SourceFile<'d>,
    document: DeTable<'d>,
    template: &'static str,
    read: impl Fn(Table<'_>) -> Result<T, FileError>,
) -> Result<T, FileError> {
    let template = DeTable::parse(template).map(Spanned::into_inner).unwrap_or_default();
    let mut draft = Draft { document, mended: Mended::default() };
    let (mut mistakes, mut left) = (Vec::<FileError>::new(), READINGS);
    while left > 0 {
        left -= 1;
        let error = match read(draft.root(source)) {
            Ok(value) if mistakes.is_empty() => return Ok(value),
            Ok(_) => break,
            Err(error) => error,
        };
        let place = error.place().filter(|place| place.file == source.file).cloned();
        if !place.as_ref().is_some_and(|place| draft.explains(place)) {
            mistakes.push(error);
        }
        let Some(place) = place.filter(|_| mistakes.len() < MOST) else { break };
        match draft.decided(&place, source, &template, &read, &mut left) {
            Some(decided) => draft = decided,
            None if draft.mend(&place, &template) => {}
            None => break,
        }
    }
    Err(FileError::all(mistakes))
}

/// Working copy of a document, with the mistakes mended so far.
#[derive(Clone)]
struct Draft<'d> {
    document: DeTable<'d>,
    mended: Mended,
}

/// Record of the mends so far.
#[derive(Clone, Default)]
struct Mended {
    /// Mended dotted keys, each with the byte offsets of the list items around it.
    keys: Vec<(String, Vec<usize>)>,
    overlooked: Overlooked,
    /// Dotted keys taken from the template.
    given: Vec<String>,
}

/// True if the dotted key `inner` is `outer` or inside it. The empty key is the document, which contains all keys.
fn is_within(inner: &str, outer: &str) -> bool {
    let rest = inner.strip_prefix(outer);
    outer.is_empty() || rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
}

/// True if one of two dotted keys is inside the other, after dropping any number of leading parts of `key`: a scenario
/// may be part of a larger file.
fn concerns(key: &str, other: &str) -> bool {
    let rests = key.match_indices('.').filter_map(|(at, _)| key.get(at + 1..));
    core::iter::once(key).chain(rests).any(|key| is_within(key, other) || is_within(other, key))
}

impl<'d> Draft<'d> {
    fn root<'a>(&'a self, source: SourceFile<'a>) -> Table<'a>
    where
        'd: 'a,
    {
        Table::root(source, &self.document, &self.mended.overlooked)
    }

    /// True if a mistake may be a mere consequence of an earlier mend.
    fn explains(&self, place: &FileLocation) -> bool {
        let (items, mended) = (items(&self.document, place), &self.mended);
        let among = match &place.fault {
            MistakeKind::Clash([]) => place.table_key(),
            _ => &place.key,
        };
        let clashes = |key: &String| match &place.fault {
            MistakeKind::Clash(with) => with.iter().any(|with| concerns(key, with)),
            _ => false,
        };
        let mut keys = mended.keys.iter();
        keys.any(|(key, within)| clashes(key) || is_within(key, among) && within.starts_with(&items))
            || mended.given.iter().any(|given| is_within(&place.key, given))
    }

    /// Replaces a wrong or missing value of a key that decides the kind of its table. The new value is the option that
    /// leaves the fewest mistakes in this table. Returns the new draft; none for other mistakes.
    fn decided<T>(
        &self,
        place: &FileLocation,
        source: SourceFile<'_>,
        template: &DeTable<'static>,
        read: impl Fn(Table<'_>) -> Result<T, FileError>,
        left: &mut usize,
    ) -> Option<Self> {
        let MistakeKind::Choice(options) = &place.fault else { return None };
        if self.mended.keys.iter().any(|(key, within)| *key == place.key && *within == items(&self.document, place)) {
            return None;
        }
        let rated = options.iter().filter_map(|option| {
            let chosen = self.choosing(place, option)?;
            let (mut trial, mut weight, mut is_read) = (chosen.clone(), 0, false);
            for _ in 0..TRIALS.min(*left) {
                *left -= 1;
                // Any further mistake is outside this table.
                is_read = true;
                let Err(error) = read(trial.root(source)) else { break };
                let found = error.place().filter(|found| found.file == source.file);
                let within = |found: &&FileLocation| {
                    is_within(&found.key, place.table_key())
                        && items(&trial.document, found).starts_with(&items(&trial.document, place))
                };
                let Some(found) = found.filter(within).cloned() else { break };
                is_read = false;
                let is_own = found.table_key() == place.table_key();
                weight += if trial.explains(&found) { 0 } else { found.fault.weight(is_own) };
                // An option that makes the whole table wrong does not fit.
                if found.key == place.table_key() || !trial.mend(&found, template) {
                    break;
                }
            }
            Some(((!is_read, weight), chosen))
        });
        rated.min_by_key(|(weight, _)| *weight).map(|(_, chosen)| chosen)
    }

    /// Returns a draft with `option` under the key; none if the key does not decide the kind of its table.
    fn choosing(&self, place: &FileLocation, option: &'static str) -> Option<Self> {
        let mut draft = self.clone();
        let keys: Vec<&str> = place.key.split('.').collect();
        let (last, parents) = keys.split_last().filter(|(last, _)| DECIDING.contains(last))?;
        let table = table_at(&mut draft.document, parents, place.at)?;
        let value = Spanned::new(place.at..place.at, DeValue::String(option.into()));
        table.insert(Spanned::new(place.at..place.at, (*last).to_owned().into()), value);
        draft.mended.keys.push((place.key.clone(), items(&draft.document, place)));
        Some(draft)
    }

    /// Mends the mistake; returns false if it cannot be mended.
    fn mend(&mut self, place: &FileLocation, template: &DeTable<'static>) -> bool {
        let items = items(&self.document, place);
        let Draft { document, mended } = self;
        mended.keys.push((place.key.clone(), items.clone()));
        let overlooked = (place.key.clone(), place.table);
        if matches!(place.fault, MistakeKind::Clash(_)) && !mended.overlooked.clashes.contains(&overlooked) {
            mended.overlooked.clashes.push(overlooked);
            return true;
        }
        let keys: Vec<&str> = place.key.split('.').collect();
        let Some((last, parents)) = keys.split_last() else { return false };
        if let MistakeKind::Unknown(Some(instead)) = place.fault
            && let Some(table) = table_at(document, parents, place.at)
            && let Some((key, value)) = table.remove_entry(*last)
        {
            if !table.contains_key(instead) {
                table.insert(Spanned::new(key.span(), instead.into()), value);
                let parents = parents.iter().map(|key| format!("{key}."));
                mended.keys.push((parents.chain([instead.to_owned()]).collect(), items));
            }
            return true;
        }
        // Other keys can be removed; without a deciding key, the rest of its table has no meaning.
        let decides = DECIDING.contains(last);
        if !decides && !mended.overlooked.keys.contains(&overlooked) {
            mended.overlooked.keys.push(overlooked);
            if let Some(table) = table_at(document, parents, place.at) {
                table.remove(*last);
            }
            return true;
        }
        // Goes from the key outwards until a key can be removed or taken from the template.
        let deepest = keys.len() - usize::from(decides && keys.len() > 1);
        (1..=deepest).rev().any(|depth| {
            let Some((outer, is_inner)) = keys.get(..depth).map(|outer| (outer, depth < keys.len())) else {
                return false;
            };
            let Some((key, parents)) = outer.split_last() else { return false };
            let Some(table) = table_at(document, parents, place.at) else { return false };
            take_out(table, key, is_inner.then_some(place.at)) || mended.give(table, outer, template)
        })
    }
}

impl Mended {
    /// Copies the template's value of the dotted key into `table`, once per key.
    fn give<'d>(&mut self, table: &mut DeTable<'d>, keys: &[&str], template: &DeTable<'static>) -> bool {
        let dotted = keys.join(".");
        let Some((last, parents)) = keys.split_last().filter(|_| !self.given.contains(&dotted)) else { return false };
        let source = parents.iter().try_fold(template, |table, key| table.get(*key)?.get_ref().as_table());
        let Some((key, value)) = source.and_then(|table| table.get_key_value(*last)) else { return false };
        table.insert(key.clone(), value.clone());
        self.given.push(dotted);
        true
    }
}

impl MistakeKind {
    /// Returns how strongly a mistake suggests that the table is meant to be another kind. A wrong key outweighs any
    /// number of wrong values; a wrong key of the table itself outweighs those in subtables.
    const fn weight(&self, is_own: bool) -> usize {
        match self {
            MistakeKind::Missing | MistakeKind::Unknown(_) if is_own => TRIALS * TRIALS,
            MistakeKind::Missing | MistakeKind::Unknown(_) => TRIALS,
            MistakeKind::Value | MistakeKind::Choice(_) | MistakeKind::Clash(_) => 1,
        }
    }
}

impl FileLocation {
    /// Returns the dotted name of the key's table.
    fn table_key(&self) -> &str {
        self.key.rsplit_once('.').map_or("", |(table, _)| table)
    }
}

/// Removes the value under `key`. In a list of tables, removes only the item around byte `item`, if given.
fn take_out(table: &mut DeTable<'_>, key: &str, item: Option<usize>) -> bool {
    if let (Some(at), Some(DeValue::Array(list))) = (item, table.get_mut(key).map(Spanned::get_mut))
        && let Some(index) = index_at(list, at).filter(|_| list.len() > 1)
    {
        let others = list.iter().enumerate().filter(|(other, _)| *other != index);
        *list = others.map(|(_, value)| value.clone()).collect();
        return true;
    }
    table.remove(key).is_some()
}

/// Returns the table under the dotted key; in a list of tables, the item around byte `at`.
fn table_at<'t, 'd>(mut table: &'t mut DeTable<'d>, keys: &[&str], at: usize) -> Option<&'t mut DeTable<'d>> {
    for key in keys {
        table = match table.get_mut(*key)?.get_mut() {
            DeValue::Table(inner) => inner,
            DeValue::Array(list) => {
                let index = index_at(list, at)?;
                match list.get_mut(index)?.get_mut() {
                    DeValue::Table(inner) => inner,
                    _ => return None,
                }
            }
            _ => return None,
        };
    }
    Some(table)
}

/// Returns the byte offsets at which the list items around the place begin.
fn items(document: &DeTable<'_>, place: &FileLocation) -> Vec<usize> {
    let (mut table, mut items) = (document, Vec::new());
    let keys: Vec<&str> = place.key.split('.').collect();
    for key in keys.iter().take(keys.len().saturating_sub(1)) {
        table = match table.get(*key).map(Spanned::get_ref) {
            Some(DeValue::Table(inner)) => inner,
            Some(DeValue::Array(list)) => match index_at(list, place.at).and_then(|index| list.get(index)) {
                Some(item) => {
                    items.push(item.span().start);
                    match item.get_ref() {
                        DeValue::Table(inner) => inner,
                        _ => break,
                    }
                }
                None => break,
            },
            _ => break,
        };
    }
    items
}

/// Returns the index of the list item around byte `at`.
fn index_at(list: &DeArray<'_>, at: usize) -> Option<usize> {
    list.iter().rposition(|item| item.span().start <= at)
}
