//! The web port of a flying server: who may connect, and the cost of hostile clients.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::panic, missing_docs, reason = "tests")]

use afbc_plant::EffectsState;
use afbc_scenario::built_in;
use afbc_serve::web::{Admission, CONNECTIONS_MAX, PAGES_MAX, Token, WebServer};
use afbc_serve::{Server, ServerHook, TimeFlow, TimeRate, fleet};
use std::io::{Read, Write};
use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpStream};
use std::time::{Duration, Instant};

const FLOW: TimeFlow = TimeFlow { rate: TimeRate::Times(1.0), paused: false };
const TOKEN: &str = "0123456789abcdef0123";
const KEY: &str = "Upgrade: websocket\r\nConnection: keep-alive, Upgrade\r\nSec-WebSocket-Version: 13\r\n\
                   Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";

struct Flight {
    server: Server,
    web: WebServer,
    began: Instant,
    lines: Vec<String>,
    /// Longest duration of one call of the web server.
    longest: Duration,
}

impl Flight {
    fn new(token: Option<&str>) -> Self {
        let scenario = built_in("outdoor").unwrap().read().unwrap();
        let server = Server::new(&fleet(&scenario, 1).unwrap(), 1).unwrap();
        let token = token.map(|token| Token::chosen(token).unwrap());
        let admission = Admission { loopback: token.is_none(), token };
        let web = WebServer::open(SocketAddr::from((Ipv4Addr::LOCALHOST, 0)), admission).unwrap();
        Flight { server, web, began: Instant::now(), lines: Vec::new(), longest: Duration::ZERO }
    }

    /// Flies for this many milliseconds of real time.
    fn fly(&mut self, milliseconds: u64) {
        let end = Instant::now() + Duration::from_millis(milliseconds);
        while Instant::now() < end {
            let Flight { server, web, lines, .. } = self;
            let update = Instant::now();
            let _ = web.update(server, FLOW, self.began.elapsed(), &mut |line| lines.push(line.to_owned()));
            self.longest = self.longest.max(update.elapsed());
            let _ = self.server.step(|vehicle, bytes| self.web.sent(vehicle, bytes), |_| ());
            std::thread::sleep(Duration::from_micros(500));
        }
    }

    fn effects(&self) -> EffectsState {
        self.server.vehicles()[0].world().plant().telemetry().unwrap()
    }

    /// Flies until `done` is true, at most half a minute.
    fn fly_until(&mut self, what: &str, mut done: impl FnMut(&mut Self) -> bool) {
        let begun = Instant::now();
        while !done(self) {
            assert!(begun.elapsed() < Duration::from_secs(30), "waited in vain: {what}");
            self.fly(5);
        }
    }

    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(self.web.address()).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(8))).unwrap();
        stream
    }

    /// Sends a request and returns the whole answer, while the flight continues.
    fn ask(&mut self, request: &str) -> String {
        let mut stream = self.connect();
        stream.write_all(request.as_bytes()).unwrap();
        let answer = std::thread::spawn(move || {
            let mut answer = Vec::new();
            let _ = stream.read_to_end(&mut answer);
            String::from_utf8_lossy(&answer).into_owned()
        });
        while !answer.is_finished() {
            self.fly(2);
        }
        answer.join().unwrap()
    }

    fn get(&mut self, target: &str, lines: &str) -> String {
        let host = self.web.address();
        self.ask(&format!("GET {target} HTTP/1.1\r\nHost: {host}\r\n{lines}\r\n"))
    }

    /// Opens a WebSocket; returns it after the server has accepted it.
    fn socket(&mut self, query: &str) -> TcpStream {
        let (mut stream, host) = (self.connect(), self.web.address());
        write!(stream, "GET /socket{query} HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\n{KEY}\r\n").unwrap();
        let connected = |flight: &Self| flight.lines.iter().filter(|line| line.ends_with("connected")).count();
        let before = connected(self);
        self.fly_until("a socket", |flight| connected(flight) > before);
        let mut head = [0; 12];
        stream.read_exact(&mut head).unwrap();
        assert_eq!(&head, b"HTTP/1.1 101");
        stream
    }
}

