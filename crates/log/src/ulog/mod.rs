//! The black box: PX4's [ULog](https://docs.px4.io/main/en/dev_log/ulog_file_format.html) of a flight, written tick by
//! tick.
//!
//! A [`BlackBox`] takes what every control tick has taken and given ([`LoggedTick`]) and puts the log's bytes into a
//! [`LogRing`] of its caller's, who empties it into a file, a card, flash or a link. Topics, fields, types and units
//! are PX4's ([`TOPICS`]), so that its tools read the log; what PX4 has no topic for is in topics of this project,
//! whose names begin with `afbc_`. Frames are PX4's too: earth frame north-east-down, body frame forward-right-down.
//!
//! A ring that is full costs log, never a tick: records go in whole or not at all, and the time for which some are
//! missing is in the log (a dropout record). A log may be cut anywhere; all whole records before the cut are read.
//!
//! ```
//! use afbc_onboard::{Configuration, ControlInputs, Flight, Readings, parameters::ParameterTable};
//! use crate::ulog::{BlackBox, LogRing, LogStart, LoggedTick, TakenInputs};
//!
//! let configuration = Configuration::default();
//! let (table, mut flight) = (ParameterTable::new(configuration.clone()), Flight::new(&configuration)?);
//! let mut ring = LogRing::<32_768>::new();
//! let mut log = BlackBox::new(&LogStart::default(), &table);
//! let mut inputs = ControlInputs::EMPTY;
//! let taken = TakenInputs::of(&inputs);
//! let report = flight.tick(1_000, &mut inputs, &Readings::NONE);
//! let view = flight.view(1_000);
//! log.tick(&LoggedTick { report: &report, readings: &Readings::NONE, taken, view: &view, escs: None, origin: None },
//!     &table, &mut ring);
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
pub use moment::{LoggedTick, TakenInputs};
pub use ring::LogRing;
pub use topics::{LoggedTopic, TOPICS};
