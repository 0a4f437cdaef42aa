//! Built-in vehicles.

use crate::file::parse;
use crate::vehicle::Vehicle;
use afbc_files::read::BuiltIn;

/// Every built-in vehicle.
pub static BUILT_IN: [BuiltIn<Vehicle>; 6] = [
    BuiltIn::new("paper", include_str!("../../../vehicles/paper.toml"), parse),
    BuiltIn::new("crazyflie", include_str!("../../../vehicles/crazyflie.toml"), parse),
    BuiltIn::new("hummingbird", include_str!("../../../vehicles/hummingbird.toml"), parse),
    BuiltIn::new("racer", include_str!("../../../vehicles/racer.toml"), parse),
    BuiltIn::new("iris", include_str!("../../../vehicles/iris.toml"), parse),
    BuiltIn::new("f550", include_str!("../../../vehicles/f550.toml"), parse),
];

/// Returns the built-in vehicle called `name`.
pub fn built_in(name: &str) -> Option<&'static BuiltIn<Vehicle>> {
    BuiltIn::named(&BUILT_IN, name)
}

/// Returns the error message for a `name` that is not a built-in vehicle.
pub fn unknown(name: &str) -> String {
    let cure = match BuiltIn::similar(&BUILT_IN, name) {
        Some(known) => format!("did you mean {}?", known.name),
        None => "`sitl vehicles` lists the built-in vehicles; for a file, write its path, as in ./my.toml".into(),
    };
    format!("\"{name}\" is no built-in vehicle; {cure}")
}
