//! Parses the head of an HTTP request.

use httparse::{EMPTY_HEADER, Request, Status};

/// Longest head \[bytes\], and most header lines.
pub(crate) const HEAD_MAX: usize = 8192;
const LINES_MAX: usize = 64;

/// The parts of a head that are used.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct RequestHead {
    pub(crate) method: String,
    pub(crate) path: String,
    pub(crate) query: String,
    pub(crate) host: Option<String>,
    pub(crate) origin: Option<String>,
    /// Key of a WebSocket handshake (version 13), if the request asks for one.
    pub(crate) socket_key: Option<String>,
    /// Length of the head \[bytes\].
    pub(crate) length: usize,
}

impl RequestHead {
    /// Parses a head; returns `None` as long as it is incomplete.
    ///
    /// # Errors
    /// Fails with what is wrong with the head.
    pub(crate) fn read(bytes: &[u8]) -> Result<Option<RequestHead>, &'static str> {
        let mut lines = [EMPTY_HEADER; LINES_MAX];
        let mut request = Request::new(&mut lines);
        let length = match request.parse(bytes) {
            Ok(Status::Complete(length)) => length,
            Ok(Status::Partial) if bytes.len() < HEAD_MAX => return Ok(None),
            Ok(Status::Partial) => return Err("the request's head is too long"),
            Err(_) => return Err("this is no HTTP request"),
        };
        // A header must not appear twice: other programs might use a different one of the two.
        let only = |name: &str| {
            let mut named = request.headers.iter().filter(|line| line.name.eq_ignore_ascii_case(name));
            match (named.next(), named.next()) {
                (None, _) => Ok(None),
                (Some(line), None) => std::str::from_utf8(line.value)
                    .map(|value| Some(value.trim().to_owned()))
                    .map_err(|_| "a header line is not text"),
                _ => Err("a header line occurs twice"),
            }
        };
        let has = |value: Option<String>, word: &str| {
            value.is_some_and(|value| value.split(',').any(|it| it.trim().eq_ignore_ascii_case(word)))
        };
        let upgrades = has(only("upgrade")?, "websocket") && has(only("connection")?, "upgrade");
        let version = only("sec-websocket-version")?;
        let socket_key = only("sec-websocket-key")?.filter(|_| upgrades && version.as_deref() == Some("13"));
        let target = request.path.unwrap_or_default();
        let (path, query) = target.split_once('?').unwrap_or((target, ""));
        Ok(Some(RequestHead {
            method: request.method.unwrap_or_default().into(),
            path: path.into(),
            query: query.into(),
            host: only("host")?,
            origin: only("origin")?,
            socket_key,
            length,
        }))
    }
}
