//! Campaigns that come with the program: each file is a template too.

use crate::file::parse;
use crate::plan::Campaign;
use afbc_sim::reader::FileError;
use afbc_sim::reader::words::nearest;
use std::path::Path;

/// A campaign file that comes with the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BuiltIn {
    /// What `sitl campaign` knows it by.
    pub name: &'static str,
    /// The file.
    pub text: &'static str,
}

/// Every built-in campaign.
pub const BUILT_IN: [BuiltIn; 3] = [
    BuiltIn { name: "robustness", text: include_str!("../campaigns/robustness.toml") },
    BuiltIn { name: "ablation", text: include_str!("../campaigns/ablation.toml") },
    BuiltIn { name: "faults", text: include_str!("../campaigns/faults.toml") },
];

/// The built-in campaign called `name`.
pub fn built_in(name: &str) -> Option<BuiltIn> {
    BUILT_IN.into_iter().find(|built_in| built_in.name == name)
}

/// The built-in campaign that somebody who wrote `name` may have meant.
pub fn similar_built_in(name: &str) -> Option<BuiltIn> {
    nearest(name, BUILT_IN.iter().map(|built_in| built_in.name)).and_then(built_in)
}

impl BuiltIn {
    /// The campaign that the file describes.
    ///
    /// # Errors
    /// None in fact: a test reads every one.
    pub fn campaign(&self) -> Result<Campaign, FileError> {
        parse(&format!("built-in {}", self.name), self.text, self.name, Path::new(""))
    }
}
