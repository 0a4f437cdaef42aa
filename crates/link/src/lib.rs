//! MAVLink 2 link between the vehicle and its trackers, commanders, simulators and ground stations.
//!
//! # Reading order
//!
//! 1. [`frames`]: conversion between the wire's frames (z down) and the workspace's (z up).
//! 2. [`Uplink`]: messages to the vehicle. [`Downlink`]: messages from it. Both can be written and read, since the
//!    simulator is the other end.
//! 3. [`Sender`]: encodes messages. [`Decoder`]: decodes bytes, in any pieces and with anything between the frames, and
//!    counts what it drops in [`Counters`].
//!
//! Layouts, checksum seeds and enumerations come from the `mavlink` crate's `common` dialect; only the messages named
//! here reach the image. Parameter messages are not supported: gains are fixed and validated before flight. Signed
//! frames are not supported and are dropped.
//!
//! No input makes the crate panic or block; memory is one frame.
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
