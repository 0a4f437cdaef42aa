//! Tests of modes hold, take-off, landing and return.

use super::*;

/// A hold first stops, then holds the place of the stop.
#[test]
fn a_hold_is_where_it_comes_to_stand() {
    let mut hold = Hold::default();
    let fast = Stage::at(here()).moving(Vector3::new(1.0, 0.0, 0.0));
    assert!(same(&fast.see(|inputs| hold.fly(inputs)).position_m, &NAN));
    let stands = Stage::at(here()).apart(Vector3::new(0.2, 0.0, 0.0));
    let at_m = here() + Vector3::new(0.2, 0.0, 0.0);
    assert_eq!(stands.see(|inputs| hold.fly(inputs)).position_m, at_m);
    let later = Stage::at(Vector3::zeros()).see(|inputs| hold.fly(inputs));
    assert!(later.position_m == at_m && later.yaw_rad.is_nan() && later.speed_m_s == 4.0, "{later:?}");
    // The vehicle holds at the ordered place, with the ordered heading and speed.
    let mut ordered = Hold { at_m: Some(here()), yaw_rad: Some(0.4), speed_m_s: Some(7.0) };
    let aim = Stage { speed_m_s: 8.0, ..Stage::at(Vector3::zeros()) }.see(|inputs| ordered.fly(inputs));
    assert_eq!((aim.position_m, aim.yaw_rad, aim.speed_m_s), (here(), 0.4, 7.0));
    assert_eq!(Stage { speed_m_s: 3.0, ..Stage::at(here()) }.see(|inputs| ordered.fly(inputs)).speed_m_s, 3.0);
}

/// A take-off is done when the vehicle is in the air, its setpoint stands at the end, and the vehicle is nearly there.
#[test]
fn a_takeoff_ends_at_its_height() {
    let from = Vector3::new(3.0, 4.0, 2.0);
    for (height, short) in [(2.0, 0.3), (10.0, 1.0)] {
        let takeoff = Stage::at(from).see(|inputs| Takeoff::new(inputs, height));
        let to = from + Vector3::new(0.0, 0.0, height);
        assert_eq!(takeoff.to_m, to);
        // The vehicle is `below` the end, and the setpoint `off` it.
        let output = |below: f32, off: f32, stage: fn(Stage) -> Stage| {
            let at = Stage::at(to - along(2, below)).apart(along(2, below + off));
            stage(at).see(|inputs| takeoff.fly(inputs))
        };
        let plain = output(0.0, 0.0, |stage| stage);
        let aim = limited(&plain);
        assert_eq!((aim.position_m, aim.up_m_s, aim.speed_m_s, plain.lifts, plain.lands), (to, 1.2, 4.0, true, false));
        assert!(plain.done && output(-5.0, 0.0, |stage| stage).done);
        assert!(output(short - 0.01, 0.0, |stage| stage).done && !output(short + 0.01, 0.0, |stage| stage).done);
        assert!(output(0.0, 0.049, |stage| stage).done && !output(0.0, 0.051, |stage| stage).done);
        assert!(output(0.0, -0.049, |stage| stage).done && !output(0.0, -0.051, |stage| stage).done);
        assert!(!output(0.0, 0.0, |stage| Stage { airborne: false, ..stage }).done);
        assert!(!output(0.0, 0.0, |stage| stage.moving(Vector3::new(0.1, 0.0, 0.0))).done);
    }
}

/// A landing vehicle descends over the place where its horizontal setpoint has stopped, at any sink rate.
#[test]
fn a_landing_is_where_it_stops() {
    let mut land = Land::default();
    for (velocity, stops) in [([0.06, 0.0, 0.0], false), ([0.0, -0.06, 0.0], false), ([0.03, 0.03, -1.5], true)] {
        let output = Stage::at(here()).moving(velocity.into()).see(|inputs| land.fly(inputs));
        assert_eq!((output.lands, output.lifts, output.done, land.over_m.is_some()), (true, false, false, stops));
        let over = if stops { here().x } else { f32::NAN };
        assert!(same(&limited(&output).position_m, &Vector3::new(over, if stops { here().y } else { over }, f32::NAN)));
    }
    let output = Stage::at(Vector3::zeros()).see(|inputs| land.fly(inputs));
    assert_eq!(limited(&output).position_m.xy(), here().xy(), "it stays there");
}

