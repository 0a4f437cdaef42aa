//! All instruments together: random streams, presets, refusals, failures.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, clippy::float_cmp, missing_docs)] // tests

use crate::common;
use afbc_plant::instruments::{
    BarometerModel, FailureKind, GnssModel, GyroscopeModel, ImuModel, InstrumentFault, MagnetometerModel, Preset,
    TrackerModel,
};
use afbc_plant::{InstrumentReadings, InstrumentSuite, MeasurementDropouts, SimulatedInstruments, Truth};
use afbc_types::{Declared, Mounting};
use common::{STEP_S, rest, run, run_with};
use nalgebra::{Quaternion, Vector3};

/// Returns all instruments with every random property.
fn all() -> InstrumentSuite {
    let often = MeasurementDropouts { rate_hz: 2.0, mean_s: 0.1 };
    let mut imu = ImuModel::MPU_6000;
    (imu.gyro.vibration_rad_s, imu.accel.vibration_m_s2) = (0.1, 2.0);
    InstrumentSuite {
        imu: Some(imu),
        tracker: Some(TrackerModel {
            outliers: 0.05,
            stamp_noise_s: 1e-4,
            loss: often,
            freeze: often,
            ..TrackerModel::MOCAP_100
        }),
        gnss: Some(GnssModel { loss: often, ..GnssModel::M10 }),
        barometer: Some(BarometerModel { offset_m: 1.0, ..BarometerModel::BMP388 }),
        magnetometer: Some(MagnetometerModel::IST8310),
    }
}

/// Returns a climbing, turning motion.
fn moving(k: u32) -> Truth {
    let t = f64::from(k) * STEP_S;
    let attitude = Quaternion::new((0.2 * t).cos(), 0.0, 0.0, (0.2 * t).sin());
    Truth { position_m: Vector3::new(t, 0.5 * t, 1.0 + t), rates_rad_s: Vector3::z() * 0.4, attitude, ..rest() }
}

#[test]
fn the_same_seed_measures_the_same() {
    let of = |seed| run(all(), seed, 2000, moving);
    assert_eq!(of(7), of(7));
    let (one, other) = (of(7), of(8));
    let differ = |part: fn(&InstrumentReadings) -> String| one.iter().map(part).ne(other.iter().map(part));
    assert!(differ(|r| format!("{:?}", r.imu)) && differ(|r| format!("{:?}", r.tracker)));
    assert!(differ(|r| format!("{:?}", r.gnss)) && differ(|r| format!("{:?}", r.barometer)));
    assert!(differ(|r| format!("{:?}", r.magnetometer)));
}

/// An instrument reads the same alone, with all others, and while those fail.
#[test]
fn no_instrument_changes_another_ones_readings() {
    let (suite, none) = (all(), InstrumentSuite::default());
    let together = run(suite, 7, 3000, moving);
    let alone = [
        run(InstrumentSuite { imu: suite.imu, ..none }, 7, 3000, moving),
        run(InstrumentSuite { tracker: suite.tracker, ..none }, 7, 3000, moving),
        run(InstrumentSuite { gnss: suite.gnss, ..none }, 7, 3000, moving),
        run(InstrumentSuite { barometer: suite.barometer, ..none }, 7, 3000, moving),
        run(InstrumentSuite { magnetometer: suite.magnetometer, ..none }, 7, 3000, moving),
    ];
    for (k, all) in together.iter().enumerate() {
        let [imu, tracker, gnss, barometer, magnetometer] = alone.each_ref().map(|readings| &readings[k]);
        assert_eq!((all.imu, &all.tracker), (imu.imu, &tracker.tracker));
        assert_eq!((&all.gnss, &all.barometer), (&gnss.gnss, &barometer.barometer));
        assert_eq!(all.magnetometer, magnetometer.magnetometer);
    }
    let noisy = FailureKind::ImuNoisy { rates_rad_s: 1.0, specific_force_m_s2: 1.0 };
    let failing = run_with(suite, &[fault(noisy)], 7, 3000, moving);
    assert!(together.iter().zip(&failing).all(|(a, b)| a.tracker == b.tracker && a.gnss == b.gnss));
}

