//! Replays an exact log: runs the firmware's own code on every tick's logged inputs and compares its outputs with the
//! logged ones. It can also show the outputs under changed settings.

mod change;
mod compare;
mod frames;
mod outcome;
mod player;
mod quantities;
mod run;

pub use change::SettingChange;
pub use compare::{ChangeComparison, ChangeRow, QuantityFigure};
pub use outcome::{ExactReplay, FirstDifference, GivenSignal, LoggedParameter, ReplayFinding};
pub use quantities::{QUANTITIES, ReplayQuantity};

use crate::ulog;
use afbc_files::read::FileError;
use afbc_vehicles::{Vehicle, built_in};
use frames::StartSearch;
use std::fs;
use std::path::Path;

/// Replays the log at `path`. `progress` is called with the number of bytes done since its last call. Without
/// `vehicle`, the built-in vehicle that the log names is used. With `changes`, the flight is also run under these
/// changes.
///
/// # Errors
/// One line, if the log cannot be read, is no exact log, is of another version or of another vehicle, or if a change is
/// refused.
pub fn replay(
    path: &Path,
    vehicle: Option<&Vehicle>,
    changes: &[SettingChange],
    mut progress: impl FnMut(u64),
) -> Result<ExactReplay, FileError> {
    let shown = path.display().to_string();
    let failed = |problem: String| FileError::whole(&shown, problem);
    let mut bytes = fs::read(path)
        .map_err(|error| failed(format!("the log cannot be read ({error}); give the path of an exact log")))?;
    if ulog::is_ulog(&bytes) {
        return Err(failed("this is a PX4 ULog; replay it without --exact".into()));
    }
    let start = match frames::look(&bytes) {
        StartSearch::Start(start) => start,
        StartSearch::Refused(problem) => return Err(failed(problem)),
    };
    let known = match vehicle {
        Some(_) => None,
        None => Some(named(&start.vehicle).map_err(failed)??),
    };
    let Some(vehicle) = vehicle.or(known.as_ref()) else {
        return Err(failed("the log names no vehicle; give the vehicle's file by --vehicle".into()));
    };
    let players = player::TickPlayers::of(vehicle, &start, changes).map_err(|problem| problem.of(&shown))?;
    run::run(&mut bytes, start, players, &mut progress).map_err(failed)
}

/// Reads the built-in vehicle with this name.
fn named(name: &str) -> Result<Result<Vehicle, FileError>, String> {
    let known = built_in(name).ok_or_else(|| {
        format!(
            "the log is from the vehicle '{}', which is not built in; give the vehicle's file by --vehicle",
            name.escape_debug()
        )
    })?;
    Ok(known.read())
}

/// Returns true if the bytes begin like an exact log.
pub(crate) fn is_exact(bytes: &[u8]) -> bool {
    frames::begins(bytes)
}
