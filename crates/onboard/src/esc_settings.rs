//! Settings of the motor controllers' telemetry.

use afbc_types::parameters;

parameters! {
    /// Telemetry of the motor controllers, and its use. Names and numbers are PX4's. Not in the paper.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct EscSettings {
        /// Whether the vehicle requests telemetry from the motor controllers by DSHOT. They answer over the board's
        /// telemetry line.
        #[switch(DSHOT_TEL_CFG)]
        pub serial: bool = false,
        /// Whether each motor controller answers every DSHOT frame on its own line (bidirectional DSHOT), on boards
        /// that can read it. Takes effect from the next start on.
        #[switch(DSHOT_BIDIR_EN)]
        pub answers: bool = false,
        /// Number of magnets in a motor's bell, an even number, usually 14.
        #[parameter(MOT_POLE_COUNT, "number", 2.0..=400.0)]
        pub poles: u32 = 14,
        /// Whether the vehicle reports rotors that do not turn as commanded.
        #[switch(FD_ACT_EN)]
        pub detects: bool = true,
        /// Action when a rotor fails in flight: 0 only a warning, 1 hold, 2 land, 3 return.
        #[parameter(COM_ACT_FAIL_ACT, "number", 0.0..=3.0)]
        pub action: u32 = 0,
        /// Whether the notch filter on the velocity follows the measured rotor speeds. Otherwise the filter stays at
        /// the speed in the vehicle's file.
        #[switch(MOT_NOTCH_FOLLOW)]
        pub follows: bool = true,
    }
}
