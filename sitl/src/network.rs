//! Vehicle reached over a network, in real time.

use afbc_hil::{Autopilot, Error};
use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpStream, ToSocketAddrs, UdpSocket};
use std::thread;
use std::time::{Duration, Instant};

/// Duration of one exchange.
const PERIOD: Duration = Duration::from_millis(1);
/// Longest wait between two reads.
const NAP: Duration = Duration::from_micros(200);
/// Longest time to open a TCP connection, and for the connection to accept written data.
const PATIENCE: Duration = Duration::from_secs(5);

/// Vehicle at a UDP or TCP port.
pub(crate) struct NetworkBoard {
    socket: Socket,
    /// End of the current millisecond.
    deadline: Option<Instant>,
}

enum Socket {
    Udp(UdpSocket),
    Tcp(TcpStream),
}

impl NetworkBoard {
    /// Opens a UDP socket that sends to `address` (HOST:PORT) and receives from there.
    ///
    /// # Errors
    /// If the address cannot be resolved or reached, with a message for the user.
    pub(crate) fn udp(address: &str) -> Result<Self, String> {
        let to = resolved(address)?;
        let from: SocketAddr = if to.is_ipv4() { ([0, 0, 0, 0], 0).into() } else { ([0_u16; 8], 0).into() };
        let connect = || {
            let socket = UdpSocket::bind(from)?;
            socket.connect(to)?;
            socket.set_nonblocking(true)?;
            Ok(socket)
        };
        let socket =
            connect().map_err(|error: io::Error| format!("udp:{address}: the address cannot be reached ({error})"))?;
        Ok(NetworkBoard { socket: Socket::Udp(socket), deadline: None })
    }

    /// Connects to the TCP port of `address` (HOST:PORT).
    ///
    /// # Errors
    /// If the address cannot be resolved or reached, with a message for the user.
    pub(crate) fn tcp(address: &str) -> Result<Self, String> {
        let to = resolved(address)?;
        let connect = || {
            let stream = TcpStream::connect_timeout(&to, PATIENCE)?;
            stream.set_nodelay(true)?;
            stream.set_write_timeout(Some(PATIENCE))?;
            Ok(stream)
        };
        let stream =
            connect().map_err(|error: io::Error| format!("tcp:{address}: the address cannot be reached ({error})"))?;
        Ok(NetworkBoard { socket: Socket::Tcp(stream), deadline: None })
    }
}

fn resolved(address: &str) -> Result<SocketAddr, String> {
    let found = address.to_socket_addrs().ok().and_then(|mut addresses| addresses.next());
    found.ok_or_else(|| format!("{address}: no such address; write HOST:PORT, as in 127.0.0.1:18570"))
}

impl Socket {
    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        match self {
            _ if bytes.is_empty() => Ok(()),
            Socket::Udp(socket) => socket.send(bytes).map(drop),
            Socket::Tcp(stream) => {
                // The write blocks, so that a full buffer does not cut a frame. The timeout bounds the wait.
                stream.set_nonblocking(false)?;
                stream.write_all(bytes)
            }
        }
    }

    /// Reads received bytes; returns 0 if there are none.
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = match self {
            Socket::Udp(socket) => socket.recv(buffer),
            Socket::Tcp(stream) => {
                stream.set_nonblocking(true)?;
                match stream.read(buffer) {
                    Ok(0) => return Err(io::ErrorKind::ConnectionReset.into()),
                    read => read,
                }
            }
        };
        match read {
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => Ok(0),
            read => read,
        }
    }
}

impl Autopilot for NetworkBoard {
    fn exchange(&mut self, uplink: &[u8], hear: &mut dyn FnMut(&[u8])) -> Result<(), Error> {
        let deadline = *self.deadline.get_or_insert_with(Instant::now);
        let mut buffer = [0; 65_536];
        loop {
            let length = self.socket.read(&mut buffer).map_err(failed)?;
            if length > 0 {
                hear(buffer.get(..length).unwrap_or_default());
                continue;
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                break;
            }
            thread::sleep(left.min(NAP));
        }
        // The period counts from the former deadline, so that delays are made up for.
        self.deadline = Some(deadline + PERIOD);
        self.socket.write(uplink).map_err(failed)
    }
}

fn failed(error: io::Error) -> Error {
    let reason = if error.kind() == io::ErrorKind::ConnectionRefused {
        "no program listens at this port".into()
    } else {
        format!("the connection failed ({error})")
    };
    Error::Autopilot(reason.into())
}