/// Flights are reproduced by seed, also by later versions: these bits must never change.
#[test]
fn readings_never_change() {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut add = |value: f64| hash = (hash ^ value.to_bits()).wrapping_mul(0x0100_0000_01b3);
    for readings in run(all(), 2026, 5000, moving) {
        let imu = readings.imu.unwrap();
        imu.rates_rad_s.iter().chain(&imu.specific_force_m_s2).copied().for_each(&mut add);
        for fix in readings.tracker {
            fix.position_m.iter().chain(&fix.attitude.coords).copied().for_each(&mut add);
        }
        for fix in readings.gnss {
            fix.position_m.iter().chain(&fix.velocity_m_s).copied().for_each(&mut add);
        }
        readings.barometer.iter().for_each(|fix| add(fix.height_m));
        readings.magnetometer.iter().for_each(|fix| fix.field_ut.iter().copied().for_each(&mut add));
    }
    assert_eq!(hash, HASH, "{hash:#x}");
}

const HASH: u64 = 0xd1cd_1699_d4e2_2aba;

/// Every preset is valid, has a unique name, and differs from a perfect instrument.
#[test]
fn presets_are_accepted() {
    fn check<T: Declared + Default + PartialEq + core::fmt::Debug>(presets: &[Preset<T>]) -> Vec<&'static str> {
        for preset in presets {
            preset.settings.validate().unwrap();
            assert_ne!(preset.settings, T::default(), "{}", preset.name);
        }
        presets.iter().map(|preset| preset.name).collect()
    }
    assert_eq!(check(&ImuModel::PRESETS), ["icm-42688-p", "bmi270", "mpu-6000"]);
    assert_eq!(check(&TrackerModel::PRESETS), ["mocap-100"]);
    assert_eq!(check(&GnssModel::PRESETS), ["m10"]);
    assert_eq!(check(&BarometerModel::PRESETS), ["dps310", "bmp388"]);
    assert_eq!(check(&MagnetometerModel::PRESETS), ["ist8310", "qmc5883l"]);
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    let refused = |suite: InstrumentSuite| SimulatedInstruments::new(&suite, &[], 1, STEP_S).unwrap_err().range.name;
    let none = InstrumentSuite::default();
    let imu = |imu| refused(InstrumentSuite { imu: Some(imu), ..none });
    assert_eq!(
        imu(ImuModel { gyro: GyroscopeModel { scale: 0.2, ..GyroscopeModel::DEFAULT }, ..ImuModel::DEFAULT }),
        "scale"
    );
    let far = Mounting { position_m: Vector3::repeat(20.0), ..Mounting::DEFAULT };
    assert_eq!(imu(ImuModel { mounting: far, ..ImuModel::DEFAULT }), "position_m");
    assert_eq!(
        refused(InstrumentSuite { tracker: Some(TrackerModel { rate_hz: 0.0, ..TrackerModel::DEFAULT }), ..none }),
        "rate_hz"
    );
    assert_eq!(
        refused(InstrumentSuite { gnss: Some(GnssModel { reported: f64::NAN, ..GnssModel::DEFAULT }), ..none }),
        "reported"
    );
    let washed = BarometerModel { wash_height_m: 0.0, ..BarometerModel::DEFAULT };
    assert_eq!(refused(InstrumentSuite { barometer: Some(washed), ..none }), "wash_height_m");
    let steep = MagnetometerModel { inclination_rad: 2.0, ..MagnetometerModel::DEFAULT };
    assert_eq!(refused(InstrumentSuite { magnetometer: Some(steep), ..none }), "inclination_rad");
    assert_eq!(SimulatedInstruments::new(&none, &[], 1, 0.0).unwrap_err().range.name, "step_s");
    let bad = fault(FailureKind::ImuClipped { rates_rad_s: -1.0, specific_force_m_s2: 1.0 });
    assert_eq!(SimulatedInstruments::new(&none, &[bad], 1, STEP_S).unwrap_err().range.name, "rates_rad_s");
    let late = InstrumentFault { start_s: f64::NAN, ..fault(FailureKind::ImuDead) };
    assert_eq!(SimulatedInstruments::new(&none, &[late], 1, STEP_S).unwrap_err().range.name, "start_s");
}

