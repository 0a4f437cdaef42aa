//! The one exception: what the command line would say.

use pyo3::PyErr;
use pyo3::create_exception;
use pyo3::exceptions::PyValueError;
use std::fmt::Display;

create_exception!(
    afbc,
    AfbcError,
    PyValueError,
    "Bad input, in the words of the command line: file, place, cure; a line for each mistake of a file."
);

/// Returns the exception that says `problem`, in one line whatever names in it hold; mistakes of a file in one each.
pub(crate) fn error(problem: impl Display) -> PyErr {
    let text = problem.to_string();
    // Mistakes of a file have a line each; any other line break is part of a name.
    let keeps = text.lines().all(is_mistake);
    let escaped = |letter: char| match letter.is_control() && !(keeps && letter == '\n') {
        true => letter.escape_default().to_string(),
        false => letter.to_string(),
    };
    AfbcError::new_err(text.chars().map(escaped).collect::<String>())
}

/// True of a line that begins with the name of a file and a number of a line.
fn is_mistake(line: &str) -> bool {
    line.split_once(':').is_some_and(|(_, rest)| rest.starts_with(|c: char| c.is_ascii_digit()))
}
