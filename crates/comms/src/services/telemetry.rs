//! Composes telemetry messages from the state of the vehicle.

use crate::services::health;
use crate::services::modes;
use crate::services::origin::{EarthOrigin, Global};
use crate::services::status::{RadioStatus, VehicleStatus};
use crate::services::streams::id;
use afbc_control::math::sqrt;
use afbc_mavlink::telemetry::{
    self, ActuatorOutputs, AttitudeQuaternion, GlobalPositionInt, GpsRawInt, HomePosition, Version, VfrHud,
};
use afbc_mavlink::{Downlink, RadioChannels, Telemetry, TimeMessage};
use micromath::F32Ext;
use nalgebra::Vector3;

/// `MAV_PROTOCOL_CAPABILITY`: MISSION_INT, COMMAND_INT, bytewise parameters, attitude and both position targets,
/// MAVLink 2.
const CAPABILITIES: u64 = 4 | 8 | 16 | 64 | 128 | 256 | 8192;
/// `MAV_PROTOCOL_CAPABILITY_FTP`.
const FILES: u64 = 32;
const TAU: f32 = core::f32::consts::TAU;

/// Returns the telemetry message numbered `message`, if its content is known.
pub fn compose(message: u32, status: &VehicleStatus) -> Option<Downlink> {
    let telemetry = |telemetry| Some(Downlink::Telemetry(telemetry));
    let (time_ms, time_us) = (status.time_ms(), status.time_us);
    match message {
        id::SYS_STATUS => telemetry(Telemetry::System(health::system(status))),
        id::SYSTEM_TIME => {
            let powered_up_us = status.aux.powered_up_us;
            let unix_us = if powered_up_us == 0 { 0 } else { powered_up_us.saturating_add(time_us) };
            Some(Downlink::Time(TimeMessage::Time { unix_us, boot_ms: time_ms }))
        }
        id::GPS_RAW_INT => telemetry(Telemetry::GpsRawInt(fix(status)?)),
        id::ATTITUDE => {
            let state = status.state?;
            let (attitude_rad, rates_rad_s) = (state.attitude_rad, state.rates_rad_s);
            Some(Downlink::Attitude { time_ms, attitude_rad, rates_rad_s })
        }
        id::ATTITUDE_QUATERNION => {
            let state = status.state?;
            let attitude = quaternion(&state);
            telemetry(Telemetry::Attitude(AttitudeQuaternion { time_ms, attitude, rates_rad_s: state.rates_rad_s }))
        }
        id::LOCAL_POSITION_NED => {
            let state = status.state?;
            let (position_m, velocity_m_s) = (state.position_m, state.velocity_m_s);
            Some(Downlink::Position { time_ms, position_m, velocity_m_s })
        }
        id::GLOBAL_POSITION_INT => telemetry(Telemetry::GlobalPositionInt(global(status)?)),
        id::GPS_GLOBAL_ORIGIN => {
            let at = status.aux.origin?.at();
            let (place_e7, altitude_mm) = (at.e7(), at.altitude_mm());
            telemetry(Telemetry::GpsGlobalOrigin(telemetry::GlobalOrigin { place_e7, altitude_mm, time_us }))
        }
        id::RC_CHANNELS => {
            let RadioStatus { channels, rssi } = status.radio?;
            telemetry(Telemetry::Channels(RadioChannels { time_ms, us: channels.us, rssi }))
        }
        id::VFR_HUD => telemetry(Telemetry::VfrHud(summary(status)?)),
        id::BATTERY_STATUS => telemetry(Telemetry::Battery(status.aux.battery?)),
        id::ESTIMATOR_STATUS => telemetry(Telemetry::Estimator(health::estimator(status))),
        id::HOME_POSITION => telemetry(Telemetry::HomePosition(home(status)?)),
        id::EXTENDED_SYS_STATE => telemetry(Telemetry::Landed(health::landed(status))),
        id::ACTUATOR_OUTPUT_STATUS => {
            let throttles = status.throttles.map(throttle);
            telemetry(Telemetry::Outputs(ActuatorOutputs { time_us, active: status.rotors.into(), throttles }))
        }
        id::AUTOPILOT_VERSION => {
            let software = [version(env!("CARGO_PKG_VERSION_MAJOR")), version(env!("CARGO_PKG_VERSION_MINOR"))];
            let [major, minor] = software;
            let software = [major, minor, version(env!("CARGO_PKG_VERSION_PATCH")), 255];
            let capabilities = CAPABILITIES | if status.has_files { FILES } else { 0 };
            telemetry(Telemetry::Version(Version { capabilities, uid: 0, software, commit: [0; 8] }))
        }
        id::PROTOCOL_VERSION => telemetry(Telemetry::Protocol),
        id::CURRENT_MODE => Some(Downlink::CurrentMode(modes::current(status.flight_mode(), status.guided.mode))),
        _ => None,
    }
}

