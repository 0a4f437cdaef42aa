//! `sitl paper`: the paper's experiment.

use super::flight_args::{FlightArgs, report};
use super::json::JsonArgs;
use super::output_folder::OutputFolderArgs;
use super::terminal::CommandError;
use afbc_plant::PlantModel;
use afbc_report::claims::claims;
use afbc_scenario::Scenario;
use afbc_scenario::case::{Case, Reading, Sign, Uncertainty};
use afbc_scenario::paper::scenario;
use afbc_sim::flown::ScenarioFlight;
use clap::{Args, ValueEnum};
use std::process::ExitCode;

/// Fly the paper's experiment with both laws, and check the paper's three claims
///
/// The paper does not define its gusts of "1.2 N" or the signs of its uncertain parameters; choose both by options. The
/// reading `forces` is known to lose the vehicle and exits with 0; any other loss exits with 1.
#[derive(Args, Debug)]
pub(crate) struct PaperArgs {
    /// Interpretation of the paper's gusts
    #[arg(long, value_enum, default_value = "persistent")]
    reading: GustReadingArg,

    #[arg(long, value_enum, value_name = "SIGN", default_value = "+", hide_possible_values = true)]
    #[arg(help = "Sign of the 75 % error of the inertia from 20 s to 40 s: +, - or both")]
    inertia: SignsArg,

    #[arg(long, value_enum, value_name = "SIGN", default_value = "-", hide_possible_values = true)]
    #[arg(help = "Sign of the 40 % error of the thrust factor from 20 s to 40 s: +, - or both")]
    thrust: SignsArg,

    /// Fly with nominal parameters
    #[arg(long, conflicts_with_all = ["inertia", "thrust"])]
    no_uncertainty: bool,

    /// Equations of motion: the paper's (6), or the full rigid body (1)-(5)
    #[arg(long, value_enum, default_value = "simplified")]
    plant: PlantsArg,

    #[command(flatten)]
    flying: FlightArgs,

    #[command(flatten)]
    place: OutputFolderArgs,

    #[command(flatten)]
    json: JsonArgs,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum GustReadingArg {
    /// Accelerations that persist from their onset
    Persistent,
    /// Accelerations for one second each
    Pulses,
    /// Physical forces and moments that persist
    Forces,
    /// No gusts
    None,
    /// Persistent, pulses and forces, one after another
    All,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum SignsArg {
    #[value(name = "+")]
    Plus,
    #[value(name = "-")]
    Minus,
    Both,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum PlantsArg {
    Simplified,
    RigidBody,
    Both,
}

impl GustReadingArg {
    fn readings(self) -> Vec<Option<Reading>> {
        match self {
            GustReadingArg::Persistent => vec![Some(Reading::Persistent)],
            GustReadingArg::Pulses => vec![Some(Reading::Pulses)],
            GustReadingArg::Forces => vec![Some(Reading::Forces)],
            GustReadingArg::None => vec![None],
            GustReadingArg::All => Reading::ALL.map(Some).to_vec(),
        }
    }
}

impl SignsArg {
    fn include(self, sign: Sign) -> bool {
        match self {
            SignsArg::Plus => sign == Sign::Plus,
            SignsArg::Minus => sign == Sign::Minus,
            SignsArg::Both => true,
        }
    }
}

impl PlantsArg {
    fn models(self) -> &'static [PlantModel] {
        match self {
            PlantsArg::Simplified => &[PlantModel::Simplified],
            PlantsArg::RigidBody => &[PlantModel::RigidBody],
            PlantsArg::Both => &[PlantModel::Simplified, PlantModel::RigidBody],
        }
    }
}

impl PaperArgs {
    /// Flies, writes the results and prints a table.
    pub(super) fn run(self) -> Result<ExitCode, CommandError> {
        let (folder, flown) = self.flying.fly(self.scenarios()?, || self.place.open("paper"))?;
        report(&folder, &flown, &claims(&flown), self.json)?;
        Ok(ExitCode::from(u8::from(flown.iter().any(unexpectedly_lost))))
    }

    /// Returns the scenarios of all requested combinations.
    fn scenarios(&self) -> Result<Vec<Scenario>, CommandError> {
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
