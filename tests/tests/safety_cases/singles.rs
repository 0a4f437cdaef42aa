//! Single faults.

use super::case::*;
use crate::airborne::checker::CUTS;
use crate::airborne::session::item;
use crate::airborne::{COMPANION, STATION, place, velocity};
use afbc_guidance::FlightMode;
use afbc_mavlink::{Uplink, VehicleCommand};

/// Returns all cases with one fault.
pub(super) fn cases() -> Vec<Case> {
    [station(), targets(), fence(), battery(), sensors(), airframe(), link()].concat()
}

fn station() -> Vec<Case> {
    let silent = || Do::Silent(STATION);
    vec![
        case("station-lost-nothing", "the station falls silent, and that is nothing")
            .set("NAV_DLL_ACT", 0.0)
            .at(1.0, silent())
            .never(&["station lost"])
            .near(0.0, 0.0, 0.5),
        case("station-lost-hold", "the station falls silent in a mission")
            .set("NAV_DLL_ACT", 1.0)
            .mission(&AWAY)
            .at(1.0, silent())
            .lasts(9.0)
            .hears(&["hold: station lost"]),
        case("station-lost-return", "the station falls silent in a mission")
            .mission(&AWAY)
            .at(1.0, silent())
            .lasts(24.0)
            .hears(&["return: station lost", "on the ground: disarming"])
            .lands()
            .near(0.0, 0.0, 0.7),
        case("station-lost-land", "the station falls silent in a mission")
            .set("NAV_DLL_ACT", 3.0)
            .mission(&AWAY)
            .at(1.0, silent())
            .lasts(16.0)
            .hears(&["land: station lost", "on the ground: disarming"])
            .lands(),
        case("station-back", "the station comes back while the vehicle returns, and lets it")
            .mission(&AWAY)
            .at(1.0, silent())
            .at(6.0, Do::Back(STATION))
            .lasts(24.0)
            .hears(&["return: station lost", "cleared: station lost", "on the ground: disarming"])
            .lands()
            .near(0.0, 0.0, 0.7),
        case("station-lost-on-the-ground", "the station falls silent before the take-off")
            .on(Start::Ground)
            .at(0.5, silent())
            .hears(&["station lost", "on the ground: disarming"])
            .lands()
            .near(0.0, 0.0, 0.2),
        case("station-short", "the station falls silent for 1.5 s")
            .at(0.6, silent())
            .at(2.1, Do::Back(STATION))
            .never(&["station lost"]),
    ]
}

fn targets() -> Vec<Case> {
    let stop = || Do::Stream(None);
    vec![
        case("targets-lost-hold", "the stream of targets ends at 3 m/s")
            .offboard(velocity(3.0, 0.0, 0.0))
            .at(3.0, stop())
            .lasts(8.0)
            .hears(&["hold: no targets"]),
        case("targets-lost-land", "the stream of targets ends at 3 m/s")
            .set("COM_OBL_ACT", 0.0)
            .offboard(velocity(3.0, 0.0, 0.0))
            .at(3.0, stop())
            .lasts(14.0)
            .hears(&["land: no targets", "on the ground: disarming"])
            .lands(),
        case("targets-lost-return", "the stream of targets ends at 3 m/s")
            .set("COM_OBL_ACT", 2.0)
            .offboard(velocity(3.0, 0.0, 0.0))
            .at(4.0, stop())
            .lasts(25.0)
            .hears(&["return: no targets", "on the ground: disarming"])
            .lands()
            .near(0.0, 0.0, 0.7),
        case("targets-gap", "no targets for 0.3 s")
            .offboard(velocity(2.0, 0.0, 0.0))
            .at(2.0, stop())
            .at(2.3, Do::Stream(Some(velocity(0.0, 0.0, 0.0))))
            .never(&["no targets"])
            .flies(),
        case("targets-mad", "the targets become a place 500 km away")
            .offboard(velocity(2.0, 0.0, 0.0))
            .at(2.0, Do::Stream(Some(place(5e5, 0.0, 3.0))))
            .lasts(7.0)
            .hears(&["hold: no targets"]),
        case("targets-jump", "the targets jump by 20 m to and fro")
            .offboard(place(10.0, 0.0, 3.0))
            .at(1.5, Do::Stream(Some(place(-10.0, 0.0, 3.0))))
            .at(3.0, Do::Stream(Some(place(10.0, 0.0, 3.0))))
            .at(4.5, Do::Stream(Some(place(0.0, 0.0, 3.0))))
            .lasts(9.0)
            .never(&["no targets"])
            .flies(),
    ]
}

