//! Serves the page that shows a vehicle to browsers: a few files by HTTP, and a WebSocket that carries what
//! [`crate::page`] says.
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
//! Each connection has a thread of its own, and there are at most [`CONNECTIONS_MAX`]. [`PAGES_MAX`] of them are for
//! sockets of those who may come in: one more takes the place of the one that has said nothing for the longest time, so
//! that pages which somebody holds open keep nobody out. The others are for requests, which must be whole within 5 s
//! and whose answers must be taken within 30 s; if they are all in use, a new one takes the place of the oldest from
//! the address that has the most.
//!
//! The loop that flies takes one message at a time from a short queue and never waits: what a slow client does not take
//! is dropped, and a client that says too much, too long or nothing sensible is disconnected.

mod admission;
mod client;
mod door;
mod head;
mod http;
mod listener;
mod places;
mod timed;
mod token;

pub use admission::Admission;
pub use door::WebDoor;
pub use places::{CONNECTIONS_MAX, PAGES_MAX};
pub use token::Token;
