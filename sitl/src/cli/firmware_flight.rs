//! `sitl fly --exact-log` and `--ulog`: repeats the flight with the firmware's own code, which writes these logs.

use super::serve::unwritten;
use super::terminal::CommandError;
use afbc::Profile;
use afbc_files::OutputFile;
use afbc_hil::{Host, LogFile, MessagePeriods, Station, UlogFiles, place};
use afbc_onboard::Link;
use afbc_scenario::Scenario;
use afbc_scenario::contender::{ControllerKind, Law};
use afbc_sim::flight::Lost;
use afbc_vehicles::Vehicle;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Options named in this module's error messages.
const OPTIONS: &str = "--exact-log and --ulog";
/// Vehicle of a scenario that names no vehicle file.
const PAPER: &str = "paper";

/// Flight by the firmware's code, under one law.
pub(super) struct FirmwareFlight {
    scenario: Scenario,
    kind: ControllerKind,
    host: Host,
}

/// Prepares the flight of `scenario` under the law of its first contender, with the firmware's gains for the vehicle.
/// `duration_s` replaces the scenario's duration.
pub(super) fn firmware_flight(scenario: &Scenario, duration_s: Option<f64>) -> Result<FirmwareFlight, CommandError> {
    let kind = scenario.contenders.first().map_or(ControllerKind::Afbc, |contender| contender.kind());
    let contenders = vec![afbc_hil::firmware(scenario)?];
    let duration_s = duration_s.unwrap_or(scenario.duration_s);
    let scenario = Scenario { contenders, duration_s, ..scenario.clone() };
    afbc_hil::check(&scenario).map_err(|error| format!("{OPTIONS}: {}: {error}", scenario.name))?;
    let file = scenario.vehicle_file.as_ref();
    let host = match kind {
        ControllerKind::Afbc => Host::linked(file, Link::DEFAULT)?,
        kind => {
            let vehicle: Vehicle = match file {
                Some(vehicle) => vehicle.clone(),
                None => afbc_vehicles::built_in(PAPER).ok_or("the paper's vehicle is missing")?.read()?,
            };
            Host::under(&vehicle, Law::on(kind, &vehicle, Profile::Flight)?)?
        }
    };
    Ok(FirmwareFlight { scenario, kind, host })
}

impl FirmwareFlight {
    /// Flies and writes the logs; returns a line about each log.
    pub(super) fn fly(mut self, logs: FirmwareLogs) -> Result<Vec<String>, CommandError> {
        let FirmwareLogs { exact, ulog } = logs;
        if let Some((_, file)) = &exact {
            self.host.record(file.sink());
        }
        if let Some((_, files)) = &ulog {
            self.host.log(place(&self.scenario), files.sink());
        }
        let Self { scenario, kind, host } = &mut self;
        let flown =
            afbc_hil::fly(scenario, &mut Station::new(), host, MessagePeriods::LOCKSTEP, |_| ControlFlow::Continue(()));
        let mut lines = Vec::new();
        let mut logged = |path: &Path, what: &str, lost: &str| {
            lines.push(format!("{}: {what} of the firmware's code under {}{lost}", path.display(), kind.name()));
        };
        let lost = |lost: &Lost| format!("; lost at {:.3} s: {}", lost.time_s, lost.reason);
        let lost = flown.as_ref().ok().and_then(|end| end.lost.as_ref()).map_or(String::new(), lost);
        // Both logs are finished before an error is returned, so that one failure does not lose the other log.
        let exact = exact.map(|(path, file)| (file.finish().map_err(|error| unwritten(&path, &error)), path));
        let ulog = ulog.map(|(path, files)| (files.finish(), path));
        for (what, ended) in [("exact log", exact), ("ULog", ulog)] {
            if let Some((ended, path)) = ended {
                ended?;
                logged(&path, what, &lost);
            }
        }
        flown.map_err(|error| format!("{OPTIONS}: {}: {error}", scenario.name))?;
        Ok(lines)
    }
}

/// Paths of the logs.
pub(super) struct LogOutputs {
    exact: Option<OutputFile>,
    ulog: Option<PathBuf>,
}

/// Files of the logs.
pub(super) struct FirmwareLogs {
    pub(super) exact: Option<(PathBuf, LogFile)>,
    pub(super) ulog: Option<(PathBuf, UlogFiles)>,
}

impl LogOutputs {
    /// Checks that the requested files do not exist and can be created.
    pub(super) fn new(exact: Option<&Path>, ulog: Option<&Path>) -> Result<Self, CommandError> {
        if let Some(file) = ulog.filter(|path| !path.is_dir()) {
            OutputFile::new(file, "--ulog")?;
        }
        let exact = exact.map(|path| OutputFile::new(path, "--exact-log")).transpose()?;
        Ok(LogOutputs { exact, ulog: ulog.map(Path::to_path_buf) })
    }
}

impl FirmwareLogs {
    /// Creates the files.
    pub(super) fn create(outputs: &LogOutputs) -> Result<Self, CommandError> {
        let LogOutputs { exact, ulog } = outputs;
        let exact =
            exact.as_ref().map(|output| Ok::<_, CommandError>((output.path().into(), LogFile::create(output)?)));
        let ulog = ulog.as_ref().map(|path| UlogFiles::create(path).map(|files| (path.clone(), files)));
        Ok(FirmwareLogs { exact: exact.transpose()?, ulog: ulog.transpose()? })
    }
}
