//! Shell completion of names: scenarios, campaigns, suites, vehicles and laws.

use afbc_campaign::suite::SUITES;
use afbc_campaign::{random, rough};
use afbc_files::read::BuiltIn;
use afbc_scenario::contender::{Contender, ControllerKind};
use clap::{Arg, Command};
use clap_complete::engine::{ArgValueCompleter, CompletionCandidate, PathCompleter, ValueCompleter};
use std::ffi::OsStr;

/// Adds name completion to the arguments of `command`.
pub(super) fn completed(command: Command) -> Command {
    let name = command.get_name().to_owned();
    command.mut_args(|arg| with_names(&name, arg))
}

/// Adds completion of the names that an argument of `command` accepts, and of files if it accepts those too.
fn with_names(command: &str, arg: Arg) -> Arg {
    let value = arg.get_value_names().and_then(|names| names.first()).map_or("", |name| name.as_str());
    let (names, is_file): (fn() -> Vec<String>, bool) = match (command, arg.get_id().as_str(), value) {
        ("scenarios", "name", _) => (scenarios, false),
        ("campaigns", "name", _) => (campaigns, false),
        ("suites", "name", _) => (suites, false),
        ("vehicles", "name", _) => (vehicles, false),
        (_, "controllers" | "against", _) => (contenders, false),
        ("tune", "contenders", _) => (laws, false),
        (_, _, "SCENARIO") => (scenarios, true),
        (_, _, "CAMPAIGN") => (campaigns, true),
        (_, _, "SUITE") => (suites, true),
        (_, _, "VEHICLE") => (vehicles, true),
        _ => return arg,
    };
    arg.add(ArgValueCompleter::new(move |current: &OsStr| {
        let begins = |name: &String| current.to_str().is_some_and(|current| name.starts_with(current));
        let files = if is_file { PathCompleter::any().complete(current) } else { Vec::new() };
        names().into_iter().filter(begins).map(CompletionCandidate::new).chain(files).collect()
    }))
}

fn built_in<T>(all: &[BuiltIn<T>]) -> Vec<String> {
    all.iter().map(|known| known.name.to_owned()).collect()
}

fn scenarios() -> Vec<String> {
    built_in(&afbc_scenario::BUILT_IN)
}

fn campaigns() -> Vec<String> {
    built_in(&afbc_campaign::BUILT_IN)
}

fn suites() -> Vec<String> {
    built_in(&SUITES).into_iter().chain([random::NAME, rough::NAME].map(str::to_owned)).collect()
}

fn vehicles() -> Vec<String> {
    built_in(&afbc_vehicles::BUILT_IN)
}

fn contenders() -> Vec<String> {
    Contender::all_standard().map(|contender| contender.name).collect()
}

fn laws() -> Vec<String> {
    ControllerKind::all().into_iter().map(|kind| kind.name().to_owned()).collect()
}