/// Converts a throttle from 48 to 2047 to a number from 0 to 1.
fn throttle(throttle: u16) -> f32 {
    f32::from(throttle.saturating_sub(47)) / 2000.0
}

/// Parses a part of the version number.
fn version(digits: &str) -> u8 {
    digits.bytes().fold(0, |number, digit| number.wrapping_mul(10).wrapping_add(digit.saturating_sub(b'0')))
}

fn quaternion(state: &afbc_types::State) -> [f32; 4] {
    let q = state.quaternion().coords;
    [q.w, q.x, q.y, q.z]
}

/// Returns the compass heading \[deg\], from 0 to below 360, of a yaw that is positive counterclockwise.
fn heading_deg(yaw_rad: f32) -> f32 {
    let turns = -yaw_rad / TAU;
    let heading = 360.0 * (turns - F32Ext::floor(turns));
    // The heading of a yaw just above 0 is rounded up to 360.
    if heading < 360.0 { heading } else { 0.0 }
}

/// Returns home, or the origin of the local frame if there is no home.
fn home_m(status: &VehicleStatus) -> Vector3<f32> {
    status.guided.home_m.unwrap_or_default()
}

fn place(status: &VehicleStatus) -> Option<(EarthOrigin, Global, afbc_types::State)> {
    let (origin, state) = (status.aux.origin?, status.state?);
    status.is_located().then(|| (origin, origin.global(&state.position_m), state))
}

fn global(status: &VehicleStatus) -> Option<GlobalPositionInt> {
    let (_, place, state) = place(status)?;
    let cm_s = |speed_m_s: f32| (speed_m_s * 100.0) as i16;
    let v = state.velocity_m_s;
    Some(GlobalPositionInt {
        time_ms: status.time_ms(),
        place_e7: place.e7(),
        altitude_mm: place.altitude_mm(),
        relative_mm: ((state.position_m.z - home_m(status).z) * 1e3) as i32,
        velocity_ned_cm_s: [cm_s(v.x), cm_s(-v.y), cm_s(-v.z)],
        heading_cdeg: ((heading_deg(state.attitude_rad.z) * 100.0) as u16).min(35_999),
    })
}

fn fix(status: &VehicleStatus) -> Option<GpsRawInt> {
    let receiver = status.aux.receiver?;
    let known = place(status);
    let (place_e7, altitude_mm) = known.as_ref().map_or(([0; 2], 0), |(_, place, _)| (place.e7(), place.altitude_mm()));
    let (speed_cm_s, course_cdeg) = known.map_or((u16::MAX, u16::MAX), |(.., state)| {
        let v = state.velocity_m_s;
        // The approximate arctangent is accurate to 0.16 degrees. A receiver's own course is accurate to a few degrees.
        let course = heading_deg(F32Ext::atan2(v.y, v.x)) * 100.0;
        ((sqrt(v.xy().norm_squared()) * 100.0) as u16, (course as u16).min(35_999))
    });
    let crate::services::status::GnssReceiver { kind, satellites, sigma_mm } = receiver;
    Some(GpsRawInt {
        time_us: status.time_us,
        place_e7,
        altitude_mm,
        kind,
        satellites,
        sigma_mm,
        speed_cm_s,
        course_cdeg,
    })
}

