//! All commands except `paper`.

use super::terminal::CommandError;
use super::{
    again, bring_up, campaign, compare, fly, hitl, mcap, params, pil, plot, replay, results, scenarios, serve, shell,
    suite, tune, vehicle,
};
use clap::{Command, Subcommand};
use std::process::ExitCode;

#[derive(Debug, Subcommand)]
pub(super) enum ExtraCommand {
    Fly(fly::FlyArgs),
    Campaign(campaign::CampaignArgs),
    Merge(campaign::MergeArgs),
    Compare(compare::CompareArgs),
    Again(again::AgainArgs),
    Tune(tune::TuneArgs),
    Check(scenarios::CheckArgs),
    Scenarios(scenarios::ScenariosArgs),
    Campaigns(campaign::CampaignsArgs),
    Suites(suite::SuitesArgs),
    Vehicles(vehicle::VehiclesArgs),
    Params(params::ParamsArgs),
    Plot(plot::PlotArgs),
    Results(results::ResultsArgs),
    Replay(replay::ReplayArgs),
    Mcap(mcap::McapArgs),
    Serve(serve::ServeArgs),
    Pil(pil::PilArgs),
    Hitl(hitl::HitlArgs),
    BringUp(bring_up::BringUpArgs),
    Completions(shell::CompletionsArgs),
    Man(shell::ManArgs),
}

impl ExtraCommand {
    /// Runs the command; `program` is the whole command line's definition.
    pub(super) fn run(self, program: Command) -> Result<ExitCode, CommandError> {
        match self {
            ExtraCommand::Fly(fly) => fly.run(),
            ExtraCommand::Campaign(campaign) => campaign.run(),
            ExtraCommand::Merge(merge) => merge.run(),
            ExtraCommand::Compare(compare) => compare.run(),
            ExtraCommand::Again(again) => again.run(program),
            ExtraCommand::Tune(tune) => tune.run(),
            ExtraCommand::Check(check) => check.run(),
            ExtraCommand::Scenarios(scenarios) => scenarios.run(),
            ExtraCommand::Campaigns(campaigns) => campaigns.run(),
            ExtraCommand::Suites(suites) => suites.run(),
            ExtraCommand::Vehicles(vehicles) => vehicles.run(),
            ExtraCommand::Params(params) => params.run(),
            ExtraCommand::Plot(plot) => plot.run(),
            ExtraCommand::Results(results) => results.run(),
            ExtraCommand::Replay(replay) => replay.run(),
            ExtraCommand::Mcap(mcap) => mcap.run(),
            ExtraCommand::Serve(serve) => serve.run(),
            ExtraCommand::Pil(pil) => pil.run(),
            ExtraCommand::Hitl(hitl) => hitl.run(),
            ExtraCommand::BringUp(bring_up) => bring_up.run(),
            ExtraCommand::Completions(completions) => completions.run(),
            ExtraCommand::Man(man) => man.run(program),
        }
    }
}
