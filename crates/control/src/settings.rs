//! Settings of every controller, in addition to vehicle parameters and gains.

use crate::drag::KnownDrag;
use afbc_types::parameters;

parameters! {
    /// Settings of every controller, in addition to vehicle parameters and gains.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
    #[cfg_attr(feature = "defmt", derive(defmt::Format))]
    pub struct Settings {
        /// Time between steps.
        #[parameter(DT, "s", 1e-4..=0.02)]
        pub dt_s: f32 = 0.001,
        /// Largest force of one rotor. The default is practically unlimited, as in the paper.
        #[parameter(FORCE_MAX, "N", 1e-3..=1e4)]
        pub rotor_force_max_n: f32 = 1e4,
        /// Share of the weight to which thrust is raised, at most, to make room for roll and pitch. The default is no
        /// limit but the rotors'.
        #[parameter(RAISE_MAX, "1", 0.1..=1e6)]
        pub raised_thrust_max: f32 = 1e6,
        /// Drag that a law may make up for.
        #[group("")]
        pub drag: KnownDrag = KnownDrag::NONE,
    }
}
