//! Content of a board's parameter flash in which some parameters are already set.

use afbc_store::{Ram, RecordName, Store, hash};
use embedded_storage::nor_flash::ReadNorFlash;
use std::error::Error;

/// Bytes of a sector as the store counts them, and name of the images' vehicle.
const SECTOR: usize = 16 * 1024;
const VEHICLE: &[u8] = b"paper";

/// Value of `MOT_PROTOCOL` for PWM at 400 Hz.
pub const PWM400: f32 = 4.0;

/// Returns the content of a flash in which parameters have these values. A word of 4 bytes takes `stride` bytes of the
/// chip's flash, the rest of which stays erased.
pub fn parameters(values: &[(&str, f32)], stride: usize) -> Result<Vec<u8>, Box<dyn Error>> {
    let mut changes = ParameterFlash::new()?;
    for (name, value) in values {
        changes.set(name, *value)?;
    }
    changes.bytes(stride)
}

/// Store in which parameters are set one after another.
pub struct ParameterFlash(Store<Ram<SECTOR>>);

impl ParameterFlash {
    /// Creates an empty store.
    pub fn new() -> Result<Self, Box<dyn Error>> {
        let mut store = Store::open(Ram::<SECTOR>::BLANK, 0, hash(VEHICLE)).map_err(|error| error.reason())?;
        store.make_room().map_err(|error| error.reason())?;
        Ok(ParameterFlash(store))
    }

    /// Sets a parameter.
    pub fn set(&mut self, name: &str, value: f32) -> Result<(), Box<dyn Error>> {
        let name = RecordName::new(name).ok_or("a name")?;
        Ok(self.0.set(name, 0, Some(value.to_bits())).map_err(|error| error.reason())?)
    }

    /// Returns the content of the flash, with `stride` bytes per word of 4 bytes.
    pub fn bytes(self, stride: usize) -> Result<Vec<u8>, Box<dyn Error>> {
        let mut bytes = vec![0; 2 * SECTOR];
        self.0.into_flash().read(0, &mut bytes).map_err(|error| format!("{error:?}"))?;
        let words = bytes.as_chunks::<4>().0.iter();
        Ok(words.flat_map(|word| word.iter().copied().chain(std::iter::repeat_n(0xFF, stride - 4))).collect())
    }
}
