//! Limits the number of connections, and chooses which connection a new one replaces.

use std::collections::BTreeMap;
use std::io;
use std::net::{IpAddr, Shutdown, TcpStream};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// Largest number of pages at a time: WebSockets of admitted clients.
pub const PAGES_MAX: usize = 8;
/// Largest number of other connections at a time.
const OTHERS_MAX: usize = 32;
/// Largest number of connections at a time.
pub const CONNECTIONS_MAX: usize = PAGES_MAX + OTHERS_MAX;

/// The open connections.
#[derive(Clone, Debug, Default)]
pub(crate) struct ConnectionSlots(Arc<Mutex<Vec<OpenConnection>>>);

#[derive(Debug)]
struct OpenConnection {
    number: u32,
    from: IpAddr,
    stream: TcpStream,
    /// Time when a page last sent a message, or connected; `None` for connections that are no page, or no longer one.
    said: Option<Instant>,
}

impl OpenConnection {
    const fn is_page(&self) -> bool {
        self.said.is_some()
    }
}

/// A connection's place; dropping it frees the place.
#[derive(Debug)]
pub(crate) struct ConnectionSlot {
    slots: ConnectionSlots,
    number: u32,
}

impl ConnectionSlots {
    /// Gives a new connection a place. If too many connections are no pages yet, it replaces the oldest of them from
    /// the address that has the most: a client with many connections loses one of its own.
    ///
    /// # Errors
    /// Fails with the system's error.
    pub(crate) fn enter(&self, number: u32, stream: &TcpStream) -> io::Result<ConnectionSlot> {
        let (from, stream) = (stream.peer_addr()?.ip(), stream.try_clone()?);
        let mut open = self.lock();
        if open.iter().filter(|it| !it.is_page()).count() >= OTHERS_MAX
            && let Some(slot) = last_to_stay(&open)
        {
            // This ends the thread of the connection, which may be waiting for data.
            let _ = open.remove(slot).stream.shutdown(Shutdown::Both);
        }
        open.push(OpenConnection { number, from, stream, said: None });
        Ok(ConnectionSlot { slots: self.clone(), number })
    }

    fn lock(&self) -> MutexGuard<'_, Vec<OpenConnection>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl ConnectionSlot {
    /// Turns the connection into a page; returns false if its place has been taken. If there are too many pages, the
    /// page that has been silent for longest loses its place, so that eight open pages lock nobody out.
    pub(crate) fn keep(&self) -> bool {
        let mut open = self.slots.lock();
        let Some(own) = open.iter().position(|it| it.number == self.number) else { return false };
        if open.iter().filter(|it| it.is_page()).count() >= PAGES_MAX {
            let silent = open.iter_mut().filter(|it| it.is_page()).min_by_key(|it| it.said);
            silent.into_iter().for_each(|silent| silent.said = None);
        }
        open.get_mut(own).map(|own| own.said = Some(Instant::now())).is_some()
    }

    /// Notes that the page has sent a message.
    pub(crate) fn speaks(&self) {
        let mut open = self.slots.lock();
        let own = open.iter_mut().find(|it| it.number == self.number && it.is_page());
        own.into_iter().for_each(|own| own.said = Some(Instant::now()));
    }

    /// Returns false once the page's place has been taken.
    pub(crate) fn is_page(&self) -> bool {
        self.slots.lock().iter().any(|it| it.number == self.number && it.is_page())
    }
}

impl Drop for ConnectionSlot {
    fn drop(&mut self) {
        self.slots.lock().retain(|it| it.number != self.number);
    }
}

/// Returns the oldest connection of the address with the most connections, not counting pages.
fn last_to_stay(open: &[OpenConnection]) -> Option<usize> {
    let mut counts = BTreeMap::new();
    open.iter().filter(|it| !it.is_page()).for_each(|it| *counts.entry(it.from).or_insert(0_usize) += 1);
    let most = counts.into_iter().max_by_key(|(_, count)| *count).map(|(from, _)| from)?;
    open.iter().position(|it| !it.is_page() && it.from == most)
}
