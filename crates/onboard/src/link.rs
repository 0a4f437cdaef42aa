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
        /// Link that carries the exact log in place of MAVLink, counted from 1; 0 for none, from the next start on. The
        /// first one never does.
        #[parameter(LOG_PORT, "number", 0.0..=4.0)]
        pub log_port: u32 = 0,
    }
}
