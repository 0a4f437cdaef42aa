//! Simulator as WebAssembly: the vehicle of `sitl serve`, for the page in `crates/web/page`, and the flights of
//! `sitl fly`, with bit-identical results.

use afbc::Profile;
use afbc_scenario::{BUILT_IN, Scenario, built_in};
use afbc_serve::page::PageBackend;
use afbc_serve::{Server, ServerAction, TimeFlow, TimeRate, fleet};
use afbc_sim::LogRate;
use afbc_sim::columns::{ESTIMATE, MOTION};
use afbc_sim::flight::Sample;
use afbc_sim::run::FlightResult;
use serde_json::json;
use wasm_bindgen::prelude::*;

/// Name that selects the scenario's own vehicle.
const OWN: &str = "paper";

/// Served vehicle and its page.
#[wasm_bindgen]
pub struct Playground {
    server: Server,
    backend: PageBackend,
}

#[wasm_bindgen]
impl Playground {
    /// Puts a vehicle on the ground of a built-in scenario. An empty `vehicle`, or `paper`, selects the scenario's own.
    #[wasm_bindgen(constructor)]
    pub fn new(scenario: &str, vehicle: &str, seed: f64) -> Result<Playground, JsError> {
        let mut scenario = read(scenario)?;
        if !vehicle.is_empty() && vehicle != OWN {
            let known = afbc_vehicles::built_in(vehicle);
            let known = known.ok_or_else(|| JsError::new(&format!("{vehicle}: no such vehicle")))?;
            let file = known.read().map_err(|error| JsError::new(&error.to_string()))?;
            scenario = on(scenario, &file)?;
        }
        // JavaScript's numbers are doubles, which hold integers exactly up to 53 bits.
        scenario.seed = seed as u64;
        let scenarios = fleet(&scenario, 1).map_err(|error| JsError::new(&error.to_string()))?;
        let server = Server::new(&scenarios, 1).map_err(|error| JsError::new(&format!("{error:?}")))?;
        Ok(Playground { server, backend: PageBackend::new() })
    }

    /// Returns the data that the page needs once, since they do not change.
    pub fn hello(&self) -> String {
        self.backend.description(&self.server).unwrap_or_default()
    }

    /// Returns the values of the parameters.
    pub fn values(&self) -> String {
        self.backend.values(&self.server).unwrap_or_default()
    }

    /// Advances by this many milliseconds. Returns the action left to the caller by a scheduled command, if any.
    pub fn advance(&mut self, steps: u32) -> String {
        let mut left = ServerAction::Nothing;
        for _ in 0..steps {
            let (backend, mut said) = (&mut self.backend, Vec::new());
            let action =
                self.server.step(|vehicle, bytes| backend.sent(vehicle, bytes), |text| said.push(text.to_owned()));
            self.backend.update(&mut self.server);
            if action != ServerAction::Nothing {
                left = action;
            }
        }
        to_do(left)
    }

    /// Returns the current state for the page.
    pub fn frame(&mut self, speed: f64, paused: bool) -> String {
        let flow = TimeFlow { rate: TimeRate::Times(speed), paused };
        self.backend.frame(&self.server, flow).unwrap_or_default()
    }

    /// Runs a command of the page; returns its messages and the action left to the caller.
    pub fn command(&mut self, command: &str) -> String {
        let reply = self.backend.command(&mut self.server, command);
        json!({ "messages": reply.messages, "then": to_do(reply.action) }).to_string()
    }
}

/// Returns the names of the scenarios in which a vehicle can be served.
#[wasm_bindgen]
pub fn scenarios() -> Vec<String> {
    let served = |name: &str| read(name).ok().is_some_and(|scenario| fleet(&scenario, 1).is_ok());
    BUILT_IN.iter().map(|it| it.name).filter(|name| served(name)).map(str::to_owned).collect()
}

/// Returns the names of the vehicles.
#[wasm_bindgen]
pub fn vehicles() -> Vec<String> {
    afbc_vehicles::BUILT_IN.iter().map(|it| it.name.to_owned()).collect()
}

/// Log of a flight.
#[wasm_bindgen]
pub struct FlightLog {
    names: Vec<String>,
    rows: Vec<f64>,
}

#[wasm_bindgen]
impl FlightLog {
    /// Returns the names of the columns, as in the CSV that `sitl fly` writes.
    pub fn names(&self) -> Vec<String> {
        self.names.clone()
    }

    /// Returns the values, row after row.
    pub fn rows(&self) -> Vec<f64> {
        self.rows.clone()
    }
}

/// Flies a built-in scenario under a law, as `sitl fly SCENARIO --controller LAW` does.
#[wasm_bindgen]
pub fn fly(scenario: &str, law: &str) -> Result<FlightLog, JsError> {
    let mut scenario = read(scenario)?;
    scenario.choose(&[law.to_owned()]).map_err(|error| JsError::new(&error.to_string()))?;
    let contender = scenario.contenders.first().ok_or_else(|| JsError::new("nothing flies"))?;
    let every = LogRate::usual(scenario.duration_s).steps(&scenario, contender).map_err(|it| JsError::new(&it))?;
    let run = FlightResult::fly(&scenario, contender, every).map_err(|error| JsError::new(&format!("{error:?}")))?;
    let rotors = scenario.rotors.len();
    let mut names: Vec<String> = MOTION.iter().map(|(name, _)| (*name).to_owned()).collect();
    names.extend((1..=rotors).map(|rotor| format!("omega{rotor}_rad_s")));
    let estimates = scenario.instruments.imu.is_some();
    if estimates {
        names.extend(ESTIMATE.iter().map(|(name, _)| (*name).to_owned()));
    }
    let mut rows = Vec::with_capacity(names.len() * run.log.len());
    run.log.iter().for_each(|sample| row(sample, rotors, estimates, &mut rows));
    Ok(FlightLog { names, rows })
}

/// Appends a row.
fn row(sample: &Sample, rotors: usize, estimates: bool, rows: &mut Vec<f64>) {
    rows.extend(MOTION.iter().map(|(_, value)| value(sample)));
    rows.extend(sample.action.speeds.0.iter().take(rotors).map(|&speed| f64::from(speed)));
    if estimates {
        let estimated = sample.estimated.as_ref();
        rows.extend(ESTIMATE.iter().map(|(_, value)| estimated.map_or(f64::NAN, |it| f64::from(value(it)))));
    }
}

fn read(name: &str) -> Result<Scenario, JsError> {
    let known = built_in(name).ok_or_else(|| JsError::new(&format!("{name}: no such scenario")))?;
    known.read().map_err(|error| JsError::new(&error.to_string()))
}

fn on(scenario: Scenario, vehicle: &afbc_vehicles::Vehicle) -> Result<Scenario, JsError> {
    scenario.on(vehicle, Profile::Flight).map_err(|error| JsError::new(&error.to_string()))
}

/// Returns the caller's action as text, such as `speed 2`; empty if there is none.
fn to_do(action: ServerAction) -> String {
    match action {
        ServerAction::Nothing | ServerAction::Step(_) | ServerAction::Quit => String::new(),
        ServerAction::Speed(speed) => format!("speed {speed}"),
        ServerAction::Pause(true) => "pause".into(),
        ServerAction::Pause(false) => "resume".into(),
    }
}
