//! The black box: logs a flight tick by tick in PX4's [ULog](https://docs.px4.io/main/en/dev_log/ulog_file_format.html)
//! format.
//!
//! A [`BlackBox`] takes the inputs and outputs of every control tick ([`TickRecord`](afbc_onboard::TickRecord)) and
//! puts the log's bytes into its caller's [`LogRing`]. The caller empties the ring into a file, a card, flash or a
//! link. Topics, fields, types and units are PX4's ([`TOPICS`]), so PX4's tools can read the log. Signals for which PX4
//! has no topic are in topics whose names begin with `afbc_`. Frames are PX4's: earth frame north-east-down, body frame
//! forward-right-down.
//!
//! A full ring loses log records but never delays a tick. A record is written whole or not at all, and dropout records
//! state for how long records are missing. A log may be cut anywhere; all whole records before the cut can be read.
//!
//! ```
//! use afbc_log::ulog::{BesideTick, BlackBox, LogRing, LogStart};
//! use afbc_onboard::{Configuration, ControlInputs, Flight, TickInputs, TickRecord, parameters::ParameterTable};
//!
//! let configuration = Configuration::default();
//! let (table, mut flight) = (ParameterTable::new(configuration.clone()), Flight::<4>::new(&configuration)?);
//! let mut ring = LogRing::<32_768>::new();
//! let mut log = BlackBox::new(&LogStart::default(), &table);
//! let (mut messages, inputs) = (ControlInputs::EMPTY, TickInputs { time_us: 1_000, ..TickInputs::default() });
//! let before = flight.before(&messages);
//! let report = flight.tick(inputs.time_us, &mut messages, &inputs.readings);
//! let details = flight.details(&inputs, &before, &messages);
//! log.tick(&TickRecord { report: &report, details: &details }, &BesideTick::default(), &table, &mut ring);
//! assert!(ring.front().starts_with(b"ULog"));
//! # Ok::<(), afbc_types::OutOfRange>(())
//! ```

mod black_box;
mod definitions;
mod dropouts;
mod known;
mod layout;
mod moment;
mod record;
mod ring;
mod topics;

pub use black_box::BlackBox;
pub use definitions::LogStart;
pub use layout::LoggedField;
pub use moment::BesideTick;
pub use ring::LogRing;
pub use topics::{LoggedTopic, TOPICS};
