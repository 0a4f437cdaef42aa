//! Serves one connection, from its first byte to its last.

use crate::web::admission::Admission;
use crate::web::deadline::{DeadlineStream, RateCounter};
use crate::web::head::{HEAD_MAX, RequestHead};
use crate::web::http::{answer, refuse, switch};
use crate::web::slots::ConnectionSlot;
use afbc_web::PageFile;
use std::io::{self, Read};
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};
use std::time::{Duration, Instant};
use tungstenite::handshake::derive_accept_key;
use tungstenite::protocol::frame::CloseFrame;
use tungstenite::protocol::frame::coding::CloseCode;
use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Message, WebSocket};

/// Limits: time for a complete request, time for reading an answer, and time for a page to accept a write.
const HEAD_MAX_TIME: Duration = Duration::from_secs(5);
const ANSWER_MAX_TIME: Duration = Duration::from_secs(30);
const PATIENCE: Duration = Duration::from_secs(5);
/// Interval at which outgoing messages are looked for.
const NAP: Duration = Duration::from_millis(8);
/// Longest message from a page, and most bytes that wait to be written.
const MESSAGE_MAX: usize = 16_384;
const WAITING_MAX: usize = 1 << 20;
/// Largest number of outgoing messages that are queued for a client.
const OUT_MAX: usize = 32;
/// Largest number of messages of a client per second, including pings.
const RATE_MAX: u32 = 60;

/// WebSocket close code for a page that another page has replaced; such a page does not reconnect by itself.
const TAKEN: u16 = 4000;
const TAKEN_BY: &str = "too many pages are open, so another page has replaced this one; reload to replace another page";

/// An event of a client.
pub(crate) enum ClientEvent {
    /// A client has connected: its number, its address and the sender of its messages.
    New(u32, String, SyncSender<Arc<str>>),
    /// The client with this number has sent a text.
    Said(u32, String),
    /// The client with this number is gone.
    Gone(u32),
}

/// Data that all connections share.
pub(crate) struct WebState {
    pub(crate) admission: Admission,
    pub(crate) files: Vec<PageFile>,
    pub(crate) events: SyncSender<ClientEvent>,
}

/// Serves a connection until it ends.
pub(crate) fn serve(
    mut stream: TcpStream,
    (number, slot): (u32, &ConnectionSlot),
    shared: &WebState,
) -> io::Result<()> {
    stream.set_nodelay(true)?;
    let (head, rest) = match read_head(&mut DeadlineStream::new(&mut stream, HEAD_MAX_TIME))? {
        Ok(read) => read,
        Err(problem) => {
            return refuse(&mut DeadlineStream::new(&mut stream, ANSWER_MAX_TIME), "400 Bad Request", problem);
        }
    };
    let out = &mut DeadlineStream::new(&mut stream, ANSWER_MAX_TIME);
    if let Err((status, problem)) = shared.admission.check_names(&head) {
        return refuse(out, status, &problem);
    }
    let page = match head.path.strip_prefix('/') {
        Some("index.html") => Some(""),
        page => page,
    };
    // Scripts and styles are not secret, and a browser requests them without the token.
    let secret = page == Some("") || page == Some("socket");
    if let (true, Err((status, problem))) = (secret, shared.admission.check_token(&head)) {
        return refuse(out, status, &problem);
    }
    match (head.method.as_str(), page) {
        ("GET", Some("socket")) => match &head.socket_key {
            Some(_) if !slot.keep() => {
                refuse(out, "503 Service Unavailable", "too many pages are open; try again later")
            }
            Some(key) => {
                switch(out, &derive_accept_key(key.as_bytes()))?;
                converse(stream, rest, (number, slot), shared)
            }
            None => refuse(out, "426 Upgrade Required", "here is a WebSocket, version 13"),
        },
        ("GET" | "HEAD", Some(path)) => match shared.files.iter().find(|file| file.path == path) {
            Some(file) => answer(out, "200 OK", file.media, &file.text, head.method == "HEAD"),
            None => refuse(out, "404 Not Found", "there is no such file"),
        },
        _ => refuse(out, "405 Method Not Allowed", "only GET and HEAD"),
    }
}

