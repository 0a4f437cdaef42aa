//! What a receiver is told: navigation solutions at a high rate, no NMEA, a vehicle that flies, a fast line.

use super::frame::{MessageId, UbxCommand};

/// Poll of the version.
pub(super) const MON_VER: MessageId = [0x0A, 0x04];
pub(super) const NAV_PVT: MessageId = [0x01, 0x07];
pub(super) const ACK_ACK: MessageId = [0x05, 0x01];
pub(super) const ACK_NAK: MessageId = [0x05, 0x00];
const CFG_VALSET: MessageId = [0x06, 0x8A];
const CFG_PRT: MessageId = [0x06, 0x00];
const CFG_MSG: MessageId = [0x06, 0x01];
const CFG_RATE: MessageId = [0x06, 0x08];
const CFG_NAV5: MessageId = [0x06, 0x24];
/// First version of the protocol that is configured by keys.
const KEYS_FROM: u16 = 27;
/// Slowest baud rate that is left as it is, and what a slower one is made.
pub(super) const FAST_BAUD: u32 = 115_200;
/// Dynamic model: airborne, with less than 4 g.
const AIRBORNE: u8 = 8;
/// Time between two solutions, by keys and by messages \[ms\]: with all constellations in use, the eighth generation
/// computes five a second.
const BY_KEYS_MS: u16 = 100;
const BY_MESSAGES_MS: u16 = 200;
/// Keys, the size of whose values is in the third of the highest bits.
const UART1_BAUDRATE: u32 = 0x4052_0001;
const UART1OUTPROT_NMEA: u32 = 0x1074_0002;
const MSGOUT_UBX_NAV_PVT_UART1: u32 = 0x2091_0007;
const NAVSPG_DYNMODEL: u32 = 0x2011_0021;
const RATE_MEAS: u32 = 0x3021_0001;

/// How a receiver is configured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Interface {
    /// Ninth and tenth generation.
    Keys,
    /// Eighth and earlier.
    Messages,
}

impl Interface {
    /// Reads the answer to the poll of the version, which names that of the protocol among its texts.
    pub(super) fn of(version: &[u8]) -> Self {
        const NAME: &[u8] = b"PROTVER";
        let at = version.windows(NAME.len()).position(|text| text == NAME);
        // One byte stands between name and number; of the number, four digits fit into 16 bits.
        let digits = at.and_then(|at| version.get(at + NAME.len() + 1..)).unwrap_or_default();
        let digits = digits.iter().take_while(|digit| digit.is_ascii_digit()).take(4);
        let protocol = digits.fold(0, |number, digit| 10 * number + u16::from(*digit - b'0'));
        if protocol >= KEYS_FROM { Interface::Keys } else { Interface::Messages }
    }
}

/// What a step is worth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Worth {
    /// Without it the receiver is used by NMEA.
    Needed,
    /// Left out if it is refused.
    Wished,
    /// A line that is to run at this baud rate from then on; its answer may be lost.
    Line(u32),
}

/// Returns the step of this number for a receiver whose line is to have this baud rate; none after the last one.
pub(super) fn step(interface: Interface, number: u8, baud: u32) -> Option<(UbxCommand, Worth)> {
    Some(match (interface, number) {
        (Interface::Keys, 0) => (set(MSGOUT_UBX_NAV_PVT_UART1, &[1]), Worth::Needed),
        (Interface::Keys, 1) => (set(NAVSPG_DYNMODEL, &[AIRBORNE]), Worth::Wished),
        (Interface::Keys, 2) => (set(UART1OUTPROT_NMEA, &[0]), Worth::Wished),
        (Interface::Keys, 3) => (set(UART1_BAUDRATE, &baud.to_le_bytes()), Worth::Line(baud)),
        // After the baud rate: a slow line has no room for so many solutions.
        (Interface::Keys, 4) => (set(RATE_MEAS, &BY_KEYS_MS.to_le_bytes()), Worth::Wished),
        (Interface::Messages, 0) => {
            let [class, number] = NAV_PVT;
            (UbxCommand::new(CFG_MSG, &[class, number, 1]), Worth::Needed)
        }
        (Interface::Messages, 1) => {
            // A mask that takes the dynamic model alone.
            let payload = core::array::from_fn::<u8, 36, _>(|at| match at {
                0 => 1,
                2 => AIRBORNE,
                _ => 0,
            });
            (UbxCommand::new(CFG_NAV5, &payload), Worth::Wished)
        }
        (Interface::Messages, 2) => {
            let [a, b, c, d] = baud.to_le_bytes();
            // First UART; 8N1; in UBX and NMEA, out UBX alone.
            let payload = [1, 0, 0, 0, 0xC0, 0x08, 0, 0, a, b, c, d, 3, 0, 1, 0, 0, 0, 0, 0];
            (UbxCommand::new(CFG_PRT, &payload), Worth::Line(baud))
        }
        (Interface::Messages, 3) => {
            let [low, high] = BY_MESSAGES_MS.to_le_bytes();
            // Each measurement a solution, aligned to GPS time.
            (UbxCommand::new(CFG_RATE, &[low, high, 1, 0, 1, 0]), Worth::Wished)
        }
        _ => return None,
    })
}

/// Returns the command that sets a key in RAM.
fn set(key: u32, value: &[u8]) -> UbxCommand {
    let mut payload = [0; 12];
    // Version 0; the layer RAM alone, so that a power cycle undoes it.
    let bytes = [0, 1, 0, 0].into_iter().chain(key.to_le_bytes()).chain(value.iter().copied());
    payload.iter_mut().zip(bytes).for_each(|(to, from)| *to = from);
    UbxCommand::new(CFG_VALSET, payload.get(..8 + value.len()).unwrap_or_default())
}
