//! Reads the bytes that the image sends over USB. The models have no USB bus. The bytes are therefore taken from the
//! ring buffer in RAM where they wait for the port (`chip_stm32::usb`), as the USB task would take them.

use object::{Object, ObjectSymbol};
use rigless::emulator::Host;
use rigless::soc::Width;
use std::error::Error;
use std::path::Path;

/// Part of the ring buffer's symbol name in the image.
const NAME: &str = "chip_stm323usb4SENT";
/// Number of words after the ring's bytes: the state of an `embassy_sync::pipe::Pipe` without waiting tasks. If its
/// content begins at the start, all words are zero except the content's end.
const WORDS: u64 = 8;
const LENGTH: u64 = 1024;

/// Ring buffer, and the bytes taken from it.
#[derive(Debug)]
pub struct UsbRing {
    address: u64,
    pub bytes: Vec<u8>,
}

impl UsbRing {
    /// Finds the ring buffer in an image.
    pub fn find(image: &Path) -> Result<Self, Box<dyn Error>> {
        let file = std::fs::read(image)?;
        let file = object::File::parse(file.as_slice())?;
        let is_ring = |name: &str| name.contains(NAME);
        let ring = file.symbols().find(|symbol| symbol.name().is_ok_and(is_ring)).ok_or("the image has no USB")?;
        if ring.size() != 4 * WORDS + LENGTH {
            return Err("the image's USB ring has another layout than expected".into());
        }
        Ok(UsbRing { address: ring.address(), bytes: Vec::new() })
    }

    /// Empties the ring buffer, unless the image is just writing to it.
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
