//! Serves the web page of a vehicle to browsers: a few files by HTTP, and a WebSocket that carries the messages of
//! [`crate::page`].
//!
//! # Who gets in
//!
//! On loopback, every program of this machine may connect, but no page of another site. The request must name this
//! machine ([`Admission`]), so that no foreign name can be made to point here (DNS rebinding), and a browser's request
//! must come from the page itself. At any other address a [`Token`] is needed, too. There is no encryption: the network
//! in between can read everything.
//!
//! # What clients cost the flight
//!
//! Each connection has its own thread, and there are at most [`CONNECTIONS_MAX`] connections.
//!
//! [`PAGES_MAX`] of them are for the WebSockets of admitted pages. One page more replaces the page that has been silent
//! for longest, so that open pages lock nobody out.
//!
//! The other connections are for requests, which must be complete within 5 s and whose answers must be read within 30
//! s. If all are in use, a new connection replaces the oldest one of the address that has the most.
//!
//! The flight's loop takes one message at a time from a short queue and never waits. Messages that a slow client does
//! not accept are dropped. A client that sends too many messages, too long ones or invalid ones is disconnected.

mod admission;
mod client;
mod deadline;
mod head;
mod http;
mod listener;
mod server;
mod slots;
mod token;

pub use admission::Admission;
pub use server::WebServer;
pub use slots::{CONNECTIONS_MAX, PAGES_MAX};
pub use token::Token;
