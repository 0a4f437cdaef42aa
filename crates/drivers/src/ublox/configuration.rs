//! Configuration of a receiver: navigation solutions at a high rate, no NMEA, an airborne model and a fast line.

use super::frame::{MessageId, UbxCommand};

/// Version poll.
pub(super) const MON_VER: MessageId = [0x0A, 0x04];
pub(super) const NAV_PVT: MessageId = [0x01, 0x07];
pub(super) const ACK_ACK: MessageId = [0x05, 0x01];
pub(super) const ACK_NAK: MessageId = [0x05, 0x00];
const CFG_VALSET: MessageId = [0x06, 0x8A];
const CFG_PRT: MessageId = [0x06, 0x00];
const CFG_MSG: MessageId = [0x06, 0x01];
const CFG_RATE: MessageId = [0x06, 0x08];
const CFG_NAV5: MessageId = [0x06, 0x24];
/// First protocol version that is configured by keys.
const KEYS_FROM: u16 = 27;
/// Baud rate that slower lines are raised to.
pub(super) const FAST_BAUD: u32 = 115_200;
/// Dynamic model: airborne with less than 4 g.
const AIRBORNE: u8 = 8;
/// Time between two solutions, with keys and with messages \[ms\]. With all constellations in use, the eighth
/// generation computes five per second.
const BY_KEYS_MS: u16 = 100;
const BY_MESSAGES_MS: u16 = 200;
/// Configuration keys; bits 28 to 30 of a key encode the size of its value.
const UART1_BAUDRATE: u32 = 0x4052_0001;
const UART1OUTPROT_NMEA: u32 = 0x1074_0002;
const MSGOUT_UBX_NAV_PVT_UART1: u32 = 0x2091_0007;
const NAVSPG_DYNMODEL: u32 = 0x2011_0021;
const RATE_MEAS: u32 = 0x3021_0001;

/// Configuration interface of a receiver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Interface {
    /// Keys: ninth and tenth generation.
    Keys,
    /// Messages: eighth generation and earlier.
    Messages,
}

impl Interface {
    /// Returns the interface from the answer to the version poll, which names the protocol version in one of its texts.
    pub(super) fn of(version: &[u8]) -> Self {
        const NAME: &[u8] = b"PROTVER";
        let at = version.windows(NAME.len()).position(|text| text == NAME);
        // One byte separates name and number. Four digits fit into 16 bits.
        let digits = at.and_then(|at| version.get(at + NAME.len() + 1..)).unwrap_or_default();
        let digits = digits.iter().take_while(|digit| digit.is_ascii_digit()).take(4);
        let protocol = digits.fold(0, |number, digit| 10 * number + u16::from(*digit - b'0'));
        if protocol >= KEYS_FROM { Interface::Keys } else { Interface::Messages }
    }
}

/// Importance of a configuration step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Importance {
    /// Required: without it the receiver is used with NMEA.
    Needed,
    /// Optional: skipped if refused.
    Wished,
    /// Sets the line's baud rate; its answer may be lost.
    Line(u32),
}

/// Returns the configuration step with this number, for a line with this baud rate; none after the last step.
pub(super) fn step(interface: Interface, number: u8, baud: u32) -> Option<(UbxCommand, Importance)> {
    Some(match (interface, number) {
        (Interface::Keys, 0) => (set(MSGOUT_UBX_NAV_PVT_UART1, &[1]), Importance::Needed),
        (Interface::Keys, 1) => (set(NAVSPG_DYNMODEL, &[AIRBORNE]), Importance::Wished),
        (Interface::Keys, 2) => (set(UART1OUTPROT_NMEA, &[0]), Importance::Wished),
        (Interface::Keys, 3) => (set(UART1_BAUDRATE, &baud.to_le_bytes()), Importance::Line(baud)),
        // After the baud rate, since a slow line has no room for so many solutions.
        (Interface::Keys, 4) => (set(RATE_MEAS, &BY_KEYS_MS.to_le_bytes()), Importance::Wished),
        (Interface::Messages, 0) => {
            let [class, number] = NAV_PVT;
            (UbxCommand::new(CFG_MSG, &[class, number, 1]), Importance::Needed)
        }
        (Interface::Messages, 1) => {
            // The mask of the first byte applies only the dynamic model.
            let payload = core::array::from_fn::<u8, 36, _>(|at| match at {
                0 => 1,
                2 => AIRBORNE,
                _ => 0,
            });
            (UbxCommand::new(CFG_NAV5, &payload), Importance::Wished)
        }
        (Interface::Messages, 2) => {
            let [a, b, c, d] = baud.to_le_bytes();
            // The payload sets UART 1 to 8N1, with UBX and NMEA as input, and only UBX as output.
            let payload = [1, 0, 0, 0, 0xC0, 0x08, 0, 0, a, b, c, d, 3, 0, 1, 0, 0, 0, 0, 0];
            (UbxCommand::new(CFG_PRT, &payload), Importance::Line(baud))
        }
        (Interface::Messages, 3) => {
            let [low, high] = BY_MESSAGES_MS.to_le_bytes();
            // The receiver gives one solution per measurement, aligned to GPS time.
            (UbxCommand::new(CFG_RATE, &[low, high, 1, 0, 1, 0]), Importance::Wished)
        }
        _ => return None,
    })
}

/// Returns the command that sets a key in RAM.
fn set(key: u32, value: &[u8]) -> UbxCommand {
    let mut payload = [0; 12];
    // Version 0; only the RAM layer, so that a power cycle undoes it.
    let bytes = [0, 1, 0, 0].into_iter().chain(key.to_le_bytes()).chain(value.iter().copied());
    payload.iter_mut().zip(bytes).for_each(|(to, from)| *to = from);
    UbxCommand::new(CFG_VALSET, payload.get(..8 + value.len()).unwrap_or_default())
}