fn home(status: &VehicleStatus) -> Option<HomePosition> {
    let (origin, position_m) = (status.aux.origin?, status.guided.home_m?);
    let place = origin.global(&position_m);
    let (place_e7, altitude_mm, attitude) = (place.e7(), place.altitude_mm(), [1.0, 0.0, 0.0, 0.0]);
    Some(HomePosition { place_e7, altitude_mm, position_m, attitude, time_us: status.time_us })
}

fn summary(status: &VehicleStatus) -> Option<VfrHud> {
    let state = status.state?;
    let v = state.velocity_m_s;
    let above_m = status.aux.origin.map_or(0.0, |origin| origin.at().altitude_m as f32);
    let rotors = usize::from(status.rotors).max(1);
    let throttles = status.throttles.iter().take(rotors).map(|it| throttle(*it)).sum::<f32>() / rotors as f32;
    Some(VfrHud {
        speed_m_s: sqrt(v.xy().norm_squared()),
        altitude_m: above_m + state.position_m.z,
        climb_m_s: v.z,
        heading_deg: heading_deg(state.attitude_rad.z) as i16,
        throttle_percent: (100.0 * throttles) as u16,
    })
}

#[cfg(test)]
#[allow(clippy::expect_used, clippy::panic, reason = "a test that cannot go on should say why")]
mod tests {
    use super::*;

    #[test]
    fn headings_are_a_compass() {
        for (yaw, heading) in [(0.0, 0.0), (-0.25, 90.0), (0.25, 270.0), (-1.5, 180.0), (-3.0, 0.0)] {
            assert!((heading_deg(yaw * TAU) - heading).abs() < 1e-3, "{yaw} of a turn");
        }
        assert!((0.0..360.0).contains(&heading_deg(1e-9)));
    }

    #[test]
    fn the_version_is_the_packages() {
        assert_eq!(["0", "7", "12"].map(version), [0, 7, 12]);
    }

    /// Unknown values are not reported. A vehicle that knows nothing still reports its health.
    #[test]
    fn what_is_not_known_is_not_reported() {
        let status = VehicleStatus::default();
        for message in [
            id::GPS_RAW_INT,
            id::ATTITUDE,
            id::LOCAL_POSITION_NED,
            id::GLOBAL_POSITION_INT,
            id::GPS_GLOBAL_ORIGIN,
            id::BATTERY_STATUS,
            id::HOME_POSITION,
            id::VFR_HUD,
            id::RC_CHANNELS,
        ] {
            assert_eq!(compose(message, &status), None, "message {message}");
        }
        for message in [id::SYS_STATUS, id::ESTIMATOR_STATUS, id::EXTENDED_SYS_STATE, id::AUTOPILOT_VERSION] {
            assert!(compose(message, &status).is_some(), "message {message}");
        }
    }

    /// Returns a flying vehicle of which everything is known.
    fn flying() -> VehicleStatus {
        let state = afbc_types::State {
            position_m: Vector3::new(30.0, -20.0, 12.5),
            velocity_m_s: Vector3::new(3.0, -4.0, 1.25),
            attitude_rad: Vector3::new(0.1, -0.2, -0.5),
            rates_rad_s: Vector3::new(0.3, 0.4, -0.6),
        };
        let mut status =
            VehicleStatus { state: Some(state), time_us: 5_000_123, rotors: 4, ..VehicleStatus::default() };
        status.guided.home_m = Some(Vector3::new(1.0, 2.0, 2.5));
        status.throttles = [47, 1047, 2047, 1047, 0, 0, 0, 0];
        status.aux.origin = EarthOrigin::new(EarthOrigin::SIMULATED);
        status.aux.receiver =
            Some(crate::services::status::GnssReceiver { kind: 3, satellites: 11, sigma_mm: [700, 900] });
        status.aux.powered_up_us = 1_700_000_000_000_000;
        status
    }

    fn reported(message: u32, status: &VehicleStatus) -> Telemetry {
        match compose(message, status) {
            Some(Downlink::Telemetry(telemetry)) => telemetry,
            other => panic!("message {message}: {other:?}"),
        }
    }

