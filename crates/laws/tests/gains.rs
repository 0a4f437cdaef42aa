//! All laws declare their gains consistently, and the error for a bad gain names it.

use crate::harness::{SETTINGS, vehicle};
use afbc_laws::{Dfbc, Geometric, Indi, L1, Mpc, Pid, dfbc, geometric, indi, l1, mpc, pid};
use afbc_types::{Declaration, Declared, DeclaredValue, DeclaredValueMut, OutOfRange, Range};
use core::convert::Infallible;
use std::collections::BTreeMap;

/// Gains with the same key have the same name, unit and range in all controllers.
#[test]
fn gains_of_one_key_are_declared_alike() {
    let mut declared: BTreeMap<&str, Declaration> = BTreeMap::new();
    let mut shared = 0;
    let mut visit = |declaration: &Declaration, _: DeclaredValue<'_>| {
        if let Some(before) = declared.insert(declaration.range.name, *declaration) {
            let same = |d: Declaration| (d.id, d.range, d.unit, d.tuned);
            assert_eq!(same(before), same(*declaration));
            shared += 1;
        }
        Ok::<(), Infallible>(())
    };
    let Ok(()) = pid::Gains::DEFAULT.visit(&mut visit);
    let Ok(()) = geometric::Gains::DEFAULT.visit(&mut visit);
    let Ok(()) = indi::Gains::DEFAULT.visit(&mut visit);
    let Ok(()) = l1::Gains::DEFAULT.visit(&mut visit);
    let Ok(()) = dfbc::Gains::DEFAULT.visit(&mut visit);
    let Ok(()) = mpc::Gains::DEFAULT.visit(&mut visit);
    assert!(shared > 35, "{shared}");
}

#[test]
fn gains_out_of_range_are_refused_by_name() {
    /// Sets each gain in turn to a bad value and checks that it is refused by name.
    fn refused<G: Declared + Copy>(gains: G, count: usize, build: fn(G) -> Result<(), OutOfRange>) {
        assert_eq!(build(gains), Ok(()));
        for bad in [|range: &Range| (range.max * 2.0) as f32, |_: &Range| f32::NAN, |_: &Range| -1.0] {
            for index in 0..count {
                let (mut gains, mut at, mut name) = (gains, 0, "");
                let Ok(()) = gains.visit_mut(&mut |declaration, value| {
                    if let (true, DeclaredValueMut::Single([gain])) = (at == index, value) {
                        (*gain, name) = (bad(&declaration.range), declaration.range.name);
                    }
                    at += 1;
                    Ok::<(), Infallible>(())
                });
                assert_eq!(at, count);
                assert_eq!(build(gains).unwrap_err().range.name, name);
            }
        }
    }
    refused(pid::Gains::PAPER_VEHICLE, 25, |gains| Pid::new(vehicle(), SETTINGS, gains).map(drop));
    refused(geometric::Gains::GOODARZI_2013, 19, |gains| Geometric::new(vehicle(), SETTINGS, gains).map(drop));
    refused(indi::Gains::PAPER_VEHICLE, 18, |gains| Indi::new(vehicle(), SETTINGS, gains).map(drop));
    refused(l1::Gains::BY_HAND, 23, |gains| L1::new(vehicle(), SETTINGS, gains).map(drop));
    refused(dfbc::Gains::PAPER_VEHICLE, 18, |gains| Dfbc::new(vehicle(), SETTINGS, gains).map(drop));
    refused(mpc::Gains::PAPER_VEHICLE, 19, |gains| Mpc::new(vehicle(), SETTINGS, gains).map(drop));
    let gains = pid::Gains { tilt_max_rad: 1.5, ..pid::Gains::PAPER_VEHICLE };
    assert_eq!(gains.validate().unwrap_err().range.name, "tilt_max_rad");
    let gains = indi::Gains { rotor_time_constant_s: -0.1, ..indi::Gains::PAPER_VEHICLE };
    assert_eq!(gains.validate().unwrap_err().range.name, "rotor_time_constant_s");
    let settings = afbc_control::Settings { dt_s: 1.0, ..SETTINGS };
    assert_eq!(Indi::new(vehicle(), settings, indi::Gains::PAPER_VEHICLE).unwrap_err().range.name, "dt_s");
    let mut vehicle = vehicle();
    vehicle.mass_kg = 0.0;
    assert_eq!(Pid::new(vehicle, SETTINGS, pid::Gains::PAPER_VEHICLE).unwrap_err().range.name, "mass_kg");
}
