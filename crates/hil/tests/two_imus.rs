//! Tests flights on two inertial sensors. If one is wrong, the vehicle must fly on the other.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::indexing_slicing,
    missing_docs,
    reason = "a test that cannot go on should say why"
)]

use afbc::Profile;
use afbc_estimator::Measurement;
use afbc_hil::Host;
use afbc_mavlink::{Address, Datum, Encoder, ExternalTarget, FRAME_MAX, Height, ManualControl, Uplink, VehicleCommand};
use afbc_onboard::{Aged, ImuSelector};
use afbc_scenario::{Scenario, load};
use afbc_sim::flight::World;
use afbc_types::{ROTORS_MAX, RotorSpeeds};
use afbc_vehicles::BUILT_IN;
use nalgebra::{Matrix3, Vector3};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use std::path::Path;

const STATION: Address = Address { system: 255, component: 190 };
/// Scenario that starts on the ground, outdoors.
const SCENARIO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../twin/scenarios/hover.toml");
/// Noise of the second sensor, added to the first sensor's \[rad/s, m/s2\].
const NOISE: [f32; 2] = [0.02, 1.0];
/// Time after which the vehicle hovers at its height \[ms\].
const HOVERS_MS: u64 = 12_000;
/// Largest distance from the hover position \[m\], and largest tilt \[rad\]. A fault of 30 deg/s or 0.5 g goes
/// unnoticed for half a second, and its effect must be braked.
const OFF_M: f64 = 4.0;
const TILT_RAD: f64 = 1.3;
/// Number of flights with a wrong sensor.
const CASES: usize = 64;

/// Fault of a sensor.
#[derive(Clone, Copy, Debug)]
enum Fault {
    None,
    /// A bias of the rates (0) or the force (1), which grows over this time \[rad/s, m/s2, ms\].
    Bias(usize, Vector3<f32>, u64),
    /// The rates (0) or the force (1) get stuck.
    Stuck(usize),
}

/// Measurements of a flight from the fault on.
#[derive(Debug, Default)]
struct Flown {
    lost: bool,
    /// Largest tilt \[rad\], and largest distance from the hover position \[m\].
    tilt_rad: f64,
    off_m: f64,
    /// Changes of the sensor in use: time \[ms\], and true for the second sensor.
    changes: Vec<(u64, bool)>,
    second_flies: bool,
    works: [bool; 2],
}

fn normal(random: &mut Xoshiro256PlusPlus) -> f32 {
    (0..12).map(|_| random.next_u64() as f32 / u64::MAX as f32).sum::<f32>() - 6.0
}

/// Returns sticks that jump from stop to stop, each with its own period.
fn jerky(now_ms: u64) -> ManualControl {
    let stick = |period_ms: u64| if (now_ms / period_ms).is_multiple_of(2) { 1.0 } else { -1.0 };
    ManualControl { roll: stick(2_600), pitch: stick(3_700), throttle: 0.3 * stick(1_100), yaw: stick(1_900) }
}

