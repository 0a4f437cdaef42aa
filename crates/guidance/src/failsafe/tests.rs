//! Tests of the failsafe checks: each cause by itself, with its threshold on both sides.
#![allow(clippy::unwrap_used, reason = "tests")]

use super::*;
use proptest::prelude::*;

/// Inputs in flight without any cause for a failsafe.
fn calm() -> FailsafeInputs<'static> {
    FailsafeInputs {
        mode: FlightMode::Hold,
        armed: true,
        descends: false,
        position_m: Some(Vector3::new(1.0, 2.0, 3.0)),
        home_m: Some(Vector3::new(1.0, 2.0, 3.0)),
        battery: None,
        sensors: FailedSensors::default(),
        silent_us: Some(0),
        targets: true,
        fence: FenceStatus::default(),
        sticks: true,
        dt_s: 1e-3,
    }
}

/// Runs the checks. Returns the causes present and the announcements of ended ones.
fn look(
    watch: &mut FailsafeMemory,
    failsafe: &FailsafeSettings,
    seen: &FailsafeInputs<'_>,
) -> (std::vec::Vec<FailsafeCause>, GuidanceNotices) {
    let mut notices = GuidanceNotices::default();
    let before = watch.present;
    let (action, cause, new) = watch.update(failsafe, seen, &mut notices);
    let holding: std::vec::Vec<FailsafeCause> =
        FailsafeCause::ALL.into_iter().filter(|cause| watch.is_present(*cause)).collect();
    // Expect the strongest action and the first cause that has it. A disarmed vehicle gets no action, nor does a
    // descent of a vehicle that knows its position.
    let counts = |cause: &&FailsafeCause| seen.position_m.is_none() || **cause != FailsafeCause::Descent;
    let strongest =
        holding.iter().filter(counts).map(|cause| failsafe.action(*cause)).max().unwrap_or(FailsafeAction::None);
    assert_eq!(action, if seen.armed { strongest } else { FailsafeAction::None });
    let first = holding
        .iter()
        .filter(counts)
        .find(|cause| failsafe.action(**cause) == strongest && strongest > FailsafeAction::None);
    assert_eq!(cause, first.copied().unwrap_or(FailsafeCause::Descent), "{holding:?}");
    let news = holding.iter().filter(|cause| before & bit(**cause) == 0).fold(0, |set, cause| set | bit(*cause));
    assert_eq!(new, news);
    (holding, notices)
}

fn found(failsafe: &FailsafeSettings, seen: &FailsafeInputs<'_>) -> std::vec::Vec<FailsafeCause> {
    look(&mut FailsafeMemory::default(), failsafe, seen).0
}

extern crate std;

