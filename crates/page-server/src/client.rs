//! One connection, from its first byte to its last.

use crate::admission::Admission;
use crate::head::{HEAD_MAX, Head};
use crate::http::{answer, refuse, switch};
use afbc_web::PageFile;
use std::io::{self, Read};
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};
use std::time::{Duration, Instant};
use tungstenite::handshake::derive_accept_key;
use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Message, WebSocket};

/// Time for a request to be whole, and for a client to take what is written.
const PATIENCE: Duration = Duration::from_secs(5);
/// Time between two looks at what is to be sent.
const NAP: Duration = Duration::from_millis(8);
/// Longest message from a page, and most of what waits to be written \[bytes\].
const MESSAGE_MAX: usize = 16_384;
const WAITING_MAX: usize = 1 << 20;
/// Messages that wait for a client, and for the flight.
const OUT_MAX: usize = 16;
/// Messages of a client in a second.
const RATE_MAX: u32 = 60;

/// Something that a client does.
pub(crate) enum Event {
    /// It is there, and hears by this.
    New(u32, String, SyncSender<Arc<str>>),
    /// It says something.
    Said(u32, String),
    /// It is gone.
    Gone(u32),
}

/// What all connections share.
pub(crate) struct Shared {
    pub(crate) admission: Admission,
    pub(crate) files: Vec<PageFile>,
    pub(crate) events: SyncSender<Event>,
}

/// Serves a connection until it ends.
pub(crate) fn serve(mut stream: TcpStream, number: u32, shared: &Shared) -> io::Result<()> {
    stream.set_nodelay(true)?;
    stream.set_write_timeout(Some(PATIENCE))?;
    let (head, rest) = match read_head(&mut stream)? {
        Ok(read) => read,
        Err(problem) => return refuse(&mut stream, "400 Bad Request", problem),
    };
    if let Err((status, problem)) = shared.admission.check_names(&head) {
        return refuse(&mut stream, status, &problem);
    }
    let page = match head.path.strip_prefix('/') {
        Some("index.html") => Some(""),
        page => page,
    };
    // Scripts and styles are the same for everybody, and a browser asks for them without the token.
    let secret = page == Some("") || page == Some("socket");
    if let (true, Err((status, problem))) = (secret, shared.admission.check_token(&head)) {
        return refuse(&mut stream, status, &problem);
    }
    match (head.method.as_str(), page) {
        ("GET", Some("socket")) => match &head.socket_key {
            Some(key) => {
                switch(&mut stream, &derive_accept_key(key.as_bytes()))?;
                converse(stream, rest, number, shared)
            }
            None => refuse(&mut stream, "426 Upgrade Required", "here is a WebSocket, version 13"),
        },
        ("GET" | "HEAD", Some(path)) => match shared.files.iter().find(|file| file.path == path) {
            Some(file) => answer(&mut stream, "200 OK", file.media, &file.text, head.method == "HEAD"),
            None => refuse(&mut stream, "404 Not Found", "there is no such file"),
        },
        _ => refuse(&mut stream, "405 Method Not Allowed", "only GET and HEAD"),
    }
}

/// Reads a head within [`PATIENCE`], however slowly it comes; returns what follows it, too.
fn read_head(stream: &mut TcpStream) -> io::Result<Result<(Head, Vec<u8>), &'static str>> {
    let deadline = Instant::now() + PATIENCE;
    let (mut bytes, mut part) = (Vec::new(), [0; 1024]);
    loop {
        let left = deadline.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(io::ErrorKind::TimedOut.into());
        }
        stream.set_read_timeout(Some(left))?;
        let length = stream.read(&mut part)?;
        if length == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        bytes.extend_from_slice(part.get(..length).unwrap_or_default());
        match Head::read(&bytes) {
            Ok(Some(head)) => {
                let rest = bytes.split_off(head.length.min(bytes.len()));
                return Ok(Ok((head, rest)));
            }
            Ok(None) if bytes.len() < HEAD_MAX => {}
            Ok(None) => return Ok(Err("its head is too long")),
            Err(problem) => return Ok(Err(problem)),
        }
    }
}

/// Carries messages both ways.
fn converse(stream: TcpStream, rest: Vec<u8>, number: u32, shared: &Shared) -> io::Result<()> {
    let from = stream.peer_addr()?.to_string();
    stream.set_read_timeout(Some(NAP))?;
    let (sender, out) = sync_channel(OUT_MAX);
    let mut limits = WebSocketConfig::default();
    limits.max_message_size = Some(MESSAGE_MAX);
    limits.max_frame_size = Some(MESSAGE_MAX);
    limits.max_write_buffer_size = WAITING_MAX;
    // Each message is written at once: a frame that waits for others to fill a buffer is late.
    limits.write_buffer_size = 0;
    let mut socket = WebSocket::from_partially_read(stream, rest, Role::Server, Some(limits));
    // The loop that flies takes these in a millisecond.
    if shared.events.send(Event::New(number, from, sender)).is_err() {
        return Ok(());
    }
    let end = exchange(&mut socket, &out, number, shared);
    // Once the flight has ended nobody wants to know, and the connection ends in any case.
    let _ = shared.events.send(Event::Gone(number));
    let _ = socket.close(None).and_then(|()| socket.flush());
    end
}

fn exchange(
    socket: &mut WebSocket<TcpStream>,
    out: &Receiver<Arc<str>>,
    number: u32,
    shared: &Shared,
) -> io::Result<()> {
    let (mut since, mut said) = (Instant::now(), 0);
    loop {
        loop {
            match out.try_recv() {
                Ok(text) => socket.send(Message::text(text.as_ref())).map_err(in_io)?,
                Err(TryRecvError::Empty) => break,
                // The flight has ended, or has had enough of this client.
                Err(TryRecvError::Disconnected) => return Ok(()),
            }
        }
        match socket.read() {
            Ok(Message::Text(text)) => {
                if since.elapsed() > Duration::from_secs(1) {
                    (since, said) = (Instant::now(), 0);
                }
                said += 1;
                if said > RATE_MAX || shared.events.send(Event::Said(number, text.as_str().into())).is_err() {
                    return Ok(());
                }
            }
            // What is no text says nothing sensible.
            Ok(Message::Binary(_) | Message::Frame(_) | Message::Close(_)) => return Ok(()),
            Ok(Message::Ping(_) | Message::Pong(_)) => {
                said += 1;
                if said > RATE_MAX {
                    return Ok(());
                }
            }
            Err(tungstenite::Error::Io(error)) if is_silence(&error) => {}
            Err(error) => return Err(in_io(error)),
        }
    }
}

fn is_silence(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut | io::ErrorKind::Interrupted)
}

fn in_io(error: tungstenite::Error) -> io::Error {
    match error {
        tungstenite::Error::Io(error) => error,
        error => io::Error::other(error),
    }
}