    /// Each message has the right values. The state's z is up and y is left; MAVLink's z is down and y is right.
    #[test]
    fn a_flying_vehicle_reports_its_state() {
        let status = flying();
        let (origin, state) = (status.aux.origin.expect("known"), status.state.expect("known"));
        let here = origin.global(&state.position_m);
        let Telemetry::GlobalPositionInt(global) = reported(id::GLOBAL_POSITION_INT, &status) else {
            panic!("another")
        };
        assert_eq!((global.time_ms, global.place_e7, global.altitude_mm), (5_000, here.e7(), 500_500));
        assert_eq!((global.relative_mm, global.velocity_ned_cm_s), (10_000, [300, 400, -125]));
        // Half a radian to the right is 28.64 degrees.
        assert_eq!(global.heading_cdeg, 2864);
        let Telemetry::GpsRawInt(fix) = reported(id::GPS_RAW_INT, &status) else { panic!("another") };
        assert_eq!((fix.time_us, fix.place_e7, fix.altitude_mm), (5_000_123, here.e7(), 500_500));
        assert_eq!((fix.kind, fix.satellites, fix.sigma_mm), (3, 11, [700, 900]));
        // 3 m/s north and 4 m/s east make a course of 53.13 degrees, accurate to 0.16.
        assert_eq!(fix.speed_cm_s, 500);
        assert!(fix.course_cdeg.abs_diff(5313) <= 16, "{}", fix.course_cdeg);
        let Telemetry::VfrHud(summary) = reported(id::VFR_HUD, &status) else { panic!("another") };
        assert_eq!((summary.speed_m_s, summary.altitude_m, summary.climb_m_s), (5.0, 500.5, 1.25));
        // The throttles of the four rotors are 0, 1/2, 1 and 1/2.
        assert_eq!((summary.heading_deg, summary.throttle_percent), (28, 50));
        let Telemetry::Attitude(attitude) = reported(id::ATTITUDE_QUATERNION, &status) else { panic!("another") };
        let q = state.quaternion().coords;
        assert_eq!((attitude.time_ms, attitude.rates_rad_s), (5_000, state.rates_rad_s));
        assert_eq!(attitude.attitude, [q.w, q.x, q.y, q.z]);
        let (attitude_rad, rates_rad_s) = (state.attitude_rad, state.rates_rad_s);
        assert_eq!(
            compose(id::ATTITUDE, &status),
            Some(Downlink::Attitude { time_ms: 5_000, attitude_rad, rates_rad_s })
        );
        let (position_m, velocity_m_s) = (state.position_m, state.velocity_m_s);
        let position = Downlink::Position { time_ms: 5_000, position_m, velocity_m_s };
        assert_eq!(compose(id::LOCAL_POSITION_NED, &status), Some(position));
        let Telemetry::HomePosition(home) = reported(id::HOME_POSITION, &status) else { panic!("another") };
        let at = origin.global(&Vector3::new(1.0, 2.0, 2.5));
        assert_eq!((home.place_e7, home.altitude_mm, home.time_us), (at.e7(), 490_500, 5_000_123));
        assert_eq!((home.position_m, home.attitude), (Vector3::new(1.0, 2.0, 2.5), [1.0, 0.0, 0.0, 0.0]));
        let Telemetry::GpsGlobalOrigin(place) = reported(id::GPS_GLOBAL_ORIGIN, &status) else { panic!("another") };
        assert_eq!(
            (place.place_e7, place.altitude_mm, place.time_us),
            (EarthOrigin::SIMULATED.e7(), 488_000, 5_000_123)
        );
        let Telemetry::Outputs(outputs) = reported(id::ACTUATOR_OUTPUT_STATUS, &status) else { panic!("another") };
        assert_eq!((outputs.time_us, outputs.active), (5_000_123, 4));
        assert_eq!(outputs.throttles, [0.0, 0.5, 1.0, 0.5, 0.0, 0.0, 0.0, 0.0]);
    }

