//! What the image gives to its USB link, of which the models have no bus: taken from the ring in its RAM in which the
//! bytes wait for the port (`chip_stm32::usb`), as its task would.

use object::{Object, ObjectSymbol};
use rigless::emulator::Host;
use rigless::soc::Width;
use std::error::Error;
use std::path::Path;

/// Part of the ring's name in the image.
const NAME: &str = "chip_stm323usb4SENT";
/// Words behind the ring's bytes: the state of an `embassy_sync::pipe::Pipe` that nobody waits for. All are zero but
/// the end of what is in it, if that begins at the start.
const WORDS: u64 = 8;
const LENGTH: u64 = 1024;

/// The ring, and what was taken from it.
#[derive(Debug)]
pub struct UsbRing {
    address: u64,
    pub bytes: Vec<u8>,
}

impl UsbRing {
    /// Finds it in an image.
    pub fn find(image: &Path) -> Result<Self, Box<dyn Error>> {
        let file = std::fs::read(image)?;
        let file = object::File::parse(file.as_slice())?;
        let is_ring = |name: &str| name.contains(NAME);
        let ring = file.symbols().find(|symbol| symbol.name().is_ok_and(is_ring)).ok_or("the image has no USB")?;
        if ring.size() != 4 * WORDS + LENGTH {
            return Err("the ring of USB is not as it was".into());
        }
        Ok(UsbRing { address: ring.address(), bytes: Vec::new() })
    }

    /// Empties it, unless the image is about to write.
    pub fn drain(&mut self, host: &mut dyn Host) {
        let mut set = (0..WORDS).filter_map(|word| {
            let address = self.address + LENGTH + 4 * word;
            host.read(address, Width::W32).ok().filter(|value| *value != 0).map(|value| (address, value))
        });
        let (Some((address, end @ 1..LENGTH)), None) = (set.next(), set.next()) else { return };
        drop(set);
        for at in 0..end {
            self.bytes.push(host.read(self.address + at, Width::W8).unwrap_or_default() as u8);
        }
        let _ = host.write(address, Width::W32, 0);
    }
}
