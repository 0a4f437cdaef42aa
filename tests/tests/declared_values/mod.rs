//! Files with every declared value, and what changes with each.

mod document;
mod scenario;
mod stories;
mod subject;
mod vehicle;
