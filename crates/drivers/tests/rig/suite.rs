//! Tests that every driver passes.

use super::{Model, Rig, comes_back_at_once, refuses_another, run, survives_all_troubles};
use afbc_drivers::{InertialReading, MagneticReading, PartFault, PressureReading, SensorPart};
use afbc_types::Stamped;
use nalgebra::Vector3;
use std::ops::RangeInclusive;

/// Source of the time of a part's readings.
#[derive(Debug)]
pub enum Pace {
    /// The part's interrupts. The fields are the time between two interrupts \[us\], and the smallest number of
    /// readings in the first second.
    Interrupts(u64, usize),
    /// The driver's own polling, with this number of readings in 10 s.
    Polled(RangeInclusive<usize>),
}

/// A driver, the model of its part, and what the two should do.
pub struct Suite<'a, P: SensorPart, M> {
    /// The driver.
    pub part: &'a dyn Fn() -> P,
    /// The part.
    pub model: &'a dyn Fn() -> M,
    /// Returns true if a reading is what the modelled part measures.
    pub right: fn(&P::Reading) -> bool,
    /// The longest that a fault may stay unnoticed \[us\].
    pub notice_us: u64,
    /// Other parts that the driver must refuse, and the identity by which it names each.
    pub others: Vec<(M, u8)>,
    /// Source and number of the readings.
    pub pace: Pace,
}

impl<P: SensorPart, M: Model> Suite<'_, P, M> {
    /// Every fault is noticed and survived, other parts are refused by name, and each reading is given once.
    pub fn passes(self) {
        let Suite { part, model, right, notice_us, others, pace } = self;
        survives_all_troubles(part, model, matches!(pace, Pace::Interrupts(..)), notice_us, right);
        for (other, identity) in others {
            refuses_another(part(), other, identity);
        }
        let rig = Rig::new(model());
        let mut driver = rig.driver(part());
        match pace {
            Pace::Interrupts(period_us, least) => {
                comes_back_at_once(part, model, right);
                let (readings, faults) = run(&mut driver, &rig, 1_000_000);
                let times: Vec<u64> = readings.iter().map(|reading| reading.at_us).collect();
                assert!(faults.is_empty() && times.len() > least, "{}: {}, {faults:?}", P::NAME, times.len());
                assert!(times.windows(2).all(|pair| pair[1] - pair[0] == period_us), "{}: not {period_us} us", P::NAME);
                assert!(times.iter().all(|at_us| at_us % period_us == 0), "{}: not the interrupts' times", P::NAME);
            }
            Pace::Polled(counts) => {
                let _ = run(&mut driver, &rig, 500_000);
                let (readings, faults) = run(&mut driver, &rig, 10_000_000);
                assert!(faults.is_empty() && counts.contains(&readings.len()), "{}: {}", P::NAME, readings.len());
            }
        }
    }
}

/// An IMU reads turns and forces of its whole range, and what is beyond as the end of it; and temperatures, with errors
/// up to that.
pub fn reads_the_whole_range<P: SensorPart<Reading = InertialReading>, M: Model>(
    part: P,
    model: M,
    set: impl Fn(&mut M, [f64; 3], [f64; 3], f64),
    (temperatures_c, error_c): ([f64; 4], f32),
) {
    let rig = Rig::new(model);
    let mut driver = rig.driver(part);
    let _ = run(&mut driver, &rig, 500_000);
    let motions = [(1990.0, 15.9), (-1990.0, -15.9), (2500.0, 15.0), (-1900.0, -20.0)];
    for ((rate, force), temperature_c) in motions.into_iter().zip(temperatures_c) {
        rig.with(|part| set(part, [rate; 3], [force; 3], temperature_c));
        let _ = run(&mut driver, &rig, 5_000);
        let (readings, _) = run(&mut driver, &rig, 10_000);
        let reading = readings.last().expect("readings").value;
        let [rate, force] = [rate.clamp(-2000.0, 2000.0).to_radians(), force.clamp(-16.0, 16.0) * 9.80665];
        let rates_rad_s = reading.rates_rad_s - Vector3::from_element(rate as f32);
        let force_m_s2 = reading.specific_force_m_s2 - Vector3::from_element(force as f32);
        assert!(rates_rad_s.amax() < 0.02 && force_m_s2.amax() < 0.05, "{}: {reading:?}", P::NAME);
        assert!((reading.temperature_c - temperature_c as f32).abs() < error_c, "{}: {reading:?}", P::NAME);
    }
}

