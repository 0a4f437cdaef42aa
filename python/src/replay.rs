//! The function `replay`, which runs the estimator over recorded flights.

use crate::argument::CallArg;
use crate::error::error;
use crate::work::watched;
use afbc_replay::EstimatorStart;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;

/// Runs the estimator over a recorded flight, a ULog of PX4 or of this firmware. Returns its estimate beside the log's,
/// in the columns of `sitl replay`'s CSV file. NaN marks missing values.
#[pyfunction]
pub(crate) fn replay<'py>(py: Python<'py>, log: CallArg<'py, PathBuf>) -> PyResult<Bound<'py, PyDict>> {
    let log = log.named("log")?;
    let replayed = watched(py, None, None, |_| {
        let recording = afbc_replay::read(&log).map_err(|error| error.to_string())?;
        afbc_replay::fly(&recording, None).map_err(|error| error.to_string())
    })?;
    let replayed = replayed.map_err(error)?;
    if let EstimatorStart::Never(why) = replayed.start {
        let log = log.display();
        return Err(error(format!("{log}: the estimator never started ({why}); record a log that begins at rest")));
    }
    let dict = PyDict::new(py);
    for (name, values) in afbc_report::replay::columns(&replayed.rows) {
        dict.set_item(name, PyArray1::from_vec(py, values))?;
    }
    Ok(dict)
}
