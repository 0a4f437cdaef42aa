//! Parameters of the running vehicle: stations read and set them, and flash stores them.
//!
//! * [`ParameterTable`]: the parameters of a [`Configuration`](crate::Configuration) by name and by index; each change
//!   is checked.
//! * [`Kept`]: stores changed parameters in a [`Store`](afbc_store::Store), and reads them in later images.
//!
//! Names are those of `docs/parameters.md`. A new group is one line in `groups.rs`.

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
