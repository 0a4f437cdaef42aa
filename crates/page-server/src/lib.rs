//! Serves the page that shows a vehicle to browsers: a few files by HTTP, and a WebSocket that carries what
//! [`afbc_page`] says.
//!
//! # Who gets in
//!
//! On loopback, whoever is on this machine, but no page of another site: the request must name this machine
//! ([`Admission`]), so that no other name can be made to point here (DNS rebinding), and a browser's must come from the
//! page itself. At any other address a [`Token`] is needed too. There is no encryption: a network in between reads
//! along.
//!
//! # What clients cost the flight
//!
//! Each connection has a thread of its own, and there are at most [`CONNECTIONS_MAX`]. The loop that flies takes one
//! message at a time from a short queue and never waits: what a slow client does not take is dropped, and a client that
//! says too much, too long or nothing sensible is disconnected.
#![forbid(unsafe_code)]

mod admission;
mod client;
mod door;
mod head;
mod http;
mod listener;
mod token;

pub use admission::Admission;
pub use door::WebDoor;
pub use listener::CONNECTIONS_MAX;
pub use token::Token;