fn fence() -> Vec<Case> {
    let fast = || velocity(5.0, 0.0, 0.0);
    let out = |name, what| case(name, what).offboard(fast()).lasts(8.0);
    vec![
        out("fence-nothing", "flown out at 5 m/s by targets, and that is nothing")
            .fenced(0.0)
            .lasts(4.0)
            .never(&["geofence"])
            .flies(),
        out("fence-warn", "flown out at 5 m/s by targets").fenced(1.0).lasts(4.0).hears(&["at the geofence"]).flies(),
        out("fence-hold", "flown out at 5 m/s by targets")
            .fenced(2.0)
            .hears(&["hold: at the geofence"])
            .bound(|bounds| bounds.radius_m = 16.5),
        out("fence-return", "flown out at 5 m/s by targets")
            .fenced(3.0)
            .lasts(25.0)
            .hears(&["return: at the geofence", "on the ground: disarming"])
            .bound(|bounds| bounds.radius_m = 16.5)
            .lands()
            .near(0.0, 0.0, 0.7),
        out("fence-land", "flown out at 5 m/s by targets")
            .fenced(4.0)
            .lasts(16.0)
            .hears(&["land: at the geofence", "on the ground: disarming"])
            .bound(|bounds| bounds.radius_m = 16.5)
            .lands(),
        case("fence-height-hold", "flown out upwards at 3 m/s by targets")
            .fenced(2.0)
            .offboard(velocity(0.0, 0.0, 3.0))
            .hears(&["hold: at the geofence"])
            .bound(|bounds| bounds.height_m = 10.5),
        case("fence-height-return", "flown out upwards at 3 m/s by targets")
            .fenced(3.0)
            .offboard(velocity(0.0, 0.0, 3.0))
            .lasts(21.0)
            .hears(&["return: at the geofence", "on the ground: disarming"])
            .bound(|bounds| bounds.height_m = 10.5)
            .lands()
            .near(0.0, 0.0, 0.7),
        case("fence-place", "a target 30 m away")
            .fenced(2.0)
            .offboard(place(0.0, 30.0, 3.0))
            .lasts(8.0)
            .hears(&["hold: at the geofence"])
            .bound(|bounds| bounds.radius_m = 21.5),
        case("fence-attitude", "flown out by an attitude")
            .fenced(2.0)
            .offboard(leaning())
            .lasts(11.0)
            .hears(&["hold: at the geofence"])
            .bound(|bounds| (bounds.radius_m, bounds.height_m) = (13.5, 8.0)),
        case("fence-sticks", "flown out by sticks")
            .fenced(2.0)
            .at(0.0, Do::Stream(Some(sticks(1.0, 0.0))))
            .at(0.2, say(select(FlightMode::Position)))
            .lasts(8.0)
            .hears(&["hold: at the geofence"])
            .bound(|bounds| bounds.radius_m = 16.5),
        case("fence-take-off", "a take-off above the fence")
            .fenced(2.0)
            .on(Start::Ground)
            .at(0.5, say(take_off(20.0)))
            .lasts(11.5)
            .hears(&["refused: outside the geofence", "on the ground: disarming"])
            .lands(),
        case("fence-take-off-mode", "the mode takeoff, whose height is above the fence")
            .fenced(2.0)
            .set("MIS_TAKEOFF_ALT", 12.0)
            .on(Start::Ground)
            .at(0.5, say(select(FlightMode::Takeoff)))
            .lasts(11.5)
            .hears(&["refused: outside the geofence", "on the ground: disarming"])
            .lands(),
        case("fence-mission-take-off", "a mission that begins with a take-off above the fence")
            .fenced(2.0)
            .on(Start::Ground)
            .before(Do::Upload(vec![item(0, TAKE_OFF, [0.0, 0.0, 20.0]), item(1, WAYPOINT, AWAY[0])]))
            .at(0.5, say(VehicleCommand::StartMission(0, None)))
            .lasts(11.5)
            .hears(&["mission item 0: outside the geofence", "on the ground: disarming"])
            .lands(),
        case("fence-mission", "a mission whose second item lies outside")
            .fenced(2.0)
            .mission(&[[4.0, 0.0, 3.0], [40.0, 0.0, 3.0]])
            .lasts(9.0)
            .hears(&["mission item 1: outside the geofence"])
            .near(0.0, 0.0, 1.5),
        case("fence-go-to", "an order to fly to a place outside")
            .outdoors()
            .fenced(2.0)
            .at(0.5, say(go_to(30.0, 0.0, 3.0)))
            .lasts(5.0)
            .hears(&["refused: outside the geofence"])
            .bound(|bounds| bounds.radius_m = 5.0),
        case("fence-go-to-height", "an order to climb through the fence")
            .outdoors()
            .fenced(2.0)
            .at(0.5, say(go_to(0.0, 0.0, 20.0)))
            .lasts(5.0)
            .hears(&["refused: outside the geofence"])
            .bound(|bounds| bounds.radius_m = 5.0),
        case("fence-return-height", "a return whose height is above the fence stays inside")
            .fenced(2.0)
            .set("RTL_RETURN_ALT", 15.0)
            .mission(&[[8.0, 0.0, 3.0]])
            .at(6.0, say(VehicleCommand::Return))
            .lasts(29.0)
            .never(&["at the geofence"])
            .hears(&["on the ground: disarming"])
            .bound(|bounds| bounds.height_m = 8.2)
            .lands()
            .near(0.0, 0.0, 0.7),
    ]
}

