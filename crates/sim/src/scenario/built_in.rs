//! Scenarios that come with the program: each file is a template too.

use super::definition::Scenario;
use super::file::parse;
use crate::reader::FileError;
use crate::reader::words::nearest;

/// A scenario file that comes with the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BuiltIn {
    /// What `sitl fly` knows it by.
    pub name: &'static str,
    /// The file.
    pub text: &'static str,
}

/// Every built-in scenario.
pub const BUILT_IN: [BuiltIn; 9] = [
    BuiltIn { name: "paper", text: include_str!("../../scenarios/paper.toml") },
    BuiltIn { name: "hover", text: include_str!("../../scenarios/hover.toml") },
    BuiltIn { name: "step", text: include_str!("../../scenarios/step.toml") },
    BuiltIn { name: "circle", text: include_str!("../../scenarios/circle.toml") },
    BuiltIn { name: "lissajous", text: include_str!("../../scenarios/lissajous.toml") },
    BuiltIn { name: "waypoints", text: include_str!("../../scenarios/waypoints.toml") },
    BuiltIn { name: "delivery", text: include_str!("../../scenarios/delivery.toml") },
    BuiltIn { name: "hardware", text: include_str!("../../scenarios/hardware.toml") },
    BuiltIn { name: "storm", text: include_str!("../../scenarios/storm.toml") },
];

/// The built-in scenario called `name`.
pub fn built_in(name: &str) -> Option<BuiltIn> {
    BUILT_IN.into_iter().find(|built_in| built_in.name == name)
}

/// The built-in scenario that somebody who wrote `name` may have meant.
pub fn similar_built_in(name: &str) -> Option<BuiltIn> {
    nearest(name, BUILT_IN.iter().map(|built_in| built_in.name)).and_then(built_in)
}

impl BuiltIn {
    /// The scenario that the file describes.
    ///
    /// # Errors
    /// None in fact: a test reads every one.
    pub fn scenario(&self) -> Result<Scenario, FileError> {
        parse(&format!("built-in {}", self.name), self.text, self.name)
    }
}
