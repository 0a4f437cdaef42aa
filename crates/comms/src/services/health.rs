//! Health of the vehicle: SYS_STATUS, ESTIMATOR_STATUS and the landed state.

use crate::services::status::{AuxSensors, VehicleStatus};
use afbc_flight_core::{Mode, Reasons};
use afbc_guidance::FlightMode;
use afbc_mavlink::telemetry::{BatteryStatus, EstimatorStatus, SystemStatus};

/// Bits of `MAV_SYS_STATUS_SENSOR`.
pub mod sensor {
    #![allow(missing_docs, reason = "MAVLink's names")]
    pub const GYROSCOPE: u32 = 1;
    pub const ACCELEROMETER: u32 = 2;
    pub const MAGNETOMETER: u32 = 4;
    pub const BAROMETER: u32 = 8;
    pub const SATELLITES: u32 = 0x20;
    pub const TRACKER: u32 = 0x80;
    pub const MOTORS: u32 = 0x8000;
    pub const GYROSCOPE_2: u32 = 0x2_0000;
    pub const ACCELEROMETER_2: u32 = 0x4_0000;
    pub const ATTITUDE: u32 = 0x20_0000;
    pub const BATTERY: u32 = 0x0200_0000;
    pub const ARMING: u32 = 0x1000_0000;
}

/// Sensors that must be healthy before the vehicle can be armed, if the vehicle has them.
pub(super) const NEEDED: u32 =
    sensor::GYROSCOPE | sensor::ACCELEROMETER | sensor::GYROSCOPE_2 | sensor::ACCELEROMETER_2 | sensor::MAGNETOMETER;

/// Values of `MAV_LANDED_STATE`.
const ON_GROUND: u8 = 1;
const IN_AIR: u8 = 2;
const TAKING_OFF: u8 = 3;
const LANDING: u8 = 4;

impl AuxSensors {
    /// Sets the battery's voltage \[V\] and current \[A\], if the current is measured. None means that no battery was
    /// read.
    pub fn put_battery(&mut self, reading: Option<(f32, Option<f32>)>) {
        self.sensors.present |= sensor::BATTERY;
        self.battery = reading.map(|(voltage_v, current_a)| BatteryStatus {
            // The two largest values have special meanings.
            voltage_mv: (voltage_v * 1e3).min(65_533.0) as u16,
            current_ca: current_a.map_or(-1, |current_a| (current_a * 1e2) as i16),
            consumed_mah: -1,
            remaining_percent: -1,
            charge: 0,
        });
    }
}

/// Returns SYS_STATUS.
pub fn system(status: &VehicleStatus) -> SystemStatus {
    let aux = &status.aux;
    // With two IMUs, the shell reports each of them.
    let first = (sensor::GYROSCOPE | sensor::ACCELEROMETER) & !aux.sensors.present;
    let inertial = first | sensor::ATTITUDE;
    let located = status.is_located();
    let fixed = aux.receiver.is_some_and(|receiver| receiver.kind >= 3);
    let faulty = aux.sensors.present & !aux.sensors.healthy & NEEDED;
    let ready = status.against.is_some_and(Reasons::is_empty) && faulty == 0;
    let armable = status.mode.armed() || ready;
    let sets = [
        (status.senses, true, inertial),
        (!status.senses, located, sensor::TRACKER),
        (aux.receiver.is_some(), fixed && located, sensor::SATELLITES),
        (aux.battery.is_some(), true, sensor::BATTERY),
        (true, status.escs.failures.iter().all(Option::is_none), sensor::MOTORS),
        (true, armable, sensor::ARMING),
    ];
    let reported = aux.sensors;
    let present = sets.iter().filter(|(present, ..)| *present).fold(reported.present, |all, (_, _, bits)| all | bits);
    let well = sets.iter().filter(|(present, healthy, _)| *present && *healthy);
    let healthy = well.fold(reported.present & reported.healthy, |all, (_, _, bits)| all | bits);
    let battery = aux.battery;
    SystemStatus {
        present,
        enabled: present,
        healthy,
        // Share of the tick's 1 ms that was used.
        load_permille: status.tick_us.clamp(0.0, 1000.0) as u16,
        voltage_mv: battery.map_or(u16::MAX, |battery| battery.voltage_mv),
        current_ca: battery.map_or(-1, |battery| battery.current_ca),
        remaining_percent: battery.map_or(-1, |battery| battery.remaining_percent),
        dropped_frames: u16::try_from(status.dropped_frames).unwrap_or(u16::MAX),
    }
}

