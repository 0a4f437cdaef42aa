//! Tests acro mode by radio: flips, and how they end.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::indexing_slicing,
    missing_docs,
    reason = "a test that cannot go on should say why"
)]

mod flier;

use afbc_guidance::FlightMode;
use afbc_vehicles::{BUILT_IN, Vehicle};
use flier::{Flier, KILL, MODE, PITCH, ROLL, THROTTLE, YAW, crsf};

/// Rate of a flip \[deg/s\].
const FLIP_DEG_S: f32 = 360.0;

fn vehicle(name: &str) -> Option<Vehicle> {
    BUILT_IN.iter().find(|built_in| built_in.name == name).map(|built_in| built_in.read().unwrap())
}

/// Returns a vehicle that hovers some metres up, with acro mode at the other end of the mode switch.
fn hovering(name: &str, seed: u64, most_deg_s: f32) -> Flier {
    let mut flier = Flier::of(vehicle(name).as_ref(), true, seed, crsf(), 4);
    flier.set("COM_FLTMODE6", 6.0);
    for axis in ["MC_ACRO_R_MAX", "MC_ACRO_P_MAX", "MC_ACRO_Y_MAX"] {
        flier.set(axis, most_deg_s);
    }
    // Wind shakes the Crazyflie (28 g) on the ground.
    flier.set("EST_STILL_ACC", 1.5);
    flier.fly(8_000);
    flier.up();
    climb(&mut flier);
    flier
}

/// Climbs by some 15 m.
fn climb(flier: &mut Flier) {
    flier.channels.us[THROTTLE] = 2000;
    flier.fly(5_000);
    flier.channels.us[THROTTLE] = 1500;
    flier.fly(3_000);
}

/// Measurements of a flip.
#[derive(Debug)]
struct Flip {
    /// Angle turned about the axis \[rad\].
    turned_rad: f64,
    /// Largest error of the rates after the first 0.4 s \[rad/s\].
    off_rad_s: f64,
    /// Largest loss of height until 6 s after the flip \[m\].
    lost_m: f64,
    /// Time from the flip's end until the vehicle stays upright \[ms\].
    upright_ms: u64,
}

fn tilt_rad(flier: &Flier) -> f64 {
    let attitude_rad = flier.world.plant().motion().attitude_rad;
    (attitude_rad.x.cos() * attitude_rad.y.cos()).acos()
}

/// Turns about an axis for one second with one stick at its end, then returns to position mode.
fn flip(flier: &mut Flier, stick: usize, end: u16) -> Flip {
    let axis = [ROLL, PITCH, YAW].iter().position(|other| *other == stick).unwrap();
    let wanted_rad_s = f64::from(FLIP_DEG_S.to_radians()) * if (end > 1500) == (stick != YAW) { 1.0 } else { -1.0 };
    flier.channels.us[MODE] = 2000;
    flier.fly(300);
    assert_eq!(flier.mode(), FlightMode::Acro);
    let begin_m = flier.position_m().z;
    let (mut turned_rad, mut off_rad_s, mut lost_m) = (0.0, 0.0_f64, 0.0_f64);
    flier.channels.us[stick] = end;
    for ms in 0..1_000 {
        flier.tick(None);
        let rates_rad_s = flier.world.plant().motion().rates_rad_s;
        turned_rad += rates_rad_s[axis] * 1e-3;
        if ms >= 400 {
            let mut off = rates_rad_s;
            off[axis] -= wanted_rad_s;
            off_rad_s = off_rad_s.max(off.norm());
        }
        lost_m = lost_m.max(begin_m - flier.position_m().z);
    }
    flier.channels.us[stick] = 1500;
    flier.channels.us[MODE] = 1000;
    let mut upright_ms = 0;
    for ms in 0..6_000 {
        flier.tick(None);
        lost_m = lost_m.max(begin_m - flier.position_m().z);
        if tilt_rad(flier) > 0.5 {
            upright_ms = ms;
        }
    }
    assert_eq!((flier.mode(), flier.armed()), (FlightMode::Position, true));
    Flip { turned_rad, off_rad_s, lost_m, upright_ms }
}

