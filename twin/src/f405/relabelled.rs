//! ICM-20608-G with the identity of another part of its family that shares its registers for readings, ranges and
//! power. It is no full MPU-6000: that has no ACCEL_CONFIG_2, another thermometer and another filter.

use rigless::chip::Timeline;
use rigless::chip::icm20608::Icm20608;
use rigless::chip::spi::Peer;
use rigless::snapshot::{Error, Reader, Store, Writer};

const WHO_AM_I: u8 = 0x75;
const READS: u8 = 0x80;

#[derive(Debug)]
pub struct RelabelledImu {
    pub inner: Icm20608,
    identity: u8,
    /// Register of the next byte read; `None` outside a read.
    register: Option<u8>,
    /// True if the next byte is the first of a transfer.
    is_first: bool,
}

impl RelabelledImu {
    /// Creates a part with this identity.
    pub fn new(identity: u8) -> Self {
        RelabelledImu { inner: Icm20608::new(), identity, register: None, is_first: false }
    }
}

impl Peer for RelabelledImu {
    fn transfer(&mut self, mosi: u32, bits: u8, context: &mut Timeline<'_, '_>) -> u32 {
        let answer = self.inner.transfer(mosi, bits, context);
        if std::mem::take(&mut self.is_first) {
            let byte = mosi as u8;
            self.register = (byte & READS != 0).then_some(byte & !READS);
            return answer;
        }
        let register = self.register;
        self.register = register.map(|register| register.wrapping_add(1));
        if register == Some(WHO_AM_I) { self.identity.into() } else { answer }
    }

    fn select(&mut self, context: &mut Timeline<'_, '_>) {
        (self.register, self.is_first) = (None, true);
        self.inner.select(context);
    }

    fn deselect(&mut self, context: &mut Timeline<'_, '_>) {
        self.inner.deselect(context);
    }

    fn restarted(&mut self, context: &mut Timeline<'_, '_>) {
        self.inner.restarted(context);
    }
}

/// Snapshots are taken between transfers, so the transfer's state is not stored.
impl Store for RelabelledImu {
    fn store(&self, to: &mut Writer) -> Result<(), Error> {
        self.inner.store(to)
    }

    fn load(&mut self, from: &mut Reader) -> Result<(), Error> {
        self.inner.load(from)
    }
}
