//! `sitl paper`: the paper's experiment.

use super::flying::{Flying, report};
use super::json::Json;
use super::place::Place;
use super::terminal::Failure;
use afbc_plant::PlantModel;
use afbc_report::claims::claims;
use afbc_scenario::Scenario;
use afbc_scenario::case::{Case, Reading, Sign, Uncertainty};
use afbc_scenario::paper::scenario;
use afbc_sim::flown::ScenarioFlight;
use clap::{Args, ValueEnum};
use std::process::ExitCode;

/// Fly the paper's experiment under both laws and check its three claims
///
/// The paper does not define its gusts of "1.2 N" or the signs of its uncertain parameters; both can be chosen. Exits
/// with 0 even if the `forces` reading loses the vehicle, as is known; any other loss gives 1.
#[derive(Args, Debug)]
pub(crate) struct Paper {
    /// Reading of the gusts
    #[arg(long, value_enum, default_value = "persistent")]
    reading: GustReading,

    #[arg(long, value_enum, value_name = "SIGN", default_value = "+", hide_possible_values = true)]
    #[arg(help = "Sign of the inertia's error of 75 % from 20 s to 40 s: +, - or both")]
    inertia: Signs,

    #[arg(long, value_enum, value_name = "SIGN", default_value = "-", hide_possible_values = true)]
    #[arg(help = "Sign of the thrust factor's error of 40 % from 20 s to 40 s: +, - or both")]
    thrust: Signs,

    /// Fly with nominal parameters
    #[arg(long, conflicts_with_all = ["inertia", "thrust"])]
    no_uncertainty: bool,

    /// Equations of motion: the paper's (6), or the full rigid body (1)-(5)
    #[arg(long, value_enum, default_value = "simplified")]
    plant: Plants,

    #[command(flatten)]
    flying: Flying,

    #[command(flatten)]
    place: Place,

    #[command(flatten)]
    json: Json,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum GustReading {
    /// Accelerations that persist from their onset
    Persistent,
    /// Accelerations for one second each
    Pulses,
    /// Physical forces and moments that persist
    Forces,
    /// No gusts
    None,
    /// The first three in turn
    All,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Signs {
    #[value(name = "+")]
    Plus,
    #[value(name = "-")]
    Minus,
    Both,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Plants {
    Simplified,
    RigidBody,
    Both,
}

impl GustReading {
    fn readings(self) -> Vec<Option<Reading>> {
        match self {
            GustReading::Persistent => vec![Some(Reading::Persistent)],
            GustReading::Pulses => vec![Some(Reading::Pulses)],
            GustReading::Forces => vec![Some(Reading::Forces)],
            GustReading::None => vec![None],
            GustReading::All => Reading::ALL.map(Some).to_vec(),
        }
    }
}

impl Signs {
    fn include(self, sign: Sign) -> bool {
        match self {
            Signs::Plus => sign == Sign::Plus,
            Signs::Minus => sign == Sign::Minus,
            Signs::Both => true,
        }
    }
}

impl Plants {
    fn models(self) -> &'static [PlantModel] {
        match self {
            Plants::Simplified => &[PlantModel::Simplified],
            Plants::RigidBody => &[PlantModel::RigidBody],
            Plants::Both => &[PlantModel::Simplified, PlantModel::RigidBody],
        }
    }
}

impl Paper {
    /// Flies, writes the results and prints a table.
    pub(super) fn run(self) -> Result<ExitCode, Failure> {
        let (folder, flown) = self.flying.fly(self.scenarios()?, || self.place.open("paper"))?;
        report(&folder, &flown, &claims(&flown), self.json)?;
        Ok(ExitCode::from(u8::from(flown.iter().any(unexpectedly_lost))))
    }

    /// Returns the scenarios of all requested combinations.
    fn scenarios(&self) -> Result<Vec<Scenario>, Failure> {
        let wanted = |u: &Uncertainty| self.inertia.include(u.inertia) && self.thrust.include(u.thrust);
        let uncertainties = if self.no_uncertainty {
            vec![None]
        } else {
            Uncertainty::ALL.into_iter().filter(wanted).map(Some).collect()
        };
        let mut scenarios = Vec::new();
        for &model in self.plant.models() {
            for reading in self.reading.readings() {
                for &uncertainty in &uncertainties {
                    scenarios.push(scenario(model, Case { reading, uncertainty })?);
                }
            }
        }
        Ok(scenarios)
    }
}

/// True if the vehicle was lost in a reading other than `forces`.
fn unexpectedly_lost(flown: &ScenarioFlight) -> bool {
    let reading = flown.scenario.case.and_then(|case| case.reading);
    flown.run.lost.is_some() && reading != Some(Reading::Forces)
}
