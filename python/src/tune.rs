//! The function `tune`, which searches for gains.

use crate::argument::{self, CallArg, SEEDS, optional};
use crate::error::error;
use crate::scenario::ScenarioArgument;
use crate::vehicle::{self, VehicleArgument};
use crate::work::watched;
use afbc::Profile;
use afbc_scenario::contender::{Contender, ControllerKind};
use afbc_tune::{self as search, SearchOptions};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Searches for gains of a law by CMA-ES, as `sitl tune` does, for the paper's vehicle or another one. The flights are
/// the training flights, or the given scenarios.
///
/// Returns the costs `before` and `after`, the number of `evaluations`, the `gains` found by name, and their `text` for
/// a scenario or vehicle file.
#[pyfunction]
#[pyo3(
    signature = (
        law, scenarios=None, *, vehicle=None, budget=CallArg::Default(1000), seed=CallArg::Default(1),
        step=CallArg::Default(search::STEP), flying=false, threads=None, progress=None
    ),
    text_signature = "(law, scenarios=None, *, vehicle=None, budget=1000, seed=1, step=..., flying=False, \
                      threads=None, progress=None)"
)]
#[expect(clippy::too_many_arguments, reason = "each by its name")]
pub(crate) fn tune<'py>(
    py: Python<'py>,
    law: CallArg<'py, String>,
    scenarios: Option<CallArg<'py, Vec<ScenarioArgument<'py>>>>,
    vehicle: Option<CallArg<'py, VehicleArgument<'py>>>,
    budget: CallArg<'py, u64>,
    seed: CallArg<'py, u64>,
    step: CallArg<'py, f64>,
    flying: bool,
    threads: Option<CallArg<'py, u64>>,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let law = law.named("law")?;
    let kind = ControllerKind::named(&law)
        .ok_or_else(|| error(format!("{law}: no such controller; {}", ControllerKind::cure(&law))))?;
    let (budget, seed) = (budget.within("budget", 1..=1_000_000)? as usize, seed.within("seed", SEEDS)?);
    let step = step.named("step")?;
    if !(0.001..=1.0).contains(&step) {
        return Err(error(format!("step: {step} given; a number from 0.001 to 1 is needed")));
    }
    let threads = argument::threads(threads.as_ref())?;
    let scenarios = optional(scenarios.as_ref(), "scenarios")?;
    if scenarios.as_ref().is_some_and(Vec::is_empty) {
        return Err(error("scenarios: the list is empty; name a scenario, or leave it out for the training flights"));
    }
    let vehicle = vehicle::given(vehicle.as_ref())?;
    let start = match (&vehicle, flying) {
        (None, false) => search::by_hand(kind),
        (Some(vehicle), false) => search::by_hand_on(kind, vehicle),
        (None, true) => Contender::of(kind, Profile::Flight),
        (Some(vehicle), true) => Contender::of(kind, Profile::Flight).on(vehicle, Profile::Flight).map_err(error)?,
    };
    let (start, flights, conditions) = match (scenarios, &vehicle) {
        (Some(scenarios), _) => {
            let mut flights = scenarios.iter().map(ScenarioArgument::scenario).collect::<PyResult<Vec<_>>>()?;
            if let Some(vehicle) = &vehicle {
                let on = flights.into_iter().map(|flight| flight.on(vehicle, Profile::Flight));
                flights = on.collect::<Result<_, _>>().map_err(error)?;
            }
            (start, flights, Vec::new())
        }
        (None, Some(vehicle)) => {
            let flights = search::training_on(vehicle).map_err(error)?;
            (start.monitored(), flights, search::conditions_on(vehicle).map_err(error)?)
        }
        (None, None) => (start.monitored(), search::training().map_err(error)?, search::conditions().map_err(error)?),
    };
    let options = SearchOptions { budget, step, seed };
    let found = watched(py, threads, progress.as_ref(), |watch| {
        search::search(&start, &flights, &conditions, options, |tried, _| {
            watch.set(tried as u64);
            !watch.is_over()
        })
        .map_err(|error| error.to_string())
    })?;
    let found = found.map_err(error)?;
    let gains = PyDict::new(py);
    for (name, value) in crate::controller::gains(&found.contender) {
        gains.set_item(name, value)?;
    }
    let dict = PyDict::new(py);
    dict.set_item("before", found.before)?;
    dict.set_item("after", found.after)?;
    dict.set_item("evaluations", found.evaluations)?;
    dict.set_item("gains", gains)?;
    dict.set_item("text", search::found_text(&found.contender, &flights))?;
    Ok(dict)
}
