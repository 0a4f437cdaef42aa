//! Built-in campaigns.

use crate::file::parse;
use crate::plan::Campaign;
use afbc_files::read::{BuiltIn, FileError};
use std::path::Path;

/// All built-in campaigns.
pub static BUILT_IN: [BuiltIn<Campaign>; 4] = [
    BuiltIn::new("robustness", include_str!("../campaigns/robustness.toml"), read),
    BuiltIn::new("ablation", include_str!("../campaigns/ablation.toml"), read),
    BuiltIn::new("estimation", include_str!("../campaigns/estimation.toml"), read),
    BuiltIn::new("faults", include_str!("../campaigns/faults.toml"), read),
];

/// Returns the built-in campaign called `name`.
pub fn built_in(name: &str) -> Option<&'static BuiltIn<Campaign>> {
    BuiltIn::named(&BUILT_IN, name)
}

/// Returns the built-in campaign whose name is similar to `name`.
pub fn similar_built_in(name: &str) -> Option<&'static BuiltIn<Campaign>> {
    BuiltIn::similar(&BUILT_IN, name)
}

/// Reads a built-in campaign, which refers to no other files.
fn read(file: &str, text: &str, name: &str) -> Result<Campaign, FileError> {
    parse(file, text, name, Path::new(""))
}
