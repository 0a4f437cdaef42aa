//! Typed access to TOML: checks every value as it is read and refuses unknown keys.

use super::error::{FileError, FileLocation, MistakeKind, SourceFile};
use super::words::{self, nearest, one_of};
use afbc_types::{Declaration, Declared, DeclaredValueMut, Range};
use nalgebra::Vector3;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Largest length of an array of tables that is searched in each step of a flight.
const MOST: usize = 100;

/// Mistakes already reported, which the reader overlooks: dotted keys with the byte offsets of their tables.
#[derive(Clone, Default)]
pub(crate) struct Overlooked {
    /// Removed keys. A reader that needs one gets any value.
    pub(crate) keys: Vec<(String, usize)>,
    /// Keys whose value conflicts with others.
    pub(crate) clashes: Vec<(String, usize)>,
}

/// One table of a document, with a record of the keys read so far.
pub struct Table<'a> {
    source: SourceFile<'a>,
    /// Dotted name; empty for the document.
    path: String,
    /// Byte offset of the table, to which errors about missing keys point.
    start: usize,
    entries: &'a DeTable<'a>,
    read: Vec<&'static str>,
    /// Declared keys among the read keys, with their unit symbols.
    units: Vec<(&'static str, &'static str)>,
    overlooked: &'a Overlooked,
}

impl<'a> Table<'a> {
    /// Returns the document as a table.
    pub(crate) fn root(source: SourceFile<'a>, entries: &'a DeTable<'a>, overlooked: &'a Overlooked) -> Self {
        Table { source, path: String::new(), start: 0, entries, read: Vec::new(), units: Vec::new(), overlooked }
    }

