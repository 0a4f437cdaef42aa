//! `sitl fly PLAN.plan`: flies a plan of QGroundControl.

use super::firmware_flight::{FirmwareLogs, LogOutputs};
use super::interrupt;
use super::mcap::FlightMcap;
use super::serve::unwritten;
use super::terminal::{CommandError, print, say};
use super::vehicle::VehicleArgs;
use afbc_serve::{QgcPlan, ServedVehicle, fleet, fly_plan};
use std::path::PathBuf;
use std::process::ExitCode;

/// Scenario with the place, weather and instruments of the flight.
const SCENARIO: &str = "outdoor";
/// Longest flight \[s\].
const LONGEST_S: f64 = 3600.0;

/// Flight of a plan.
pub(super) struct PlanFlight {
    pub(super) path: PathBuf,
    pub(super) on: VehicleArgs,
    pub(super) duration: Option<f64>,
    pub(super) exact_log: Option<PathBuf>,
    pub(super) ulog: Option<PathBuf>,
    pub(super) mcap: Option<PathBuf>,
}

impl PlanFlight {
    /// Flies mission, geofence and rally points of the plan; exits with 1 if the mission is not completed.
    pub(super) fn run(mut self) -> Result<ExitCode, CommandError> {
        let file = self.path.display().to_string();
        let text = std::fs::read_to_string(&self.path).map_err(|error| format!("{file}: {error}"))?;
        let plan = QgcPlan::read(&file, &text)?;
        let scenario = afbc_scenario::built_in(SCENARIO).ok_or("the scenario is missing")?.read()?;
        let scenario = self.on.put(scenario)?;
        // The vehicle starts on the ground.
        let stands = fleet(&scenario, 1)?.pop().ok_or("there is no vehicle")?;
        let mut vehicle = ServedVehicle::new(&stands, 1, None)?;
        if let Some((place, altitude_m)) = plan.home
            && !vehicle.move_origin(place, altitude_m.unwrap_or(0.0))
        {
            return Err(format!("{file}: plannedHomePosition: the home is at a pole; plan elsewhere").into());
        }
        let mcap = FlightMcap::plan(self.mcap, &mut self.ulog)?;
        interrupt::ends_it()?;
        let FirmwareLogs { exact, ulog } =
            FirmwareLogs::create(&LogOutputs::new(self.exact_log.as_deref(), self.ulog.as_deref())?)?;
        exact.iter().for_each(|(_, file)| vehicle.record(file.clone()));
        ulog.into_iter().for_each(|(_, files)| vehicle.log(files));
        let end = fly_plan(&mut vehicle, &plan, self.duration.unwrap_or(LONGEST_S), &mut |line| say(line));
        interrupt::is_too_late();
        // If a log fails, all other results are still written; the error is reported at the end.
        let logged = vehicle.end_log();
        let recorded = exact.map(|(path, file)| file.finish().map_err(|error| unwritten(&path, &error)));
        let converted = mcap.map(FlightMcap::finish);
        let end = end.map_err(|problem| format!("{file}: {problem}"))?;
        let how = match (end.complete || end.reached.contains(&last(&plan)), end.disarmed) {
            (true, _) if end.fell => "not landed: the vehicle has fallen after its last item",
            (false, _) if end.fell => "not complete: the vehicle has fallen",
            (true, true) => "complete, on the ground",
            (true, false) => "complete, in hold",
            (false, true) => "not complete: the vehicle has landed",
            (false, false) if end.stopped => "not complete: the vehicle has stopped, in hold",
            (false, false) => "not complete in time; give more time by --duration",
        };
        let (items, reached) = (plan.mission.len(), end.reached.len());
        let fence = plan.fence.len();
        print(&format!(
            "{file}: {items} mission items ({reached} reached in {:.1} s), {fence} geofence items, {} rally points: \
             {how}\n",
            end.flight_s,
            plan.rally.len()
        ))?;
        logged?;
        recorded.transpose()?;
        converted.transpose()?;
        Ok(ExitCode::from(u8::from(how.starts_with("not"))))
    }
}

/// Returns the number of the last mission item.
fn last(plan: &QgcPlan) -> u16 {
    plan.mission.len().saturating_sub(1) as u16
}