/// Each flip about roll and pitch follows its rate, and ends upright in position mode. About yaw, the rotors of the
/// paper's vehicle only reach half the rate, so that yaw rates are not checked.
#[test]
fn flips_end_in_position_mode() {
    for name in ["paper", "racer", "crazyflie"] {
        let mut flier = hovering(name, 1, FLIP_DEG_S);
        for (stick, end) in [(ROLL, 2000), (ROLL, 1000), (PITCH, 2000), (PITCH, 1000), (YAW, 2000)] {
            climb(&mut flier);
            let flip = flip(&mut flier, stick, end);
            // Upside down, the thrust drives the vehicle down: it loses some g t^2 in 1 s, and more until it stops. The
            // Crazyflie has the slowest rotors, and leans by more than 0.5 rad again to stop.
            let (lost_m, upright_ms) = if name == "crazyflie" { (20.0, 3_000) } else { (15.0, 1_200) };
            assert!(flip.lost_m < lost_m && flip.upright_ms < upright_ms, "{name} {flip:?}");
            if stick != YAW {
                // The vehicle turns once, less what it misses until it reaches the rate.
                assert!((5.8..6.5).contains(&flip.turned_rad.abs()), "{name} {flip:?}");
                assert!(flip.off_rad_s < 1.3, "{name} {flip:?}");
            }
        }
        assert!(flier.report.as_ref().unwrap().health.control.fallback.is_none(), "{name}");
    }
}

/// A flip is what a pilot in acro mode wants: no tumble detection stops the motors, even for longer than its usual
/// time.
#[test]
fn it_is_not_found_tumbling() {
    let mut flier = hovering("paper", 2, 720.0);
    (0..4).for_each(|_| climb(&mut flier));
    flier.channels.us[MODE] = 2000;
    flier.channels.us[ROLL] = 1900;
    for _ in 0..2_500 {
        flier.tick(None);
        assert!(flier.armed());
    }
    assert_eq!(flier.mode(), FlightMode::Acro);
    flier.channels.us[ROLL] = 1500;
    flier.channels.us[MODE] = 1000;
    flier.fly(6_000);
    assert!(flier.armed() && tilt_rad(&flier) < 0.5, "{}", tilt_rad(&flier));
}

/// When the radio is lost in a flip, the last frame holds for half a second, then hold mode rights the vehicle.
#[test]
fn a_pilot_who_is_lost_in_a_flip_is_righted() {
    let mut flier = hovering("paper", 3, FLIP_DEG_S);
    (0..2).for_each(|_| climb(&mut flier));
    for lost_after_ms in [250, 500, 750] {
        climb(&mut flier);
        flier.channels.us[MODE] = 2000;
        flier.channels.us[ROLL] = 2000;
        flier.fly(lost_after_ms);
        let receiver = std::mem::replace(&mut flier.receiver, Box::new(|_, _| Vec::new()));
        flier.fly(600);
        assert_eq!((flier.mode(), flier.armed()), (FlightMode::Hold, true));
        flier.fly(1_500);
        assert!(flier.tilt_rad(4_000) < 0.5, "after {lost_after_ms} ms");
        let place_m = flier.position_m();
        flier.fly(2_000);
        assert!((flier.position_m() - place_m).norm() < 2.0);
        flier.receiver = receiver;
        flier.channels.us[ROLL] = 1500;
        flier.fly(1_000);
        flier.channels.us[MODE] = 1000;
        flier.fly(1_000);
        assert_eq!(flier.mode(), FlightMode::Position, "after {lost_after_ms} ms");
    }
}

#[test]
fn the_kill_switch_counts() {
    let mut flier = hovering("paper", 4, FLIP_DEG_S);
    flier.channels.us[MODE] = 2000;
    flier.channels.us[ROLL] = 2000;
    flier.fly(300);
    flier.channels.us[KILL] = 2000;
    flier.fly(20);
    assert!(!flier.armed() && flier.report.as_ref().unwrap().throttles.iter().all(|throttle| *throttle == 0));
}
