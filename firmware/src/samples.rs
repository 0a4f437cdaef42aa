//! What the sensors have read, from the sampling task to the control tick.
//!
//! The task runs at a higher priority than the tick, so that a sample's time is that of its interrupt, and a transfer
//! from a sensor goes on while the tick runs. The tick takes what has arrived.

use crate::vehicle::Flight;
use afbc_calibration::RawSample;
use afbc_estimator::Measurement;
use afbc_onboard::{Aged, ImuPair, ImuSelector, RawReadings, Readings};
use core::cell::RefCell;
use core::future::ready;
use core::sync::atomic::{AtomicBool, Ordering};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use heapless::Deque;
use nalgebra::Vector3;

/// Measurements that wait, at most; a tick takes [`AIDS_MAX`](afbc_onboard::AIDS_MAX).
const WAITING: usize = 4;

/// When a sample was true.
#[derive(Clone, Copy, Debug)]
pub enum SampleTime {
    /// On the vehicle's clock ([`embassy_time::Instant`]) \[us\].
    At(u64),
    /// So long before the tick that takes it begins \[us\]: from a host in lockstep, which does not know the clock.
    BeforeTick(u32),
}

/// What a sensor has read.
#[derive(Clone, Copy, Debug)]
pub enum SampleValue {
    /// Rates \[rad/s\] and specific force \[m/s2\] in the sensor's axes.
    Imu([Vector3<f32>; 2]),
    /// A measurement of any other sensor.
    Aid(Measurement),
}

/// The sensors of a board.
pub trait Sampler {
    /// True if there are any.
    const SENSES: bool = true;
    /// True if there are two inertial sensors, of which one flies.
    const IS_REDUNDANT: bool = false;

    /// Reads them for ever, at a higher priority than the control tick, and [`put`]s what they have read.
    fn run(self) -> impl Future<Output = ()>;
}

/// The sensors of a board that has none: the state comes over the link.
pub struct NoSensors;

impl Sampler for NoSensors {
    const SENSES: bool = false;

    fn run(self) -> impl Future<Output = ()> {
        ready(())
    }
}

/// What has arrived since the last tick.
struct Arrived {
    /// Newest sample of the inertial sensor: a faster one's driver averages.
    imu: Option<(SampleTime, [Vector3<f32>; 2])>,
    aids: Deque<(SampleTime, Measurement), WAITING>,
}

static SELECTOR: Mutex<CriticalSectionRawMutex, RefCell<ImuSelector>> = Mutex::new(RefCell::new(ImuSelector::NEW));

static ARRIVED: Mutex<CriticalSectionRawMutex, RefCell<Arrived>> =
    Mutex::new(RefCell::new(Arrived { imu: None, aids: Deque::new() }));

/// True while samples are wanted, and what the sensors have read meanwhile.
static CALIBRATES: AtomicBool = AtomicBool::new(false);
static RAW: Mutex<CriticalSectionRawMutex, RefCell<RawReadings>> = Mutex::new(RefCell::new(RawReadings::NONE));

/// Puts what a sensor has read where the next tick takes it.
pub fn put(time: SampleTime, value: SampleValue) {
    ARRIVED.lock(|arrived| {
        // Not borrowed elsewhere while it is locked; no panic in any case.
        let Ok(mut arrived) = arrived.try_borrow_mut() else { return };
        match value {
            SampleValue::Imu(imu) => arrived.imu = Some((time, imu)),
            SampleValue::Aid(aid) => {
                if arrived.aids.is_full() {
                    // The oldest is worth least.
                    arrived.aids.pop_front();
                }
                // There is room now.
                let _ = arrived.aids.push_back((time, aid));
            }
        }
    });
}

/// Puts a sample of the first of two inertial sensors, in the body's axes; [`ImuSelector`] says which flies.
pub fn put_first_imu(at_us: u64, sample: [Vector3<f32>; 2]) {
    put_selected(at_us, |selector| selector.take_first(at_us, sample));
}

/// Puts a sample of the second.
pub fn put_second_imu(at_us: u64, sample: [Vector3<f32>; 2]) {
    put_selected(at_us, |selector| selector.take_second(at_us, sample));
}

fn put_selected(at_us: u64, select: impl FnOnce(&mut ImuSelector) -> Option<[Vector3<f32>; 2]>) {
    let flies = SELECTOR.lock(|selector| selector.try_borrow_mut().ok().and_then(|mut selector| select(&mut selector)));
    if let Some(sample) = flies {
        put(SampleTime::At(at_us), SampleValue::Imu(sample));
    }
}

/// Cross-checks two inertial sensors after a tick that took these readings. Out of line, so that the tick's
/// stack and instructions stay as they are counted.
#[inline(never)]
pub(crate) fn cross_check(flight: &Flight, readings: &Readings) {
    SELECTOR.lock(|selector| {
        selector.try_borrow_mut().ok().map(|mut selector| flight.cross_check(&mut selector, readings))
    });
}

/// Returns which of two inertial sensors flies at `now_us`, and which work.
pub(crate) fn imu_pair(now_us: u64) -> ImuPair {
    SELECTOR.lock(|selector| selector.try_borrow().map(|selector| selector.pair(now_us)).unwrap_or_default())
}

/// Returns the next sample for a calibration or a station; collects readings, or not, from now on.
pub(crate) fn raw(collects: bool) -> Option<RawSample> {
    let collected = CALIBRATES.swap(collects, Ordering::Relaxed);
    RAW.lock(|raw| {
        let mut raw = raw.try_borrow_mut().ok().filter(|_| collects)?;
        if !collected {
            // What is left of an earlier calibration is not of this one.
            *raw = RawReadings::NONE;
        }
        raw.take()
    })
}

/// Adds the readings of a tick to what a calibration takes.
#[cold]
#[inline(never)]
fn collect(now_us: u64, readings: &Readings) {
    RAW.lock(|raw| raw.try_borrow_mut().ok().map(|mut raw| raw.add(now_us, readings)));
}

/// Sets `readings` to what has arrived, for a tick that begins at `now_us`; further measurements wait for the next one.
pub(crate) fn take(now_us: u64, readings: &mut Readings) {
    readings.clear();
    ARRIVED.lock(|arrived| {
        let Ok(mut arrived) = arrived.try_borrow_mut() else { return };
        if let Some((time, value)) = arrived.imu.take() {
            readings.imu = Some(Aged { value, age_us: time.age_us(now_us) });
        }
        for slot in &mut readings.aids {
            let Some((time, value)) = arrived.aids.pop_front() else { break };
            *slot = Some(Aged { value, age_us: time.age_us(now_us) });
        }
    });
    if CALIBRATES.load(Ordering::Relaxed) {
        collect(now_us, readings);
    }
}

impl SampleTime {
    /// Returns the age at `now_us`.
    fn age_us(self, now_us: u64) -> u32 {
        match self {
            // Sampling interrupts the tick, so that a sample may be newer than its beginning: the age is 0 then.
            SampleTime::At(at_us) => now_us.saturating_sub(at_us).try_into().unwrap_or(u32::MAX),
            SampleTime::BeforeTick(age_us) => age_us,
        }
    }
}
