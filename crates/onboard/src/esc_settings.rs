//! Settings of the motor controllers' telemetry.

use afbc_types::parameters;

parameters! {
    /// Telemetry of the motor controllers, and what the vehicle makes of it. Names and numbers are PX4's. Not in the
    /// paper.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct EscSettings {
        /// The motor controllers are asked for their telemetry, by DSHOT, and answer over the board's line for it.
        #[switch(DSHOT_TEL_CFG)]
        pub serial: bool = false,
        /// The motor controllers answer each frame of DSHOT on their own line (bidirectional DSHOT), to boards that can
        /// hear them, from the next start on.
        #[switch(DSHOT_BIDIR_EN)]
        pub answers: bool = false,
        /// Magnetic poles of a motor, an even number: those of its bell, usually 14.
        #[parameter(MOT_POLE_COUNT, "number", 2.0..=400.0)]
        pub poles: u32 = 14,
        /// Rotors that do not turn as commanded are reported.
        #[switch(FD_ACT_EN)]
        pub detects: bool = true,
        /// What the vehicle does in flight when a rotor fails: 0 nothing but to say so, 1 hold, 2 land, 3 return.
        #[parameter(COM_ACT_FAIL_ACT, "number", 0.0..=3.0)]
        pub action: u32 = 0,
        /// The notch in the velocity follows the rotors; otherwise it stands at the speed of the vehicle's file.
        #[switch(MOT_NOTCH_FOLLOW)]
        pub follows: bool = true,
    }
}
