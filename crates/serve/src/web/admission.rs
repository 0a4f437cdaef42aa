//! Access checks for requests of web clients.

use crate::web::head::RequestHead;
use crate::web::token::Token;
use std::net::IpAddr;

/// Rules for who may connect.
#[derive(Clone, Debug)]
pub struct Admission {
    /// Token that clients must send; `None` on loopback.
    pub token: Option<Token>,
    /// True if a request's host must be a loopback name of this machine.
    pub loopback: bool,
}

/// A refusal: HTTP status and one line with the reason.
pub(crate) type HttpRefusal = (&'static str, String);

impl Admission {
    /// Creates the rules for this address. On loopback, a request must name this machine. If there is a token, clients
    /// need it.
    ///
    /// # Errors
    /// Fails for an address that other machines reach, without a token.
    pub fn at(address: IpAddr, token: Option<Token>) -> Result<Self, String> {
        let loopback = address.is_loopback();
        if !loopback && token.is_none() {
            return Err(format!(
                "other machines can reach {address}, so the page needs a token; set one with --web-token"
            ));
        }
        Ok(Admission { token, loopback })
    }

    /// Checks the request's host and, if a browser sends it, the origin: the page must come from this server.
    pub(crate) fn check_names(&self, head: &RequestHead) -> Result<(), HttpRefusal> {
        let Some(host) = &head.host else { return Err(("400 Bad Request", "the request names no host".into())) };
        if self.loopback && !is_own(host) {
            let cure = "open the address that was printed at the start";
            return Err(("403 Forbidden", format!("this server does not have the requested host name; {cure}")));
        }
        // Browsers send the origin of the page that makes the request.
        let origin = head.origin.as_ref().map(|origin| origin.split_once("://").map_or("", |(_, authority)| authority));
        if origin.is_some_and(|origin| !origin.eq_ignore_ascii_case(host)) {
            return Err(("403 Forbidden", "the request comes from a page of another site".into()));
        }
        Ok(())
    }

    /// Checks the token.
    pub(crate) fn check_token(&self, head: &RequestHead) -> Result<(), HttpRefusal> {
        match &self.token {
            Some(token) if !token.is_told(&head.query) => {
                let cure = "open the whole address that was printed at the start, including ?token=";
                Err(("401 Unauthorized", format!("the token is missing or wrong; {cure}")))
            }
            _ => Ok(()),
        }
    }
}

/// Returns true for a loopback name or address, with any port.
fn is_own(host: &str) -> bool {
    let name = match host.rsplit_once(':') {
        Some((name, port)) if port.bytes().all(|byte| byte.is_ascii_digit()) => name,
        _ => host,
    };
    let bare = name.trim_start_matches('[').trim_end_matches(']');
    name.eq_ignore_ascii_case("localhost") || bare.parse::<IpAddr>().is_ok_and(|address| address.is_loopback())
}
