//! The command line: one module for each command.

mod aboard;
mod again;
mod bring_up;
mod campaign;
mod compare;
mod exact;
mod fleet;
mod fly;
mod flying;
mod hitl;
mod in_the_loop;
mod interrupt;
mod json;
mod manifest;
mod mcap;
mod over_seeds;
mod page;
mod paper;
mod params;
mod pil;
mod place;
mod plan;
mod plot;
mod program;
mod progress;
mod random;
mod replay;
mod results;
mod rough;
mod scenarios;
mod serve;
mod shell;
mod suite;
mod target;
mod terminal;
mod tune;
mod vehicle;
mod written;

use clap::{Command as Program, CommandFactory, FromArgMatches, Parser, Subcommand};
use std::process::ExitCode;
use terminal::Failure;

/// Flies an adaptive fuzzy backstepping (AFBC) quadrotor controller and other controllers in simulation.
///
/// Without a command, `sitl` is `sitl paper`: it flies the experiment of Yacef, Bouhali and Hamerlain, prints the
/// results of both laws and writes logs, figures and a report.
#[derive(Debug, Parser)]
#[command(version, args_conflicts_with_subcommands = true, max_term_width = 110)]
#[command(
    after_help = "Exit codes: 0 success; 1 a vehicle was lost, or a replay differs; 2 wrong input, or nothing written; \
                  130 interrupted"
)]
pub(crate) struct Cli {
    #[command(subcommand)]
    command: Option<Command>,

    #[command(flatten, next_help_heading = "Options of `sitl paper`")]
    paper: paper::Paper,
}

#[derive(Debug, Subcommand)]
enum Command {
    Paper(paper::Paper),
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

impl Cli {
    /// Returns the whole command line.
    pub(crate) fn program() -> Program {
        program::prepared(Self::command())
    }

    /// Reads the command line; ends the program if it is wrong or asks for help.
    pub(crate) fn read() -> Self {
        let read = Self::program().try_get_matches().and_then(|matches| Self::from_arg_matches(&matches));
        read.unwrap_or_else(|error| program::advised(error).exit())
    }

    /// Runs the command.
    pub(crate) fn run(self) -> Result<ExitCode, Failure> {
        match self.command.unwrap_or(Command::Paper(self.paper)) {
            Command::Paper(paper) => paper.run(),
            Command::Fly(fly) => fly.run(),
            Command::Campaign(campaign) => campaign.run(),
            Command::Merge(merge) => merge.run(),
            Command::Compare(compare) => compare.run(),
            Command::Again(again) => again.run(Self::command()),
            Command::Tune(tune) => tune.run(),
            Command::Check(check) => check.run(),
            Command::Scenarios(scenarios) => scenarios.run(),
            Command::Campaigns(campaigns) => campaigns.run(),
            Command::Suites(suites) => suites.run(),
            Command::Vehicles(vehicles) => vehicles.run(),
            Command::Params(params) => params.run(),
            Command::Plot(plot) => plot.run(),
            Command::Results(results) => results.run(),
            Command::Replay(replay) => replay.run(),
            Command::Mcap(mcap) => mcap.run(),
            Command::Serve(serve) => serve.run(),
            Command::Pil(pil) => pil.run(),
            Command::Hitl(hitl) => hitl.run(),
            Command::BringUp(bring_up) => bring_up.run(),
            Command::Completions(completions) => completions.run(),
            Command::Man(man) => man.run(Self::command()),
        }
    }
}
