//! MAVLink 2 link between the vehicle and its trackers, commanders, simulators and ground stations.
//!
//! # Reading order
//!
//! 1. [`frames`]: conversion between the wire's frames (z down) and the workspace's (z up).
//! 2. [`Uplink`]: messages to the vehicle. [`Downlink`]: messages from the vehicle. Both can be read and written, since
//!    the simulator is the other end. [`Transfer`]: files and logs of vehicles with storage.
//! 3. [`Sender`]: encodes messages. [`Decoder`]: decodes bytes in pieces of any size, with anything between the frames,
//!    and counts dropped frames in [`Counters`].
//!
//! Layouts, checksum seeds and enumerations come from the `mavlink` crate's `common` dialect. The firmware contains
//! only the messages named here. Signatures use SHA-256 of the `hmac-sha256` crate: [`Key`], [`ReceivedFrame`].
//!
//! No input makes the crate panic or block. Its memory is one frame.
//!
//! ```
//! use afbc_mavlink::{Address, Decoder, FRAME_MAX, Sender, Uplink};
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
#![allow(deprecated, reason = "messages that stations still send")]
#![allow(clippy::type_complexity, reason = "a message's layout is the tuple of its fields")]

mod address;
mod answer;
mod channels;
mod clocks;
mod command;
mod decoder;
mod downlink;
pub mod frames;
mod framing;
mod health;
mod inertial;
mod interval;
mod message;
mod mission;
mod modes;
mod operator;
mod parameter;
mod place;
mod question;
mod signature;
mod target;
pub mod telemetry;
mod texts;
mod transfer;
mod uplink;
mod wire;

pub use address::Address;
pub use answer::Answer;
pub use channels::{ChannelsOverride, RADIO_CHANNELS, RadioChannels};
pub use clocks::Clock;
pub use command::{CalibrationRequest, Command, Reboot, Storage};
pub use decoder::{Counters, Decoder, FrameHandler};
pub use downlink::{Downlink, Text};
pub use framing::{FRAME_MAX, SIGNED_FRAME_MAX, Sender};
pub use health::{HealthArray, StatesRefused};
pub use inertial::InertialSample;
pub use interval::{DataStream, Interval};
pub use mavlink::dialects::common::{MavCmd, MavSeverity};
pub use message::{Fault, Message, MessageFormat};
pub use mission::{Mission, MissionCurrent, MissionItem, MissionResult, Part, Plan};
pub use modes::{AvailableMode, CurrentMode};
pub use operator::{ControlAnswer, ControlRequest};
pub use parameter::{ParameterError, ParameterName, ParameterRequest, ParameterValue};
pub use place::{Datum, Height, Place};
pub use question::{
    EventError, EventRequest, ExtendedAnswer, ExtendedName, ExtendedRequest, FileOperation, FileRefusal, FtpError,
    LogAnswer, LogRequest, Question, QuestionRefusal, Serial, Terrain, UnansweredWish,
};
pub use signature::{Key, ReceivedFrame, SetupSigning, Stamp, TIME_MAX};
pub use target::{AttitudeAndThrust, Axes, ExternalTarget, ManualControl, PositionTarget};
pub use telemetry::Telemetry;
pub use texts::sent_texts;
pub use transfer::{
    ComponentMetadata, FILE_DATA_MAX, FileOpcode, FilePacket, LOG_DATA_MAX, LogData, LogEntry, LogMessage,
    STREAM_DATA_MAX, StreamedLog, Transfer,
};
pub use uplink::Uplink;
