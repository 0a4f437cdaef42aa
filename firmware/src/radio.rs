//! A radio receiver in place of one of the links.

use crate::board::{Board, Links, Transmitter as _};
use crate::recording;
use crate::ticks::Tick;
use crate::vehicle::ParameterTable;
use afbc_onboard::ControlInputs;
use afbc_radio::RadioProtocol;
use afbc_station::{Comms, RadioControl};
use static_cell::StaticCell;

/// Baud rate of CRSF, between ExpressLRS's 420,000 and Crossfire's 416,666.
const CRSF_BAUD: u32 = 420_000;

/// True if a board may have one: it flies by its own sensors, and has a link to spare. Others have none of it.
pub const fn is_possible<B: Board>() -> bool {
    recording::is_possible::<B>()
}

/// The pilot: a receiver's line, if there is one, and a station's channels.
pub struct RadioLine {
    control: RadioControl,
    /// Index of the link.
    link: Option<usize>,
}

/// Returns the index of the link that a receiver is on: that of the parameters, or the board's own for it. The first
/// one never is.
fn link<B: Board>(table: &ParameterTable) -> Option<usize> {
    let port = usize::try_from(table.configuration().radio.receiver.port).ok()?;
    port.checked_sub(1).or(B::RADIO_LINK).filter(|link| (1..B::Links::COUNT).contains(link))
}

/// True if the exact log may have the link that the parameters give it.
pub fn leaves_log<B: Board>(table: &ParameterTable) -> bool {
    let log = usize::try_from(table.configuration().link.log_port).ok().and_then(|port| port.checked_sub(1));
    !is_possible::<B>() || log.is_none() || log != link::<B>(table)
}

impl RadioLine {
    /// Begins to listen, to be called once.
    #[inline(never)]
    pub fn begin<B: Board>(table: &ParameterTable, links: &mut B::Links) -> Option<&'static mut Self> {
        static LINE: StaticCell<RadioLine> = StaticCell::new();
        if !is_possible::<B>() {
            return None;
        }
        let link = link::<B>(table);
        if let Some(link) = link.and_then(|link| links.each().get_mut(link)) {
            match table.configuration().radio.receiver.protocol {
                RadioProtocol::Crsf => link.transmitter.set_baud(CRSF_BAUD),
                RadioProtocol::Sbus => link.transmitter.set_sbus(),
            }
        }
        Some(LINE.init_with(|| RadioLine { control: RadioControl::default(), link }))
    }

    /// Index of its link.
    pub fn link(&self) -> Option<usize> {
        self.link
    }

    /// Takes bytes of the receiver, or none; returns what the pilot wants. Out of line, like the report.
    #[inline(never)]
    pub fn receive(&mut self, comms: &mut Comms, bytes: &[u8], table: &ParameterTable) -> Option<ControlInputs> {
        comms.pilot(&mut self.control, bytes, &table.configuration().radio)
    }

    /// Sends what the transmitter shows.
    #[inline(never)]
    pub fn send(&mut self, comms: &Comms, tick: &Tick, links: &mut impl Links, table: &ParameterTable) {
        // SBUS has no way back.
        if table.configuration().radio.receiver.protocol == RadioProtocol::Crsf
            && let Some(link) = self.link.and_then(|link| links.each().get_mut(link))
            && let Some(bytes) = comms.radio_telemetry(&mut self.control)
        {
            link.transmitter.transmit(tick, &bytes);
        }
    }
}
