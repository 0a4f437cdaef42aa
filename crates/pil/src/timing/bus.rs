//! Computes times on the buses of sensors and motors.

use afbc_drivers::{ScriptStep, SensorPart};
use afbc_flight_core::dshot::DshotRate;

/// Bits of a DSHOT frame, plus one without a pulse at the end.
const FRAME_BITS: u64 = 17;
/// Time of a DSHOT frame \[ns\].
pub(super) const FRAME_NS: u64 = (FRAME_BITS * 1_000_000_000).div_ceil(DshotRate::Dshot600 as u64);
/// Clock of I2C \[Hz\].
const I2C_HZ: u32 = 400_000;

/// Bus traffic of one reading of a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BusScript {
    /// Name of the part.
    pub part: &'static str,
    /// Bytes on the bus, including addresses.
    pub bytes: u64,
    /// Number of transfers.
    pub transfers: u64,
    /// Clock of the bus \[Hz\].
    pub clock_hz: u32,
    /// Time on the bus \[ns\].
    pub time_ns: u64,
}

/// Bus of a part.
#[derive(Clone, Copy, Debug)]
pub(super) enum BusKind {
    /// SPI with this input clock \[Hz\].
    Spi(u32),
    /// I2C.
    I2c,
}

/// Returns the fastest clock not above `most_hz` that a prescaler of 2, 4 ... 256 makes from `kernel_hz`; the slowest
/// clock if all are above.
#[must_use]
pub fn spi_clock_hz(kernel_hz: u32, most_hz: u32) -> u32 {
    (1..8).map(|power| kernel_hz >> power).find(|hz| *hz <= most_hz).unwrap_or(kernel_hz >> 8)
}

/// Returns the time of `bytes` over SPI \[ns\].
#[must_use]
pub fn spi_ns(bytes: u64, clock_hz: u32) -> u64 {
    (bytes * 8 * 1_000_000_000).div_ceil(clock_hz.into())
}

/// Returns the time of an I2C transfer \[ns\]. Each of the `bytes`, addresses included, takes nine bits. Each of the
/// `conditions` (start, repeated start, stop) takes one.
#[must_use]
pub fn i2c_ns(bytes: u64, conditions: u64) -> u64 {
    ((bytes * 9 + conditions) * 1_000_000_000).div_ceil(I2C_HZ.into())
}

/// Computes the bus traffic of one reading by the longest cycle of its driver. Adds one read of a register, with which
/// the driver asks whether the part is ready.
pub(super) fn script<P: SensorPart>(wire: BusKind) -> BusScript {
    let format = P::SPI;
    let clock_hz = match (wire, format) {
        (BusKind::Spi(kernel_hz), Some(format)) => spi_clock_hz(kernel_hz, format.clock_hz),
        _ => I2C_HZ,
    };
    let dummies = format.map_or(0, |format| format.dummies as u64);
    let mut script = BusScript { part: P::NAME, bytes: 0, transfers: 0, clock_hz, time_ns: 0 };
    let mut add = |data: u64, is_read: bool| {
        let (bytes, time_ns) = match wire {
            BusKind::Spi(_) => {
                let bytes = 1 + data + if is_read { dummies } else { 0 };
                (bytes, spi_ns(bytes, clock_hz))
            }
            // Every access sends an address and a register. A read sends the address again before the answer.
            BusKind::I2c => {
                let bytes = 2 + data + u64::from(is_read);
                (bytes, i2c_ns(bytes, 2 + u64::from(is_read)))
            }
        };
        script.bytes += bytes;
        script.transfers += 1;
        script.time_ns += time_ns;
    };
    for step in P::CYCLE {
        match *step {
            ScriptStep::Read(_, length) => add(length as u64, true),
            ScriptStep::Identify(..) | ScriptStep::Await(..) => add(1, true),
            ScriptStep::Set(..) | ScriptStep::Write(..) => add(1, false),
            ScriptStep::SetLike(..) => {
                add(1, true);
                add(1, false);
            }
            ScriptStep::WriteAll(_, bytes) => add(bytes.len() as u64, false),
            ScriptStep::Wait(_) | ScriptStep::Ready(_) => (),
        }
    }
    add(1, true);
    script
}
