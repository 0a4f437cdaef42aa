//! A battery's voltage and current from ADC samples.

use afbc_drivers::PartFault;
use afbc_drivers::battery::{BatteryPins, BatteryScale, BatterySensor, FILTER_S};
use proptest::prelude::*;

const RANGE_V: f32 = 3.3;
/// Scale of the Matek H743, as ArduPilot describes the board.
const MATEK: BatteryScale = BatteryScale { volts_per_volt: 11.0, amperes_per_volt: 40.0 };
/// Time between two readings \[us\].
const STEP_US: u64 = 50_000;

/// Returns the ADC samples for a battery.
fn numbers(voltage_v: f32, current_a: f32, end: u16) -> [u16; 2] {
    let share = [voltage_v / MATEK.volts_per_volt, current_a / MATEK.amperes_per_volt].map(|volts| volts / RANGE_V);
    share.map(|share| (share.clamp(0.0, 1.0) * f32::from(end)) as u16)
}

proptest! {
    /// Any battery is read with the resolution of the ADC, of 12 or 16 bits.
    #[test]
    fn what_is_there_is_read(voltage in 0.6..35.0_f32, current in 0.0..130.0_f32, wide in any::<bool>()) {
        let end = if wide { u16::MAX } else { 4095 };
        let mut sensor = BatterySensor::new(RANGE_V);
        let (volts, amperes) = MATEK.read(&sensor.take(7, numbers(voltage, current, end), end).expect("a battery"));
        prop_assert!((volts - voltage).abs() < 36.3 / f32::from(end) + 1e-4);
        prop_assert!((amperes.expect("measured") - current).abs() < 132.0 / f32::from(end) + 1e-3);
    }

    /// Any samples at any times give a reading within the range, or none.
    #[test]
    fn any_number_is_survived(all in prop::collection::vec((any::<[u16; 2]>(), any::<u16>(), any::<u64>()), 1..30)) {
        let mut sensor = BatterySensor::new(RANGE_V);
        for (numbers, end, at_us) in all {
            let Ok(BatteryPins { voltage_v, current_v }) = sensor.take(at_us, numbers, end) else { continue };
            prop_assert!(voltage_v > 0.0 && voltage_v < RANGE_V);
            prop_assert!(current_v.is_none_or(|volts| (0.0..RANGE_V).contains(&volts)));
        }
    }
}

/// A step in voltage is followed with the filter's time constant, at any sampling rate.
#[test]
fn readings_are_filtered() {
    for step_us in [20_000, STEP_US, 100_000] {
        let mut sensor = BatterySensor::new(RANGE_V);
        let mut read =
            |at_us, volts| MATEK.read(&sensor.take(at_us, numbers(volts, 0.0, 65_535), 65_535).expect("one")).0;
        let mut volts = read(0, 16.8);
        for step in 1..=(FILTER_S * 1e6) as u64 / step_us {
            volts = read(step * step_us, 14.8);
        }
        // An exponential leaves 0.37 after one time constant; a filter with finite steps leaves more.
        let left = (volts - 14.8) / 2.0;
        assert!((0.36..0.46).contains(&left), "{step_us} us: {left}");
    }
}

/// The cases are the rows of the fault table in the module's documentation.
#[test]
fn faults_are_no_reading() {
    let good = numbers(16.0, 20.0, 65_535);
    for (fault, is_read) in [
        ([0, good[1]], false),
        ([500, good[1]], false),
        ([65_535, good[1]], false),
        ([65_000, good[1]], false),
        ([good[0], 65_535], true),
        ([good[0], 0], true),
    ] {
        let mut sensor = BatterySensor::new(RANGE_V);
        let before = sensor.take(0, good, 65_535).expect("a battery");
        let at = sensor.take(STEP_US, fault, 65_535);
        assert_eq!(at.is_ok(), is_read, "{fault:?}");
        assert!(is_read || at == Err(PartFault::Range));
        if fault[1] == 65_535 {
            assert_eq!(at.expect("a voltage").current_v, None);
        }
        // The faulty sample has not entered the filter.
        let after = sensor.take(2 * STEP_US, good, 65_535).expect("a battery");
        assert!((after.voltage_v - before.voltage_v).abs() < 1e-4);
    }
}

/// The vehicle's own scales of voltage and current replace the board's independently.
#[test]
fn scales_are_changed() {
    assert_eq!(MATEK.changed([-1.0, 0.0]), MATEK);
    assert_eq!(MATEK.changed([15.3, -1.0]), BatteryScale { volts_per_volt: 15.3, ..MATEK });
    assert_eq!(MATEK.changed([-1.0, 36.4]), BatteryScale { amperes_per_volt: 36.4, ..MATEK });
}