/// Returns a client's WebSocket frame, with a mask of zeros.
fn frame(kind: u8, payload: &[u8]) -> Vec<u8> {
    let length = payload.len();
    let mut bytes = vec![0x80 | kind];
    match length {
        0..=125 => bytes.push(0x80 | length as u8),
        126..=65_535 => bytes.extend([0x80 | 126, (length >> 8) as u8, length as u8]),
        _ => {
            bytes.push(0x80 | 127);
            bytes.extend((length as u64).to_be_bytes());
        }
    }
    bytes.extend([0; 4]);
    bytes.extend_from_slice(payload);
    bytes
}

fn status(answer: &str) -> &str {
    answer.split(' ').nth(1).unwrap_or_default()
}

#[test]
fn the_page_and_its_files_are_served() {
    let mut flight = Flight::new(None);
    let page = flight.get("/", "");
    assert!(page.starts_with("HTTP/1.1 200") && page.contains("Content-Security-Policy: default-src 'self'"));
    for file in page.split('"').filter(|name| name.ends_with(".js") || name.ends_with(".css")) {
        assert_eq!(status(&flight.get(&format!("/{file}"), "")), "200", "{file}");
    }
    for (target, expected) in [("/../Cargo.toml", "404"), ("/nothing", "404"), ("/socket", "426")] {
        assert_eq!(status(&flight.get(target, "")), expected, "{target}");
    }
    let host = flight.web.address();
    assert_eq!(status(&flight.ask(&format!("POST / HTTP/1.1\r\nHost: {host}\r\n\r\n"))), "405");
}

/// DNS rebinding: the name of another site is made to point here, and that site's page opens a WebSocket.
#[test]
fn pages_of_other_sites_get_nothing() {
    let mut flight = Flight::new(None);
    let port = flight.web.address().port();
    for (host, expected) in [
        (format!("127.0.0.1:{port}"), "200"),
        (format!("localhost:{port}"), "200"),
        (format!("[::1]:{port}"), "200"),
        ("localhost".into(), "200"),
        (format!("evil.example:{port}"), "403"),
        (format!("127.0.0.1.evil.example:{port}"), "403"),
        (format!("localhost.evil.example:{port}"), "403"),
        ("192.168.1.1".into(), "403"),
        (String::new(), "403"),
    ] {
        assert_eq!(status(&flight.ask(&format!("GET / HTTP/1.1\r\nHost: {host}\r\n\r\n"))), expected, "{host}");
    }
    let host = flight.web.address();
    for origin in ["http://evil.example", "null", "http://127.0.0.1:1", "https://localhost"] {
        let answer = flight.get("/socket", &format!("Origin: {origin}\r\n{KEY}"));
        assert_eq!(status(&answer), "403", "{origin}");
    }
    assert_eq!(status(&flight.ask("GET / HTTP/1.1\r\n\r\n")), "400");
    let twice = format!("GET / HTTP/1.1\r\nHost: {host}\r\nHost: evil.example\r\n\r\n");
    assert_eq!(status(&flight.ask(&twice)), "400");
    let _ = flight.socket("");
    assert!(flight.lines.iter().any(|line| line.contains("connected")), "{:?}", flight.lines);
}

#[test]
fn other_addresses_need_the_token() {
    let everybody: IpAddr = [0, 0, 0, 0].into();
    assert!(Admission::at(everybody, None).unwrap_err().contains("needs a token"));
    assert!(Token::chosen("short").is_err() && Token::chosen("with spaces in between").is_err());
    let drawn: Vec<String> = (0..100).map(|_| Token::random().unwrap().to_string()).collect();
    assert!(drawn.iter().all(|token| token.len() == 36 && drawn.iter().filter(|it| *it == token).count() == 1));

    let mut flight = Flight::new(Some(TOKEN));
    assert!(flight.web.url().ends_with(&format!("/?token={TOKEN}")));
    let refused = flight.get("/", "");
    assert_eq!(status(&refused), "401");
    assert!(refused.ends_with("including ?token=\n"), "{refused}");
    let near: Vec<String> = (0..TOKEN.len()).map(|length| TOKEN[..length].into()).collect();
    for wrong in near.into_iter().chain([TOKEN.to_uppercase(), format!("{TOKEN}0"), format!("x{TOKEN}")]) {
        for target in ["/", "/socket"] {
            let answer = flight.get(&format!("{target}?token={wrong}"), KEY);
            assert_eq!(status(&answer), "401", "{target} {wrong}");
        }
    }
    assert_eq!(status(&flight.get(&format!("/?token={TOKEN}"), "")), "200");
    let _ = flight.socket(&format!("?token={TOKEN}"));
    // On a page of another site, even the right token does not help.
    assert_eq!(
        status(&flight.get(&format!("/socket?token={TOKEN}"), &format!("Origin: http://a.example\r\n{KEY}"))),
        "403"
    );
}

