//! Messages of telemetry, each from what is known of the vehicle.

use crate::services::health;
use crate::services::modes;
use crate::services::origin::{Global, Origin};
use crate::services::picture::Picture;
use crate::services::streams::id;
use afbc_link::telemetry::{self, ActuatorOutputs, AttitudeQuaternion, Fix, GlobalPosition, Home, Summary, Version};
use afbc_link::{Clock, Downlink, Telemetry};
use nalgebra::Vector3;

/// `MAV_PROTOCOL_CAPABILITY`: commands and items with integers, encoding of parameters by bytes, targets of attitude
/// and position, MAVLink 2, missions.
const CAPABILITIES: u64 = 4 | 8 | 16 | 64 | 128 | 256 | 8192;
const TAU: f32 = core::f32::consts::TAU;

/// Returns the telemetry message numbered `message`, if what it tells is known.
pub fn compose(message: u32, picture: &Picture) -> Option<Downlink> {
    let telemetry = |telemetry| Some(Downlink::Telemetry(telemetry));
    let (time_ms, time_us) = (picture.time_ms(), picture.time_us);
    match message {
        id::SYS_STATUS => telemetry(Telemetry::System(health::system(picture))),
        id::SYSTEM_TIME => {
            let powered_up_us = picture.surroundings.powered_up_us;
            let unix_us = if powered_up_us == 0 { 0 } else { powered_up_us.saturating_add(time_us) };
            Some(Downlink::Clock(Clock::Time { unix_us, boot_ms: time_ms }))
        }
        id::GPS_RAW_INT => telemetry(Telemetry::Fix(fix(picture)?)),
        id::ATTITUDE => {
            let state = picture.state?;
            let (attitude_rad, rates_rad_s) = (state.attitude_rad, state.rates_rad_s);
            Some(Downlink::Attitude { time_ms, attitude_rad, rates_rad_s })
        }
        id::ATTITUDE_QUATERNION => {
            let state = picture.state?;
            let attitude = quaternion(&state);
            telemetry(Telemetry::Attitude(AttitudeQuaternion { time_ms, attitude, rates_rad_s: state.rates_rad_s }))
        }
        id::LOCAL_POSITION_NED => {
            let state = picture.state?;
            let (position_m, velocity_m_s) = (state.position_m, state.velocity_m_s);
            Some(Downlink::Position { time_ms, position_m, velocity_m_s })
        }
        id::GLOBAL_POSITION_INT => telemetry(Telemetry::Global(global(picture)?)),
        id::GPS_GLOBAL_ORIGIN => {
            let at = picture.surroundings.origin?.at();
            let (place_e7, altitude_mm) = (at.e7(), at.altitude_mm());
            telemetry(Telemetry::Origin(telemetry::Origin { place_e7, altitude_mm, time_us }))
        }
        id::VFR_HUD => telemetry(Telemetry::Summary(summary(picture)?)),
        id::BATTERY_STATUS => telemetry(Telemetry::Battery(picture.surroundings.battery?)),
        id::ESTIMATOR_STATUS => telemetry(Telemetry::Estimator(health::estimator(picture))),
        id::HOME_POSITION => telemetry(Telemetry::Home(home(picture)?)),
        id::EXTENDED_SYS_STATE => telemetry(Telemetry::Landed(health::landed(picture))),
        id::ACTUATOR_OUTPUT_STATUS => {
            let throttles = picture.throttles.map(throttle);
            telemetry(Telemetry::Outputs(ActuatorOutputs { time_us, active: picture.rotors.into(), throttles }))
        }
        id::AUTOPILOT_VERSION => {
            let software = [version(env!("CARGO_PKG_VERSION_MAJOR")), version(env!("CARGO_PKG_VERSION_MINOR"))];
            let [major, minor] = software;
            let software = [major, minor, version(env!("CARGO_PKG_VERSION_PATCH")), 255];
            telemetry(Telemetry::Version(Version { capabilities: CAPABILITIES, uid: 0, software, commit: [0; 8] }))
        }
        id::PROTOCOL_VERSION => telemetry(Telemetry::Protocol),
        id::CURRENT_MODE => Some(Downlink::CurrentMode(modes::current(picture.flight_mode(), picture.guided.mode))),
        _ => None,
    }
}

/// Returns a throttle of 48 to 2047 as 0 to 1.
fn throttle(throttle: u16) -> f32 {
    f32::from(throttle.saturating_sub(47)) / 2000.0
}

/// Reads a number of the version.
fn version(digits: &str) -> u8 {
    digits.bytes().fold(0, |number, digit| number.wrapping_mul(10).wrapping_add(digit.saturating_sub(b'0')))
}

