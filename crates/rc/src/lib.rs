//! Radio control: from a receiver's bytes to the pilot's commands.
//!
//! * [`CrsfDecoder`] and [`SbusDecoder`] decode a receiver's bytes into frames of [`Channels`].
//! * [`RadioLink`] decides from frames and time whether the link is up.
//! * [`RadioPilot`] turns channels into sticks, requests and orders, using [`RadioSettings`] with PX4's names.
//! * [`CrsfTelemetry`] encodes telemetry for the pilot's transmitter.
//!
//! The crate does no input or output and has no clock: the caller passes bytes and times. Any bytes are accepted;
//! invalid frames are skipped.
//!
//! ```
//! use afbc_rc::{CRSF_MICROSECONDS, Channels, CrsfDecoder, CrsfFrame, RadioLink};
//!
//! // Sixteen channels at their centre, as an ExpressLRS receiver sends them.
//! let frame = CrsfFrame::Channels(Channels::of([1500; 16])).encode();
//! let (mut decoder, mut link) = (CrsfDecoder::default(), RadioLink::default());
//! for number in 0..20 {
//!     decoder.feed(&frame, number * 4_000, |frame| {
//!         if let CrsfFrame::Channels(channels) = frame {
//!             link.take(&channels, number * 4_000);
//!         }
//!     });
//! }
//! assert!(link.heard(80_000).is_some_and(|channels| channels.us[0] == 1500));
//! assert!(link.heard(800_000).is_none());
//! assert_eq!(CRSF_MICROSECONDS, 988..=2012);
//! ```
#![no_std]

mod channels;
mod crsf;
mod curves;
mod link;
mod pilot;
mod sbus;
mod settings;
mod switches;
mod telemetry;

pub use channels::{CHANNELS, Channels};
pub use crsf::{CRSF_GAP_US, CRSF_MICROSECONDS, CrsfDecoder, CrsfFrame, LinkStatistics};
pub use curves::StickCurves;
pub use link::{ACQUIRE_FRAMES, RECOVERY_US, RadioLink, SILENT_US};
pub use pilot::{PilotInputs, PilotNotice, PilotOutput, RadioPilot};
pub use sbus::{SBUS_GAP_US, SbusDecoder, SbusFrame};
pub use settings::{ChannelCalibration, RadioFunctions, RadioProtocol, RadioReceiver, RadioSettings, SwitchModes};
pub use telemetry::CrsfTelemetry;