/// Returns ESTIMATOR_STATUS. Its uncertainties are those of the satellite receiver, if there is one.
pub fn estimator(status: &VehicleStatus) -> EstimatorStatus {
    /// Bits of `ESTIMATOR_STATUS_FLAGS`: ATTITUDE, VELOCITY_HORIZ, VELOCITY_VERT, POS_HORIZ_REL, POS_VERT_ABS.
    const MOTION: u16 = 1 | 2 | 4 | 8 | 32;
    /// Bit POS_HORIZ_ABS.
    const ABSOLUTE: u16 = 16;
    let located = status.is_located();
    let absolute = located && status.aux.origin.is_some();
    let attitude = u16::from(status.senses);
    let flags = if located { MOTION } else { attitude } | if absolute { ABSOLUTE } else { 0 };
    let sigma_m = status.aux.receiver.map_or([f32::NAN; 2], |receiver| {
        receiver.sigma_mm.map(|sigma_mm| if sigma_mm == 0 { f32::NAN } else { sigma_mm as f32 * 1e-3 })
    });
    EstimatorStatus { time_us: status.time_us, flags, sigma_m }
}

/// Returns the `MAV_LANDED_STATE`.
pub fn landed(status: &VehicleStatus) -> u8 {
    match (status.mode, status.guided.mode) {
        (Mode::Disarmed, _) => ON_GROUND,
        _ if !status.is_airborne() => ON_GROUND,
        (Mode::Descending, _) | (_, FlightMode::Land) => LANDING,
        (_, FlightMode::Takeoff) => TAKING_OFF,
        _ => IN_AIR,
    }
}

#[cfg(test)]
#[allow(clippy::expect_used, reason = "a test that cannot go on should say why")]
mod tests {
    use super::*;
    use crate::services::status::{GnssReceiver, SensorBits};
    use afbc_flight_core::Refusal;
    use afbc_types::State;

    fn well() -> VehicleStatus {
        let mut status = VehicleStatus { state: Some(State::default()), senses: true, ..VehicleStatus::default() };
        status.against = Some(Reasons::NONE);
        status.aux.receiver = Some(GnssReceiver { kind: 3, satellites: 12, sigma_mm: [500, 800] });
        let sensors = sensor::MAGNETOMETER | sensor::BAROMETER;
        status.aux.sensors = SensorBits { present: sensors, healthy: sensors };
        status
    }