#[test]
fn each_cause_is_found_by_itself_in_flight() {
    let failsafe = FailsafeSettings { fence_radius_m: 10.0, station_lost_s: 1.0, ..FailsafeSettings::DEFAULT };
    assert_eq!(found(&failsafe, &calm()), []);
    let descends = FailsafeInputs { descends: true, ..calm() };
    assert_eq!(found(&failsafe, &descends), [FailsafeCause::Descent]);
    assert_eq!(found(&failsafe, &FailsafeInputs { silent_us: Some(1_000_000), ..calm() }), []);
    let silent = FailsafeInputs { silent_us: Some(1_001_000), ..calm() };
    assert_eq!(found(&failsafe, &silent), [FailsafeCause::Station]);
    assert_eq!(found(&failsafe, &FailsafeInputs { silent_us: None, ..calm() }), [], "never heard");
    for mode in FlightMode::ALL {
        let blind = FailsafeInputs { mode, targets: false, sticks: false, ..calm() };
        let expected: &[FailsafeCause] = match mode {
            FlightMode::Offboard => &[FailsafeCause::Targets],
            FlightMode::Position | FlightMode::Altitude | FlightMode::Stabilised | FlightMode::Acro => {
                &[FailsafeCause::Sticks]
            }
            _ => &[],
        };
        assert_eq!(found(&failsafe, &blind), expected);
        assert_eq!(found(&failsafe, &FailsafeInputs { mode, ..calm() }), []);
        assert_eq!(found(&failsafe, &FailsafeInputs { armed: false, ..blind }), []);
    }
    let outside = FailsafeInputs { position_m: Some(Vector3::new(20.0, 0.0, 0.0)), ..calm() };
    assert_eq!(found(&failsafe, &outside), [FailsafeCause::Fence]);
    let sensors = |sensors: FailedSensors| FailsafeInputs { sensors, ..calm() };
    let none = FailedSensors::default();
    for failed in [
        FailedSensors { inertial: true, ..none },
        FailedSensors { barometer: true, ..none },
        FailedSensors { magnetometer: true, ..none },
        FailedSensors { gnss: true, ..none },
        FailedSensors { tracker: true, ..none },
    ] {
        assert!(failed.any() && !none.any());
        assert_eq!(found(&failsafe, &sensors(failed)), [FailsafeCause::Sensors]);
        assert_eq!(found(&failsafe, &FailsafeInputs { armed: false, ..sensors(failed) }), [FailsafeCause::Sensors]);
    }
    for seen in [descends, silent, outside] {
        assert_eq!(found(&failsafe, &FailsafeInputs { armed: false, ..seen }), [], "on the ground");
    }
}

/// The end of a cause is announced in flight, for causes that can end.
#[test]
fn the_end_of_a_cause_is_announced_in_flight() {
    let failsafe = FailsafeSettings { fence_radius_m: 10.0, station_lost_s: 1.0, ..FailsafeSettings::DEFAULT };
    let all = FailsafeInputs {
        mode: FlightMode::Offboard,
        position_m: Some(Vector3::new(20.0, 0.0, 0.0)),
        sensors: FailedSensors { gnss: true, ..FailedSensors::default() },
        silent_us: Some(u32::MAX),
        targets: false,
        ..calm()
    };
    let mut watch = FailsafeMemory::default();
    let (holding, notices) = look(&mut watch, &failsafe, &all);
    assert_eq!(holding, [FailsafeCause::Fence, FailsafeCause::Sensors, FailsafeCause::Station, FailsafeCause::Targets]);
    assert_eq!(notices.iter().count(), 0);
    let mut landed = watch;
    let (holding, notices) = look(&mut watch, &failsafe, &FailsafeInputs { silent_us: Some(u32::MAX), ..calm() });
    assert_eq!(holding, [FailsafeCause::Station]);
    assert!(
        notices.iter().eq([GuidanceNotice::Over(FailsafeCause::Fence), GuidanceNotice::Over(FailsafeCause::Sensors)])
    );
    let (_, notices) = look(&mut watch, &failsafe, &calm());
    assert!(notices.iter().eq([GuidanceNotice::Over(FailsafeCause::Station)]));
    let (_, notices) = look(&mut watch, &failsafe, &calm());
    assert_eq!(notices.iter().count(), 0);
    let (_, notices) = look(&mut landed, &failsafe, &FailsafeInputs { armed: false, ..calm() });
    assert_eq!(notices.iter().count(), 0, "on the ground");
}

/// New causes that have an action are announced, except one already announced with its mode.
#[test]
fn what_is_new_is_announced() {
    let failsafe = FailsafeSettings { fence_action: FenceAction::Nothing, ..FailsafeSettings::DEFAULT };
    let new = bit(FailsafeCause::Fence) | bit(FailsafeCause::BatteryLow) | bit(FailsafeCause::Station);
    for (but, expected) in [
        (None, &[FailsafeCause::BatteryLow, FailsafeCause::Station][..]),
        (Some(FailsafeCause::Station), &[FailsafeCause::BatteryLow][..]),
        (Some(FailsafeCause::Sensors), &[FailsafeCause::BatteryLow, FailsafeCause::Station][..]),
    ] {
        let mut notices = GuidanceNotices::default();
        announce(&failsafe, new, but, &mut notices);
        assert!(notices.iter().eq(expected.iter().map(|cause| GuidanceNotice::Found(*cause))), "{notices:?}");
    }
}

