//! A card by a chip's own interface to it, of the second version of the specification as all are today. The models' own
//! is of the first on this bus: what the second has beside it is added (SD Physical Layer Simplified Specification).

use super::CardSlot;
use rigless::chip::Timeline;
use rigless::chip::sd::{Answer, Card, Outcome, command};
use rigless::snapshot::{Error, Reader, Store, Writer};

/// Application commands that send registers (4.7.4): the SD status and the configuration.
const SD_STATUS: u8 = 13;
const SEND_SCR: u8 = 51;
/// Bits of the operating conditions (5.1): the power-up is done, the card addresses blocks, at 3.2 to 3.3 V.
const CONDITIONS: u32 = 1 << 31 | 1 << 30 | 1 << 20;
/// The configuration (5.6): version 3, one line or four.
const CONFIGURATION: [u8; 8] = [0x02, 0x35, 0x80, 0, 0, 0, 0, 0];
/// The SD status (4.10.2): four lines.
const STATUS: [u8; 64] = {
    let mut status = [0; 64];
    status[0] = 0x80;
    status
};
/// Bits of the card's status (4.10.1): it takes no data, and programs.
const READY_FOR_DATA: u32 = 1 << 8;
const STATE: u32 = 0xF << 9;
const PROGRAMMING: u32 = 7 << 9;

/// A slot.
#[derive(Debug)]
pub struct SdSlot {
    pub slot: CardSlot,
    /// The next command is an application command.
    is_escaped: bool,
    /// The register that is read next in the place of a block: none, configuration or status.
    register: u8,
    /// A block has come, since when is to be seen.
    has_come: bool,
}

impl SdSlot {
    pub fn new() -> Self {
        SdSlot { slot: CardSlot::new(), is_escaped: false, register: 0, has_come: false }
    }
}

impl Card for SdSlot {
    fn command(&mut self, index: u8, argument: u32, context: &mut Timeline<'_, '_>) -> Answer {
        let now_ns = context.now().0;
        if self.slot.is_out(now_ns).0 {
            (self.is_escaped, self.register, self.has_come) = (false, 0, false);
            return Answer::None;
        }
        let is_escaped = std::mem::replace(&mut self.is_escaped, index == command::APP_CMD);
        // The model takes a block without a clock: it counts from the next command on.
        if std::mem::take(&mut self.has_come) {
            self.slot.write(now_ns);
        }
        self.register = if is_escaped && [SD_STATUS, SEND_SCR].contains(&index) { index } else { 0 };
        let answer = self.slot.card.command(index, argument, context);
        match (index, answer) {
            // It repeats voltage and pattern (4.3.13).
            (command::SEND_IF_COND, _) if !is_escaped => Answer::Short(argument & 0xFFF),
            (command::SD_SEND_OP_COND, Answer::Short(_)) if is_escaped => Answer::Short(CONDITIONS),
            (_, Answer::Short(status)) if now_ns < self.slot.busy_until_ns => {
                Answer::Short(status & !(READY_FOR_DATA | STATE) | PROGRAMMING)
            }
            _ => answer,
        }
    }

    fn read(&mut self, block: &mut [u8]) -> Outcome {
        let register: &[u8] = match std::mem::take(&mut self.register) {
            SEND_SCR => &CONFIGURATION,
            SD_STATUS => &STATUS,
            _ if self.slot.was_out => return Outcome::Ended,
            _ => return self.slot.card.read(block),
        };
        if register.len() != block.len() {
            return Outcome::Ended;
        }
        block.copy_from_slice(register);
        Outcome::Whole
    }

    fn write(&mut self, block: &[u8]) -> Outcome {
        if self.slot.was_out {
            return Outcome::Ended;
        }
        let outcome = self.slot.card.write(block);
        self.has_come = outcome == Outcome::Whole;
        outcome
    }

    fn commanded(&self) -> &[(u8, u32)] {
        self.slot.card.commanded()
    }
}

impl Store for SdSlot {
    fn store(&self, to: &mut Writer) -> Result<(), Error> {
        to.put(&(self.is_escaped, self.register, self.has_come))?;
        self.slot.store(to)
    }

    fn load(&mut self, from: &mut Reader) -> Result<(), Error> {
        (self.is_escaped, self.register, self.has_come) = from.take()?;
        self.slot.load(from)
    }
}
