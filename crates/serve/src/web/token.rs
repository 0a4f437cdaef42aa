//! The secret token that clients need where not everybody may connect.

use constant_time_eq::constant_time_eq;
use std::fmt::{self, Display, Formatter};

/// Fewest characters of a chosen token.
const CHARACTERS_MIN: usize = 16;
/// Random bytes of a generated token.
const BYTES: usize = 18;

/// A secret that every client sends in the address: `?token=...`.
#[derive(Clone, PartialEq, Eq)]
pub struct Token(String);

impl Token {
    /// Generates a token from the system's random numbers.
    ///
    /// # Errors
    /// Fails if the system has no source of random numbers.
    pub fn random() -> Result<Self, String> {
        let mut bytes = [0; BYTES];
        getrandom::fill(&mut bytes)
            .map_err(|error| format!("the system gives no random numbers for a token ({error})"))?;
        Ok(Token(bytes.iter().map(|byte| format!("{byte:02x}")).collect()))
    }

    /// Uses a token that somebody has chosen.
    ///
    /// # Errors
    /// Fails with one line that says why the text is not accepted as a token.
    pub fn chosen(text: &str) -> Result<Self, String> {
        let text = text.trim();
        let plain = text.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'-' || byte == b'_');
        if !plain || text.len() < CHARACTERS_MIN {
            return Err(format!("a token has at least {CHARACTERS_MIN} letters, digits, - and _"));
        }
        Ok(Token(text.into()))
    }

    /// Returns true if the query has the right token. The comparison takes the same time however much of it is right.
    pub(crate) fn is_told(&self, query: &str) -> bool {
        let told = query.split('&').find_map(|pair| pair.strip_prefix("token="));
        told.is_some_and(|told| constant_time_eq(told.as_bytes(), self.0.as_bytes()))
    }
}

impl Display for Token {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl fmt::Debug for Token {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str("Token")
    }
}
