//! Test bus with a register model of a part. Time passes while the driver waits, and every kind of fault can be
//! simulated.

pub mod mpu_registers;
pub mod suite;

use afbc_drivers::{BusError, Driver, InertialReading, PartFault, PartTiming, Registers, SensorPart};
use afbc_types::Stamped;
use core::future::pending;
use embassy_futures::block_on;
use nalgebra::Vector3;
use std::cell::RefCell;
use std::rc::Rc;

/// Register model of a part, as in its data sheet.
pub trait Model {
    /// Reads consecutive registers.
    fn read(&mut self, now_us: u64, register: u8, into: &mut [u8]);
    /// Writes consecutive registers.
    fn write(&mut self, now_us: u64, register: u8, bytes: &[u8]);
    /// Loses everything, as after a brown-out.
    fn reset(&mut self, now_us: u64);
    /// Returns the time of the next interrupt after `now_us`; none if the pin is not set up.
    fn next_interrupt_us(&self, _now_us: u64) -> Option<u64> {
        None
    }
}

/// Simulated fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Trouble {
    /// Nothing.
    None,
    /// Every byte reads as this value: a broken wire or a dead part.
    Reads(u8),
    /// The bus reports errors.
    BusErrors,
    /// Transfers never end.
    Hangs,
    /// Each register repeats its last answer.
    Frozen,
    /// The part was reset.
    Reset,
    /// The interrupt does not come.
    NoInterrupt,
    /// One in this many transactions has a flipped bit in its answer.
    Flips(u32),
}

/// Faults that a driver must detect.
pub const NOTICED: [Trouble; 7] = [
    Trouble::Reads(0x00),
    Trouble::Reads(0xFF),
    Trouble::BusErrors,
    Trouble::Hangs,
    Trouble::Frozen,
    Trouble::Reset,
    Trouble::NoInterrupt,
];

struct World<M> {
    model: M,
    now_us: u64,
    trouble: Trouble,
    /// Time at which the fault ends by itself.
    ends_us: u64,
    answers: Vec<(u8, Vec<u8>)>,
    transactions: u32,
    random: u64,
    /// Time of the last interrupt.
    ready_us: Option<u64>,
}

impl<M> World<M> {
    /// Ends the fault when its time is over.
    fn pass(&mut self) {
        if self.now_us >= self.ends_us {
            self.trouble = Trouble::None;
        }
    }
}

/// Delay from an interrupt to the driver \[us\].
const LATENCY_US: u64 = 7;

/// Bus, interrupt and clock of a part.
pub struct Rig<M>(Rc<RefCell<World<M>>>);

impl<M> Clone for Rig<M> {
    fn clone(&self) -> Self {
        Rig(self.0.clone())
    }
}

impl<M: Model> Rig<M> {
    /// Creates a rig with a part.
    pub fn new(model: M) -> Self {
        let (now_us, trouble, answers) = (1_000, Trouble::None, Vec::new());
        Rig(Rc::new(RefCell::new(World {
            model,
            now_us,
            trouble,
            ends_us: u64::MAX,
            answers,
            transactions: 0,
            random: 7,
            ready_us: None,
        })))
    }

    /// Returns a driver for the part.
    pub fn driver<P: SensorPart>(&self, part: P) -> Driver<P, Rig<M>, Rig<M>> {
        Driver::new(part, self.clone(), self.clone())
    }

    /// Sets the fault from now on.
    pub fn set(&self, trouble: Trouble) {
        let mut world = self.0.borrow_mut();
        if trouble == Trouble::Reset {
            let now_us = world.now_us;
            world.model.reset(now_us);
        }
        (world.trouble, world.ends_us) = (trouble, u64::MAX);
    }

    /// Sets the fault for this time.
    pub fn set_for(&self, trouble: Trouble, us: u64) {
        self.set(trouble);
        let mut world = self.0.borrow_mut();
        world.ends_us = world.now_us + us;
    }

    /// Accesses the part's model.
    pub fn with<T>(&self, change: impl FnOnce(&mut M) -> T) -> T {
        change(&mut self.0.borrow_mut().model)
    }

    /// Returns the time \[us\].
    pub fn now_us(&self) -> u64 {
        self.0.borrow().now_us
    }
}

