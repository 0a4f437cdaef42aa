//! Barometer, magnetometer, GNSS receiver and battery: their readings as measurements, and what stations are to know of
//! them.

use crate::samples::{self, SampleTime, SampleValue};
use afbc_drivers::battery::{BatteryPins, BatteryScale};
use afbc_drivers::{FixReading, MagneticReading, PressureReading};
use afbc_estimator::Origin;
use afbc_onboard::sensors::{FixFrame, field, height};
use afbc_station::AuxSensors;
use afbc_station::services::health::sensor;
use afbc_station::services::origin::{EarthOrigin, Global};
use afbc_station::services::status::{GnssReceiver, SensorBits};
use afbc_types::Stamped;
use core::cell::RefCell;
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use nalgebra::Matrix3;

/// Time without a reading after which a sensor has failed \[us\].
const SILENT_US: u64 = 2_000_000;

struct Known {
    frame: FixFrame,
    origin: Option<EarthOrigin>,
    /// Newest epoch of the receiver, with its time \[us\].
    receiver: Option<(u64, GnssReceiver)>,
    /// Time of the newest reading \[us\].
    barometer: Option<u64>,
    magnetometer: Option<u64>,
    /// Newest reading, with its time \[us\] and the board's own scale.
    battery: Option<(u64, Option<BatteryPins>, BatteryScale)>,
}

static KNOWN: Mutex<CriticalSectionRawMutex, RefCell<Known>> = Mutex::new(RefCell::new(Known {
    frame: FixFrame::NEW,
    origin: None,
    receiver: None,
    barometer: None,
    magnetometer: None,
    battery: None,
}));

/// Not borrowed elsewhere while it is locked; no panic in any case.
fn with<T>(change: impl FnOnce(&mut Known) -> T) -> Option<T> {
    KNOWN.lock(|known| known.try_borrow_mut().ok().map(|mut known| change(&mut known)))
}

/// Puts what a barometer has read.
pub fn put_pressure(reading: &Stamped<PressureReading>) {
    let _ = with(|known| known.barometer = Some(reading.at_us));
    samples::put(SampleTime::At(reading.at_us), SampleValue::Aid(height(&reading.value)));
}

/// Puts what a magnetometer has read, whose axes `to_body` turns into the body's.
pub fn put_field(reading: &Stamped<MagneticReading>, to_body: &Matrix3<f32>) {
    let _ = with(|known| known.magnetometer = Some(reading.at_us));
    samples::put(SampleTime::At(reading.at_us), SampleValue::Aid(field(&reading.value, to_body)));
}

/// Puts a GNSS receiver's fix; none for an epoch without one.
pub fn put_fix(at_us: u64, fix: Option<FixReading>) {
    let receiver = fix.map_or(GnssReceiver::NO_FIX, |fix| GnssReceiver {
        kind: GnssReceiver::FIX_3D,
        satellites: fix.satellites,
        sigma_mm: [fix.horizontal_sigma_m, fix.vertical_sigma_m].map(|sigma_m| (sigma_m * 1e3) as u32),
    });
    // Computed outside the lock, which all interrupts wait for: places are in double precision. Nobody else has fixes.
    let mut frame = with(|known| known.frame).unwrap_or(FixFrame::NEW);
    let measured = fix.and_then(|fix| Some((fix, frame.measure(&fix)?)));
    let first = measured.filter(|(_, (_, is_first))| *is_first).map(|(fix, _)| fix);
    let origin = first.and_then(|FixReading { latitude_deg, longitude_deg, altitude_m, .. }| {
        EarthOrigin::new(Global { latitude_deg, longitude_deg, altitude_m })
    });
    let _ = with(|known| {
        known.frame = frame;
        known.receiver = Some((at_us, receiver));
        // Of the first fix alone: later ones must not take it away.
        if origin.is_some() {
            known.origin = origin;
        }
    });
    if let Some((_, (measurement, _))) = measured {
        samples::put(SampleTime::At(at_us), SampleValue::Aid(measurement));
    }
}

/// Returns the place from which fixes are measured, once there is one.
pub(crate) fn frame_origin() -> Option<Origin> {
    with(|known| known.frame.origin()).flatten()
}

/// Puts what a battery's pins have read, which mean `scale` on this board; none if it is none of a battery.
pub fn put_battery(at_us: u64, pins: Option<BatteryPins>, scale: BatteryScale) {
    let _ = with(|known| known.battery = Some((at_us, pins, scale)));
}

/// Returns what stations are to know at `now_us`, where the vehicle's parameters tell these volts and amperes per volt
/// at the battery's pins.
pub(crate) fn known(now_us: u64, told: [f32; 2]) -> AuxSensors {
    // Saturating: a reading may be newer than the tick that stations are told of.
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
