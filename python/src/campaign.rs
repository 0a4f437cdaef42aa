//! The functions `campaign`, `merge` and `campaigns`.

use crate::argument::{self, CallArg, optional};
use crate::error::error;
use crate::vehicle::{self, VehicleArgument};
use crate::work::{WorkProgress, watched};
use afbc::Profile;
use afbc_campaign::{
    self as campaigns, BUILT_IN, Campaign, CampaignFolder, CampaignSummary, Manifest, ResultRow, Shard, subject,
};
use numpy::{PyArray1, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;
use std::path::PathBuf;

/// Flies a campaign, built in or from a file: one scenario, many times, with drawn vehicles, weather and faults.
/// Returns columns with a row for each flight of each contender.
///
/// With `out`, results and report are written into this folder, as by `sitl campaign`. Finished flights are kept, and
/// the same call resumes. `flights` flies only the first flights. `shard`, "I/N", flies every N-th flight from the I-th
/// on; `merge` joins the shards.
#[pyfunction]
#[pyo3(signature = (campaign, *, flights=None, vehicle=None, shard=None, out=None, threads=None, progress=None))]
#[expect(clippy::too_many_arguments, reason = "each by its name")]
pub(crate) fn campaign<'py>(
    py: Python<'py>,
    campaign: CallArg<'py, PathBuf>,
    flights: Option<CallArg<'py, u64>>,
    vehicle: Option<CallArg<'py, VehicleArgument<'py>>>,
    shard: Option<CallArg<'py, String>>,
    out: Option<CallArg<'py, PathBuf>>,
    threads: Option<CallArg<'py, u64>>,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let mut plan = subject::campaign(&campaign.named("campaign")?).map_err(error)?;
    if let Some(vehicle) = vehicle::given(vehicle.as_ref())? {
        plan.scenario = plan.scenario.on(&vehicle, Profile::Flight).map_err(error)?;
    }
    if let Some(flights) = flights {
        plan.flights = flights.within("flights", 1..=plan.flights)?;
    }
    plan.check().map_err(error)?;
    let threads = argument::threads(threads.as_ref())?;
    let out = optional(out.as_ref(), "out")?;
    let shard = optional(shard.as_ref(), "shard")?.map_or(Ok(Shard::WHOLE), |shard| {
        let known: Result<Shard, _> = shard.parse();
        known.map_err(|problem| error(format!("shard {shard}: {problem}")))
    })?;
    if shard.of > plan.flights {
        return Err(error(format!("shard {shard}: the campaign has only {} flights; use fewer parts", plan.flights)));
    }
    let manifest = Manifest::new(&plan, shard);
    let rows = match out {
        Some(out) => {
            let folder = CampaignFolder::open(&out, manifest.clone(), false).map_err(error)?;
            watched(py, threads, progress.as_ref(), |watch| kept(&plan, &folder, watch))?
        }
        None => watched(py, threads, progress.as_ref(), |watch| {
            let fly = |flight| {
                if watch.is_over() {
                    return Err("interrupted".to_owned());
                }
                let rows = plan.rows(flight).map_err(|error| format!("flight {flight} cannot be flown: {error}"))?;
                watch.add(1);
                Ok(rows)
            };
            Ok((0..shard.count(plan.flights))
                .into_par_iter()
                .map(|index| fly(shard.flight(index)))
                .collect::<Result<Vec<_>, _>>()?
                .into_iter()
                .flatten()
                .collect())
        })?,
    };
    columns(py, &manifest, &rows.map_err(error)?)
}

/// Flies a campaign in a folder and returns all its rows.
fn kept(plan: &Campaign, folder: &CampaignFolder, watch: &WorkProgress) -> Result<Vec<ResultRow>, String> {
    // Counts the flights flown now; those of earlier runs are reported as one sum.
    let summary = campaigns::fly(plan, folder, watch.stop(), &|done| watch.add(done));
    let summary = summary.map_err(|error| error.to_string())?.ok_or("interrupted; repeat the same call to resume")?;
    concluded(folder, &summary)
}

/// Merges all shards of a campaign into the folder `out`, as `sitl merge` does, with the same bytes as on one machine.
/// Returns columns with a row for each flight of each contender.
#[pyfunction]
pub(crate) fn merge<'py>(
    py: Python<'py>,
    shards: CallArg<'py, Vec<PathBuf>>,
    out: CallArg<'py, PathBuf>,
) -> PyResult<Bound<'py, PyDict>> {
    let (shards, out) = (shards.named("shards")?, out.named("out")?);
    if shards.is_empty() {
        return Err(error("shards: the list is empty; name the folders of all shards"));
    }
    let merged = watched(py, None, None, |_| {
        let (folder, summary) = campaigns::merge(&shards, &out, false).map_err(|error| error.to_string())?;
        Ok((folder.manifest().clone(), concluded(&folder, &summary)?))
    })?;
    let (manifest, rows) = merged.map_err(|problem: String| error(problem))?;
    columns(py, &manifest, &rows)
}

/// Writes the report of a folder's flights and returns their rows.
fn concluded(folder: &CampaignFolder, summary: &CampaignSummary) -> Result<Vec<ResultRow>, String> {
    afbc_report::campaign::write(folder.output_folder(), summary).map_err(|error| error.to_string())?;
    let rows = folder.results().map_err(|error| error.to_string())?.ok_or("the results have been deleted")?;
    rows.collect::<Result<_, _>>().map_err(|error| error.to_string())
}

fn columns<'py>(py: Python<'py>, manifest: &Manifest, rows: &[ResultRow]) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("flight", rows.iter().map(|row| row.flight).collect::<Vec<_>>().to_pyarray(py))?;
    dict.set_item("seed", rows.iter().map(|row| row.seed).collect::<Vec<_>>().to_pyarray(py))?;
    dict.set_item("contender", rows.iter().map(|row| row.contender.as_str()).collect::<Vec<_>>())?;
    dict.set_item("trajectory", rows.iter().map(|row| row.trajectory.as_str()).collect::<Vec<_>>())?;
    dict.set_item("lost_reason", rows.iter().map(|row| row.lost_reason.as_deref()).collect::<Vec<_>>())?;
    dict.set_item("trip_reason", rows.iter().map(|row| row.trip_reason.as_deref()).collect::<Vec<_>>())?;
    for (i, column) in manifest.columns().into_iter().enumerate() {
        let value = |row: &ResultRow| row.numbers.get(i).copied().flatten().unwrap_or(f64::NAN);
        dict.set_item(column.name, PyArray1::from_iter(py, rows.iter().map(value)))?;
    }
    Ok(dict)
}

/// Returns the names of the built-in campaigns.
#[pyfunction]
#[pyo3(name = "campaigns")]
pub(crate) fn campaigns_() -> Vec<&'static str> {
    BUILT_IN.iter().map(|known| known.name).collect()
}