fn battery() -> Vec<Case> {
    vec![
        case("battery-low", "12 % left")
            .watched()
            .at(0.5, Do::Line("battery 0.12"))
            .lasts(9.0)
            .hears(&["battery low"])
            .never(&["return", "land"])
            .near(0.0, 0.0, 0.5),
        case("battery-critical-warn", "6 % left")
            .watched()
            .set("COM_LOW_BAT_ACT", 0.0)
            .at(0.5, Do::Line("battery 0.06"))
            .lasts(9.0)
            .hears(&["battery low", "battery critical"])
            .never(&["return", "land"]),
        case("battery-critical-return", "6 % left in a mission")
            .watched()
            .mission(&AWAY)
            .at(0.5, Do::Line("battery 0.06"))
            .lasts(29.0)
            .hears(&["battery low", "return: battery critical", "on the ground: disarming"])
            .lands()
            .near(0.0, 0.0, 0.7),
        case("battery-critical-land", "6 % left")
            .watched()
            .set("COM_LOW_BAT_ACT", 2.0)
            .at(0.5, Do::Line("battery 0.06"))
            .lasts(19.0)
            .hears(&["battery low", "land: battery critical", "on the ground: disarming"])
            .lands(),
        case("battery-empty-land", "3 % left in a mission")
            .watched()
            .mission(&AWAY)
            .at(0.5, Do::Line("battery 0.03"))
            .lasts(21.0)
            .hears(&["battery low", "return: battery critical", "land: battery almost empty", "on the ground"])
            .lands(),
        case("battery-sags", "20 % left, and the load of climbs and sprints")
            .watched()
            .at(0.2, Do::Line("battery 0.2"))
            .offboard(velocity(0.0, 0.0, 3.0))
            .at(1.5, Do::Stream(Some(velocity(5.0, 0.0, -1.0))))
            .at(3.0, Do::Stream(Some(velocity(-5.0, 0.0, 3.0))))
            .at(4.5, Do::Stream(Some(velocity(0.0, 0.0, 0.0))))
            .bound(|bounds| (bounds.height_m, bounds.tilt_rad) = (14.0, 0.6))
            .never(&["battery"])
            .flies(),
        case("battery-glitch", "the voltage of 3 % for 0.1 s")
            .watched()
            .at(0.5, Do::Line("battery 0.03"))
            .at(0.6, Do::Line("battery 0.9"))
            .never(&["battery"])
            .near(0.0, 0.0, 0.5),
        case("battery-recovers", "6 % left for 8 s, then full again: does not count")
            .watched()
            .mission(&AWAY)
            .at(0.5, Do::Line("battery 0.06"))
            .at(8.5, Do::Line("battery 1"))
            .at(10.5, say(select(FlightMode::Hold)))
            .lasts(29.0)
            .hears(&["return: battery critical", "refused: a failsafe is active", "on the ground: disarming"])
            .lands(),
        case("battery-low-before", "12 % left before arming")
            .watched()
            .before(Do::Line("battery 0.12"))
            .on(Start::PowerUp)
            .at(0.0, say(VehicleCommand::Arm))
            .lasts(1.0)
            .hears(&["arming refused: battery low or unknown"])
            .lands(),
        case("battery-wrong-cells", "the battery has fewer cells than it is said to have")
            .watched()
            .set("BAT1_N_CELLS", 6.0)
            .on(Start::PowerUp)
            .at(0.0, say(VehicleCommand::Arm))
            .lasts(1.0)
            .hears(&["arming refused: battery low or unknown"])
            .lands(),
    ]
}