/// Reads the head of a request; returns it with the bytes that follow it.
fn read_head(stream: &mut impl Read) -> io::Result<Result<(RequestHead, Vec<u8>), &'static str>> {
    let (mut bytes, mut part) = (Vec::new(), [0; 1024]);
    loop {
        let length = stream.read(&mut part)?;
        if length == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        bytes.extend_from_slice(part.get(..length).unwrap_or_default());
        match RequestHead::read(&bytes) {
            Ok(Some(head)) => {
                let rest = bytes.split_off(head.length.min(bytes.len()));
                return Ok(Ok((head, rest)));
            }
            Ok(None) if bytes.len() < HEAD_MAX => {}
            Ok(None) => return Ok(Err("the request's head is too long")),
            Err(problem) => return Ok(Err(problem)),
        }
    }
}

/// Carries messages in both directions until the connection ends.
fn converse(
    stream: TcpStream,
    rest: Vec<u8>,
    (number, slot): (u32, &ConnectionSlot),
    shared: &WebState,
) -> io::Result<()> {
    let from = stream.peer_addr()?.to_string();
    stream.set_read_timeout(Some(NAP))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    let (sender, out) = sync_channel(OUT_MAX);
    let mut limits = WebSocketConfig::default();
    limits.max_message_size = Some(MESSAGE_MAX);
    limits.max_frame_size = Some(MESSAGE_MAX);
    limits.max_write_buffer_size = WAITING_MAX;
    // Write each message at once: waiting to fill a buffer would delay the frames.
    limits.write_buffer_size = 0;
    let mut socket = WebSocket::from_partially_read(stream, rest, Role::Server, Some(limits));
    // The flight's loop handles this event within a millisecond.
    if shared.events.send(ClientEvent::New(number, from, sender)).is_err() {
        return Ok(());
    }
    let end = exchange(&mut socket, &out, (number, slot), shared);
    // If the flight has ended, nobody receives this event, and that is fine.
    let _ = shared.events.send(ClientEvent::Gone(number));
    let taken = (!slot.is_page()).then(|| CloseFrame { code: CloseCode::Library(TAKEN), reason: TAKEN_BY.into() });
    let _ = socket.close(taken).and_then(|()| socket.flush());
    end
}

fn exchange(
    socket: &mut WebSocket<TcpStream>,
    out: &Receiver<Arc<str>>,
    (number, slot): (u32, &ConnectionSlot),
    shared: &WebState,
) -> io::Result<()> {
    let mut rate = RateCounter::new(Instant::now());
    while slot.is_page() {
        loop {
            match out.try_recv() {
                Ok(text) => socket.send(Message::text(text.as_ref())).map_err(in_io)?,
                Err(TryRecvError::Empty) => break,
                // The flight has ended, or has dropped this client.
                Err(TryRecvError::Disconnected) => return Ok(()),
            }
        }
        match socket.read() {
            Ok(Message::Text(_) | Message::Ping(_) | Message::Pong(_)) if rate.count(Instant::now()) > RATE_MAX => {
                return Ok(());
            }
            Ok(Message::Text(text)) => {
                slot.speaks();
                if shared.events.send(ClientEvent::Said(number, text.as_str().into())).is_err() {
                    return Ok(());
                }
            }
            Ok(Message::Ping(_) | Message::Pong(_)) => {}
            // Pages send only text.
            Ok(Message::Binary(_) | Message::Frame(_) | Message::Close(_)) => return Ok(()),
            Err(tungstenite::Error::Io(error)) if is_silence(&error) => {}
            Err(error) => return Err(in_io(error)),
        }
    }
    Ok(())
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
