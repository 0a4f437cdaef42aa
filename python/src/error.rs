//! The exception `AfbcError`, which repeats the command line's error messages.

use pyo3::PyErr;
use pyo3::create_exception;
use pyo3::exceptions::PyValueError;
use std::fmt::Display;

create_exception!(
    afbc,
    AfbcError,
    PyValueError,
    "Bad input, described as on the command line: file, place and cure, with a line for each mistake of a file."
);

/// Returns the exception for `problem`. The mistakes of a file have a line each; other problems have one line, whatever
/// the names in them contain.
pub(crate) fn error(problem: impl Display) -> PyErr {
    let text = problem.to_string();
    // If each line is a mistake of a file, line breaks stay. Otherwise a line break is part of a name and is escaped.
    let keeps = text.lines().all(is_mistake);
    let escaped = |letter: char| match letter.is_control() && !(keeps && letter == '\n') {
        true => letter.escape_default().to_string(),
        false => letter.to_string(),
    };
    AfbcError::new_err(text.chars().map(escaped).collect::<String>())
}

/// Returns true if the line begins with a file name and a line number.
fn is_mistake(line: &str) -> bool {
    line.split_once(':').is_some_and(|(_, rest)| rest.starts_with(|c: char| c.is_ascii_digit()))
}