/// A magnetometer reads these fields, and none beyond its range, after which it reads on.
pub fn reads_fields<P: SensorPart<Reading = MagneticReading>, M: Model>(
    part: P,
    model: M,
    set: impl Fn(&mut M, [f64; 3]),
    is_field: impl Fn(&MagneticReading, [f64; 3]) -> bool,
    [inside, beyond]: [&[[f64; 3]]; 2],
) {
    let rig = Rig::new(model);
    let mut driver = rig.driver(part);
    let mut reads = |field_ut, settles_us| {
        rig.with(|part| set(part, field_ut));
        let _ = run(&mut driver, &rig, settles_us);
        run(&mut driver, &rig, 500_000)
    };
    let is_right = |(readings, faults): (Vec<Stamped<MagneticReading>>, Vec<PartFault>), field_ut| {
        let is_right = readings.len() > 10 && readings.iter().all(|reading| is_field(&reading.value, field_ut));
        assert!(faults.is_empty() && is_right, "{}, {field_ut:?}: {readings:?}, {faults:?}", P::NAME);
    };
    let _ = reads(inside[0], 50_000);
    inside.iter().for_each(|field_ut| is_right(reads(*field_ut, 50_000), *field_ut));
    for &field_ut in beyond {
        let (readings, faults) = reads(field_ut, 50_000);
        assert!(readings.is_empty() && !faults.is_empty(), "{}, {field_ut:?}: {readings:?}", P::NAME);
        assert!(faults.iter().all(|fault| *fault == PartFault::Range), "{}, {field_ut:?}: {faults:?}", P::NAME);
        is_right(reads(inside[0], 300_000), inside[0]);
    }
}

/// A barometer reads these pressures \[Pa\] at these temperatures \[C\], with errors up to these and
/// at least so many readings in half a second.
pub fn reads_pressures<P: SensorPart<Reading = PressureReading>, M: Model>(
    part: impl Fn() -> P,
    model: impl Fn(f64, f64) -> M,
    points: &[(f64, f64)],
    [error_pa, error_c]: [f64; 2],
    least: usize,
) {
    for &(pressure_pa, temperature_c) in points {
        let rig = Rig::new(model(pressure_pa, temperature_c));
        let (readings, faults) = run(&mut rig.driver(part()), &rig, 500_000);
        let what = format!("{}, {pressure_pa} Pa, {temperature_c} C", P::NAME);
        assert!(readings.len() >= least && faults.is_empty(), "{what}: {faults:?}");
        for PressureReading { pressure_pa: pa, temperature_c: c } in readings.into_iter().map(|reading| reading.value) {
            assert!((f64::from(pa) - pressure_pa).abs() < error_pa, "{what}: {pa}");
            assert!((f64::from(c) - temperature_c).abs() < error_c, "{what}: {c}");
        }
    }
}

/// Beyond its range of pressures \[Pa\] and of -40 to 85 C, a barometer reads nothing.
pub fn reads_no_pressure_beyond<P: SensorPart<Reading = PressureReading>, M: Model>(
    part: impl Fn() -> P,
    model: impl Fn(f64, f64) -> M,
    [least_pa, most_pa]: [f64; 2],
) {
    for (pressure_pa, temperature_c) in [(least_pa, 25.0), (most_pa, 25.0), (1e5, -40.5), (1e5, 85.5)] {
        let rig = Rig::new(model(pressure_pa, temperature_c));
        let (readings, faults) = run(&mut rig.driver(part()), &rig, 500_000);
        assert!(readings.is_empty() && !faults.is_empty(), "{}: {readings:?}", P::NAME);
        assert!(faults.iter().all(|fault| *fault == PartFault::Range), "{}: {faults:?}", P::NAME);
    }
}
