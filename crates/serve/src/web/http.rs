//! HTTP responses, one per connection.

use std::io::{self, Write};

/// Security headers: only the page's own scripts and styles, no embedding by other sites, and no referrer for other
/// sites.
const SAFETY: &str = "Content-Security-Policy: default-src 'self'; img-src 'self' data: blob:; \
    style-src 'self' 'unsafe-inline'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'\r\n\
    X-Content-Type-Options: nosniff\r\n\
    Referrer-Policy: no-referrer\r\n\
    Cross-Origin-Resource-Policy: same-origin\r\n\
    Cross-Origin-Opener-Policy: same-origin\r\n\
    Cache-Control: no-store\r\n";

/// Sends a text; for a HEAD request, only its header.
pub(crate) fn answer(out: &mut impl Write, status: &str, media: &str, text: &str, head: bool) -> io::Result<()> {
    let length = text.len();
    write!(
        out,
        "HTTP/1.1 {status}\r\n{SAFETY}Content-Type: {media}\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n"
    )?;
    if !head {
        out.write_all(text.as_bytes())?;
    }
    out.flush()
}

/// Sends an error with one line that says what is wrong.
pub(crate) fn refuse(out: &mut impl Write, status: &str, problem: &str) -> io::Result<()> {
    answer(out, status, "text/plain; charset=utf-8", &format!("{problem}\n"), false)
}

/// Sends the response that starts a WebSocket.
pub(crate) fn switch(out: &mut impl Write, key: &str) -> io::Result<()> {
    write!(
        out,
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
         Sec-WebSocket-Accept: {key}\r\n\r\n"
    )?;
    out.flush()
}
