//! `sitl fly --exact-log`: the same flight by the firmware's own code.

use super::serve::unwritten;
use super::terminal::Failure;
use afbc::Profile;
use afbc_hil::{ExactLogFile, Host, MessagePeriods, Station};
use afbc_onboard::Link;
use afbc_scenario::Scenario;
use afbc_scenario::contender::{ControllerKind, Law};
use afbc_vehicles::Vehicle;
use std::ops::ControlFlow;
use std::path::Path;

/// Vehicle of a scenario without a vehicle file.
const PAPER: &str = "paper";

/// A flight to be flown by the firmware's code, under one law.
pub(super) struct AboardFlight {
    scenario: Scenario,
    kind: ControllerKind,
    host: Host,
}

/// Returns the flight of `scenario` under the first of its contenders' laws, for so many seconds, with the gains that
/// the vehicle's firmware has.
pub(super) fn aboard(scenario: &Scenario, duration_s: Option<f64>) -> Result<AboardFlight, Failure> {
    let kind = scenario.contenders.first().map_or(ControllerKind::Afbc, |contender| contender.kind());
    let contenders = vec![afbc_hil::firmware(scenario)?];
    let duration_s = duration_s.unwrap_or(scenario.duration_s);
    let scenario = Scenario { contenders, duration_s, ..scenario.clone() };
    afbc_hil::check(&scenario).map_err(|error| format!("--exact-log: {}: {error}", scenario.name))?;
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
    Ok(AboardFlight { scenario, kind, host })
}

impl AboardFlight {
    /// Flies, and writes the log; returns a line on it.
    pub(super) fn fly(mut self, path: &Path) -> Result<String, Failure> {
        let file = ExactLogFile::create(path).map_err(|error| unwritten(path, &error))?;
        self.host.record(file.sink());
        let Self { scenario, kind, host } = &mut self;
        let flown =
            afbc_hil::fly(scenario, &mut Station::new(), host, MessagePeriods::LOCKSTEP, |_| ControlFlow::Continue(()));
        file.finish().map_err(|error| unwritten(path, &error))?;
        let end = flown.map_err(|error| format!("--exact-log: {}: {error}", scenario.name))?;
        let lost = end.lost.map_or(String::new(), |lost| format!("; lost at {:.3} s: {}", lost.time_s, lost.reason));
        Ok(format!("{}: exact log of the firmware's code under {}{lost}", path.display(), kind.name()))
    }
}
