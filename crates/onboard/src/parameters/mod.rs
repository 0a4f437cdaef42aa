//! Parameters of the vehicle while it runs: what stations read and set, and what is kept in flash.
//!
//! * [`ParameterTable`]: the parameters of a [`Configuration`](crate::Configuration) by name and by place, each change
//!   checked.
//! * [`Kept`]: what of it is in a [`Store`](afbc_store::Store), over new images and other vehicles.
//!
//! Names are those of `docs/parameters.md`. A new group is a line in `groups.rs`.

mod encoding;
mod groups;
mod kept;
mod reason;
mod table;

pub use encoding::{Kind, decode};
pub use groups::Parameter;
pub use kept::{Kept, RecordChange};
pub use reason::{REASON_MAX, Reason};
pub use table::ParameterTable;