/// Largest tilt \[rad\] of a vehicle that touches the ground within seconds after losing its position. The contact
/// disturbs the estimate, and the law responds to this until the vehicle stands.
const ON_GROUND_RAD: f64 = 1.0;

fn sensors() -> Vec<Case> {
    let fails = |name, what, line| case(name, what).at(0.5, Do::Line(line));
    let lands = || say(VehicleCommand::Land);
    vec![
        fails("gnss-lost", "GNSS lost for good", "fault gnss lost")
            .outdoors()
            .bound(|bounds| bounds.tilt_rad = ON_GROUND_RAD)
            .lasts(24.0)
            .hears(&["sensor fault", DESCENDS])
            .lands(),
        fails("gnss-short", "GNSS lost for 3 s", "fault gnss lost 3")
            .outdoors()
            .lasts(7.0)
            .hears(&["sensor fault", "cleared: sensor fault"]),
        fails("gnss-lost-land", "GNSS lost for good", "fault gnss lost")
            .outdoors()
            .bound(|bounds| bounds.tilt_rad = ON_GROUND_RAD)
            .set("COM_SENS_ACT", 4.0)
            .lasts(20.0)
            .hears(&["land: sensor fault"])
            .lands(),
        fails("gnss-jumped", "GNSS jumps by 5 m", "fault gnss jumped 5 0 0").outdoors().lasts(10.0),
        fails("magnetometer-lost", "magnetometer lost for good", "fault magnetometer lost")
            .outdoors()
            .lasts(10.0)
            .hears(&["sensor fault"]),
        fails("magnetometer-disturbed", "20 uT beside the magnetometer", "fault magnetometer disturbed 20 0 0")
            .outdoors()
            .lasts(10.0),
        fails("barometer-lost", "barometer lost for good", "fault barometer lost")
            .outdoors()
            .lasts(8.0)
            .hears(&["sensor fault"]),
        fails("barometer-return", "barometer lost for good in a mission", "fault barometer lost")
            .outdoors()
            .set("COM_SENS_ACT", 3.0)
            .mission(&AWAY)
            .lasts(26.0)
            .hears(&["return: sensor fault", "on the ground: disarming"])
            .lands()
            .near(0.0, 0.0, 5.0),
        fails("barometer-hold", "barometer lost for 3 s in a mission", "fault barometer lost 3")
            .outdoors()
            .set("COM_SENS_ACT", 2.0)
            .mission(&AWAY)
            .lasts(9.0)
            .hears(&["hold: sensor fault", "cleared: sensor fault"]),
        fails("barometer-stuck", "barometer stuck", "fault barometer stuck").outdoors().lasts(8.0),
        case("barometer-lost-before", "barometer lost before arming")
            .outdoors()
            .before(Do::Line("at 3 fault barometer lost"))
            .on(Start::PowerUp)
            .at(0.0, say(VehicleCommand::Arm))
            .lasts(1.0)
            .hears(&["arming refused: a sensor has failed"])
            .lands(),
        fails("tracker-lost", "tracker lost for good", "fault tracker lost")
            .lasts(24.0)
            .hears(&["sensor fault", DESCENDS])
            .lands(),
        fails("tracker-short", "tracker lost for 3 s", "fault tracker lost 3").lasts(7.0).hears(&["sensor fault"]),
        fails("tracker-frozen", "tracker repeats its pose", "fault tracker frozen")
            .lasts(24.0)
            .hears(&[DESCENDS])
            .lands(),
        fails("tracker-jumped", "tracker's frame jumps by 0.5 m", "fault tracker jumped 0.5 0 0 0").near(0.0, 0.0, 0.3),
        fails("imu-dead", "inertial sensor dead", "fault imu dead")
            .hears(&["IMU failed: flying on the tracker's poses alone"])
            .near(0.0, 0.0, 0.3),
        fails("imu-stuck", "inertial sensor stuck, then a landing", "fault imu stuck")
            .at(3.0, lands())
            .lasts(14.0)
            .hears(&["IMU failed: flying on the tracker's poses alone", "on the ground: disarming"])
            .lands()
            .near(0.0, 0.0, 0.5),
        fails("imu-noisy", "noise of 0.2 rad/s and 3 m/s2 on the inertial sensor", "fault imu noisy 0.2 3")
            .near(0.0, 0.0, 0.4),
        fails("gyro-biased", "the gyroscope's bias steps by 0.03 rad/s", "fault imu biased 0.03 0 0 0 0 0")
            .near(0.0, 0.0, 0.4),
        fails("imu-dead-outdoors", "inertial sensor dead: nobody knows the attitude", "fault imu dead")
            .outdoors()
            .falls(CUTS[1])
            .hears(&[]),
        fails("estimator-invalid", "inertial sensor and tracker lost: no attitude", "fault imu dead")
            .at(0.5, Do::Line("fault tracker lost"))
            .falls(CUTS[1]),
    ]
}

