//! Memory card on a chip's SD interface, of the second version of the specification, like all cards of today. The
//! emulator's card follows the first version on this bus; this module adds the differences (SD Physical Layer
//! Simplified Specification).

use super::CardSlot;
use rigless::chip::Timeline;
use rigless::chip::sd::{Answer, Card, Outcome, command};
use rigless::snapshot::{Error, Reader, Store, Writer};

/// Application commands that send a register (4.7.4): the SD status and the configuration (SCR).
const SD_STATUS: u8 = 13;
const SEND_SCR: u8 = 51;
/// Operating conditions (5.1): power-up done, block addressing, 3.2 to 3.3 V.
const CONDITIONS: u32 = 1 << 31 | 1 << 30 | 1 << 20;
/// Configuration (5.6): version 3; one data line or four.
const CONFIGURATION: [u8; 8] = [0x02, 0x35, 0x80, 0, 0, 0, 0, 0];
/// SD status (4.10.2): four data lines in use.
const STATUS: [u8; 64] = {
    let mut status = [0; 64];
    status[0] = 0x80;
    status
};
/// Fields of the card's status (4.10.1), by which a card that is programming refuses data.
const READY_FOR_DATA: u32 = 1 << 8;
const STATE: u32 = 0xF << 9;
const PROGRAMMING: u32 = 7 << 9;

/// Card slot on an SD interface.
#[derive(Debug)]
pub struct SdSlot {
    pub slot: CardSlot,
    /// True if the next command is an application command.
    is_escaped: bool,
    /// Command whose register is read next in place of a block: 0 for none, `SEND_SCR` or `SD_STATUS`.
    register: u8,
    /// True if a block has come whose write time is still to be counted.
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
        // The model takes a block without a time, so writing counts from the next command.
        if std::mem::take(&mut self.has_come) {
            self.slot.write(now_ns);
        }
        self.register = if is_escaped && [SD_STATUS, SEND_SCR].contains(&index) { index } else { 0 };
        let answer = self.slot.card.command(index, argument, context);
        match (index, answer) {
            // The card echoes voltage and check pattern (4.3.13).
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