#[test]
fn commands_of_the_page_fly_the_vehicle() {
    let mut flight = Flight::new(None);
    let mut socket = flight.socket("");
    socket.write_all(&frame(1, br#"{"do":"line","text":"gust 7 0 0 0.1 5"}"#)).unwrap();
    flight.fly_until("the gust", |flight| flight.effects().wind_m_s.x > 6.0);
    let mut text = String::new();
    while !(text.contains(r#""kind":"hello""#)
        && text.contains(r#""kind":"values""#)
        && text.contains(r#""kind":"frame""#))
    {
        let mut bytes = vec![0; 1 << 16];
        let length = socket.read(&mut bytes).unwrap();
        assert!(length > 0, "the socket has ended");
        text += &String::from_utf8_lossy(&bytes[..length]);
        flight.fly(5);
    }
}

/// Hostile clients do not make the flight's loop wait, and well-behaved clients are still served.
#[test]
fn hostile_clients_cost_the_flight_nothing() {
    let mut flight = Flight::new(None);
    let mut good = flight.socket("");
    let mut held = Vec::new();
    // The clients send request heads that never end, half of a TLS handshake, nothing, and garbage.
    for bytes in [&b"GET / HTTP/1.1\r\nHost:"[..], b"\x16\x03\x01\x02\x00", b"", &[b'A'; 20_000]] {
        let mut stream = flight.connect();
        let _ = stream.write_all(bytes);
        held.push(stream);
    }
    // WebSocket frames that are too long, too many, without a mask, or never end.
    let long = frame(1, &vec![b'x'; 200_000]);
    let huge = [&[0x81, 0xff][..], &u64::MAX.to_be_bytes(), &[0; 4]].concat();
    let flood: Vec<u8> = (0..5000).flat_map(|_| frame(1, br#"{"do":"arm"}"#)).collect();
    let pings: Vec<u8> = (0..5000).flat_map(|_| frame(9, b"")).collect();
    for bytes in [&long[..], &huge, &flood, &pings, b"\x81\x05hello", b"\xff\x80\0\0\0\0", &frame(2, &[0; 100])] {
        let mut socket = flight.socket("");
        let _ = socket.set_write_timeout(Some(Duration::from_millis(200)));
        let _ = socket.write_all(bytes);
        flight.fly_until("its end", |flight| flight.lines.last().is_some_and(|line| line.ends_with("gone")));
        held.push(socket);
    }
    // Text that is not a command gets an answer.
    for text in ["[".repeat(16_000), "{}".into(), r#"{"do":"line","text":"quit"}"#.into(), "\u{0}".into()] {
        good.write_all(&frame(1, text.as_bytes())).unwrap();
    }
    // Many connections at a time: those beyond the limit are closed at once.
    let many: Vec<TcpStream> = (0..100).map(|_| flight.connect()).collect();
    let is_closed = |mut stream: &TcpStream| matches!(stream.read(&mut [0; 1]), Ok(0));
    many.iter().for_each(|stream| stream.set_nonblocking(true).unwrap());
    flight.fly_until("their end", |_| many.iter().filter(|it| is_closed(it)).count() >= many.len() - CONNECTIONS_MAX);
    drop(many);
    // The limit also holds in debug builds and on busy machines; it shows that the web server never waits.
    assert!(flight.longest < Duration::from_millis(250), "{:?}", flight.longest);
    drop(held);
    let _ = good.write_all(&frame(1, br#"{"do":"line","text":"battery 0.5"}"#));
    flight.fly_until("the command", |flight| flight.effects().battery.unwrap().charge < 0.51);
    // A new page is served once the others have left.
    flight.fly_until("the page", |flight| status(&flight.get("/", "")) == "200");
}

/// Clients without the token cannot lock out clients that have it, however slowly they read or ask.
#[test]
fn slow_strangers_keep_no_holder_out() {
    let mut flight = Flight::new(Some(TOKEN));
    let host = flight.web.address();
    let page = flight.get(&format!("/?token={TOKEN}"), "");
    let files: Vec<String> = page.split('"').filter(|it| it.ends_with(".js")).map(str::to_owned).collect();
    assert!(!files.is_empty());
    let get = |file: &str| format!("GET /{file} HTTP/1.1\r\nHost: {host}\r\n\r\n");
    let mut held = Vec::new();
    for round in 0..3 {
        // Answers that nobody reads, half requests, and connections that send nothing.
        for place in 0..2 * CONNECTIONS_MAX {
            let mut stream = flight.connect();
            let asked = get(&files[place % files.len()]);
            let length = [asked.len(), asked.len() / 2, 0][place % 3];
            let _ = stream.write_all(&asked.as_bytes()[..length]);
            held.push(stream);
        }
        flight.fly(50);
        assert_eq!(status(&flight.get(&format!("/?token={TOKEN}"), "")), "200", "{round}");
        for file in &files {
            assert_eq!(status(&flight.get(&format!("/{file}"), "")), "200", "{round} {file}");
        }
    }
    // An open page stays open, however many clients connect.
    let mut socket = flight.socket(&format!("?token={TOKEN}"));
    for _ in 0..4 * CONNECTIONS_MAX {
        held.push(flight.connect());
    }
    flight.fly(200);
    socket.write_all(&frame(1, br#"{"do":"line","text":"gust 7 0 0 0.1 5"}"#)).unwrap();
    flight.fly_until("the gust", |flight| flight.effects().wind_m_s.x > 6.0);
    assert!(!flight.lines.iter().any(|line| line.ends_with("gone")), "{:?}", flight.lines);
    assert!(flight.longest < Duration::from_millis(250), "{:?}", flight.longest);
}

/// Eight open pages cannot lock out a ninth one, with or without a token. The ninth page replaces the one that has been
/// silent for longest; this page is told the reason. The others stay.
#[test]
fn a_page_too_many_takes_the_place_of_the_silent_one() {
    for (token, query) in [(None, ""), (Some(TOKEN), &*format!("?token={TOKEN}"))] {
        let mut flight = Flight::new(token);
        let mut pages: Vec<TcpStream> = (0..PAGES_MAX).map(|_| flight.socket(query)).collect();
        let gone = |flight: &Flight| flight.lines.iter().filter(|line| line.ends_with("gone")).count();
        for silent in [1, 2, 4] {
            // All pages except this one send a message, the first page each time.
            for (index, page) in pages.iter_mut().enumerate().filter(|(index, _)| *index != silent) {
                page.write_all(&frame(1, br#"{"do":"line","text":"status"}"#)).unwrap_or_else(|_| panic!("{index}"));
            }
            flight.fly(100);
            let before = gone(&flight);
            pages.push(flight.socket(query));
            flight.fly_until("its end", |flight| gone(flight) > before);
            flight.fly(100);
            assert_eq!(gone(&flight), before + 1, "{:?}", flight.lines);
            let mut said = Vec::new();
            pages.remove(silent).read_to_end(&mut said).unwrap();
            // A WebSocket close frame with the code 4000.
            let close = said.windows(4).rposition(|it| it[0] == 0x88 && it[2..] == 4000_u16.to_be_bytes());
            let reason = close.map(|at| String::from_utf8_lossy(&said[at + 4..]).into_owned());
            assert!(reason.as_ref().is_some_and(|it| it.starts_with("too many pages are open")), "{reason:?}");
        }
        let refused = flight.get("/", "");
        assert_eq!(status(&refused), if token.is_some() { "401" } else { "200" });
    }
}

/// A page that only watches, and pings to keep its connection alive, stays. A page that floods pings is disconnected.
#[test]
fn pings_keep_a_page_alive() {
    let mut flight = Flight::new(None);
    let mut socket = flight.socket("");
    let is_gone = |flight: &Flight| flight.lines.iter().any(|line| line.ends_with("gone"));
    for _ in 0..100 {
        socket.write_all(&frame(9, b"here")).unwrap();
        flight.fly(30);
    }
    assert!(!is_gone(&flight), "{:?}", flight.lines);
    (0..100).for_each(|_| drop(socket.write_all(&frame(9, b"here"))));
    flight.fly_until("its end", |flight| is_gone(flight));
}