fn airframe() -> Vec<Case> {
    let suffers = |name, what, line| case(name, what).at(0.5, Do::Line(line));
    vec![
        suffers("rotor-80", "a rotor with 80 % of its thrust", "rotor 2 0.8").near(0.0, 0.0, 0.4),
        suffers("rotor-60", "a rotor with 60 % of its thrust, then a landing", "rotor 2 0.6")
            .at(4.0, say(VehicleCommand::Land))
            .lasts(15.0)
            .hears(&["on the ground: disarming"])
            .lands()
            .near(0.0, 0.0, 1.0),
        suffers("gust", "a gust of 8 m/s", "gust 0 8 0 0.5 2")
            .outdoors()
            .lasts(8.0)
            .bound(|bounds| (bounds.tilt_rad, bounds.radius_m) = (0.8, 12.0)),
        suffers("gust-down", "a gust of 4 m/s downwards, 3 m above the ground", "gust 0 0 -4 0.3 1")
            .outdoors()
            .lasts(6.0),
        suffers("turbulence", "severe turbulence", "turbulence severe")
            .outdoors()
            .lasts(10.0)
            .bound(|bounds| (bounds.tilt_rad, bounds.radius_m) = (0.8, 12.0)),
        suffers("payload", "a payload of a third of the weight, and without it", "payload 0.16 0.05")
            .at(3.0, Do::Line("payload 0"))
            .near(0.0, 0.0, 0.4),
        suffers("push", "a push of 2 N for 1 s", "push 2 0 0 1")
            .near(0.0, 0.0, 0.4)
            .bound(|bounds| bounds.tilt_rad = 0.75),
        suffers("weak", "rotors of 70 % of their thrust", "change thrust-factor 0.7").near(0.0, 0.0, 0.4),
        suffers("tumble", "a push of its moments tips it over", "change roll-moment -3")
            .falls(CUTS[0])
            .bound(|bounds| bounds.touch_m_s = 20.0),
        case("no-lift", "a payload that it cannot lift")
            .on(Start::Ground)
            .at(0.2, Do::Line("payload 1.2 0.02"))
            .at(0.5, say(take_off(3.0)))
            .lasts(23.0)
            .hears(&["land: take-off failed: still on the ground", "on the ground: disarming"])
            .lands(),
    ]
}

