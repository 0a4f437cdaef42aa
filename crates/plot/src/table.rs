//! Tables of numbers and words.

/// Points of a line, x and y; none of them is NaN.
pub type Points = Vec<(f64, f64)>;

/// Columns of the same length: a file of one table, or a topic of a log, with which its columns' names begin.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LogTable {
    /// Name of the topic; empty for a file of one table.
    pub topic: String,
    /// Numbers; NaN where there is none.
    pub numbers: Vec<(String, Vec<f64>)>,
    /// Words, such as the contender.
    pub words: Vec<(String, Vec<String>)>,
}

impl LogTable {
    /// Returns the name of a column, with that of its topic.
    pub(crate) fn full(&self, column: &str) -> String {
        if self.topic.is_empty() { column.into() } else { format!("{}.{column}", self.topic) }
    }

    /// Returns a column by that name.
    pub(crate) fn column(&self, full: &str) -> Option<&[f64]> {
        self.numbers.iter().find(|(name, _)| self.full(name) == full).map(|(_, values)| values.as_slice())
    }
}