/// Takes off and hovers. At `at_ms` one sensor fails, the second if `of_second`. Without a fault, jerky sticks fly the
/// vehicle from then on.
fn fly(
    scenario: &Scenario,
    mut host: Host,
    of_second: bool,
    fault: Fault,
    at_ms: u64,
    end_ms: u64,
    has_compass: bool,
) -> Flown {
    let mut world = World::released(scenario, 1e-3).unwrap();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(scenario.seed);
    let (mut sender, mut buffer) = (Encoder::new(STATION), [0; FRAME_MAX]);
    let mut speeds = RotorSpeeds::<ROTORS_MAX>::default();
    let (mut flown, mut selector) = (Flown::default(), ImuSelector::NEW);
    let mut draw = |sigma: f32| Vector3::from_fn(|_, _| sigma * normal(&mut random));
    // The second sensor differs in scale and alignment by a percent, and in its biases.
    let errors = Matrix3::from_columns(&[draw(0.007), draw(0.007), draw(0.007)]) + Matrix3::identity();
    let biases = [draw(0.02), draw(0.2)];
    let (mut stuck, mut armed_ms, mut start_m) = (None, None, Vector3::zeros());
    for now_ms in 0..end_ms {
        world.advance(&speeds);
        world.look();
        let motion = world.plant().motion();
        let mut readings = world.readings().copied().unwrap_or_default();
        if !has_compass && now_ms >= at_ms {
            let others = readings.aids.into_iter().flatten();
            let mut others = others.filter(|aid| !matches!(aid.value, Measurement::MagneticField { .. }));
            readings.aids = std::array::from_fn(|_| others.next());
        }
        if let Some(Aged { value: first, age_us }) = readings.imu {
            let at_us = now_ms * 1_000 + 1_000 - u64::from(age_us);
            let [rates, force] = first;
            let mut pair = [first, [errors * rates + biases[0] + draw(NOISE[0]), force + biases[1] + draw(NOISE[1])]];
            let failed = &mut pair[usize::from(of_second)];
            if now_ms >= at_ms {
                match fault {
                    Fault::None => (),
                    Fault::Bias(quantity, bias, ramp_ms) => {
                        failed[quantity] += bias * ((now_ms - at_ms + 1) as f32 / (ramp_ms + 1) as f32).min(1.0);
                    }
                    Fault::Stuck(quantity) => failed[quantity] = *stuck.get_or_insert(failed[quantity]),
                }
            }
            let [first, second] = pair;
            let taken = [selector.take_first(at_us, first), selector.take_second(at_us, second)];
            readings.imu = taken.into_iter().flatten().last().map(|value| Aged { value, age_us });
        }
        host.sense(&readings);
        let command = match armed_ms {
            None if now_ms > 4_000 && now_ms % 500 == 0 => Some(VehicleCommand::Arm),
            Some(armed_ms) if (now_ms - armed_ms) % 1000 == 500 && motion.position_m.z < 0.5 && now_ms < HOVERS_MS => {
                Some(VehicleCommand::TakeOff(Height { metres: 5.0, above: Datum::Here }))
            }
            _ => None,
        };
        let message = match fault {
            // MAV_STANDARD_MODE_POSITION_HOLD, once the sticks are received.
            Fault::None if now_ms == at_ms + 100 => Some(Uplink::Command(VehicleCommand::SelectStandardMode(1))),
            Fault::None if now_ms > at_ms && now_ms % 1_000 > 0 => {
                Some(Uplink::Target(ExternalTarget::Sticks(jerky(now_ms))))
            }
            _ => command.map(Uplink::Command).or((now_ms % 1_000 == 0).then_some(Uplink::Heartbeat)),
        };
        let bytes = message.map_or(Vec::new(), |message| sender.send(&message, &mut buffer).to_vec());
        let report = host.next_tick(&bytes).report;
        speeds = report.motors;
        let before = selector.pair(0).second_flies;
        host.cross_check(&mut selector, &readings);
        flown.second_flies = selector.pair(0).second_flies;
        if flown.second_flies != before {
            flown.changes.push((now_ms, flown.second_flies));
        }
        if report.mode.armed() && armed_ms.is_none() {
            armed_ms = Some(now_ms);
        }
        if now_ms == at_ms {
            start_m = motion.position_m;
        }
        if now_ms >= at_ms {
            flown.tilt_rad = flown.tilt_rad.max(motion.attitude_rad.x.hypot(motion.attitude_rad.y));
            flown.off_m = flown.off_m.max((motion.position_m - start_m).norm());
            if flown.tilt_rad > 1.2 || motion.position_m.z < 0.3 || !report.mode.armed() {
                flown.lost = true;
                break;
            }
        }
    }
    flown.works = selector.pair(end_ms * 1_000).works;
    flown
}

fn scenario(seed: u64) -> Scenario {
    let mut scenario = load(Path::new(SCENARIO)).unwrap();
    scenario.seed = seed;
    scenario.realism.seed = seed;
    scenario
}

/// Checks a flight with a fault.
fn check(flown: &Flown, second_flies: bool, works: [bool; 2], what: &str) {
    assert!(!flown.lost && flown.off_m < OFF_M && flown.tilt_rad < TILT_RAD, "{what}: {flown:?}");
    assert_eq!((flown.second_flies, flown.works), (second_flies, works), "{what}: {flown:?}");
}

