//! The vehicle's health as stations read it.

use crate::services::picture::Picture;
use afbc_flight_core::{Mode, Reasons};
use afbc_guidance::FlightMode;
use afbc_link::telemetry::{EstimatorStatus, SystemStatus};

/// `MAV_SYS_STATUS_SENSOR`.
pub mod sensor {
    #![allow(missing_docs, reason = "MAVLink's names")]
    pub const GYROSCOPE: u32 = 1;
    pub const ACCELEROMETER: u32 = 2;
    pub const MAGNETOMETER: u32 = 4;
    pub const BAROMETER: u32 = 8;
    pub const SATELLITES: u32 = 0x20;
    pub const TRACKER: u32 = 0x80;
    pub const MOTORS: u32 = 0x8000;
    pub const ATTITUDE: u32 = 0x20_0000;
    pub const BATTERY: u32 = 0x0200_0000;
    pub const ARMING: u32 = 0x1000_0000;
}

/// `MAV_LANDED_STATE`.
const ON_GROUND: u8 = 1;
const IN_AIR: u8 = 2;
const TAKING_OFF: u8 = 3;
const LANDING: u8 = 4;

/// Returns SYS_STATUS.
pub fn system(picture: &Picture) -> SystemStatus {
    let surroundings = &picture.surroundings;
    let inertial = sensor::GYROSCOPE | sensor::ACCELEROMETER | sensor::ATTITUDE;
    let located = picture.is_located();
    let fixed = surroundings.receiver.is_some_and(|receiver| receiver.kind >= 3);
    let armable = picture.mode.armed() || picture.against.is_some_and(Reasons::is_empty);
    let sets = [
        (picture.senses, true, inertial),
        (!picture.senses, located, sensor::TRACKER),
        (surroundings.receiver.is_some(), fixed && located, sensor::SATELLITES),
        (surroundings.battery.is_some(), true, sensor::BATTERY),
        (true, true, sensor::MOTORS),
        (true, armable, sensor::ARMING),
    ];
    let told = surroundings.sensors;
    let present = sets.iter().filter(|(present, ..)| *present).fold(told.present, |all, (_, _, bits)| all | bits);
    let well = sets.iter().filter(|(present, healthy, _)| *present && *healthy);
    let healthy = well.fold(told.present & told.healthy, |all, (_, _, bits)| all | bits);
    let battery = surroundings.battery;
    SystemStatus {
        present,
        enabled: present,
        healthy,
        // Of a tick's millisecond.
        load_permille: picture.tick_us.clamp(0.0, 1000.0) as u16,
        voltage_mv: battery.map_or(u16::MAX, |battery| battery.voltage_mv),
        current_ca: battery.map_or(-1, |battery| battery.current_ca),
        remaining_percent: battery.map_or(-1, |battery| battery.remaining_percent),
        dropped_frames: u16::try_from(picture.dropped_frames).unwrap_or(u16::MAX),
    }
}

/// Returns ESTIMATOR_STATUS. Uncertainties are those of the satellite receiver, where there is one.
pub fn estimator(picture: &Picture) -> EstimatorStatus {
    /// ATTITUDE, VELOCITY_HORIZ, VELOCITY_VERT, POS_HORIZ_REL, POS_VERT_ABS.
    const MOTION: u16 = 1 | 2 | 4 | 8 | 32;
    /// POS_HORIZ_ABS.
    const ABSOLUTE: u16 = 16;
    let located = picture.is_located();
    let absolute = located && picture.surroundings.origin.is_some();
    let attitude = u16::from(picture.senses);
    let flags = if located { MOTION } else { attitude } | if absolute { ABSOLUTE } else { 0 };
    let sigma_m = picture.surroundings.receiver.map_or([f32::NAN; 2], |receiver| {
        receiver.sigma_mm.map(|sigma_mm| if sigma_mm == 0 { f32::NAN } else { sigma_mm as f32 * 1e-3 })
    });
    EstimatorStatus { time_us: picture.time_us, flags, sigma_m }
}

/// Returns the `MAV_LANDED_STATE`.
pub fn landed(picture: &Picture) -> u8 {
    match (picture.mode, picture.guided.mode) {
        (Mode::Disarmed, _) => ON_GROUND,
        _ if !picture.is_airborne() => ON_GROUND,
        (Mode::Descending, _) | (_, FlightMode::Land) => LANDING,
        (_, FlightMode::Takeoff) => TAKING_OFF,
        _ => IN_AIR,
    }
}

#[cfg(test)]
#[allow(clippy::expect_used, reason = "a test that cannot go on should say why")]
mod tests {
    use super::*;
    use crate::services::picture::{Receiver, Sensors};
    use afbc_flight_core::Refusal;
    use afbc_types::State;

    fn well() -> Picture {
        let mut picture = Picture { state: Some(State::default()), senses: true, ..Picture::default() };
        picture.against = Some(Reasons::NONE);
        picture.surroundings.receiver = Some(Receiver { kind: 3, satellites: 12, sigma_mm: [500, 800] });
        let sensors = sensor::MAGNETOMETER | sensor::BAROMETER;
        picture.surroundings.sensors = Sensors { present: sensors, healthy: sensors };
        picture
    }

    /// What MAVSDK's `health` reads: gyroscope, accelerometer, magnetometer, position, arming.
    #[test]
    fn a_vehicle_outdoors_is_all_well() {
        let SystemStatus { present, enabled, healthy, .. } = system(&well());
        assert_eq!((present, enabled), (healthy, healthy));
        for bit in [sensor::GYROSCOPE, sensor::ACCELEROMETER, sensor::MAGNETOMETER, sensor::SATELLITES, sensor::ARMING]
        {
            assert_ne!(healthy & bit, 0, "{bit:#x}");
        }
        assert_eq!(estimator(&well()).flags & 1, 1);
    }

