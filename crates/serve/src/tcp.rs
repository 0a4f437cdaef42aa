//! A vehicle's TCP port.

use crate::peer::Event;
use std::io::{self, Read, Write};
use std::net::{IpAddr, SocketAddr, TcpListener, TcpStream};

/// Bytes that wait for a slow reader before it is let go: some minutes of telemetry.
const WAITING_MAX: usize = 1 << 22;
/// Most connections.
const STREAMS_MAX: usize = 32;
/// Most bytes taken from a stream in one step.
const TAKEN_MAX: usize = 65_536;

/// A listener and its streams.
pub(crate) struct Tcp {
    listener: TcpListener,
    streams: Vec<Connection>,
}

struct Connection {
    number: u32,
    stream: TcpStream,
    address: SocketAddr,
    /// Bytes that the system has not taken yet.
    waiting: Vec<u8>,
    open: bool,
}

impl Tcp {
    /// Opens the port `port` of this address.
    ///
    /// # Errors
    /// The system's.
    pub(crate) fn open(address: IpAddr, port: u16) -> io::Result<Self> {
        let listener = TcpListener::bind((address, port))?;
        listener.set_nonblocking(true)?;
        Ok(Tcp { listener, streams: Vec::new() })
    }

    pub(crate) fn address(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    /// Accepts and receives what has arrived. `number` gives a new peer its number.
    pub(crate) fn receive(&mut self, number: &mut impl FnMut() -> u32, mut on: impl FnMut(Event<'_>)) {
        while let Ok((stream, address)) = self.listener.accept() {
            let fit = self.streams.len() < STREAMS_MAX && stream.set_nonblocking(true).is_ok();
            if fit {
                // Small frames leave at once; without it they only come later.
                let _ = stream.set_nodelay(true);
                self.streams.push(Connection { number: number(), stream, address, waiting: Vec::new(), open: true });
                on(Event::New(address));
            }
        }
        for connection in &mut self.streams {
            connection.receive(&mut on);
            if !connection.open {
                on(Event::Gone(connection.address, connection.number));
            }
        }
        self.streams.retain(|connection| connection.open);
    }

    /// Sends `bytes` to everyone.
    pub(crate) fn send(&mut self, bytes: &[u8]) {
        for connection in &mut self.streams {
            connection.waiting.extend_from_slice(bytes);
            connection.flush();
        }
    }
}

impl Connection {
    fn receive(&mut self, on: &mut impl FnMut(Event<'_>)) {
        let (mut buffer, mut taken) = ([0; 4096], 0);
        while taken < TAKEN_MAX {
            match self.stream.read(&mut buffer) {
                Ok(length @ 1..) => {
                    taken += length;
                    on(Event::Sent(self.number, buffer.get(..length).unwrap_or_default()));
                }
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Ok(0) | Err(_) => {
                    self.open = false;
                    return;
                }
            }
        }
    }

    /// Hands over as much as the system takes.
    fn flush(&mut self) {
        while self.open && !self.waiting.is_empty() {
            match self.stream.write(&self.waiting) {
                Ok(length @ 1..) => {
                    self.waiting.drain(..length);
                }
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => break,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Ok(0) | Err(_) => self.open = false,
            }
        }
        self.open &= self.waiting.len() <= WAITING_MAX;
    }
}