/// Either sensor fails with a fault of any quantity, axis, size, time and onset, with or without a compass. The wrong
/// sensor is soon out of use, and the right one never is.
#[test]
fn the_right_one_flies_of_two_that_disagree() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut uniform = |least: f32, most: f32| least + (most - least) * (random.next_u64() as f32 / u64::MAX as f32);
    for case in 0..CASES {
        // A bias of 3 to 30 deg/s, or of 0.15 to 0.5 g.
        let quantity = usize::from(case % 5 == 4);
        let size = [uniform(3.0_f32.ln(), 30.0_f32.ln()).exp().to_radians(), uniform(1.5, 5.0)][quantity];
        let direction = match case % 4 {
            3 => Vector3::from_fn(|_, _| uniform(-1.0, 1.0)).normalize(),
            axis => Vector3::ith(axis, if uniform(-1.0, 1.0) > 0.0 { 1.0 } else { -1.0 }),
        };
        let ramp_ms = if case / 4 % 2 == 0 { 0 } else { uniform(0.0, 2_000.0) as u64 };
        let of_second = case / 8 % 2 == 1;
        let fault = Fault::Bias(quantity, direction * size, ramp_ms);
        let at_ms = uniform(13_000.0, 17_000.0) as u64;
        // Without a compass, nothing measures the heading in a hover.
        let has_compass = case / 16 % 2 == 0 || direction.z.abs() > 0.7;
        let flown = fly(&scenario(case as u64 + 1), Host::new().unwrap(), of_second, fault, at_ms, 26_000, has_compass);
        let what = format!("case {case}: of second {of_second}, {fault:?} at {at_ms} ms, compass {has_compass}");
        check(&flown, !of_second, [of_second, !of_second], &what);
        assert!(flown.changes.len() == usize::from(!of_second), "{what}: {flown:?}");
    }
}

/// Every other vehicle flies on the right sensor, too.
#[test]
fn every_vehicle_is_carried_by_the_right_one() {
    let faults = [
        Fault::Bias(0, Vector3::x() * 0.17, 0),
        Fault::Bias(0, Vector3::y() * -0.5, 0),
        Fault::Bias(0, Vector3::z() * 0.3, 0),
        Fault::Bias(1, Vector3::new(2.0, -2.0, 2.0), 0),
    ];
    for (index, built_in) in BUILT_IN.iter().filter(|built_in| built_in.name != "crazyflie").enumerate() {
        for fault in faults {
            let vehicle = built_in.read().unwrap();
            let flown = scenario(index as u64 + 1).on(&vehicle, Profile::Flight).unwrap();
            let host = Host::for_vehicle(&vehicle).unwrap();
            let flown = fly(&flown, host, false, fault, 14_000, 22_000, true);
            check(&flown, true, [false, true], &format!("{} {fault:?}", built_in.name));
        }
    }
}

/// A sensor with a stuck quantity is not used; the other sensor flies.
#[test]
fn a_quantity_that_is_stuck_does_not_fly() {
    for (case, of_second) in [false, true].into_iter().cycle().take(8).enumerate() {
        let fault = Fault::Stuck(case / 2 % 2);
        let flown = fly(&scenario(case as u64 + 1), Host::new().unwrap(), of_second, fault, 13_000, 20_000, true);
        check(&flown, !of_second, [of_second, !of_second], &format!("of second {of_second}, {fault:?}"));
    }
}

/// Without a fault the sensors are never changed, for each vehicle, with jerky sticks, in calm air and in strong wind.
#[test]
fn without_a_fault_the_first_flies() {
    let vehicles = BUILT_IN.iter().filter(|built_in| built_in.name != "crazyflie");
    for (index, built_in) in vehicles.enumerate() {
        for wind_m_s in [[0.0, 0.0, 0.0], [5.0, -3.0, 0.0]] {
            let vehicle = built_in.read().unwrap();
            let mut flown = scenario(index as u64 + 1);
            flown.realism.wind.steady_m_s = wind_m_s.into();
            let host = Host::for_vehicle(&vehicle).unwrap();
            let flown = flown.on(&vehicle, Profile::Flight).unwrap();
            let flown = fly(&flown, host, false, Fault::None, 13_000, 30_000, true);
            assert!(flown.off_m > 5.0, "it is flown about: {flown:?}");
            assert!(flown.changes.is_empty() && flown.works == [true; 2], "{} {wind_m_s:?}: {flown:?}", built_in.name);
        }
    }
}
