//! Parameters of the link and of the log.

use afbc_types::{Choice, parameters};

/// Times at which the black box is written, with PX4's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LogMode {
    /// Logs from arming until one second after disarming, in each flight.
    Armed,
    /// Logs from power-up until one second after the first disarming, then as [`Armed`](Self::Armed).
    BootUntilDisarm,
    /// Logs from power-up until power-down.
    Boot,
}

impl Choice for LogMode {
    const ALL: &'static [Self] = &[LogMode::Armed, LogMode::BootUntilDisarm, LogMode::Boot];
    const WORDS: &'static [&'static str] = &["armed", "boot_until_disarm", "boot"];
}

/// Default baud rate of a link: the highest at which no UART of these boards loses a byte (docs/timing.md).
pub const BAUD: u32 = 460_800;

parameters! {
    /// Parameters of the link. A change takes effect from the next start on.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Link {
        /// MAVLink system id, from the next start on.
        #[parameter(MAV_SYS_ID, "number", 1.0..=250.0)]
        pub system: u32 = 1,
        /// Baud rate of the serial line, which also limits the rate of telemetry, from the next start on.
        #[parameter(SER_TEL1_BAUD, "number", 9600.0..=921600.0)]
        pub baud: u32 = BAUD,
        /// Number of the link that carries the exact log in place of MAVLink, counted from 1; 0 for none, from the next
        /// start on. Link 1 always carries MAVLink.
        #[parameter(LOG_PORT, "number", 0.0..=4.0)]
        pub log_port: u32 = 0,
        /// Time during which boards with storage write the black box.
        #[choice(SDLOG_MODE)]
        pub log_mode: LogMode = LogMode::Armed,
    }
}
