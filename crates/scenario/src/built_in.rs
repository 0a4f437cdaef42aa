//! The scenarios that come with the program.

use super::definition::Scenario;
use super::file::parse;
use afbc_files::read::BuiltIn;

/// Every built-in scenario.
pub static BUILT_IN: [BuiltIn<Scenario>; 12] = [
    BuiltIn::new("paper", include_str!("../scenarios/paper.toml"), parse),
    BuiltIn::new("hover", include_str!("../scenarios/hover.toml"), parse),
    BuiltIn::new("step", include_str!("../scenarios/step.toml"), parse),
    BuiltIn::new("circle", include_str!("../scenarios/circle.toml"), parse),
    BuiltIn::new("lissajous", include_str!("../scenarios/lissajous.toml"), parse),
    BuiltIn::new("waypoints", include_str!("../scenarios/waypoints.toml"), parse),
    BuiltIn::new("wind", include_str!("../scenarios/wind.toml"), parse),
    BuiltIn::new("delivery", include_str!("../scenarios/delivery.toml"), parse),
    BuiltIn::new("hardware", include_str!("../scenarios/hardware.toml"), parse),
    BuiltIn::new("storm", include_str!("../scenarios/storm.toml"), parse),
    BuiltIn::new("mocap", include_str!("../scenarios/mocap.toml"), parse),
    BuiltIn::new("outdoor", include_str!("../scenarios/outdoor.toml"), parse),
];

/// Returns the built-in scenario called `name`.
pub fn built_in(name: &str) -> Option<&'static BuiltIn<Scenario>> {
    BuiltIn::named(&BUILT_IN, name)
}

/// Returns the built-in scenario whose name is similar to `name`.
pub fn similar_built_in(name: &str) -> Option<&'static BuiltIn<Scenario>> {
    BuiltIn::similar(&BUILT_IN, name)
}