    #[test]
    fn each_fault_takes_its_bit() {
        type Case = (fn(&mut Picture), u32);
        let cases: [Case; 4] = [
            (|picture| picture.surroundings.sensors.healthy = sensor::BAROMETER, sensor::MAGNETOMETER),
            (|picture| picture.surroundings.receiver = Some(Receiver::default()), sensor::SATELLITES),
            (|picture| picture.against = Some(Refusal::NotAtRest.into()), sensor::ARMING),
            (|picture| picture.against = None, sensor::ARMING),
        ];
        let all = system(&well()).healthy;
        for (spoil, bit) in cases {
            let mut picture = well();
            spoil(&mut picture);
            assert_eq!(system(&picture).healthy, all & !bit, "{bit:#x}");
        }
    }

    #[test]
    fn the_landed_state_follows_modes() {
        let mut picture = well();
        assert_eq!(landed(&picture), ON_GROUND);
        picture.mode = Mode::Flying;
        assert_eq!(landed(&picture), ON_GROUND);
        picture.guided.airborne = true;
        assert_eq!(landed(&picture), IN_AIR);
        picture.guided.mode = FlightMode::Takeoff;
        assert_eq!(landed(&picture), TAKING_OFF);
        picture.mode = Mode::Descending;
        assert_eq!(landed(&picture), LANDING);
    }

    /// Every set of what there is and what is well, by the definition of each bit.
    #[test]
    fn every_bit_is_there_and_well_by_what_it_means() {
        for case in 0..128_u32 {
            let has = |bit: u32| case >> bit & 1 == 1;
            let mut picture = well();
            picture.senses = has(0);
            if !has(1) {
                picture.health.state_age_us = u32::MAX;
            }
            picture.surroundings.receiver =
                has(2).then_some(Receiver { kind: if has(3) { 3 } else { 2 }, satellites: 9, sigma_mm: [0; 2] });
            let battery = afbc_link::telemetry::Battery {
                voltage_mv: 11_100,
                current_ca: 250,
                remaining_percent: 66,
                consumed_mah: 5,
                charge: 1,
            };
            picture.surroundings.battery = has(4).then_some(battery);
            picture.mode = if has(5) { Mode::Flying } else { Mode::Disarmed };
            picture.against = Some(if has(6) { Refusal::NotAtRest.into() } else { Reasons::NONE });
            (picture.tick_us, picture.dropped_frames) = (123.9, 77);
            let inertial = sensor::GYROSCOPE | sensor::ACCELEROMETER | sensor::ATTITUDE;
            let others = sensor::MAGNETOMETER | sensor::BAROMETER | sensor::MOTORS;
            let present = others
                + sensor::ARMING
                + if has(0) { inertial } else { sensor::TRACKER }
                + if has(2) { sensor::SATELLITES } else { 0 }
                + if has(4) { sensor::BATTERY } else { 0 };
            let ill = if !has(0) && !has(1) { sensor::TRACKER } else { 0 }
                + if has(2) && !(has(1) && has(3)) { sensor::SATELLITES } else { 0 }
                + if has(6) && !has(5) { sensor::ARMING } else { 0 };
            let told = system(&picture);
            assert_eq!((told.present, told.enabled, told.healthy), (present, present, present - ill), "{case:#b}");
            assert_eq!((told.load_permille, told.dropped_frames), (123, 77));
            let battery = if has(4) { (11_100, 250, 66) } else { (u16::MAX, -1, -1) };
            assert_eq!((told.voltage_mv, told.current_ca, told.remaining_percent), battery);

            picture.surroundings.origin = has(6).then(|| {
                let at = crate::services::origin::Origin::SIMULATED;
                crate::services::origin::Origin::new(at).expect("possible")
            });
            let motion = if has(1) { 1 + 2 + 4 + 8 + 32 } else { u16::from(has(0)) };
            let absolute = if has(1) && has(6) { 16 } else { 0 };
            assert_eq!(estimator(&picture).flags, motion + absolute, "{case:#b}");
            assert!(estimator(&picture).sigma_m.iter().all(|sigma| sigma.is_nan()));
        }
        let mut picture = well();
        picture.time_us = 42;
        assert_eq!((estimator(&picture).time_us, estimator(&picture).sigma_m), (42, [0.5, 0.8]));
        // What the shell says is ill is ill, and what is not there is not well.
        let sensors = Sensors { present: sensor::BAROMETER, healthy: sensor::MAGNETOMETER };
        picture.surroundings.sensors = sensors;
        let told = system(&picture);
        assert_eq!((told.present & 12, told.healthy & 12), (sensor::BAROMETER, 0));
        (picture.tick_us, picture.dropped_frames) = (5e3, 70_000);
        assert_eq!((system(&picture).load_permille, system(&picture).dropped_frames), (1000, u16::MAX));
    }

    #[test]
    fn landings_are_told_in_the_air_only() {
        let mut picture = well();
        for (mode, flight_mode, airborne, expected) in [
            (Mode::Flying, FlightMode::Land, true, LANDING),
            (Mode::Flying, FlightMode::Land, false, ON_GROUND),
            (Mode::Descending, FlightMode::Hold, false, ON_GROUND),
            (Mode::Disarmed, FlightMode::Takeoff, true, ON_GROUND),
            (Mode::Coasting, FlightMode::Hold, true, IN_AIR),
            (Mode::Coasting, FlightMode::Takeoff, true, TAKING_OFF),
        ] {
            (picture.mode, picture.guided.mode, picture.guided.airborne) = (mode, flight_mode, airborne);
            assert_eq!(landed(&picture), expected, "{mode:?} {flight_mode:?} {airborne}");
        }
    }
}
