//! Reads logs and finds their columns by name.

use crate::table::{LogTable, Points};
use afbc_files::read::FileError;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// All columns of a log.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LogColumns {
    file: String,
    tables: Vec<LogTable>,
}

/// Names of time columns, in order of preference.
const TIMES: [&str; 5] = ["time_s", "t_s", "t", "time", "timestamp"];
/// Name of the column that tells which contender a row belongs to.
const CONTENDER: &str = "contender";
/// Jaro-Winkler similarity from which a known name is suggested for an unknown one.
const SIMILAR: f64 = 0.6;

impl LogColumns {
    /// Reads the log at `path`. The first bytes tell Parquet, ULog and MCAP; anything else is read as CSV.
    ///
    /// # Errors
    /// A file that cannot be read or parsed gives one line that names the problem.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        let file = path.display().to_string();
        let fault = |problem: String| FileError::whole(&file, problem);
        let unread = |error: std::io::Error| fault(format!("the log cannot be read ({error}); give the path of a log"));
        let bytes = fs::read(path).map_err(unread)?;
        let tables = match bytes.as_slice() {
            [b'P', b'A', b'R', b'1', ..] => crate::parquet::read(bytes).map_err(fault)?,
            [0x89, b'M', b'C', b'A', b'P', ..] => {
                crate::mcap::check(&bytes).and_then(|()| crate::mcap::read(&bytes)).map_err(fault)?
            }
            [b'U', b'L', b'o', b'g', ..] => crate::mcap::read_ulog(path)?,
            _ => crate::csv::read(&bytes).map_err(fault)?,
        };
        Ok(LogColumns { file, tables })
    }

    /// Returns the names of all numeric columns.
    pub fn names(&self) -> Vec<String> {
        let of = |table: &LogTable| table.numbers.iter().map(|(name, _)| table.full(name)).collect::<Vec<_>>();
        self.tables.iter().flat_map(of).collect()
    }

    /// Returns the default x-axis for column `y`: the time column of its table.
    ///
    /// # Errors
    /// Fails with one line if there is no column `y`, or its table has no time column.
    pub fn usual_x(&self, y: &str) -> Result<String, FileError> {
        let (table, _) = self.find(y)?;
        let names = || table.numbers.iter().map(|(name, _)| name.as_str());
        let time = TIMES.into_iter().find(|time| names().any(|name| name == *time));
        let none =
            || FileError::whole(&self.file, format!("the log has no time column for {y}; name a column with --x"));
        time.map(|name| table.full(name)).ok_or_else(none)
    }

    /// Returns column `y` over column `x`, per contender if the table has contenders. Rows without both numbers are
    /// left out.
    ///
    /// # Errors
    /// Fails with one line if a column does not exist, or the two are in different tables.
    pub fn points(&self, x: &str, y: &str) -> Result<BTreeMap<Option<String>, Points>, FileError> {
        let (table, ys) = self.find(y)?;
        let xs = match table.column(x) {
            Some(xs) => xs,
            None => {
                self.find(x)?;
                let problem =
                    format!("{x}: its topic has other times than the topic of {y}; name a column of that topic");
                return Err(FileError::whole(&self.file, problem));
            }
        };
        let contenders = table.words.iter().find(|(name, _)| name == CONTENDER).map(|(_, words)| words.as_slice());
        let mut points: BTreeMap<Option<String>, Points> = BTreeMap::new();
        for (row, (x, y)) in xs.iter().zip(ys).enumerate() {
            if x.is_finite() && y.is_finite() {
                let contender = contenders.and_then(|all| all.get(row)).cloned();
                points.entry(contender).or_default().push((*x, *y));
            }
        }
        Ok(points)
    }

    fn find(&self, name: &str) -> Result<(&LogTable, &[f64]), FileError> {
        let found = self.tables.iter().find_map(|table| Some((table, table.column(name)?)));
        found.ok_or_else(|| {
            let names = self.names();
            let likeness = |known: &&String| strsim::jaro_winkler(known, name);
            let similar = names.iter().max_by(|a, b| likeness(a).total_cmp(&likeness(b)));
            let cure = match similar.filter(|known| likeness(known) > SIMILAR) {
                Some(known) => format!("did you mean {known}?"),
                None => format!("there are {}", names.iter().take(8).cloned().collect::<Vec<_>>().join(", ")),
            };
            FileError::whole(&self.file, format!("no column {name}; {cure}"))
        })
    }
}
