//! Command line, with one module per command.
#![cfg_attr(
    not(feature = "all"),
    allow(dead_code, reason = "some of what commands share is used by those left out only")
)]

mod comparison_output;
mod flight_args;
mod interrupt;
mod json;
mod manifest;
mod output_folder;
mod paper;
mod program;
mod progress;
mod terminal;

// Commands other than `sitl paper`.
#[cfg(feature = "all")]
mod again;
#[cfg(feature = "all")]
mod bring_up;
#[cfg(feature = "all")]
mod campaign;
#[cfg(feature = "all")]
mod commands;
#[cfg(feature = "all")]
mod compare;
#[cfg(feature = "all")]
mod completion;
#[cfg(feature = "all")]
mod described;
#[cfg(feature = "all")]
mod exact;
#[cfg(feature = "all")]
mod firmware_flight;
#[cfg(feature = "all")]
mod fleet;
#[cfg(feature = "all")]
mod fly;
#[cfg(feature = "all")]
mod hitl;
#[cfg(feature = "all")]
mod in_the_loop;
#[cfg(feature = "all")]
mod mcap;
#[cfg(feature = "all")]
mod over_seeds;
#[cfg(feature = "all")]
mod page;
#[cfg(feature = "all")]
mod params;
#[cfg(feature = "all")]
mod pil;
#[cfg(feature = "all")]
mod plan;
#[cfg(feature = "all")]
mod plot;
#[cfg(feature = "all")]
mod random;
#[cfg(feature = "all")]
mod replay;
#[cfg(feature = "all")]
mod results;
#[cfg(feature = "all")]
mod rough;
#[cfg(feature = "all")]
mod scenarios;
#[cfg(feature = "all")]
mod serve;
#[cfg(feature = "all")]
mod shell;
#[cfg(feature = "all")]
mod suite;
#[cfg(feature = "all")]
mod target;
#[cfg(feature = "all")]
mod tune;
#[cfg(feature = "all")]
mod vehicle;

use clap::{Command, CommandFactory, FromArgMatches, Parser, Subcommand};
use std::process::ExitCode;
use terminal::CommandError;

/// Flies an adaptive fuzzy backstepping (AFBC) quadrotor controller and other controllers in simulation.
///
/// Without a command, `sitl` runs `sitl paper`: it flies the experiment of Yacef, Bouhali and Hamerlain, prints the
/// results of both laws, and writes logs, figures and a report.
#[derive(Debug, Parser)]
#[command(version, args_conflicts_with_subcommands = true, max_term_width = 110)]
#[command(
    after_help = "Exit codes: 0 success; 1 a vehicle was lost, or a replay differs; 2 wrong input, or nothing written; \
                  130 interrupted"
)]
pub(crate) struct Cli {
    #[command(subcommand)]
    command: Option<CliCommand>,

    #[command(flatten, next_help_heading = "Options of `sitl paper`")]
    paper: paper::PaperArgs,
}

#[derive(Debug, Subcommand)]
enum CliCommand {
    Paper(paper::PaperArgs),
    #[cfg(feature = "all")]
    #[command(flatten)]
    Other(Box<commands::ExtraCommand>),
    #[cfg(not(feature = "all"))]
    #[command(external_subcommand)]
    Absent(Vec<String>),
}

impl Cli {
    /// Returns the definition of the whole command line.
    pub(crate) fn program() -> Command {
        program::prepared(Self::command())
    }

    /// Parses the command line; exits if it is wrong or asks for help.
    pub(crate) fn read() -> Self {
        let read = Self::program().try_get_matches().and_then(|matches| Self::from_arg_matches(&matches));
        read.unwrap_or_else(|error| program::advised(error).exit())
    }

    /// Runs the command.
    pub(crate) fn run(self) -> Result<ExitCode, CommandError> {
        match self.command.unwrap_or(CliCommand::Paper(self.paper)) {
            CliCommand::Paper(paper) => paper.run(),
            #[cfg(feature = "all")]
            CliCommand::Other(other) => other.run(Self::command()),
            #[cfg(not(feature = "all"))]
            CliCommand::Absent(words) => {
                let name = words.first().map_or("", String::as_str);
                Err(format!(
                    "{name}: this program was built for `paper` alone; `cargo run --release -- {name}` \
                             builds all commands"
                )
                .into())
            }
        }
    }
}
