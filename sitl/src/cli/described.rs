//! Descriptions of scenarios, campaigns, vehicles and searches for `--json`.

use afbc::Profile;
use afbc_campaign::Campaign;
use afbc_scenario::Scenario;
use afbc_scenario::contender::Contender;
use afbc_tune::{GainChange, SearchResult, fragment};
use afbc_vehicles::Vehicle;
use serde::Serialize;

/// Summary of a contender.
#[derive(Serialize)]
struct ContenderJson<'a> {
    name: &'a str,
    controller: &'static str,
    profile: Option<&'static str>,
}

fn who<'a>(contenders: &'a [Contender]) -> Vec<ContenderJson<'a>> {
    let who = |contender: &'a Contender| {
        let (controller, profile) = (contender.kind().name(), contender.profile().map(Profile::name));
        ContenderJson { name: &contender.name, controller, profile }
    };
    contenders.iter().map(who).collect()
}

/// Summary of a scenario.
#[derive(Serialize)]
struct ScenarioJson<'a> {
    kind: &'static str,
    name: &'a str,
    description: &'a str,
    duration_s: f64,
    plant: &'static str,
    seed: u64,
    contenders: Vec<ContenderJson<'a>>,
}

/// Returns the summary of a scenario.
pub(crate) fn scenario(scenario: &Scenario) -> impl Serialize + '_ {
    let Scenario { name, description, duration_s, model, seed, contenders, .. } = scenario;
    ScenarioJson {
        kind: "scenario",
        name,
        description,
        duration_s: *duration_s,
        plant: model.name(),
        seed: *seed,
        contenders: who(contenders),
    }
}

/// Summary of a vehicle.
#[derive(Serialize)]
struct VehicleJson<'a> {
    kind: &'static str,
    name: &'a str,
    description: &'a str,
    rotors: usize,
    mass_kg: f64,
}

/// Returns the summary of a vehicle.
pub(crate) fn vehicle(vehicle: &Vehicle) -> impl Serialize + '_ {
    let Vehicle { name, description, rotors, parameters, .. } = vehicle;
    VehicleJson { kind: "vehicle", name, description, rotors: rotors.len(), mass_kg: parameters.mass_kg }
}

/// Summary of a campaign.
#[derive(Serialize)]
struct CampaignJson<'a> {
    kind: &'static str,
    name: &'a str,
    description: &'a str,
    flights: u64,
    seed: u64,
    duration_s: f64,
    plant: &'static str,
    contenders: Vec<ContenderJson<'a>>,
    trajectories: Vec<&'a str>,
    drawn: Vec<DrawnJson>,
}

#[derive(Serialize)]
struct DrawnJson {
    name: &'static str,
    ends: [f64; 2],
}

/// Returns the summary of a campaign.
pub(crate) fn campaign(campaign: &Campaign) -> impl Serialize + '_ {
    let Campaign { name, description, flights, seed, scenario, trajectories, spreads, .. } = campaign;
    let drawn =
        spreads.iter().filter_map(|spread| Some(DrawnJson { name: spread.quantity()?.range.name, ends: spread.ends }));
    CampaignJson {
        kind: "campaign",
        name,
        description,
        flights: *flights,
        seed: *seed,
        duration_s: scenario.duration_s,
        plant: scenario.model.name(),
        contenders: who(&scenario.contenders),
        trajectories: trajectories.iter().map(|trajectory| trajectory.name.as_str()).collect(),
        drawn: drawn.collect(),
    }
}

/// Result of a search for gains.
#[derive(Serialize)]
struct TunedJson {
    controller: &'static str,
    seed: u64,
    tries: usize,
    cost_before: f64,
    cost_after: f64,
    gains: Vec<GainJson>,
    contender_toml: String,
}

#[derive(Serialize)]
struct GainJson {
    name: String,
    before: f32,
    after: f32,
}

/// Returns the result of a search with this seed; `name` is the contender's name.
pub(crate) fn tuned(found: &SearchResult, name: &str, seed: u64) -> impl Serialize {
    let SearchResult { contender, before, after, evaluations, changes } = found;
    let gain = |GainChange { name, from, to }: &GainChange| GainJson { name: name.clone(), before: *from, after: *to };
    TunedJson {
        controller: contender.kind().name(),
        seed,
        tries: *evaluations,
        cost_before: *before,
        cost_after: *after,
        gains: changes.iter().map(gain).collect(),
        contender_toml: fragment(&Contender { name: format!("{name}-tuned"), ..contender.clone() }),
    }
}
