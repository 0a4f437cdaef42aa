//! TCP port of a vehicle.

use crate::frames::frames;
use crate::peer::{PeerEvent, speaks_mavlink};
use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::net::{IpAddr, SocketAddr, TcpListener, TcpStream};
use std::time::Duration;

/// Largest number of bytes that wait for a slow reader before it is disconnected: a minute or more of telemetry.
const WAITING_MAX: usize = 1 << 20;
/// Largest number of connections, and largest number of connections that are accepted in one step.
pub(crate) const STREAMS_MAX: usize = 32;
const ACCEPTED_MAX: usize = 2;
/// Largest number of bytes read in one step from all streams together, and from one stream.
const TAKEN_MAX: usize = 16_384;
const PART_MAX: usize = 2048;
/// Largest number of bytes written to a stream in one step; much more than one step's telemetry.
const WRITTEN_MAX: usize = 4096;

/// A listener and its connections.
pub(crate) struct TcpPort {
    listener: TcpListener,
    /// Connections, rotated when a step's bytes are used up, so that each gets its turn.
    streams: VecDeque<TcpConnection>,
    /// True if frames need a signature.
    signed: bool,
}

struct TcpConnection {
    number: u32,
    stream: TcpStream,
    address: SocketAddr,
    /// Time when the connection was accepted, and time of the last frame that counts, if any.
    since: Duration,
    heard: Option<Duration>,
    has_begun: bool,
    /// Bytes that the system has not accepted yet.
    waiting: VecDeque<u8>,
    open: bool,
}

impl TcpPort {
    /// Opens port `port` of this address.
    ///
    /// # Errors
    /// Fails with the system's error.
    pub(crate) fn open(address: IpAddr, port: u16) -> io::Result<Self> {
        let listener = TcpListener::bind((address, port))?;
        listener.set_nonblocking(true)?;
        Ok(TcpPort { listener, streams: VecDeque::new(), signed: false })
    }

    pub(crate) fn address(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    /// Accepts connections and reads the bytes that have arrived by `now`. If `signed`, frames need a signature.
    /// `number` returns the number of a new peer. `on` handles events; for [`PeerEvent::Sent`] it returns whether the
    /// bytes complete a valid frame.
    pub(crate) fn receive(
        &mut self,
        (now, signed): (Duration, bool),
        number: &mut impl FnMut() -> u32,
        mut on: impl FnMut(PeerEvent<'_>) -> bool,
    ) {
        if signed && !self.signed {
            // A signature is needed from now on, and nobody has sent one yet.
            self.streams.iter_mut().for_each(|connection| connection.heard = None);
        }
        self.signed = signed;
        for _ in 0..ACCEPTED_MAX {
            let Ok((stream, address)) = self.listener.accept() else { break };
            if stream.set_nonblocking(true).is_err() {
                continue;
            }
            // Send small frames at once. If this fails, they only arrive later.
            let _ = stream.set_nodelay(true);
            if self.streams.len() >= STREAMS_MAX
                && let Some(gone) = self.give_up()
            {
                on(PeerEvent::Gone(gone.address, gone.number));
            }
            self.streams.push_back(TcpConnection::new(number(), stream, address, now));
            on(PeerEvent::New(address));
        }
        let mut left = TAKEN_MAX;
        for connection in &mut self.streams {
            connection.receive(now, &mut left, &mut on);
            if !connection.open {
                on(PeerEvent::Gone(connection.address, connection.number));
            }
        }
        self.streams.retain(|connection| connection.open);
        if left == 0 && !self.streams.is_empty() {
            self.streams.rotate_left(1);
        }
    }

    /// Removes the connection that has been silent for longest; connections without any valid frame go first.
    fn give_up(&mut self) -> Option<TcpConnection> {
        let streams = self.streams.iter().enumerate();
        let longest = streams.min_by_key(|(_, it)| (it.heard.is_some(), it.heard.unwrap_or(it.since), it.number));
        longest.map(|(place, _)| place).and_then(|place| self.streams.remove(place))
    }

    /// Sends complete frames to everyone. If frames need a signature, peers that have not signed get heartbeats only.
    pub(crate) fn send(&mut self, bytes: &[u8]) {
        for connection in &mut self.streams {
            if !self.signed || connection.heard.is_some() {
                connection.waiting.extend(bytes);
            } else {
                frames(bytes).filter(|it| it.is_heartbeat()).for_each(|it| connection.waiting.extend(it.bytes()));
            }
            connection.flush();
        }
    }
}

impl TcpConnection {
    fn new(number: u32, stream: TcpStream, address: SocketAddr, since: Duration) -> Self {
        let (heard, has_begun, waiting) = (None, false, VecDeque::new());
        TcpConnection { number, stream, address, since, heard, has_begun, waiting, open: true }
    }

    /// Reads once, at most `left` bytes.
    fn receive(&mut self, now: Duration, left: &mut usize, on: &mut impl FnMut(PeerEvent<'_>) -> bool) {
        let mut buffer = [0; PART_MAX];
        let Some(room) = buffer.get_mut(..PART_MAX.min(*left)).filter(|room| !room.is_empty()) else { return };
        match self.stream.read(room) {
            Ok(length @ 1..) => {
                *left -= length;
                let bytes = buffer.get(..length).unwrap_or_default();
                if !self.has_begun && !speaks_mavlink(bytes) {
                    self.open = false;
                    on(PeerEvent::Foreign(self.address));
                    return;
                }
                self.has_begun = true;
                if on(PeerEvent::Sent(self.number, bytes)) {
                    self.heard = Some(now);
                }
            }
            Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted) => {}
            Ok(0) | Err(_) => self.open = false,
        }
    }

    /// Writes as many bytes as the system accepts, up to the limit per step.
    fn flush(&mut self) {
        let mut left = WRITTEN_MAX;
        while self.open && left > 0 {
            let (front, _) = self.waiting.as_slices();
            let front = front.get(..front.len().min(left)).unwrap_or_default();
            if front.is_empty() {
                break;
            }
            match self.stream.write(front) {
                Ok(length @ 1..) => {
                    left = left.saturating_sub(length);
                    self.waiting.drain(..length);
                }
                Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted) => break,
                Ok(0) | Err(_) => self.open = false,
            }
        }
        self.open &= self.waiting.len() <= WAITING_MAX;
    }
}
