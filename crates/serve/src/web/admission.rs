//! Who gets in.

use crate::web::head::Head;
use crate::web::token::Token;
use std::net::IpAddr;

/// Who gets in.
#[derive(Clone, Debug)]
pub struct Admission {
    /// What clients must tell; none on loopback.
    pub token: Option<Token>,
    /// True if only this machine's own names lead here.
    pub loopback: bool,
}

/// Why a request is refused: status and one line.
pub(crate) type Refused = (&'static str, String);

impl Admission {
    /// Admits this machine alone, or whoever tells the token.
    ///
    /// # Errors
    /// An address that others reach, without a token.
    pub fn at(address: IpAddr, token: Option<Token>) -> Result<Self, String> {
        let loopback = address.is_loopback();
        if !loopback && token.is_none() {
            return Err(format!("{address} is reached by others: a page there needs a token"));
        }
        Ok(Admission { token, loopback })
    }

    /// Checks the names in a request: that of this machine and, if a browser tells it, that of the page it comes from.
    pub(crate) fn check_names(&self, head: &Head) -> Result<(), Refused> {
        let Some(host) = &head.host else { return Err(("400 Bad Request", "it names no host".into())) };
        if self.loopback && !is_own(host) {
            let cure = "open the address that was printed at the start";
            return Err(("403 Forbidden", format!("this machine is not called so; {cure}")));
        }
        // Of another site: a browser tells on it.
        let origin = head.origin.as_ref().map(|origin| origin.split_once("://").map_or("", |(_, authority)| authority));
        if origin.is_some_and(|origin| !origin.eq_ignore_ascii_case(host)) {
            return Err(("403 Forbidden", "it comes from a page of another site".into()));
        }
        Ok(())
    }

    /// Checks the token.
    pub(crate) fn check_token(&self, head: &Head) -> Result<(), Refused> {
        match &self.token {
            Some(token) if !token.is_told(&head.query) => {
                let cure = "open the whole address that was printed at the start, with ?token= and what follows";
                Err(("401 Unauthorized", format!("the token is missing or wrong; {cure}")))
            }
            _ => Ok(()),
        }
    }
}

/// True for this machine's own names on loopback, whatever the port.
fn is_own(host: &str) -> bool {
    let name = match host.rsplit_once(':') {
        Some((name, port)) if port.bytes().all(|byte| byte.is_ascii_digit()) => name,
        _ => host,
    };
    let bare = name.trim_start_matches('[').trim_end_matches(']');
    name.eq_ignore_ascii_case("localhost") || bare.parse::<IpAddr>().is_ok_and(|address| address.is_loopback())
}
