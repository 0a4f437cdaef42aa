//! All commands except `paper`.

use super::terminal::Failure;
use super::{
    again, bring_up, campaign, compare, fly, hitl, mcap, params, pil, plot, replay, results, scenarios, serve, shell,
    suite, tune, vehicle,
};
use clap::{Command, Subcommand};
use std::process::ExitCode;

#[derive(Debug, Subcommand)]
pub(super) enum Other {
    Fly(fly::Fly),
    Campaign(campaign::Campaign),
    Merge(campaign::Merge),
    Compare(compare::Compare),
    Again(again::Again),
    Tune(tune::Tune),
    Check(scenarios::Check),
    Scenarios(scenarios::Scenarios),
    Campaigns(campaign::Campaigns),
    Suites(suite::Suites),
    Vehicles(vehicle::Vehicles),
    Params(params::Params),
    Plot(plot::Plot),
    Results(results::Results),
    Replay(replay::Replay),
    Mcap(mcap::Mcap),
    Serve(serve::Serve),
    Pil(pil::Pil),
    Hitl(hitl::Hitl),
    BringUp(bring_up::BringUp),
    Completions(shell::Completions),
    Man(shell::Man),
}

impl Other {
    /// Runs the command; `program` is the whole command line's definition.
    pub(super) fn run(self, program: Command) -> Result<ExitCode, Failure> {
        match self {
            Other::Fly(fly) => fly.run(),
            Other::Campaign(campaign) => campaign.run(),
            Other::Merge(merge) => merge.run(),
            Other::Compare(compare) => compare.run(),
            Other::Again(again) => again.run(program),
            Other::Tune(tune) => tune.run(),
            Other::Check(check) => check.run(),
            Other::Scenarios(scenarios) => scenarios.run(),
            Other::Campaigns(campaigns) => campaigns.run(),
            Other::Suites(suites) => suites.run(),
            Other::Vehicles(vehicles) => vehicles.run(),
            Other::Params(params) => params.run(),
            Other::Plot(plot) => plot.run(),
            Other::Results(results) => results.run(),
            Other::Replay(replay) => replay.run(),
            Other::Mcap(mcap) => mcap.run(),
            Other::Serve(serve) => serve.run(),
            Other::Pil(pil) => pil.run(),
            Other::Hitl(hitl) => hitl.run(),
            Other::BringUp(bring_up) => bring_up.run(),
            Other::Completions(completions) => completions.run(),
            Other::Man(man) => man.run(program),
        }
    }
}