fn link() -> Vec<Case> {
    let other = |command| Do::Say(COMPANION, Uplink::Command(command));
    vec![
        case("link-broken-third", "every third frame is broken")
            .at(0.0, Do::Breaks(3))
            .offboard(velocity(2.0, 0.0, 0.0))
            .at(0.5, say(select(FlightMode::Offboard)))
            .at(4.0, Do::Stream(Some(velocity(0.0, 0.0, 0.0))))
            .lasts(7.0)
            .never(&["no targets", "station lost"])
            .flies(),
        case("link-broken", "every frame is broken")
            .mission(&AWAY)
            .at(1.0, Do::Breaks(1))
            .lasts(24.0)
            .hears(&["return: station lost", "on the ground: disarming"])
            .lands()
            .near(0.0, 0.0, 0.7),
        case("link-noise", "kilobytes that are no frames")
            .offboard(velocity(2.0, 0.0, 0.0))
            .at(1.0, Do::Noise(4000))
            .at(2.0, Do::Noise(4000))
            .at(3.0, Do::Stream(Some(velocity(0.0, 0.0, 0.0))))
            .never(&["no targets", "station lost"])
            .flies(),
        case("second-station", "a second station orders a landing, and sends targets")
            .at(0.0, Do::Back(COMPANION))
            .at(0.5, other(VehicleCommand::Land))
            .at(1.0, Do::Say(COMPANION, velocity(5.0, 0.0, 0.0)))
            .at(1.5, other(select(FlightMode::Offboard)))
            .hears(&["245/191 ignored: 255/190 is in control"])
            .never(&["land", "offboard"])
            .near(0.0, 0.0, 0.5),
        case("second-station-takes-over", "the station is lost; another takes over while the vehicle returns")
            .mission(&AWAY)
            .at(1.0, Do::Silent(STATION))
            .at(5.0, Do::Back(COMPANION))
            .at(5.1, other(select(FlightMode::Hold)))
            .lasts(9.0)
            .hears(&["return: station lost", "cleared: station lost", "hold: ordered"]),
        case("second-station-disarms", "a second station orders to disarm in flight")
            .at(0.0, Do::Back(COMPANION))
            .at(0.5, other(VehicleCommand::Disarm))
            .hears(&["disarming refused: in flight; force to override"])
            .near(0.0, 0.0, 0.5),
        case("disarm-in-flight", "an order to disarm in flight, thrice")
            .at(0.5, say(VehicleCommand::Disarm))
            .at(1.0, say(VehicleCommand::Disarm))
            .at(1.5, say(VehicleCommand::Disarm))
            .hears(&["disarming refused: in flight; force to override"])
            .near(0.0, 0.0, 0.5),
        case("kill", "an order to stop the motors by force")
            .at(0.5, say(VehicleCommand::Kill))
            .bound(|bounds| (bounds.cut, bounds.touch_m_s) = (true, 9.0))
            .lands(),
        case("second-station-kills", "a second station orders to stop the motors by force")
            .at(0.0, Do::Back(COMPANION))
            .at(0.5, other(VehicleCommand::Kill))
            .bound(|bounds| (bounds.cut, bounds.touch_m_s) = (true, 9.0))
            .lands(),
        case("land-and-arm", "an order to land while disarmed, and one to arm")
            .on(Start::PowerUp)
            .at(0.0, say(VehicleCommand::Land))
            .at(0.5, say(VehicleCommand::Arm))
            .lasts(12.0)
            .hears(&["refused: not armed", "on the ground: disarming"])
            .lands(),
        case("arm-and-wait", "armed, and nothing else")
            .on(Start::Ground)
            .lasts(12.0)
            .hears(&["on the ground: disarming"])
            .lands()
            .near(0.0, 0.0, 0.2),
    ]
}
