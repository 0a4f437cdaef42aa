//! Files with every declared value, and the effects of changing each value.

mod document;
mod scenario;
mod stories;
mod subject;
mod vehicle;