/// A vehicle that was outside stays "outside" until it is inside by a margin. Unknown positions change nothing.
#[test]
fn a_fence_is_left_and_entered_with_a_margin() {
    let failsafe = FailsafeSettings { fence_radius_m: 10.0, fence_height_m: 20.0, ..FailsafeSettings::DEFAULT };
    let home = Vector3::new(5.0, -5.0, 2.0);
    let at = |x: f32, y: f32, z: f32| FailsafeInputs {
        position_m: Some(home + Vector3::new(x, y, z)),
        home_m: Some(home),
        ..calm()
    };
    let mut watch = FailsafeMemory::default();
    let mut outside = |seen: &FailsafeInputs<'_>| !look(&mut watch, &failsafe, seen).0.is_empty();
    let unknown = FailsafeInputs { position_m: None, ..at(0.0, 0.0, 0.0) };
    assert!(!outside(&unknown));
    for (seen, expected) in [
        (at(6.0, 7.9, 0.0), false),
        (at(6.0, -8.1, 0.0), true),
        (at(6.0, 7.9, 0.0), true),
        (at(0.0, 9.01, 0.0), true),
        (unknown, true),
        (FailsafeInputs { home_m: None, ..at(0.0, 0.0, 0.0) }, true),
        (at(0.0, -8.99, 0.0), false),
        (at(0.0, 0.0, 19.99), false),
        (at(0.0, 0.0, 20.01), true),
        (at(0.0, 0.0, 19.01), true),
        (at(0.0, 0.0, 18.99), false),
        (at(0.0, 0.0, -500.0), false),
        (unknown, false),
    ] {
        assert_eq!(outside(&seen), expected, "{seen:?}");
    }
}

proptest! {
    /// The fence is a cylinder around home, less the margin. A small fence keeps at least half its size. A size of 0
    /// means no fence.
    #[test]
    fn a_fence_is_a_cylinder(
        radius in prop_oneof![Just(0.0f32), 0.5..30.0f32], height in prop_oneof![Just(0.0f32), 0.5..30.0f32],
        margin in 0.0..4.0f32, x in -30.0..30.0f32, y in -30.0..30.0f32, z in -30.0..30.0f32,
    ) {
        let failsafe = FailsafeSettings { fence_radius_m: radius, fence_height_m: height, ..FailsafeSettings::DEFAULT };
        let home = Vector3::new(100.0, -50.0, 7.0);
        let size = |size: f32| if size > 2.0 * margin { size - margin } else { size / 2.0 };
        let beyond = f32::hypot(x, y) - size(radius);
        let above = z - size(height);
        prop_assume!(beyond.abs() > 1e-3 && above.abs() > 1e-3);
        let inside = (radius == 0.0 || beyond < 0.0) && (height == 0.0 || above < 0.0);
        prop_assert_eq!(failsafe.encloses(&home, &(home + Vector3::new(x, y, z)), margin), inside);
        let ceiling = if height == 0.0 { f32::INFINITY } else if height > 2.0 { height - 1.0 } else { height / 2.0 };
        prop_assert_eq!(failsafe.ceiling_m(), ceiling);
    }

    /// The charge follows the voltage without load, linearly between empty and full.
    #[test]
    fn the_charge_follows_the_voltage_without_load(
        voltage_v in 5.0..20.0f32, current_a in -20.0..60.0f32, number in 1..5u32, resistance_ohm in 0.0..0.05f32,
    ) {
        let battery = BatteryCells { number, empty_v: 3.4, full_v: 4.2, resistance_ohm };
        let mut charge = None;
        battery.update(&mut charge, Some(&BatteryReading { voltage_v, current_a, charge: None }), 0.01);
        let cell = f64::from(voltage_v) / f64::from(number) + f64::from(current_a) * f64::from(resistance_ohm);
        let expected = ((cell - 3.4) / 0.8).clamp(0.0, 1.0);
        prop_assert!((f64::from(charge.unwrap()) - expected).abs() < 1e-4, "{charge:?}, not {expected}");
    }
}

