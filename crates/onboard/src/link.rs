//! Parameters of the link.

use afbc_types::parameters;

parameters! {
    /// Parameters of the link. A change counts from the next start on.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Link {
        /// MAVLink system id, from the next start on.
        #[parameter(MAV_SYS_ID, "number", 1.0..=250.0)]
        pub system: u32 = 1,
        /// Baud rate of the serial line, and so what telemetry may take of it, from the next start on.
        #[parameter(SER_TEL1_BAUD, "number", 9600.0..=921600.0)]
        pub baud: u32 = 921_600,
    }
}
