//! Radio receiver on one of the links, in place of MAVLink.

use crate::board::{Board, Links, Transmitter as _};
use crate::recording;
use crate::ticks::Tick;
use afbc_comms::{Comms, RadioControl};
use afbc_onboard::ControlInputs;
use afbc_onboard::parameters::ParameterTable;
use afbc_rc::RadioProtocol;
use static_cell::StaticCell;

/// Baud rate of CRSF: that of ExpressLRS, and close enough to Crossfire's 416,666.
const CRSF_BAUD: u32 = 420_000;

/// True if the board may have a radio receiver: it has sensors and a spare link. Other images leave the code out.
pub const fn is_possible<B: Board>() -> bool {
    recording::is_possible::<B>()
}

/// Pilot's inputs, from the radio receiver, if there is one, and from the channels that a station sends.
pub struct RadioLine {
    control: RadioControl,
    /// Index of the receiver's link, if there is a receiver.
    link: Option<usize>,
}

/// Returns the index of the receiver's link: the one that the parameters name, or else the board's own. The first link
/// is reserved for stations.
fn link<B: Board>(table: &ParameterTable) -> Option<usize> {
    let port = usize::try_from(table.configuration().radio.receiver.port).ok()?;
    port.checked_sub(1).or(B::RADIO_LINK).filter(|link| (1..B::Links::COUNT).contains(link))
}

/// True if the exact log may have the link that the parameters give it, because the radio receiver does not use it.
pub fn leaves_log<B: Board>(table: &ParameterTable) -> bool {
    let log = usize::try_from(table.configuration().link.log_port).ok().and_then(|port| port.checked_sub(1));
    !is_possible::<B>() || log.is_none() || log != link::<B>(table)
}

impl RadioLine {
    /// Sets up the receiver's link. Must be called once.
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

    /// Returns the index of the receiver's link.
    pub fn link(&self) -> Option<usize> {
        self.link
    }

    /// Decodes bytes of the receiver, possibly none, and returns the pilot's inputs. It is not inlined, so that the
    /// image has a symbol for it.
    #[inline(never)]
    pub fn receive(&mut self, comms: &mut Comms, bytes: &[u8], table: &ParameterTable) -> Option<ControlInputs> {
        comms.pilot(&mut self.control, bytes, &table.configuration().radio)
    }

    /// Sends telemetry for the pilot's transmitter to show.
    #[inline(never)]
    pub fn send(&mut self, comms: &Comms, tick: &Tick, links: &mut impl Links, table: &ParameterTable) {
        // SBUS has no return channel.
        if table.configuration().radio.receiver.protocol == RadioProtocol::Crsf
            && let Some(link) = self.link.and_then(|link| links.each().get_mut(link))
            && let Some(bytes) = comms.radio_telemetry(&mut self.control)
        {
            link.transmitter.transmit(tick, &bytes);
        }
    }
}