impl<M: Model> Registers for Rig<M> {
    async fn read(&mut self, register: u8, into: &mut [u8]) -> Result<(), BusError> {
        self.0.borrow_mut().pass();
        if self.0.borrow().trouble == Trouble::Hangs {
            return pending().await;
        }
        let mut world = self.0.borrow_mut();
        let World { model, now_us, trouble, answers, transactions, random, .. } = &mut *world;
        *now_us += 2 + into.len() as u64;
        *transactions += 1;
        let before = answers.iter_mut().find(|(of, answer)| *of == register && answer.len() == into.len());
        match (&trouble, before) {
            (Trouble::BusErrors, _) => return Err(BusError),
            (Trouble::Reads(byte), _) => into.fill(*byte),
            (Trouble::Frozen, Some((_, answer))) => into.copy_from_slice(answer),
            (_, before) => {
                model.read(*now_us, register, into);
                match before {
                    Some((_, answer)) => answer.copy_from_slice(into),
                    None => answers.push((register, into.to_vec())),
                }
                if let Trouble::Flips(one_in) = trouble
                    && *transactions % *one_in == 0
                {
                    *random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                    let bit = (*random >> 33) as usize % (8 * into.len());
                    into[bit / 8] ^= 1 << (bit % 8);
                }
            }
        }
        Ok(())
    }

    async fn write(&mut self, register: u8, bytes: &[u8]) -> Result<(), BusError> {
        self.0.borrow_mut().pass();
        if self.0.borrow().trouble == Trouble::Hangs {
            return pending().await;
        }
        let mut world = self.0.borrow_mut();
        let World { model, now_us, trouble, .. } = &mut *world;
        *now_us += 2 + bytes.len() as u64;
        match trouble {
            Trouble::BusErrors => return Err(BusError),
            Trouble::Reads(_) => (),
            _ => model.write(*now_us, register, bytes),
        }
        Ok(())
    }
}

impl<M: Model> PartTiming for Rig<M> {
    fn now_us(&self) -> u64 {
        self.0.borrow().now_us
    }

    async fn wait(&self, us: u32) {
        self.0.borrow_mut().now_us += u64::from(us);
    }

    async fn ready(&mut self, us: u32) -> bool {
        let mut world = self.0.borrow_mut();
        let limit_us = world.now_us + u64::from(us);
        let due_us = world.model.next_interrupt_us(world.now_us).filter(|_| world.trouble != Trouble::NoInterrupt);
        let due_us = due_us.filter(|due_us| *due_us <= limit_us);
        world.now_us = due_us.map_or(limit_us, |due_us| due_us + LATENCY_US);
        world.ready_us = due_us;
        due_us.is_some()
    }

    fn ready_us(&self) -> Option<u64> {
        self.0.borrow().ready_us
    }
}

/// Reads until this much time has passed; returns readings and faults.
pub fn run<P: SensorPart, M: Model>(
    driver: &mut Driver<P, impl Registers, Rig<M>>,
    rig: &Rig<M>,
    us: u64,
) -> (Vec<Stamped<P::Reading>>, Vec<PartFault>) {
    let (mut readings, mut faults) = (Vec::new(), Vec::new());
    let end_us = rig.now_us() + us;
    while rig.now_us() < end_us {
        match block_on(driver.reading()) {
            Ok(reading) => readings.push(reading),
            Err(fault) => faults.push(fault),
        }
    }
    (readings, faults)
}

/// Tries the faults of a table. The driver notices each fault within `notice_us`, and takes no answer of a part that
/// answers nothing for a reading. Within a second after the fault's end, the readings are right again. `interrupts` is
/// true if the part's interrupt is used. `right` tells a right reading.
fn survives_all_troubles<P: SensorPart, M: Model>(
    part: impl Fn() -> P,
    model: impl Fn() -> M,
    interrupts: bool,
    notice_us: u64,
    right: impl Fn(&P::Reading) -> bool,
) {
    for trouble in NOTICED {
        if trouble == Trouble::NoInterrupt && !interrupts {
            continue;
        }
        let rig = Rig::new(model());
        let mut driver = rig.driver(part());
        let (readings, faults) = run(&mut driver, &rig, 1_000_000);
        assert!(faults.is_empty(), "{}, healthy: {faults:?}", P::NAME);
        assert!(readings.len() >= 5 && readings.iter().all(|reading| right(&reading.value)), "{}, healthy", P::NAME);
        assert!(driver.works());

        rig.set(trouble);
        let (readings, faults) = run(&mut driver, &rig, notice_us);
        assert!(!faults.is_empty(), "{}: {trouble:?} is not noticed: {} readings", P::NAME, readings.len());
        if matches!(trouble, Trouble::Reads(_) | Trouble::BusErrors | Trouble::Hangs) {
            assert!(
                readings.iter().all(|reading| right(&reading.value)),
                "{}: {trouble:?} is taken for a reading",
                P::NAME
            );
        }
        let (_, faults) = run(&mut driver, &rig, 2_000_000);
        assert!(trouble == Trouble::Reset || !faults.is_empty() && !driver.works(), "{}: {trouble:?}", P::NAME);

        rig.set(Trouble::None);
        let _ = run(&mut driver, &rig, 1_000_000);
        let (readings, faults) = run(&mut driver, &rig, 500_000);
        assert!(faults.is_empty(), "{}: after {trouble:?}: {faults:?}", P::NAME);
        assert!(
            readings.len() >= 3 && readings.iter().all(|reading| right(&reading.value)),
            "{}: {trouble:?}",
            P::NAME
        );
    }
    // Not every flipped bit can be detected, but the driver must go on.
    for one_in in [3, 10, 100] {
        let rig = Rig::new(model());
        let mut driver = rig.driver(part());
        rig.set(Trouble::Flips(one_in));
        let _ = run(&mut driver, &rig, 5_000_000);
        rig.set(Trouble::None);
        let _ = run(&mut driver, &rig, 1_000_000);
        let (readings, faults) = run(&mut driver, &rig, 500_000);
        assert!(faults.is_empty() && readings.len() >= 3, "{}: after flips: {faults:?}", P::NAME);
    }
}

