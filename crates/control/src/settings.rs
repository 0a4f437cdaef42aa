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
        /// Largest thrust, as a share of the weight, to which the mixer raises the thrust to make room for roll and
        /// pitch. By default only the rotors limit it.
        #[parameter(RAISE_MAX, "1", 0.1..=1e6)]
        pub raised_thrust_max: f32 = 1e6,
        /// Drag of the vehicle, which a law may compensate.
        #[group("")]
        pub drag: KnownDrag = KnownDrag::NONE,
    }
}
