//! The vehicle that this image flies, from the file that `VEHICLE=... cargo fw` names ([`build.rs`](../../build.rs)).
//!
//! The build selects the vehicle and checks its file.

use afbc_onboard::Configuration;
use afbc_types::{Choice, Parameters, Rotor, Rotors};
use nalgebra::Vector3;

/// Configuration ready to fly.
pub type Prepared = afbc_onboard::Prepared<ROTORS>;
/// The vehicle's flight software.
pub type Flight = afbc_onboard::Flight<ROTORS>;

include!(concat!(env!("OUT_DIR"), "/vehicle.rs"));

/// Configuration into which the generated code puts the vehicle's values; it replaces all of these parameters.
const PLAIN: Configuration = Configuration::plain(
    Parameters {
        mass_kg: 0.0,
        arm_m: 0.0,
        inertia_kg_m2: Vector3::new(0.0, 0.0, 0.0),
        rotor_inertia_kg_m2: 0.0,
        thrust_factor_n_s2: 0.0,
        drag_factor_n_m_s2: 0.0,
        gravity_m_s2: 0.0,
    },
    Rotors::new(&FRAME),
);

/// Returns the choice that vehicle files call `word`.
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
