//! A radio receiver in place of one of the links.

use crate::board::{Board, Links, Transmitter as _};
use crate::recording;
use crate::ticks::Tick;
use crate::vehicle::ParameterTable;
use afbc_onboard::ControlInputs;
use afbc_radio::RadioProtocol;
use afbc_station::{Comms, RadioControl};
use static_cell::StaticCell;

/// Baud rate of CRSF, between ExpressLRS's 420,000 and Crossfire's 416,666, and of SBUS.
const CRSF_BAUD: u32 = 420_000;
const SBUS_BAUD: u32 = 100_000;

/// True if a board may have one: it flies by its own sensors, and has a link to spare. Others have none of it.
pub const fn is_possible<B: Board>() -> bool {
    recording::is_possible::<B>()
}

/// The receiver's line.
pub struct RadioLine {
    control: RadioControl,
    /// Index of the link.
    link: usize,
}

impl RadioLine {
    /// Begins to listen, if the parameters want it; to be called once.
    #[inline(never)]
    pub fn begin<B: Board>(table: &ParameterTable, links: &mut B::Links) -> Option<&'static mut Self> {
        static LINE: StaticCell<RadioLine> = StaticCell::new();
        let receiver = &table.configuration().radio.receiver;
        let link = usize::try_from(receiver.port).ok()?.checked_sub(1)?;
        if !is_possible::<B>() || link == 0 {
            return None;
        }
        links.each().get_mut(link)?.transmitter.set_baud(match receiver.protocol {
            RadioProtocol::Crsf => CRSF_BAUD,
            RadioProtocol::Sbus => SBUS_BAUD,
        });
        Some(LINE.init_with(|| RadioLine { control: RadioControl::default(), link }))
    }

    /// Index of its link.
    pub fn link(&self) -> usize {
        self.link
    }

    /// Takes bytes of the receiver, or none; returns what the pilot wants. Out of line, like the report.
    #[inline(never)]
    pub fn receive(&mut self, comms: &mut Comms, bytes: &[u8], table: &ParameterTable) -> Option<ControlInputs> {
        comms.pilot(&mut self.control, bytes, &table.configuration().radio)
    }

    /// Sends what the transmitter shows.
    #[inline(never)]
    pub fn send(&mut self, comms: &Comms, tick: &Tick, links: &mut impl Links) {
        if let Some(bytes) = comms.radio_telemetry(&mut self.control)
            && let Some(link) = links.each().get_mut(self.link)
        {
            link.transmitter.transmit(tick, &bytes);
        }
    }
}