    /// Returns the file's name in error messages.
    pub fn file(&self) -> &'a str {
        self.source.file
    }

    /// Returns the number under `range.name`, if present.
    pub fn number(&mut self, range: &Range) -> Result<Option<f64>, FileError> {
        let Some(value) = self.value(range.name) else { return Ok(None) };
        self.number_in(value, range.name, range).map(Some)
    }

    /// Returns the number under `range.name`, which is required.
    pub fn need_number(&mut self, range: &Range) -> Result<f64, FileError> {
        let number = self.number(range)?;
        self.require(range)?;
        Ok(number.unwrap_or(any(range)))
    }

    /// Reads every key of `parameters` without a group that is present; the others keep their values. Each group has
    /// its own table.
    pub fn declared(&mut self, parameters: &mut impl Declared) -> Result<(), FileError> {
        self.declared_in("", parameters)
    }

    /// Reads every present key of this group of `parameters`; the others keep their values.
    pub fn declared_in(&mut self, group: &str, parameters: &mut impl Declared) -> Result<(), FileError> {
        self.declared_where(parameters, |declaration| declaration.group == group)
    }

    /// Reads every present key of `parameters` without a group, except the key `elsewhere`; the others keep their
    /// values.
    pub fn declared_but(&mut self, elsewhere: &str, parameters: &mut impl Declared) -> Result<(), FileError> {
        self.declared_where(parameters, |Declaration { group, range, .. }| group.is_empty() && range.name != elsewhere)
    }

    fn declared_where(
        &mut self,
        parameters: &mut impl Declared,
        wanted: impl Fn(&Declaration) -> bool,
    ) -> Result<(), FileError> {
        parameters.visit_mut(&mut |declaration, value| {
            let Declaration { range, unit, .. } = declaration;
            if !wanted(declaration) {
                return Ok(());
            }
            // The unit is stored before the value is read, since an error names the unit.
            self.units.push((range.name, unit));
            match value {
                DeclaredValueMut::Single([number]) => {
                    self.number(range)?.into_iter().for_each(|read| *number = read as f32)
                }
                DeclaredValueMut::Double([number]) => self.number(range)?.into_iter().for_each(|read| *number = read),
                DeclaredValueMut::Whole(number) => {
                    self.whole(range)?.into_iter().for_each(|read| *number = read as u32)
                }
                DeclaredValueMut::Switch(switch) => {
                    self.boolean(range.name)?.into_iter().for_each(|read| *switch = read)
                }
                DeclaredValueMut::Choice(index, words) => {
                    let read = self.choice(range.name, words, |word| word)?;
                    *index = words.iter().position(|word| Some(*word) == read).unwrap_or(*index);
                }
                DeclaredValueMut::Single(numbers) => {
                    let read = self.vector(range.name, [range; 3])?;
                    numbers.iter_mut().zip(read.iter().flatten()).for_each(|(number, read)| *number = *read as f32);
                }
                DeclaredValueMut::Double(numbers) => {
                    let read = self.vector(range.name, [range; 3])?;
                    numbers.iter_mut().zip(read.iter().flatten()).for_each(|(number, read)| *number = *read);
                }
            }
            Ok(())
        })
    }

    /// Returns an error if `range.name` is missing.
    pub fn require(&self, range: &Range) -> Result<(), FileError> {
        if self.has(range.name) || !self.knows(range.name) {
            return Ok(());
        }
        Err(self.missing(range.name, &format!("add it{}", self.unit(range.name))))
    }

    /// True if `key` is present.
    pub fn has(&self, key: &str) -> bool {
        self.entries.contains_key(key)
    }

    /// Returns the whole number under `range.name`, exactly, if present.
    pub fn whole(&mut self, range: &Range) -> Result<Option<u64>, FileError> {
        let Some(value) = self.value(range.name) else { return Ok(None) };
        let (min, max) = (range.min as i128, range.max as i128);
        let bounds = format!("it must lie within {} to {}", words::number(range.min), words::number(range.max));
        let outside = |number: &str| self.refuse(value, range.name, format!("{number} is out of range: {bounds}"));
        match value.get_ref() {
            // Avoids conversion to a float, which would round large numbers.
            DeValue::Integer(integer) => {
                let number = i128::from_str_radix(integer.as_str(), integer.radix()).ok();
                let number = number.filter(|number| (min..=max).contains(number)).and_then(|n| u64::try_from(n).ok());
                number
                    .map(Some)
                    .ok_or_else(|| outside(&value.get_ref().as_integer().map_or("it".into(), |i| i.to_string())))
            }
            DeValue::Float(float) if !is_whole(float.as_str()) => {
                let problem = format!("{} is not a whole number; leave out its decimals", float.as_str());
                Err(self.refuse(value, range.name, problem))
            }
            _ => match self.number_in(value, range.name, range)? {
                number if (range.min..=range.max).contains(&number) => Ok(Some(number as u64)),
                number => Err(outside(&words::number(number))),
            },
        }
    }

    /// Returns the interval `[low, high]` under `range.name`, if present. A single number gives both ends.
    pub fn interval(&mut self, range: &Range) -> Result<Option<[f64; 2]>, FileError> {
        let Some(value) = self.value(range.name) else { return Ok(None) };
        let number = |value| self.number_in(value, range.name, range);
        let Some(array) = value.get_ref().as_array() else {
            return number(value).map(|number| Some([number; 2]));
        };
        match array.iter().collect::<Vec<_>>().as_slice() {
            [low, high] => match [number(low)?, number(high)?] {
                [low, high] if low > high => Err(self.refuse(
                    value,
                    range.name,
                    format!("{low} is above {high}; write the smaller number first"),
                )),
                ends => Ok(Some(ends)),
            },
            other => Err(self.refuse(
                value,
                range.name,
                format!("{} values; write one number, or two as in [low, high]", other.len()),
            )),
        }
    }

    /// Returns the three numbers under `key`, each within its range, if present.
    pub fn vector(&mut self, key: &'static str, ranges: [&Range; 3]) -> Result<Option<Vector3<f64>>, FileError> {
        let Some(value) = self.value(key) else { return Ok(None) };
        let ([rx, ry, rz], array) = (ranges, value.get_ref().as_array());
        let number = |value, range| self.number_in(value, key, range);
        match array.map(|array| array.iter().collect::<Vec<_>>()).as_deref() {
            Some(&[x, y, z]) => Ok(Some(Vector3::new(number(x, rx)?, number(y, ry)?, number(z, rz)?))),
            Some(other) => {
                Err(self.refuse(value, key, format!("{} values; write three, as in [x, y, z]", other.len())))
            }
            None => Err(self.wrong_type(value, key, "three numbers", "[x, y, z]")),
        }
    }

    /// Returns the three numbers under the required `key`, each within `range`.
    pub fn need_vector(&mut self, key: &'static str, range: &Range) -> Result<Vector3<f64>, FileError> {
        let any = (!self.knows(key)).then(|| Vector3::repeat(any(range)));
        let vector = self.vector(key, [range; 3])?.or(any);
        vector.ok_or_else(|| self.missing(key, &format!("add three numbers{}", self.unit(key))))
    }

    /// Returns the string under `key`, if present.
    pub fn text(&mut self, key: &'static str) -> Result<Option<&'a str>, FileError> {
        let Some(value) = self.value(key) else { return Ok(None) };
        self.text_in(value, key).map(Some)
    }

    /// Returns the string under `key`, which is required.
    pub fn need_text(&mut self, key: &'static str, cure: &str) -> Result<&'a str, FileError> {
        let text = self.text(key)?.or_else(|| (!self.knows(key)).then_some("any"));
        text.ok_or_else(|| self.missing(key, cure))
    }

    /// Returns the strings in the list under `key`, if present.
    pub fn texts(&mut self, key: &'static str) -> Result<Option<Vec<&'a str>>, FileError> {
        let Some(value) = self.value(key) else { return Ok(None) };
        let Some(array) = value.get_ref().as_array() else {
            return Err(self.wrong_type(value, key, "a list", "[\"...\"]"));
        };
        array.iter().map(|item| self.text_in(item, key)).collect::<Result<_, _>>().map(Some)
    }

    /// Returns the option named under `key`, if present.
    pub fn choice<T: Copy>(
        &mut self,
        key: &'static str,
        options: &[T],
        name: fn(T) -> &'static str,
    ) -> Result<Option<T>, FileError> {
        let Some(value) = self.value(key) else { return Ok(None) };
        self.choice_in(value, key, options, name).map(Some)
    }

    /// Returns the option named under `key`, which is required.
    pub fn need_choice<T: Copy>(
        &mut self,
        key: &'static str,
        options: &[T],
        name: fn(T) -> &'static str,
    ) -> Result<T, FileError> {
        let any = options.first().copied().filter(|_| !self.knows(key));
        let choice = self.choice(key, options, name)?.or(any);
        choice.ok_or_else(|| {
            let missing = self.missing(key, &format!("it must be {}", one_of(options, name)));
            let is_misspelt = missing.place().is_some_and(|place| matches!(place.fault, MistakeKind::Unknown(_)));
            if is_misspelt {
                missing
            } else {
                missing.because(MistakeKind::Choice(options.iter().copied().map(name).collect()))
            }
        })
    }

    /// Returns the options named in the list under `key`, if present. The list must not be empty or name an option
    /// twice.
    pub fn choices<T: Copy + PartialEq>(
        &mut self,
        key: &'static str,
        options: &[T],
        name: fn(T) -> &'static str,
    ) -> Result<Option<Vec<T>>, FileError> {
        let Some(value) = self.value(key) else { return Ok(None) };
        let Some(array) = value.get_ref().as_array() else {
            return Err(self.wrong_type(value, key, "a list", "[\"...\"]"));
        };
        let (mut chosen, mut wrong) = (Vec::new(), None::<FileError>);
        for item in array.iter() {
            match self.choice_in(item, key, options, name) {
                Ok(choice) if !chosen.contains(&choice) => chosen.push(choice),
                read => {
                    let twice = |choice| format!("\"{}\" is listed twice; once is enough", name(choice));
                    let error = read.map_or_else(|error| error, |choice| self.refuse(item, key, twice(choice)));
                    wrong = Some(wrong.map_or(error.clone(), |wrong| wrong.and(error)));
                }
            }
        }
        if let Some(wrong) = wrong {
            return Err(wrong);
        }
        if chosen.is_empty() {
            return Err(self.refuse(value, key, format!("the list is empty; add {}", one_of(options, name))));
        }
        Ok(Some(chosen))
    }

    /// Returns the table under `key`, if present.
    pub fn table(&mut self, key: &'static str) -> Result<Option<Table<'a>>, FileError> {
        let Some(value) = self.value(key) else { return Ok(None) };
        self.table_in(value, key, &format!("one table: [{}]", self.dotted(key))).map(Some)
    }

    /// Returns the table under `key`, if there is one and it is a table.
    pub fn table_if(&mut self, key: &'static str) -> Result<Option<Table<'a>>, FileError> {
        let is_table = self.entries.get(key).is_some_and(|value| value.get_ref().is_table());
        if is_table { self.table(key) } else { Ok(None) }
    }

    /// Returns the tables of the array under `key`; none if it is missing.
    pub fn tables(&mut self, key: &'static str) -> Result<Vec<Table<'a>>, FileError> {
        let Some(value) = self.value(key) else { return Ok(Vec::new()) };
        let wanted = format!("[[{}]], once for each", self.dotted(key));
        let Some(array) = value.get_ref().as_array() else {
            return Err(self.wrong_type(value, key, "a list of tables", &wanted));
        };
        array.iter().map(|item| self.table_in(item, key, &wanted)).collect()
    }

    /// Returns the tables of the array under `key`, at most 100.
    pub fn few_tables(&mut self, key: &'static str) -> Result<Vec<Table<'a>>, FileError> {
        let tables = self.tables(key)?;
        if tables.len() > MOST {
            return Err(
                self.fault_at(key, format!("the file has {} of these tables; keep at most {MOST}", tables.len()))
            );
        }
        Ok(tables)
    }

    /// Returns the boolean under `key`, if present.
    pub fn boolean(&mut self, key: &'static str) -> Result<Option<bool>, FileError> {
        let Some(value) = self.value(key) else { return Ok(None) };
        let boolean = value.get_ref().as_bool();
        boolean.map(Some).ok_or_else(|| self.wrong_type(value, key, "true or false", "true or false without quotes"))
    }

    /// True if a table is under `key`.
    pub fn holds_table(&self, key: &str) -> bool {
        self.entries.get(key).is_some_and(|value| value.get_ref().is_table())
    }

    /// Returns an error for the first key that was not read.
    pub fn finish(&self) -> Result<(), FileError> {
        let Some((key, start)) = self.unread().min_by_key(|(_, start)| *start) else { return Ok(()) };
        let instead = nearest(key, self.read.iter().copied());
        let instead = instead.and_then(|known| self.read.iter().copied().find(|read| *read == known));
        let cure = match instead {
            Some(known) => self.did_you_mean(known),
            None => format!("known here: {}", self.read.join(", ")),
        };
        Err(self.unknown(key, start, &cure, instead))
    }

    /// Returns an error with `problem` if `key` is present.
    pub fn forbid(&self, key: &str, problem: &str) -> Result<(), FileError> {
        if self.has(key) { Err(self.fault_at(key, problem)) } else { Ok(()) }
    }

    /// Places an error of another file, which `key` names, at that key. Reading of this file then continues after the
    /// key.
    pub fn through(&self, key: &str, error: FileError) -> FileError {
        let at = self.entries.get(key).map_or(self.start, |value| value.span().start);
        let (file, line, key) = (self.source.file.to_owned(), self.source.line(at), self.dotted(key));
        let place = Box::new(FileLocation { file, key, at, line, table: self.start, fault: MistakeKind::Value });
        error.placed(|own| {
            if own.as_ref().is_none_or(|own| own.file != place.file) {
                *own = Some(place.clone());
            }
        })
    }

    /// Reports that the value under `key` conflicts with those under the dotted keys `with`; if `with` is empty, with
    /// the others of this table. A conflict that was reported before is ignored, so that reading goes on to the next
    /// mistake.
    ///
    /// # Errors
    /// The conflict with its `problem`.
    pub fn clash(&self, key: &str, with: &'static [&'static str], problem: impl Into<String>) -> Result<(), FileError> {
        let clash = (self.dotted(key), self.start);
        if self.overlooked.clashes.contains(&clash) {
            return Ok(());
        }
        Err(self.fault_at(key, problem).because(MistakeKind::Clash(with)))
    }

    /// Returns an error about the value under `key`.
    pub fn fault_at(&self, key: &str, problem: impl Into<String>) -> FileError {
        let start = self.entries.get(key).map_or(self.start, |value| value.span().start);
        self.error(start, key, problem)
    }

    /// Returns an error about `key` at the byte `at`.
    fn error(&self, at: usize, key: &str, problem: impl Into<String>) -> FileError {
        let in_table =
            |place: &mut Option<Box<FileLocation>>| place.iter_mut().for_each(|place| place.table = self.start);
        FileError::at(self.source, at, self.dotted(key), problem).placed(in_table)
    }

    /// False if the key was removed because its value was wrong. Any value will do then, and no mistake must follow
    /// from it.
    pub fn knows(&self, key: &str) -> bool {
        let dotted = self.dotted(key);
        !self.overlooked.keys.iter().any(|(key, table)| *table == self.start && *key == dotted)
    }

    /// Returns the error that `key` is missing, or that a similar unknown key is a misspelling.
    pub fn missing(&self, key: &'static str, cure: &str) -> FileError {
        let slip = nearest(key, self.unread().map(|(unread, _)| unread));
        match self.unread().find(|(unread, _)| Some(*unread) == slip) {
            Some((slip, start)) => self.unknown(slip, start, &self.did_you_mean(key), Some(key)),
            None => self.error(self.start, key, format!("missing; {cure}")).because(MistakeKind::Missing),
        }
    }

    /// Returns the unit of `key` in words, like [`words::unit`].
    fn unit(&self, key: &str) -> String {
        let symbol = self.units.iter().find(|(declared, _)| *declared == key).map_or("", |(_, symbol)| symbol);
        words::unit(key, symbol)
    }

    /// Returns the suggestion of `key` in place of a misspelt key.
    fn did_you_mean(&self, key: &str) -> String {
        format!("did you mean {key}{}?", self.unit(key))
    }

    /// Returns the keys that were not read, with their positions.
    fn unread(&self) -> impl Iterator<Item = (&str, usize)> {
        let keys = self.entries.iter().map(|(key, _)| (key.get_ref().as_ref(), key.span().start));
        keys.filter(|(key, _)| !self.read.contains(key))
    }

    fn unknown(&self, key: &str, start: usize, cure: &str, instead: Option<&'static str>) -> FileError {
        self.error(start, key, format!("unknown key; {cure}")).because(MistakeKind::Unknown(instead))
    }

    fn value(&mut self, key: &'static str) -> Option<&'a Spanned<DeValue<'a>>> {
        self.read.push(key);
        self.entries.get(key)
    }

    fn number_in(&self, value: &Spanned<DeValue<'a>>, key: &str, range: &Range) -> Result<f64, FileError> {
        let Range { min, max, .. } = *range;
        let number = match value.get_ref() {
            DeValue::Float(float) => float.as_str().parse::<f64>().ok(),
            DeValue::Integer(integer) if integer.radix() == 10 => integer.as_str().parse().ok(),
            DeValue::Integer(integer) => u64::from_str_radix(integer.as_str(), integer.radix()).ok().map(|i| i as f64),
            _ => None,
        };
        let unit = self.unit(key);
        let bounds = format!("it must lie within {} to {}{unit}", words::number(min), words::number(max));
        match number {
            None => Err(self.wrong_type(value, key, &format!("a number{unit}"), "digits without quotes")),
            Some(number) if !number.is_finite() => {
                Err(self.refuse(value, key, format!("{number} is not a finite number: {bounds}")))
            }
            Some(number) if range.check(number).is_err() => {
                Err(self.refuse(value, key, format!("{} is out of range: {bounds}", words::number(number))))
            }
            Some(number) => Ok(number),
        }
    }

    fn text_in(&self, value: &'a Spanned<DeValue<'a>>, key: &str) -> Result<&'a str, FileError> {
        value.get_ref().as_str().ok_or_else(|| self.wrong_type(value, key, "a string", "quotes around it"))
    }

    fn choice_in<T: Copy>(
        &self,
        value: &'a Spanned<DeValue<'a>>,
        key: &str,
        options: &[T],
        name: fn(T) -> &'static str,
    ) -> Result<T, FileError> {
        let names = || options.iter().copied().map(name);
        let text = self.text_in(value, key).map_err(|error| error.because(MistakeKind::Choice(names().collect())))?;
        options.iter().copied().find(|&option| name(option) == text).ok_or_else(|| {
            let slip = nearest(text, names()).and_then(|slip| names().find(|name| *name == slip));
            let likely = slip.map_or_else(|| names().collect(), |slip| vec![slip]);
            let slip = slip.map_or(String::new(), |known| format!("did you mean \"{known}\"? "));
            let (must, options) = (if slip.is_empty() { "it" } else { "It" }, one_of(options, name));
            let problem = format!("\"{text}\" is unknown; {slip}{must} must be {options}");
            self.refuse(value, key, problem).because(MistakeKind::Choice(likely))
        })
    }

    fn table_in(&self, value: &'a Spanned<DeValue<'a>>, key: &str, cure: &str) -> Result<Table<'a>, FileError> {
        let entries = value.get_ref().as_table().ok_or_else(|| self.wrong_type(value, key, "a table", cure))?;
        let (path, start) = (self.dotted(key), value.span().start);
        let Table { source, overlooked, .. } = *self;
        Ok(Table { source, path, start, entries, read: Vec::new(), units: Vec::new(), overlooked })
    }

    fn wrong_type(&self, value: &Spanned<DeValue<'_>>, key: &str, wanted: &str, cure: &str) -> FileError {
        let found = match value.get_ref() {
            DeValue::String(_) => "a string",
            DeValue::Integer(_) | DeValue::Float(_) => "a number",
            DeValue::Boolean(_) => "true or false",
            DeValue::Datetime(_) => "a date or time",
            DeValue::Array(_) => "a list",
            DeValue::Table(_) => "a table",
        };
        self.refuse(value, key, format!("the value is {found} and must be {wanted}; write {cure}"))
    }

    fn refuse(&self, value: &Spanned<DeValue<'_>>, key: &str, problem: String) -> FileError {
        self.error(value.span().start, key, problem)
    }

    fn dotted(&self, key: &str) -> String {
        if self.path.is_empty() { key.into() } else { format!("{}.{key}", self.path) }
    }
}

/// Returns the number within the range that is nearest to 1.
fn any(range: &Range) -> f64 {
    1.0_f64.clamp(range.min, range.max)
}

/// True if a float is written as a whole number; infinities and NaN are handled elsewhere.
fn is_whole(float: &str) -> bool {
    let number = float.parse().unwrap_or(f64::NAN);
    let is_round = float.contains(['e', 'E'])
        || float.split_once('.').is_none_or(|(_, after)| after.trim_end_matches('0').is_empty());
    !number.is_finite() || (number.fract() == 0.0 && is_round)
}
