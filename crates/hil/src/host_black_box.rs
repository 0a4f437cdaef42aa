//! The black box of a host. Its ring is emptied after every tick, or by the stream to a station.

use afbc_estimator::GeodeticOrigin;
use afbc_log::ulog::{BesideTick, BlackBox, LogRing};
use afbc_mavlink::{Address, Decoder, Downlink};
use afbc_onboard::parameters::{ParameterTable, RecordChange};
use afbc_onboard::{EscTelemetry, TickRecord};

/// Size of the ring: more than a log's beginning and one tick.
const RING: usize = 1 << 16;
/// Address of the decoder for the vehicle's texts, which never sends anything.
const LISTENER: Address = Address { system: 255, component: 190 };

/// Receiver of a log's bytes.
pub(crate) type Sink = Box<dyn FnMut(&[u8])>;

/// Writes the log of a host. Hands its bytes over, or keeps them for a station that gets them as a stream.
pub(crate) struct HostBlackBox {
    log: BlackBox,
    ring: Box<LogRing<RING>>,
    /// Receiver of the bytes; none if they stay in the ring.
    write: Option<Sink>,
    /// Geographic origin of the GNSS fixes.
    origin: Option<GeodeticOrigin>,
    /// Decodes the texts that the vehicle sends.
    decoder: Decoder<Downlink>,
}

impl HostBlackBox {
    pub(crate) fn new(log: BlackBox, origin: Option<GeodeticOrigin>, write: Option<Sink>) -> Self {
        HostBlackBox { log, ring: Box::default(), write, origin, decoder: Decoder::new(LISTENER) }
    }

    /// Logs a tick, and a parameter change after it.
    pub(crate) fn tick(
        &mut self,
        tick: &TickRecord<'_>,
        escs: &EscTelemetry,
        table: &ParameterTable,
        change: Option<RecordChange>,
    ) {
        let beside = BesideTick { escs: Some(escs), origin: self.origin };
        self.log.tick(tick, &beside, table, &mut self.ring);
        if let Some(change) = change {
            self.log.change(table, change, &mut self.ring);
        }
    }

    /// Logs the texts among the bytes sent after a tick, and hands over all waiting bytes.
    pub(crate) fn sent(&mut self, now_us: u64, bytes: &[u8]) {
        let Self { log, ring, write, decoder, .. } = self;
        decoder.feed_accepted(
            bytes,
            // Accepts signed messages, too: they are the vehicle's own.
            |_| true,
            |_, message| {
                if let Downlink::Text { severity, text } = message {
                    log.text(now_us, severity as u8, text.to_str().unwrap_or_default(), ring);
                }
            },
        );
        let Some(write) = write else { return };
        // Takes two passes if the bytes wrap around the end of the ring.
        while !ring.is_empty() {
            let front = ring.front();
            write(front);
            let length = front.len();
            ring.consume(length);
        }
    }

    /// Returns waiting bytes. Remove them by [`consume`](Self::consume).
    pub(crate) fn waiting(&self) -> &[u8] {
        self.ring.front()
    }

    pub(crate) fn consume(&mut self, bytes: usize) {
        self.ring.consume(bytes);
    }
}
