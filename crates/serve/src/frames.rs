//! MAVLink frames within the bytes that a vehicle has sent.

/// Size of a MAVLink 2 frame without its payload \[bytes\]: header and checksum.
const OVERHEAD: usize = 12;
/// Size of a signature \[bytes\], and the incompatibility flag of signed frames.
const SIGNATURE: usize = 13;
const SIGNED: u8 = 1;
/// Size of the header \[bytes\].
const HEADER: usize = 10;
/// Message id of HEARTBEAT.
const HEARTBEAT: u32 = 0;
/// Message id of STATUSTEXT, and its longest text.
const STATUSTEXT: u32 = 253;
const TEXT_MAX: usize = 50;

/// The bytes of one frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RawFrame<'a>(&'a [u8]);

/// Splits `bytes` into frames; `bytes` must consist of complete frames.
pub(crate) fn frames(mut bytes: &[u8]) -> impl Iterator<Item = RawFrame<'_>> {
    core::iter::from_fn(move || {
        let [_, payload, flags, ..] = bytes else { return None };
        let length = OVERHEAD + usize::from(*payload) + if flags & SIGNED == 0 { 0 } else { SIGNATURE };
        let (frame, rest) = bytes.split_at_checked(length)?;
        bytes = rest;
        Some(RawFrame(frame))
    })
}

impl<'a> RawFrame<'a> {
    pub(crate) fn bytes(self) -> &'a [u8] {
        self.0
    }

    fn id(self) -> u32 {
        match self.0 {
            [_, _, _, _, _, _, _, low, middle, high, ..] => u32::from_le_bytes([*low, *middle, *high, 0]),
            _ => u32::MAX,
        }
    }

    pub(crate) fn is_heartbeat(self) -> bool {
        self.id() == HEARTBEAT
    }

    /// Returns the text if the frame is a STATUSTEXT.
    pub(crate) fn text(self) -> Option<String> {
        let end = HEADER + usize::from(*self.0.get(1)?);
        let payload = self.0.get(HEADER..end).filter(|_| self.id() == STATUSTEXT)?;
        // The text follows the severity byte. MAVLink 2 removes zeros at the end of a payload.
        let text = payload.get(1..)?;
        let end = text.iter().take(TEXT_MAX).take_while(|&&byte| byte != 0).count();
        Some(String::from_utf8_lossy(text.get(..end)?).into_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use afbc_mavlink::{Address, Downlink, Encoder, SIGNED_FRAME_MAX, SigningKey, Stamp};

    #[test]
    fn signed_frames_stay_whole() {
        let mut sender = Encoder::new(Address { system: 1, component: 1 });
        let beat = Downlink::Heartbeat { armed: false, failsafe: false, mode: 0 };
        let text = Downlink::Text { severity: afbc_mavlink::MavSeverity::MAV_SEVERITY_INFO, text: "on".into() };
        let (key, stamp) = (SigningKey([1; 32]), Stamp { link: 0, time_10us: 5 });
        let sent: Vec<Vec<u8>> = [(&beat, false), (&text, true), (&beat, true), (&text, false), (&beat, true)]
            .map(|(message, signed)| {
                let signer = signed.then_some((&key, stamp));
                sender.send_signed(message, signer, &mut [0; SIGNED_FRAME_MAX]).to_vec()
            })
            .into();
        let bytes = sent.concat();
        assert!(frames(&bytes).map(RawFrame::bytes).eq(sent.iter().map(Vec::as_slice)));
        assert!(frames(&bytes).filter_map(RawFrame::text).eq(["on", "on"]));
        assert_eq!(frames(&bytes).filter(|frame| frame.is_heartbeat()).count(), 3);
    }
}
