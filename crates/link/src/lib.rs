//! What crosses the wire between the vehicle and whoever tracks, commands, simulates or watches it: MAVLink 2.
//!
//! # Reading order
//!
//! 1. [`frames`]: the wire's axes point down, ours up; the one place where they meet.
//! 2. [`Uplink`]: what comes in. [`Downlink`]: what goes out. Both can be written and read, for the other end is ours
//!    too when it simulates.
//! 3. [`Sender`]: from messages to bytes. [`Decoder`]: from bytes, in any pieces and with anything between them, to
//!    messages, with [`Counters`] of what was dropped and why.
//!
//! Layouts, checksums' seeds and enumerations come from the `mavlink` crate's `common` dialect; of its messages only
//! those named here reach the image. Parameter messages are not spoken: gains are fixed and validated before flight.
//! Signed frames are not understood and are dropped.
//!
//! Nothing here panics or waits, whatever the bytes; memory is one frame.
//!
//! ```
//! use afbc_link::{Address, Decoder, FRAME_MAX, Sender, Uplink};
//!
//! let (station, vehicle) = (Address { system: 255, component: 190 }, Address { system: 1, component: 1 });
//! let mut buffer = [0; FRAME_MAX];
//! let bytes = Sender::new(station).send(&Uplink::Heartbeat, &mut buffer);
//! assert_eq!(bytes.len(), 12 + 9);
//!
//! let mut decoder = Decoder::<Uplink>::new(vehicle);
//! decoder.feed(bytes, |from, message| assert_eq!((from, message), (station, Uplink::Heartbeat)));
//! assert_eq!(decoder.counters().received, 1);
//! ```
#![no_std]

mod address;
mod decoder;
mod downlink;
pub mod frames;
mod framing;
mod message;
mod uplink;

pub use address::Address;
pub use decoder::{Counters, Decoder};
pub use downlink::{Answer, Downlink, Health, StatesRefused, Text};
pub use framing::{FRAME_MAX, Sender};
pub use mavlink::dialects::common::{MavCmd, MavSeverity};
pub use message::{Fault, Format, Message};
pub use uplink::{Command, Uplink};