fn quaternion(state: &afbc_types::State) -> [f32; 4] {
    let q = state.quaternion().coords;
    [q.w, q.x, q.y, q.z]
}

/// Returns the compass heading of a yaw to the left \[deg\], 0 to 360.
fn heading_deg(yaw_rad: f32) -> f32 {
    let turns = -yaw_rad / TAU;
    let heading = 360.0 * (turns - libm::floorf(turns));
    if heading < 360.0 { heading } else { 0.0 }
}

/// Returns home, or the origin of the local frame while there is none.
fn home_m(picture: &Picture) -> Vector3<f32> {
    picture.guided.home_m.unwrap_or_default()
}

fn place(picture: &Picture) -> Option<(Origin, Global, afbc_types::State)> {
    let (origin, state) = (picture.surroundings.origin?, picture.state?);
    picture.is_located().then(|| (origin, origin.global(&state.position_m), state))
}

fn global(picture: &Picture) -> Option<GlobalPosition> {
    let (_, place, state) = place(picture)?;
    let cm_s = |speed_m_s: f32| (speed_m_s * 100.0) as i16;
    let v = state.velocity_m_s;
    Some(GlobalPosition {
        time_ms: picture.time_ms(),
        place_e7: place.e7(),
        altitude_mm: place.altitude_mm(),
        relative_mm: ((state.position_m.z - home_m(picture).z) * 1e3) as i32,
        velocity_ned_cm_s: [cm_s(v.x), cm_s(-v.y), cm_s(-v.z)],
        heading_cdeg: ((heading_deg(state.attitude_rad.z) * 100.0) as u16).min(35_999),
    })
}

fn fix(picture: &Picture) -> Option<Fix> {
    let receiver = picture.surroundings.receiver?;
    let known = place(picture);
    let (place_e7, altitude_mm) = known.as_ref().map_or(([0; 2], 0), |(_, place, _)| (place.e7(), place.altitude_mm()));
    let (speed_cm_s, course_cdeg) = known.map_or((u16::MAX, u16::MAX), |(.., state)| {
        let v = state.velocity_m_s;
        let course = heading_deg(libm::atan2f(v.y, v.x)) * 100.0;
        ((libm::hypotf(v.x, v.y) * 100.0) as u16, (course as u16).min(35_999))
    });
    let crate::services::picture::Receiver { kind, satellites, sigma_mm } = receiver;
    Some(Fix { time_us: picture.time_us, place_e7, altitude_mm, kind, satellites, sigma_mm, speed_cm_s, course_cdeg })
}

fn home(picture: &Picture) -> Option<Home> {
    let (origin, position_m) = (picture.surroundings.origin?, picture.guided.home_m?);
    let place = origin.global(&position_m);
    let (place_e7, altitude_mm, attitude) = (place.e7(), place.altitude_mm(), [1.0, 0.0, 0.0, 0.0]);
    Some(Home { place_e7, altitude_mm, position_m, attitude, time_us: picture.time_us })
}

fn summary(picture: &Picture) -> Option<Summary> {
    let state = picture.state?;
    let v = state.velocity_m_s;
    let above_m = picture.surroundings.origin.map_or(0.0, |origin| origin.at().altitude_m as f32);
    let rotors = usize::from(picture.rotors).max(1);
    let throttles = picture.throttles.iter().take(rotors).map(|it| throttle(*it)).sum::<f32>() / rotors as f32;
    Some(Summary {
        speed_m_s: libm::hypotf(v.x, v.y),
        altitude_m: above_m + state.position_m.z,
        climb_m_s: v.z,
        heading_deg: heading_deg(state.attitude_rad.z) as i16,
        throttle_percent: (100.0 * throttles) as u16,
    })
}

#[cfg(test)]
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

    /// Nothing is told that is not known, and a vehicle that knows nothing tells that it is not well.
    #[test]
    fn what_is_not_known_is_not_told() {
        let picture = Picture::default();
        for message in [
            id::GPS_RAW_INT,
            id::ATTITUDE,
            id::LOCAL_POSITION_NED,
            id::GLOBAL_POSITION_INT,
            id::GPS_GLOBAL_ORIGIN,
            id::BATTERY_STATUS,
            id::HOME_POSITION,
            id::VFR_HUD,
        ] {
            assert_eq!(compose(message, &picture), None, "message {message}");
        }
        for message in [id::SYS_STATUS, id::ESTIMATOR_STATUS, id::EXTENDED_SYS_STATE, id::AUTOPILOT_VERSION] {
            assert!(compose(message, &picture).is_some(), "message {message}");
        }
    }
}