/// The first plausible reading counts as it is, later ones are filtered with a time constant of 2 s.
#[test]
fn the_charge_is_filtered() {
    let battery = BatteryCells { number: 1, empty_v: 3.0, full_v: 4.0, resistance_ohm: 0.0 };
    let reading = |voltage_v: f32, current_a: f32| BatteryReading { voltage_v, current_a, charge: None };
    let mut charge = None;
    let nonsense = [
        reading(0.0, 0.0),
        reading(-3.5, 0.0),
        reading(1e3, 0.0),
        reading(2e3, 0.0),
        reading(f32::NAN, 0.0),
        reading(3.5, 1e4),
        reading(3.5, -2e4),
        reading(3.5, f32::NAN),
    ];
    for reading in &nonsense {
        battery.update(&mut charge, Some(reading), 0.01);
        assert_eq!(charge, None, "{reading:?}");
    }
    battery.update(&mut charge, None, 0.01);
    BatteryCells { number: 0, ..battery }.update(&mut charge, Some(&reading(3.5, 0.0)), 0.01);
    assert_eq!(charge, None, "not watched");
    battery.update(&mut charge, Some(&reading(3.9, 0.0)), 0.01);
    assert!((charge.unwrap() - 0.9).abs() < 1e-5);
    for _ in 0..100 {
        battery.update(&mut charge, Some(&reading(3.2, 9e3)), 0.01);
    }
    let expected = 0.2 + 0.7 * f32::exp(-0.5);
    assert!((charge.unwrap() - expected).abs() < 2e-3, "{charge:?}, not {expected}");
    let before = charge;
    battery.update(&mut charge, Some(&nonsense[0]), 0.01);
    assert_eq!(charge, before);
}

/// A charge below a threshold is found; a charge equal to it is not. A battery does not recover in flight, but may be
/// replaced on the ground.
#[test]
fn low_batteries_are_found_by_their_thresholds() {
    let failsafe = FailsafeSettings {
        cells: 1,
        low: 0.5,
        critical: 0.25,
        emergency: 0.0,
        empty_v: 3.0,
        full_v: 4.0,
        ..FailsafeSettings::DEFAULT
    };
    let with = |armed: bool, charge: f32, watch: &mut FailsafeMemory| {
        let reading = BatteryReading { voltage_v: 3.0 + charge, current_a: 0.0, charge: None };
        look(watch, &failsafe, &FailsafeInputs { battery: Some(&reading), armed, dt_s: 2.0, ..calm() }).0
    };
    use FailsafeCause::{BatteryCritical, BatteryEmergency, BatteryLow};
    let fresh = |charge: f32| with(true, charge, &mut FailsafeMemory::default());
    assert_eq!(fresh(0.5), []);
    assert_eq!(fresh(0.49), [BatteryLow]);
    assert_eq!(fresh(0.25), [BatteryLow]);
    assert_eq!(fresh(0.0), [BatteryCritical, BatteryLow], "not below nothing");
    let eager = FailsafeSettings { emergency: 0.1, ..failsafe };
    let reading = BatteryReading { voltage_v: 3.05, current_a: 0.0, charge: None };
    let mut watch = FailsafeMemory::default();
    let empty = FailsafeInputs { battery: Some(&reading), dt_s: 2.0, ..calm() };
    assert_eq!(look(&mut watch, &eager, &empty).0, [BatteryEmergency, BatteryCritical, BatteryLow]);
    assert_eq!(with(true, 0.9, &mut watch), [BatteryEmergency, BatteryCritical, BatteryLow], "in flight");
    assert!((watch.charge().unwrap() - 0.9).abs() < 1e-3);
    assert_eq!(with(false, 0.9, &mut watch), []);
}
