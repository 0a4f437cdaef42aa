//! The vehicle that this image flies, from its file: `VEHICLE=... cargo fw` ([`build.rs`](../../build.rs)).
//!
//! Which one it is, is decided when the image is built, and everything about it is checked there.

use afbc_types::{Airframe, Choice, Parameters, Rotor};
use nalgebra::Vector3;

/// What the firmware is told of it.
pub type Configuration = afbc_onboard::Configuration<ROTORS>;
/// Its parameters, from which the configuration is made.
pub type ParameterTable = afbc_onboard::parameters::ParameterTable<ROTORS>;
/// A configuration ready to be flown.
pub type Prepared = afbc_onboard::Prepared<ROTORS>;
/// The vehicle under its law.
pub type Flight = afbc_onboard::Flight<ROTORS>;
/// What one of its ticks decided.
pub type Report = afbc_onboard::Report<ROTORS>;

include!(concat!(env!("OUT_DIR"), "/vehicle.rs"));

/// Where the vehicle's values are put. Each of these is replaced.
const PLAIN: Configuration = Configuration::plain(Airframe {
    parameters: Parameters {
        mass_kg: 0.0,
        arm_m: 0.0,
        inertia_kg_m2: Vector3::new(0.0, 0.0, 0.0),
        rotor_inertia_kg_m2: 0.0,
        thrust_factor_n_s2: 0.0,
        drag_factor_n_m_s2: 0.0,
        gravity_m_s2: 0.0,
    },
    rotors: [Rotor { x: 0.0, y: 0.0, pushes_left: false }; ROTORS],
});

/// Returns the choice that files call `word`.
#[expect(clippy::indexing_slicing, reason = "evaluated by the compiler, which refuses an unknown word")]
const fn choice<C: Choice>(word: &str) -> C {
    let mut index = 0;
    while !same(C::WORDS[index].as_bytes(), word.as_bytes()) {
        index += 1;
    }
    C::ALL[index]
}

#[expect(clippy::indexing_slicing, reason = "within both lengths")]
const fn same(one: &[u8], other: &[u8]) -> bool {
    let mut at = 0;
    while at < one.len() && at < other.len() && one[at] == other[at] {
        at += 1;
    }
    at == one.len() && at == other.len()
}
