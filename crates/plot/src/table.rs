//! Tables of numeric and word columns.

/// Points (x, y) of a line, none of them NaN.
pub type Points = Vec<(f64, f64)>;

/// Columns of equal length: one table of a file, or one topic of a log. A topic's name is the prefix of its columns'
/// names.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LogTable {
    /// Name of the topic; empty for a file with a single table.
    pub topic: String,
    /// Numeric columns; NaN marks a missing number.
    pub numbers: Vec<(String, Vec<f64>)>,
    /// Word columns, such as the contender.
    pub words: Vec<(String, Vec<String>)>,
}

impl LogTable {
    /// Returns a column's name with its topic as prefix.
    pub(crate) fn full(&self, column: &str) -> String {
        if self.topic.is_empty() { column.into() } else { format!("{}.{column}", self.topic) }
    }

    /// Returns the numeric column with this full name.
    pub(crate) fn column(&self, full: &str) -> Option<&[f64]> {
        self.numbers.iter().find(|(name, _)| self.full(name) == full).map(|(_, values)| values.as_slice())
    }
}
