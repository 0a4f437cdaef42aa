//! The simulator for Python: `import afbc`.
//!
//! This crate only converts arguments and results. All that flies is in the crates that `sitl` uses, so that both give
//! the same bits. `python/afbc` has the parts that need no Rust: data frames, and types for editors.

mod argument;
mod batch;
mod campaign;
mod controller;
mod error;
mod estimator;
mod flight;
mod flight_core;
mod guidance;
mod instruments;
mod law;
mod motion;
mod plant;
mod replay;
mod scenario;
mod source;
mod tune;
mod vehicle;
mod work;

use pyo3::prelude::*;

#[pymodule]
fn _afbc(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("AfbcError", module.py().get_type::<error::AfbcError>())?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<motion::PyState>()?;
    module.add_class::<motion::PySetpoint>()?;
    module.add_class::<vehicle::PyVehicle>()?;
    module.add_class::<scenario::PyScenario>()?;
    module.add_class::<flight::PyFlight>()?;
    module.add_class::<controller::PyController>()?;
    module.add_class::<controller::PyAction>()?;
    module.add_class::<plant::PyPlant>()?;
    module.add_class::<batch::PyBatch>()?;
    module.add_class::<law::PyOwnVehicle>()?;
    module.add_class::<estimator::PyEstimator>()?;
    module.add_class::<instruments::PyInstruments>()?;
    module.add_class::<flight_core::PyFlightCore>()?;
    module.add_class::<guidance::PyGuidance>()?;
    for function in [
        wrap_pyfunction!(flight::fly, module)?,
        wrap_pyfunction!(flight::compare, module)?,
        wrap_pyfunction!(campaign::campaign, module)?,
        wrap_pyfunction!(campaign::merge, module)?,
        wrap_pyfunction!(tune::tune, module)?,
        wrap_pyfunction!(replay::replay, module)?,
        wrap_pyfunction!(law::register, module)?,
        wrap_pyfunction!(law::laws, module)?,
        wrap_pyfunction!(vehicle::vehicles, module)?,
        wrap_pyfunction!(scenario::scenarios, module)?,
        wrap_pyfunction!(campaign::campaigns_, module)?,
    ] {
        module.add_function(function)?;
    }
    // Only `pickle` calls these functions.
    module.setattr("_flight", wrap_pyfunction!(flight::_flight, module)?)?;
    module.setattr("_scenario", wrap_pyfunction!(scenario::_scenario, module)?)?;
    module.setattr("_vehicle", wrap_pyfunction!(vehicle::_vehicle, module)?)
}