/// A return climbs to the return height above home, unless it is near home, already higher, or below a ceiling. Then it
/// flies home, heading there, and descends over home.
#[test]
fn a_return_climbs_flies_and_descends() {
    let FlightModeSettings { near_home_m, return_height_m, .. } = flying();
    let home = Stage::at(here()).home_m;
    let safe = home.z + return_height_m;
    let climbs = |place: Vector3<f32>, ceiling_m: f32| {
        let stage = Stage { ceiling_m, ..Stage::at(place) };
        let output = stage.see(|inputs| Return::new(inputs, inputs.home_m.xy()).fly(inputs));
        assert_eq!((output.lands, output.lifts, output.done), (false, false, false));
        assert_eq!(limited(&output).position_m.xy(), place.xy());
        limited(&output).position_m.z
    };
    let far = |z: f32| Vector3::new(home.x + 0.8 * near_home_m, home.y + 0.7 * near_home_m, z);
    let near = |z: f32| Vector3::new(home.x + 0.7 * near_home_m, home.y - 0.7 * near_home_m, z);
    assert_eq!(climbs(far(3.0), f32::INFINITY), safe);
    assert_eq!(climbs(far(safe + 7.0), f32::INFINITY), safe + 7.0);
    assert_eq!(climbs(far(3.0), 9.0), 9.0);
    assert_eq!(climbs(near(3.0), f32::INFINITY), 3.0);

    // The vehicle already climbs while it stops.
    let mut back = Stage::at(far(3.0)).see(|inputs| Return::new(inputs, inputs.home_m.xy()));
    let stops = Stage::at(far(3.0)).moving(Vector3::new(2.0, 0.0, 0.0)).see(|inputs| back.fly(inputs));
    assert!(same(&limited(&stops).position_m, &Vector3::new(f32::NAN, f32::NAN, safe)));
    // The climb is complete if the setpoint is within 0.3 m of the height and the vehicle within 1 m.
    for (setpoint, vehicle, over) in [(0.29, 0.99, true), (0.31, 0.9, false), (0.2, 1.01, false), (-3.0, -3.0, true)] {
        let mut back = Stage::at(far(3.0)).see(|inputs| Return::new(inputs, inputs.home_m.xy()));
        let stage = Stage::at(far(safe - vehicle)).apart(along(2, vehicle - setpoint));
        let _ = stage.see(|inputs| back.fly(inputs));
        let aim = limited(&stage.see(|inputs| back.fly(inputs)));
        let towards = f32::atan2(home.y - far(0.0).y, home.x - far(0.0).x);
        assert_eq!(aim.position_m.xy() == home.xy(), over, "{setpoint}, {vehicle}");
        assert!(!over || (aim.yaw_rad - towards).abs() < 1e-5 && aim.position_m.z == safe, "{aim:?}");
        if over {
            // A slow vehicle over home descends.
            for (off, speed, descends) in [(1.02, 0.0, false), (0.9, 0.31, false), (0.98, 0.29, true)] {
                let over_home = Vector3::new(home.x, home.y, safe);
                let stage = Stage::at(over_home + along(0, off)).moving(along(1, speed));
                let flies = stage.see(|inputs| back.fly(inputs));
                assert!(!flies.lands);
                let output = stage.see(|inputs| back.fly(inputs));
                assert_eq!(output.lands, descends, "{off} m, {speed} m/s");
                if descends {
                    assert!(same(&limited(&output).position_m, &Vector3::new(home.x, home.y, f32::NAN)));
                }
            }
        }
    }
}