    /// MAVSDK's `health` reads these bits: gyroscope, accelerometer, magnetometer, position, arming.
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
        type Case = (fn(&mut VehicleStatus), u32);
        let cases: [Case; 4] = [
            (|status| status.aux.sensors.healthy = sensor::BAROMETER, sensor::MAGNETOMETER | sensor::ARMING),
            (|status| status.aux.receiver = Some(GnssReceiver::default()), sensor::SATELLITES),
            (|status| status.against = Some(Refusal::NotAtRest.into()), sensor::ARMING),
            (|status| status.against = None, sensor::ARMING),
        ];
        let all = system(&well()).healthy;
        for (spoil, bit) in cases {
            let mut status = well();
            spoil(&mut status);
            assert_eq!(system(&status).healthy, all & !bit, "{bit:#x}");
        }
    }

    /// A battery's readings become SYS_STATUS. Without a reading the battery is present but not healthy.
    #[test]
    fn a_battery_is_told() {
        for (reading, told, healthy) in [
            (Some((14.8, Some(12.5))), (14_800, 1250, -1), sensor::BATTERY),
            (Some((14.8, None)), (14_800, -1, -1), sensor::BATTERY),
            (Some((99.0, Some(400.0))), (65_533, i16::MAX, -1), sensor::BATTERY),
            (None, (u16::MAX, -1, -1), 0),
        ] {
            let mut status = well();
            status.aux.put_battery(reading);
            let reported = system(&status);
            assert_eq!((reported.voltage_mv, reported.current_ca, reported.remaining_percent), told);
            assert_eq!(
                (reported.present & sensor::BATTERY, reported.healthy & sensor::BATTERY),
                (sensor::BATTERY, healthy)
            );
        }
    }

    #[test]
    fn the_landed_state_follows_modes() {
        let mut status = well();
        assert_eq!(landed(&status), ON_GROUND);
        status.mode = Mode::Flying;
        assert_eq!(landed(&status), ON_GROUND);
        status.guided.airborne = true;
        assert_eq!(landed(&status), IN_AIR);
        status.guided.mode = FlightMode::Takeoff;
        assert_eq!(landed(&status), TAKING_OFF);
        status.mode = Mode::Descending;
        assert_eq!(landed(&status), LANDING);
    }

    /// All combinations of present and healthy sensors give the bits of their definitions.
    #[test]
    fn every_bit_is_there_and_well_by_what_it_means() {
        for case in 0..128_u32 {
            let has = |bit: u32| case >> bit & 1 == 1;
            let mut status = well();
            status.senses = has(0);
            if !has(1) {
                status.health.state_age_us = u32::MAX;
            }
            status.aux.receiver =
                has(2).then_some(GnssReceiver { kind: if has(3) { 3 } else { 2 }, satellites: 9, sigma_mm: [0; 2] });
            let battery = BatteryStatus {
                voltage_mv: 11_100,
                current_ca: 250,
                remaining_percent: 66,
                consumed_mah: 5,
                charge: 1,
            };
            status.aux.battery = has(4).then_some(battery);
            status.mode = if has(5) { Mode::Flying } else { Mode::Disarmed };
            status.against = Some(if has(6) { Refusal::NotAtRest.into() } else { Reasons::NONE });
            (status.tick_us, status.dropped_frames) = (123.9, 77);
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
            let reported = system(&status);
            assert_eq!(
                (reported.present, reported.enabled, reported.healthy),
                (present, present, present - ill),
                "{case:#b}"
            );
            assert_eq!((reported.load_permille, reported.dropped_frames), (123, 77));
            let battery = if has(4) { (11_100, 250, 66) } else { (u16::MAX, -1, -1) };
            assert_eq!((reported.voltage_mv, reported.current_ca, reported.remaining_percent), battery);

            status.aux.origin = has(6).then(|| {
                let at = crate::services::origin::EarthOrigin::SIMULATED;
                crate::services::origin::EarthOrigin::new(at).expect("possible")
            });
            let motion = if has(1) { 1 + 2 + 4 + 8 + 32 } else { u16::from(has(0)) };
            let absolute = if has(1) && has(6) { 16 } else { 0 };
            assert_eq!(estimator(&status).flags, motion + absolute, "{case:#b}");
            assert!(estimator(&status).sigma_m.iter().all(|sigma| sigma.is_nan()));
        }
        let mut status = well();
        status.time_us = 42;
        assert_eq!((estimator(&status).time_us, estimator(&status).sigma_m), (42, [0.5, 0.8]));
        // A sensor that the shell reports unhealthy is unhealthy. An absent sensor is not healthy.
        let sensors = SensorBits { present: sensor::BAROMETER, healthy: sensor::MAGNETOMETER };
        status.aux.sensors = sensors;
        let reported = system(&status);
        assert_eq!((reported.present & 12, reported.healthy & 12), (sensor::BAROMETER, 0));
        (status.tick_us, status.dropped_frames) = (5e3, 70_000);
        assert_eq!((system(&status).load_permille, system(&status).dropped_frames), (1000, u16::MAX));
    }

    #[test]
    fn landings_are_reported_in_the_air_only() {
        let mut status = well();
        for (mode, flight_mode, airborne, expected) in [
            (Mode::Flying, FlightMode::Land, true, LANDING),
            (Mode::Flying, FlightMode::Land, false, ON_GROUND),
            (Mode::Descending, FlightMode::Hold, false, ON_GROUND),
            (Mode::Disarmed, FlightMode::Takeoff, true, ON_GROUND),
            (Mode::Coasting, FlightMode::Hold, true, IN_AIR),
            (Mode::Coasting, FlightMode::Takeoff, true, TAKING_OFF),
        ] {
            (status.mode, status.guided.mode, status.guided.airborne) = (mode, flight_mode, airborne);
            assert_eq!(landed(&status), expected, "{mode:?} {flight_mode:?} {airborne}");
        }
    }
}
