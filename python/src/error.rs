//! The one exception: what the command line would say.

use pyo3::PyErr;
use pyo3::create_exception;
use pyo3::exceptions::PyValueError;
use std::fmt::Display;

create_exception!(
    afbc,
    AfbcError,
    PyValueError,
    "Bad input, in the one line that the command line would say: file, place, cure."
);

/// The exception that says `problem`.
pub(crate) fn error(problem: impl Display) -> PyErr {
    AfbcError::new_err(problem.to_string())
}
