//! Golden tables shared by the workspace's tests.
//!
//! `golden/*.csv` come from an independent simulation of the paper in `f64`. Headers include the unit where it is not
//! plain SI. Rules are ordered with the first input outermost.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::indexing_slicing,
    reason = "a broken table must stop the test"
)]

use std::path::Path;

/// Rows in every file of single-equation data, so that a truncated file makes tests fail.
pub const ROWS: usize = 200;

/// A table of `golden/`, by column name.
#[derive(Clone, Debug)]
pub struct Table {
    name: String,
    columns: Vec<String>,
    rows: Vec<Vec<String>>,
}

/// One row of a [`Table`].
#[derive(Clone, Copy, Debug)]
pub struct Row<'a> {
    table: &'a Table,
    index: usize,
}

/// Reads the table `golden/{name}.csv`.
///
/// # Panics
/// If there is no such file, or a row has another length than the header.
pub fn golden(name: &str) -> Table {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden").join(format!("{name}.csv"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
    let columns = lines.next().expect("a header");
    let rows: Vec<_> = lines.collect();
    for (number, row) in rows.iter().enumerate() {
        assert_eq!(row.len(), columns.len(), "{name}.csv, row {number}");
    }
    Table { name: name.to_owned(), columns, rows }
}

impl Table {
    /// Returns every row, in order.
    pub fn rows(&self) -> impl ExactSizeIterator<Item = Row<'_>> {
        (0..self.rows.len()).map(|index| Row { table: self, index })
    }
}

impl Row<'_> {
    /// Returns the text in a column.
    ///
    /// # Panics
    /// If there is no such column.
    pub fn text(&self, column: &str) -> &str {
        let Table { name, columns, rows } = self.table;
        let at = columns.iter().position(|c| c == column).unwrap_or_else(|| panic!("{name}.csv: no column {column}"));
        &rows[self.index][at]
    }

    /// Returns the number in a column.
    ///
    /// # Panics
    /// If there is no such column, or it holds no number.
    pub fn get(&self, column: &str) -> f64 {
        let text = self.text(column);
        text.parse().unwrap_or_else(|_| panic!("{}.csv, row {}: {column} = {text}", self.table.name, self.index))
    }

    /// Returns the numbers in several columns.
    ///
    /// # Panics
    /// As [`Row::get`].
    pub fn all<const N: usize>(&self, columns: [&str; N]) -> [f64; N] {
        columns.map(|column| self.get(column))
    }

    /// Returns the numbers in `{prefix}1` to `{prefix}9`.
    ///
    /// # Panics
    /// As [`Row::get`].
    pub fn nine(&self, prefix: &str) -> [f64; 9] {
        core::array::from_fn(|i| self.get(&format!("{prefix}{}", i + 1)))
    }

    /// Returns file and row number, for messages.
    pub fn place(&self) -> String {
        format!("{}.csv, row {}", self.table.name, self.index)
    }
}

/// The README, whose code is compiled as a documentation test.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
pub struct Readme;
