//! Readings of the sensors, passed from the sampling tasks to the control tick.
//!
//! The sampling task runs at a higher priority than the tick. A sample is therefore stamped at its interrupt, and
//! transfers from a sensor go on while the tick runs.

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

/// Number of measurements that can wait; a tick takes [`AIDS_MAX`](afbc_onboard::AIDS_MAX).
const WAITING: usize = 4;

/// Time of a sample.
#[derive(Clone, Copy, Debug)]
pub enum SampleTime {
    /// Time on the vehicle's clock ([`embassy_time::Instant`]) \[us\].
    At(u64),
    /// Age when the tick that takes the sample begins \[us\]. Used by a lockstep host, which does not know the
    /// vehicle's clock.
    BeforeTick(u32),
}

/// Reading of a sensor.
#[derive(Clone, Copy, Debug)]
pub enum SampleValue {
    /// Rates \[rad/s\] and specific force \[m/s2\] in the sensor's axes.
    Imu([Vector3<f32>; 2]),
    /// A measurement of any other sensor.
    Aid(Measurement),
}

/// Sensors of a board.
pub trait Sampler {
    /// True if there are sensors.
    const SENSES: bool = true;
    /// True if there are two inertial sensors, one of which is selected for flight.
    const IS_REDUNDANT: bool = false;

    /// Reads the sensors for ever, and passes each reading to [`put`].
    fn run(self) -> impl Future<Output = ()>;
}

/// Stand-in for a board without sensors, whose state comes over the link.
pub struct NoSensors;

impl Sampler for NoSensors {
    const SENSES: bool = false;

    fn run(self) -> impl Future<Output = ()> {
        ready(())
    }
}

/// Readings that have arrived since the last tick.
struct Arrived {
    /// Newest sample of the inertial sensor. The driver of a faster sensor averages its samples.
    imu: Option<(SampleTime, [Vector3<f32>; 2])>,
    aids: Deque<(SampleTime, Measurement), WAITING>,
}

static SELECTOR: Mutex<CriticalSectionRawMutex, RefCell<ImuSelector>> = Mutex::new(RefCell::new(ImuSelector::NEW));

static ARRIVED: Mutex<CriticalSectionRawMutex, RefCell<Arrived>> =
    Mutex::new(RefCell::new(Arrived { imu: None, aids: Deque::new() }));

/// True while raw samples are wanted, and the readings collected meanwhile.
static CALIBRATES: AtomicBool = AtomicBool::new(false);
static RAW: Mutex<CriticalSectionRawMutex, RefCell<RawReadings>> = Mutex::new(RefCell::new(RawReadings::NONE));

/// Stores a reading for the next tick.
pub fn put(time: SampleTime, value: SampleValue) {
    ARRIVED.lock(|arrived| {
        // `try_borrow_mut` succeeds, since nothing else borrows while the lock is held.
        let Ok(mut arrived) = arrived.try_borrow_mut() else { return };
        match value {
            SampleValue::Imu(imu) => arrived.imu = Some((time, imu)),
            SampleValue::Aid(aid) => {
                if arrived.aids.is_full() {
                    // Drops the oldest measurement, which is worth least.
                    arrived.aids.pop_front();
                }
                let _ = arrived.aids.push_back((time, aid));
            }
        }
    });
}

/// Stores a sample of the first of two inertial sensors, in body axes; [`ImuSelector`] selects the sensor that flies.
pub fn put_first_imu(at_us: u64, sample: [Vector3<f32>; 2]) {
    put_selected(at_us, |selector| selector.take_first(at_us, sample));
}

/// Stores a sample of the second inertial sensor.
pub fn put_second_imu(at_us: u64, sample: [Vector3<f32>; 2]) {
    put_selected(at_us, |selector| selector.take_second(at_us, sample));
}

fn put_selected(at_us: u64, select: impl FnOnce(&mut ImuSelector) -> Option<[Vector3<f32>; 2]>) {
    let flies = SELECTOR.lock(|selector| selector.try_borrow_mut().ok().and_then(|mut selector| select(&mut selector)));
    if let Some(sample) = flies {
        put(SampleTime::At(at_us), SampleValue::Imu(sample));
    }
}

/// Cross-checks two inertial sensors after a tick that used `readings`. It is not inlined, so that it is not counted in
/// the tick's stack and instructions.
#[inline(never)]
pub(crate) fn cross_check(flight: &Flight, readings: &Readings) {
    SELECTOR.lock(|selector| {
        selector.try_borrow_mut().ok().map(|mut selector| flight.cross_check(&mut selector, readings))
    });
}

/// Returns which of two inertial sensors is selected at `now_us`, and which of them work.
pub(crate) fn imu_pair(now_us: u64) -> ImuPair {
    SELECTOR.lock(|selector| selector.try_borrow().map(|selector| selector.pair(now_us)).unwrap_or_default())
}

/// Returns the next raw sample for a calibration or a station. `collects` turns collecting on or off from now on.
pub(crate) fn raw(collects: bool) -> Option<RawSample> {
    let collected = CALIBRATES.swap(collects, Ordering::Relaxed);
    RAW.lock(|raw| {
        let mut raw = raw.try_borrow_mut().ok().filter(|_| collects)?;
        if !collected {
            // Discards readings left over from an earlier calibration.
            *raw = RawReadings::NONE;
        }
        raw.take()
    })
}

/// Adds the readings of a tick to the raw readings for a calibration.
#[cold]
#[inline(never)]
fn collect(now_us: u64, readings: &Readings) {
    RAW.lock(|raw| raw.try_borrow_mut().ok().map(|mut raw| raw.add(now_us, readings)));
}

/// Moves the stored readings into `readings` for a tick that begins at `now_us`. Measurements beyond
/// [`AIDS_MAX`](afbc_onboard::AIDS_MAX) wait for the next tick.
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
    /// Returns the age at `now_us` \[us\].
    fn age_us(self, now_us: u64) -> u32 {
        match self {
            // Sampling interrupts the tick, so a sample may be newer than the tick's beginning; its age is then 0.
            SampleTime::At(at_us) => now_us.saturating_sub(at_us).try_into().unwrap_or(u32::MAX),
            SampleTime::BeforeTick(age_us) => age_us,
        }
    }
}
