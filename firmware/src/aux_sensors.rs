//! Passes readings of barometer, magnetometer, GNSS receiver and battery monitor to the estimator, and their state to
//! the ground stations.

use crate::samples::{self, SampleTime, SampleValue};
use afbc_comms::AuxSensors;
use afbc_comms::services::health::sensor;
use afbc_comms::services::origin::{EarthOrigin, Global};
use afbc_comms::services::status::{GnssReceiver, SensorBits};
use afbc_drivers::battery::{BatteryPins, BatteryScale};
use afbc_drivers::{GnssReading, MagneticReading, PressureReading};
use afbc_estimator::GeodeticOrigin;
use afbc_onboard::sensors::{FixFrame, field, height};
use afbc_types::Stamped;
use core::cell::RefCell;
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use nalgebra::Matrix3;

/// A sensor counts as failed after this time without a reading \[us\].
const SILENT_US: u64 = 2_000_000;

struct KnownAids {
    frame: FixFrame,
    origin: Option<EarthOrigin>,
    /// Newest epoch of the GNSS receiver and its time \[us\].
    receiver: Option<(u64, GnssReceiver)>,
    /// Time of the newest barometer reading \[us\].
    barometer: Option<u64>,
    magnetometer: Option<u64>,
    /// Newest battery reading: its time \[us\], the pin voltages and the board's scale for them.
    battery: Option<(u64, Option<BatteryPins>, BatteryScale)>,
}

static KNOWN: Mutex<CriticalSectionRawMutex, RefCell<KnownAids>> = Mutex::new(RefCell::new(KnownAids {
    frame: FixFrame::NEW,
    origin: None,
    receiver: None,
    barometer: None,
    magnetometer: None,
    battery: None,
}));

/// Runs `change` under the lock. `try_borrow_mut` succeeds, since nothing else borrows while the lock is held.
fn with<T>(change: impl FnOnce(&mut KnownAids) -> T) -> Option<T> {
    KNOWN.lock(|known| known.try_borrow_mut().ok().map(|mut known| change(&mut known)))
}

/// Passes on a barometer reading.
pub fn put_pressure(reading: &Stamped<PressureReading>) {
    let _ = with(|known| known.barometer = Some(reading.at_us));
    samples::put(SampleTime::At(reading.at_us), SampleValue::Aid(height(&reading.value)));
}

/// Passes on a magnetometer reading. `to_body` rotates the sensor's axes into the body's.
pub fn put_field(reading: &Stamped<MagneticReading>, to_body: &Matrix3<f32>) {
    let _ = with(|known| known.magnetometer = Some(reading.at_us));
    samples::put(SampleTime::At(reading.at_us), SampleValue::Aid(field(&reading.value, to_body)));
}

/// Passes on a GNSS fix, or `None` for an epoch without a fix.
pub fn put_fix(at_us: u64, fix: Option<GnssReading>) {
    let receiver = fix.map_or(GnssReceiver::NO_FIX, |fix| GnssReceiver {
        kind: GnssReceiver::FIX_3D,
        satellites: fix.satellites,
        sigma_mm: [fix.horizontal_sigma_m, fix.vertical_sigma_m].map(|sigma_m| (sigma_m * 1e3) as u32),
    });
    // The position is computed outside the lock, because positions are in double precision and the lock holds up all
    // interrupts. No other task changes the frame.
    let mut frame = with(|known| known.frame).unwrap_or(FixFrame::NEW);
    let measured = fix.and_then(|fix| Some((fix, frame.measure(&fix)?)));
    let first = measured.filter(|(_, (_, is_first))| *is_first).map(|(fix, _)| fix);
    let origin = first.and_then(|GnssReading { latitude_deg, longitude_deg, altitude_m, .. }| {
        EarthOrigin::new(Global { latitude_deg, longitude_deg, altitude_m })
    });
    let _ = with(|known| {
        known.frame = frame;
        known.receiver = Some((at_us, receiver));
        // Only the first fix yields an origin; later fixes must not clear it.
        if origin.is_some() {
            known.origin = origin;
        }
    });
    if let Some((_, (measurement, _))) = measured {
        samples::put(SampleTime::At(at_us), SampleValue::Aid(measurement));
    }
}

/// Returns the origin of the local frame, once a first fix has set it.
pub(crate) fn frame_origin() -> Option<GeodeticOrigin> {
    with(|known| known.frame.origin()).flatten()
}

/// Passes on the voltages at the battery's pins and the board's scale for them; `None` if the voltages cannot be a
/// battery's.
pub fn put_battery(at_us: u64, pins: Option<BatteryPins>, scale: BatteryScale) {
    let _ = with(|known| known.battery = Some((at_us, pins, scale)));
}

/// Returns the sensor state for ground stations at `now_us`. `told` has the vehicle's parameters for volts and amperes
/// at the battery per volt at the pins.
pub(crate) fn known(now_us: u64, told: [f32; 2]) -> AuxSensors {
    // The subtraction saturates, since a reading may be newer than the tick being reported.
    let works = |at_us: u64| now_us.saturating_sub(at_us) < SILENT_US;
    let aux = with(|known| {
        let mut sensors = SensorBits::default();
        for (at_us, bit) in [(known.barometer, sensor::BAROMETER), (known.magnetometer, sensor::MAGNETOMETER)] {
            sensors.present |= if at_us.is_some() { bit } else { 0 };
            sensors.healthy |= if at_us.is_some_and(works) { bit } else { 0 };
        }
        let receiver =
            known.receiver.map(|(at_us, receiver)| if works(at_us) { receiver } else { GnssReceiver::NO_FIX });
        let mut aux = AuxSensors { origin: known.origin, receiver, sensors, ..AuxSensors::default() };
        if let Some((at_us, pins, scale)) = known.battery {
            aux.put_battery(pins.filter(|_| works(at_us)).map(|pins| scale.changed(told).read(&pins)));
        }
        aux
    });
    aux.unwrap_or_default()
}