/// Returns a fault from step 1000 to step 2000.
fn fault(failure: FailureKind) -> InstrumentFault {
    InstrumentFault { failure, start_s: 1.0, end_s: 2.0, rise_s: 0.0 }
}

/// Returns true if the fault affects a measurement taken at this time.
fn acts(time_s: f64) -> bool {
    (0.9999..1.9999).contains(&time_s)
}

/// Compares readings of perfect, immediate instruments without and with a failure, step by step.
fn compare(failure: FailureKind, mut check: impl FnMut(u32, &InstrumentReadings, &InstrumentReadings)) {
    let suite = InstrumentSuite {
        imu: Some(ImuModel::DEFAULT),
        tracker: Some(TrackerModel::DEFAULT),
        gnss: Some(GnssModel::DEFAULT),
        barometer: Some(BarometerModel { noise_m: 0.1, ..BarometerModel::DEFAULT }),
        magnetometer: Some(MagnetometerModel::DEFAULT),
    };
    let turning = |k: u32| Truth {
        rates_rad_s: Vector3::new(0.001, 0.002, -0.003) * f64::from(k),
        acceleration_m_s2: Vector3::repeat(0.001) * f64::from(k),
        ..moving(k)
    };
    let (well, ill) = (run(suite, 1, 3000, turning), run_with(suite, &[fault(failure)], 1, 3000, turning));
    for (k, (well, ill)) in (0..).zip(well.iter().zip(&ill)) {
        let now = acts(f64::from(k) * STEP_S);
        if !now {
            assert_eq!(well, ill, "{failure:?}, step {k}");
        }
        check(if now { k } else { 0 }, well, ill);
    }
}

#[test]
fn the_inertial_sensor_fails_as_declared() {
    let mut before = None;
    compare(FailureKind::ImuStuck, |k, well, ill| {
        if k == 0 {
            before = well.imu;
        } else {
            let (before, stuck) = (before.unwrap(), ill.imu.unwrap());
            assert_eq!(before.rates_rad_s, stuck.rates_rad_s);
            assert_eq!(before.specific_force_m_s2, stuck.specific_force_m_s2);
            assert_eq!(stuck.at_s, well.imu.unwrap().at_s);
        }
    });
    compare(FailureKind::ImuDead, |k, _, ill| assert!(k == 0 || ill.imu.is_none()));
    let (mut rates, mut force) = (Vec::new(), Vec::new());
    compare(FailureKind::ImuNoisy { rates_rad_s: 0.5, specific_force_m_s2: 7.0 }, |k, well, ill| {
        if k > 0 {
            let (well, ill) = (well.imu.unwrap(), ill.imu.unwrap());
            rates.push(ill.rates_rad_s - well.rates_rad_s);
            force.push(ill.specific_force_m_s2 - well.specific_force_m_s2);
        }
    });
    common::assert_sigma(&common::coordinates(rates), 0.5, "rates");
    common::assert_sigma(&common::coordinates(force), 7.0, "force");
    compare(FailureKind::ImuClipped { rates_rad_s: 2.0, specific_force_m_s2: 5.0 }, |k, well, ill| {
        if k > 0 {
            let (well, ill) = (well.imu.unwrap(), ill.imu.unwrap());
            assert_eq!(ill.rates_rad_s, well.rates_rad_s.map(|rate| rate.clamp(-2.0, 2.0)));
            assert_eq!(ill.specific_force_m_s2, well.specific_force_m_s2.map(|force| force.clamp(-5.0, 5.0)));
        }
    });
    let (rates_bias_rad_s, force_bias_m_s2) = (Vector3::new(0.1, 0.2, 0.3), Vector3::new(-1.0, 0.0, 2.0));
    compare(FailureKind::ImuBiased { rates_bias_rad_s, force_bias_m_s2 }, |k, well, ill| {
        if k > 0 {
            let (well, ill) = (well.imu.unwrap(), ill.imu.unwrap());
            assert_eq!(ill.rates_rad_s, well.rates_rad_s + rates_bias_rad_s);
            assert_eq!(ill.specific_force_m_s2, well.specific_force_m_s2 + force_bias_m_s2);
        }
    });
}