    /// If the origin or the position is unknown, the other values are still reported.
    #[test]
    fn what_is_half_known_is_reported_by_halves() {
        let mut status = flying();
        status.health.state_age_us = u32::MAX;
        assert_eq!(compose(id::GLOBAL_POSITION_INT, &status), None);
        let Telemetry::GpsRawInt(fix) = reported(id::GPS_RAW_INT, &status) else { panic!("another") };
        assert_eq!((fix.place_e7, fix.altitude_mm, fix.speed_cm_s, fix.course_cdeg), ([0; 2], 0, 65_535, 65_535));
        let mut status = flying();
        status.aux.origin = None;
        let Telemetry::VfrHud(summary) = reported(id::VFR_HUD, &status) else { panic!("another") };
        assert_eq!(summary.altitude_m, 12.5);
        assert_eq!([id::HOME_POSITION, id::GPS_GLOBAL_ORIGIN].map(|it| compose(it, &status)), [None, None]);
        // Without home, heights are relative to the origin.
        let mut status = flying();
        status.guided.home_m = None;
        let Telemetry::GlobalPositionInt(global) = reported(id::GLOBAL_POSITION_INT, &status) else {
            panic!("another")
        };
        assert_eq!((global.relative_mm, compose(id::HOME_POSITION, &status)), (12_500, None));
    }

    #[test]
    fn clocks_versions_and_modes_are_reported() {
        let mut status = flying();
        let time = |unix_us| Some(Downlink::Time(TimeMessage::Time { unix_us, boot_ms: 5_000 }));
        assert_eq!(compose(id::SYSTEM_TIME, &status), time(1_700_000_005_000_123));
        status.aux.powered_up_us = 0;
        assert_eq!(compose(id::SYSTEM_TIME, &status), time(0));
        let Telemetry::Version(version) = reported(id::AUTOPILOT_VERSION, &status) else { panic!("another") };
        // The bits mean MISSION_INT, COMMAND_INT, PARAM_ENCODE_BYTEWISE, SET_ATTITUDE_TARGET, both SET_POSITION_TARGET
        // and MAVLINK2. With storage, FTP is added.
        let bits = [2, 3, 4, 6, 7, 8, 13];
        assert_eq!(version.capabilities, bits.into_iter().map(|bit| 1 << bit).sum::<u64>());
        let stored = VehicleStatus { has_files: true, ..status };
        let Telemetry::Version(with_files) = reported(id::AUTOPILOT_VERSION, &stored) else { panic!("another") };
        assert_eq!(with_files.capabilities, version.capabilities | 1 << 5);
        let text = |part: u8| crate::services::texts::Words::default().number(part.into());
        let parts = [env!("CARGO_PKG_VERSION_MAJOR"), env!("CARGO_PKG_VERSION_MINOR"), env!("CARGO_PKG_VERSION_PATCH")];
        for (part, digits) in version.software.into_iter().zip(parts) {
            assert_eq!(text(part), crate::services::texts::Words::of(digits));
        }
        assert_eq!(version.software[3], 255);
        assert_eq!(reported(id::PROTOCOL_VERSION, &status), Telemetry::Protocol);
        let mode = afbc_guidance::FlightMode::Hold;
        assert_eq!(compose(id::CURRENT_MODE, &status), Some(Downlink::CurrentMode(modes::current(mode, mode))));
        for message in [id::SYS_STATUS, id::ESTIMATOR_STATUS, id::EXTENDED_SYS_STATE] {
            let expected = match message {
                id::SYS_STATUS => Telemetry::System(health::system(&status)),
                id::ESTIMATOR_STATUS => Telemetry::Estimator(health::estimator(&status)),
                _ => Telemetry::Landed(health::landed(&status)),
            };
            assert_eq!(reported(message, &status), expected);
        }
        assert_eq!(compose(9_999, &status), None);
    }

    #[test]
    fn a_heading_is_never_360_degrees() {
        // The headings of these small yaws round to just below 360 degrees, or to 0.
        for yaw in [1e-9, 1e-7, f32::MIN_POSITIVE, 0.0] {
            assert!((0.0..360.0).contains(&heading_deg(yaw)), "{yaw}");
        }
        let mut status = flying();
        let state = status.state.as_mut().expect("known");
        state.attitude_rad.z = 1e-5;
        let Telemetry::GlobalPositionInt(global) = reported(id::GLOBAL_POSITION_INT, &status) else {
            panic!("another")
        };
        assert!(global.heading_cdeg <= 35_999);
    }
}
