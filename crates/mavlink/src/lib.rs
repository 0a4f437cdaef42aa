//! MAVLink 2 link between the vehicle and its trackers, commanders, simulators and ground stations.
//!
//! # Reading order
//!
//! 1. [`frames`]: conversion between the wire's frames (z down) and the workspace's (z up).
//! 2. [`Uplink`]: messages to the vehicle. [`Downlink`]: messages from the vehicle. Both can be read and written, since
//!    the simulator is the other end. [`Transfer`]: files and logs of vehicles with storage.
//! 3. [`Encoder`]: encodes messages. [`Decoder`]: decodes bytes in pieces of any size, with anything between the
//!    frames, and counts dropped frames in [`Counters`].
//!
//! Layouts, checksum seeds and enumerations come from the `mavlink` crate's `common` dialect. The firmware contains
//! only the messages named here. Signatures use SHA-256 of the `hmac-sha256` crate: [`SigningKey`], [`ReceivedFrame`].
//!
//! No input makes the crate panic or block. Its memory is one frame.
//!
//! ```
//! use afbc_mavlink::{Address, Decoder, Encoder, FRAME_MAX, Uplink};
//!
//! let (station, vehicle) = (Address { system: 255, component: 190 }, Address { system: 1, component: 1 });
//! let mut buffer = [0; FRAME_MAX];
//! let bytes = Encoder::new(station).send(&Uplink::Heartbeat, &mut buffer);
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
mod channels;
mod command;
mod command_result;
mod decoder;
mod downlink;
pub mod frames;
mod framing;
mod global_position;
mod health;
mod inertial;
mod interval;
mod message;
mod mission;
mod modes;
mod operator;
mod parameter;
mod service;
mod signature;
mod target;
pub mod telemetry;
mod texts;
mod time;
mod transfer;
mod uplink;
mod wire;

pub use address::Address;
pub use channels::{ChannelsOverride, RADIO_CHANNELS, RadioChannels};
pub use command::{CalibrationRequest, Reboot, Storage, VehicleCommand};
pub use command_result::CommandResult;
pub use decoder::{Counters, Decoder, FrameHandler};
pub use downlink::{Downlink, StatusText};
pub use framing::{Encoder, FRAME_MAX, SIGNED_FRAME_MAX};
pub use global_position::{Datum, GlobalPosition, Height};
pub use health::{HealthArray, StatesRefused};
pub use inertial::InertialSample;
pub use interval::{DataStream, MessageInterval};
pub use mavlink::dialects::common::{MavCmd, MavSeverity};
pub use message::{FrameFault, MessageFormat, MessageSet};
pub use mission::{MissionCurrent, MissionItem, MissionMessage, MissionRange, MissionResult, MissionType};
pub use modes::{AvailableMode, CurrentMode};
pub use operator::{ControlAnswer, ControlRequest};
pub use parameter::{ParameterError, ParameterName, ParameterRequest, ParameterValue};
pub use service::{
    EventError, EventRequest, ExtendedAnswer, ExtendedName, ExtendedRequest, FileOperation, FileRefusal, FtpError,
    LogAnswer, LogRequest, SerialControl, ServiceRefusal, ServiceRequest, Terrain, UnansweredRequest,
};
pub use signature::{ReceivedFrame, SetupSigning, SigningKey, Stamp, TIME_MAX};
pub use target::{AttitudeAndThrust, ExternalTarget, ManualControl, PositionTarget, TargetFrame};
pub use telemetry::Telemetry;
pub use texts::sent_texts;
pub use time::TimeMessage;
pub use transfer::{
    ComponentMetadata, FILE_DATA_MAX, FileOpcode, FilePacket, LOG_DATA_MAX, LogData, LogEntry, LogMessage,
    STREAM_DATA_MAX, StreamedLog, Transfer,
};
pub use uplink::Uplink;
