//! Parameters of the vehicle while it runs: what stations read and set, and what is kept in flash.
//!
//! * [`ParameterTable`]: the parameters of a [`Configuration`](crate::Configuration) by name and by place, each change
//!   checked.
//! * [`Service`]: MAVLink's parameter protocol; [`Comms::parameters`](crate::Comms::parameters) is its place.
//! * [`Kept`]: what of it is in a [`Store`](afbc_store::Store), over new images and other vehicles.
//!
//! Names are those of `docs/parameters.md`. A new group is a line in `groups.rs`.

mod encoding;
mod groups;
mod kept;
mod reason;
mod service;
mod table;

pub use encoding::Kind;
pub use groups::Parameter;
pub use kept::{Kept, RecordChange};
pub use reason::{REASON_MAX, Reason};
pub use service::{Heard, LINK_SHARE, Service, VALUE_BYTES};
pub use table::ParameterTable;