/// A part whose wire comes and goes reads again within 5 ms each time, and right; one that was reset meanwhile is set
/// up
/// again.
fn comes_back_at_once<P: SensorPart, M: Model>(
    part: impl Fn() -> P,
    model: impl Fn() -> M,
    right: impl Fn(&P::Reading) -> bool,
) {
    for trouble in [Trouble::Reads(0x00), Trouble::Reads(0xFF), Trouble::BusErrors, Trouble::Hangs] {
        let rig = Rig::new(model());
        let mut driver = rig.driver(part());
        let _ = run(&mut driver, &rig, 500_000);
        for silent_us in [5_000, 12_000, 20_000, 50_000, 90_000] {
            for _ in 0..3 {
                let back_us = rig.now_us() + silent_us;
                rig.set_for(trouble, silent_us);
                let (readings, _) = run(&mut driver, &rig, silent_us + 30_000);
                assert!(readings.iter().all(|reading| right(&reading.value)), "{}: {trouble:?}", P::NAME);
                let again: Vec<_> = readings.iter().filter(|reading| reading.at_us > back_us).collect();
                let late_us = again.first().expect("a reading").at_us - back_us;
                // A hanging transfer is given up after 10 ms.
                let most_us = if trouble == Trouble::Hangs { 15_000 } else { 5_000 };
                assert!(late_us < most_us, "{}: {trouble:?} for {silent_us} us: after {late_us} us", P::NAME);
                assert!(again.len() > 10, "{}: {trouble:?} for {silent_us} us: {}", P::NAME, again.len());
            }
        }
        rig.set(trouble);
        let _ = run(&mut driver, &rig, 50_000);
        rig.set(Trouble::Reset);
        rig.set(Trouble::None);
        let _ = run(&mut driver, &rig, 1_000_000);
        let (readings, faults) = run(&mut driver, &rig, 500_000);
        assert!(faults.is_empty() && readings.iter().all(|reading| right(&reading.value)), "{}: reset", P::NAME);
    }
}

/// Another part's answers are refused by name.
fn refuses_another<P: SensorPart, M: Model>(part: P, model: M, identity: u8) {
    let rig = Rig::new(model);
    let (readings, faults) = run(&mut rig.driver(part), &rig, 500_000);
    assert!(readings.is_empty() && faults.iter().all(|fault| *fault == PartFault::Identity(identity)), "{faults:?}");
}

/// True if an IMU's reading is this motion, within its noise.
pub fn reads(reading: &InertialReading, rates_deg_s: [f64; 3], force_g: [f64; 3], temperature_c: f64) -> bool {
    let rates_rad_s = Vector3::from(rates_deg_s).map(f64::to_radians).cast::<f32>();
    let force_m_s2 = (Vector3::from(force_g) * 9.80665).cast::<f32>();
    (reading.rates_rad_s - rates_rad_s).amax() < 5e-3
        && (reading.specific_force_m_s2 - force_m_s2).amax() < 0.06
        && (f64::from(reading.temperature_c) - temperature_c).abs() < 0.1
}

/// Returns repeatable noise from -1 to 1, which differs for each time and axis.
pub fn noise(now_us: u64, axis: u64) -> f64 {
    let x = (now_us.wrapping_mul(31) + axis).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    ((x ^ (x >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}
