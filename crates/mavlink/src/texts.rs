//! Extraction of the texts from sent messages.

use crate::framing::{FrameHeader, HEADER, START};
use mavlink::MessageData as _;
use mavlink::dialects::common::STATUSTEXT_DATA;

/// Returns severity (0 emergency to 7 debug) and text of each STATUSTEXT among complete frames that an [`Encoder`] has
/// written one after another. Used to write the texts to a log. Checksums are not verified.
///
/// [`Encoder`]: crate::Encoder
pub fn sent_texts(mut frames: &[u8]) -> impl Iterator<Item = (u8, &str)> {
    core::iter::from_fn(move || {
        loop {
            let header = frames.first_chunk::<HEADER>().filter(|header| header[0] == START).map(FrameHeader::read)?;
            let (frame, rest) = frames.split_at_checked(header.frame_length())?;
            frames = rest;
            if header.id == STATUSTEXT_DATA::ID
                && let Some((severity, text)) = read(frame.get(HEADER..HEADER + usize::from(header.length))?)
            {
                return Some((severity, text));
            }
        }
    })
}

/// Longest text \[bytes\]; extension fields follow it.
const TEXT_MAX: usize = 50;

/// Reads a payload; trailing zeros are not sent.
fn read(payload: &[u8]) -> Option<(u8, &str)> {
    let (severity, text) = payload.split_first()?;
    let text = text.get(..TEXT_MAX.min(text.len()))?.split(|byte| *byte == 0).next()?;
    Some((*severity, core::str::from_utf8(text).ok()?))
}

#[cfg(test)]
mod tests {
    use super::sent_texts;
    use crate::{Address, Downlink, Encoder, FRAME_MAX, MavSeverity, SIGNED_FRAME_MAX, SigningKey, Stamp, StatusText};

    const ME: Address = Address { system: 1, component: 1 };

    /// Texts of any length are found among other frames, signed or not; a truncated frame ends the search.
    #[test]
    fn texts_are_found() {
        let all = "A text of fifty characters, which is the longest !";
        let texts = ["", "x", "Log: no card", all];
        let mut sender = Encoder::new(ME);
        let mut frames = [0; 3000];
        let mut end = 0;
        let mut put = |bytes: &[u8]| {
            frames.iter_mut().skip(end).zip(bytes).for_each(|(place, byte)| *place = *byte);
            end += bytes.len();
        };
        let key = SigningKey([7; 32]);
        for (number, text) in texts.iter().enumerate() {
            let severity = MavSeverity::MAV_SEVERITY_WARNING;
            let message = Downlink::Text { severity, text: StatusText::from(*text) };
            if number % 2 == 0 {
                put(sender.send(&message, &mut [0; FRAME_MAX]));
            } else {
                let stamp = Stamp { link: 0, time_10us: 1 };
                put(sender.send_signed(&message, Some((&key, stamp)), &mut [0; SIGNED_FRAME_MAX]));
            }
            let other = Downlink::Heartbeat { armed: false, failsafe: false, mode: 0 };
            put(sender.send(&other, &mut [0; FRAME_MAX]));
        }
        let frames = frames.get(..end).unwrap_or_default();
        assert!(sent_texts(frames).eq(texts.map(|text| (4, text))));
        for cut in 0..end {
            assert!(sent_texts(frames.get(..cut).unwrap_or_default()).all(|(_, text)| texts.contains(&text)));
        }
        assert_eq!(sent_texts(&[0xFF; 40]).count(), 0);
    }
}