#[test]
fn the_tracker_and_the_receiver_fail_as_declared() {
    compare(FailureKind::TrackerLost, |k, _, ill| assert!(k == 0 || ill.tracker.is_empty()));
    let mut before = None;
    compare(FailureKind::TrackerFrozen, |k, well, ill| {
        for (well, ill) in well.tracker.iter().zip(&ill.tracker) {
            if k == 0 {
                before = Some(*well);
            } else {
                let held = before.unwrap();
                assert_eq!((held.position_m, held.attitude), (ill.position_m, ill.attitude));
                assert_eq!(ill.true_at_s, well.true_at_s);
            }
        }
    });
    let by_m = Vector3::new(1.0, 2.0, 3.0);
    let mut seen = 0;
    compare(FailureKind::TrackerJumped { by_m, yaw_rad: core::f64::consts::FRAC_PI_2 }, |k, well, ill| {
        for (well, ill) in well.tracker.iter().zip(&ill.tracker).filter(|_| k > 0) {
            seen += 1;
            let p = well.position_m;
            assert!((ill.position_m - by_m - Vector3::new(-p.y, p.x, p.z)).norm() < 1e-12);
            let half = core::f64::consts::FRAC_PI_4;
            let expected = Quaternion::new(half.cos(), 0.0, 0.0, half.sin()) * well.attitude;
            assert!((ill.attitude - expected).norm() < 1e-12);
        }
    });
    assert_eq!(seen, 100);
    compare(FailureKind::GnssLost, |k, _, ill| assert!(k == 0 || ill.gnss.is_empty()));
    compare(FailureKind::GnssJumped { by_m }, |k, well, ill| {
        for (well, ill) in well.gnss.iter().zip(&ill.gnss).filter(|_| k > 0) {
            assert_eq!(ill.position_m, well.position_m + by_m);
            assert_eq!(ill.velocity_m_s, well.velocity_m_s);
        }
    });
}

#[test]
fn barometer_and_magnetometer_fail_as_declared() {
    compare(FailureKind::BarometerLost, |k, _, ill| assert!(k == 0 || ill.barometer.is_empty()));
    let mut before = 0.0;
    compare(FailureKind::BarometerStuck, |k, well, ill| {
        for (well, ill) in well.barometer.iter().zip(&ill.barometer) {
            if k == 0 {
                before = well.height_m;
            } else {
                assert_eq!(ill.height_m, before);
            }
        }
    });
    let mut noise = Vec::new();
    compare(FailureKind::BarometerBlocked, |k, _, ill| {
        for ill in ill.barometer.iter().filter(|_| k > 0) {
            noise.push(ill.height_m - moving(1000).position_m.z);
        }
    });
    common::assert_sigma(&noise, 0.1, "noise of a blocked one");
    compare(FailureKind::MagnetometerLost, |k, _, ill| assert!(k == 0 || ill.magnetometer.is_empty()));
    let mut held = None;
    compare(FailureKind::MagnetometerStuck, |k, well, ill| {
        for (well, ill) in well.magnetometer.iter().zip(&ill.magnetometer) {
            if k == 0 {
                held = Some(well.field_ut);
            } else {
                assert_eq!(Some(ill.field_ut), held);
            }
        }
    });
    let field_ut = Vector3::new(10.0, -20.0, 5.0);
    compare(FailureKind::MagnetometerDisturbed { field_ut }, |k, well, ill| {
        for (well, ill) in well.magnetometer.iter().zip(&ill.magnetometer).filter(|_| k > 0) {
            assert_eq!(ill.field_ut, well.field_ut + field_ut);
        }
    });
}
