//! Every reference described by a file keeps its given limits and a controller's limits; anything else is refused in
//! one line. The tests compute velocities and accelerations from differences of positions.
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, reason = "tests")]

use afbc_scenario::trajectory::Trajectory;
use afbc_scenario::trajectory::minimum_snap::LEG_MIN_M;
use core::f64::consts::{PI, TAU};
use nalgebra::Vector3;
use proptest::prelude::*;
use std::fmt::Write as _;

/// Longest flight \[s\].
const LONGEST_S: f64 = 36_000.0;

/// A place: position and heading.
type Place = (Vector3<f64>, f64);

fn read(trajectory: &str) -> Result<Trajectory, String> {
    let text = format!("[trajectory]\n{trajectory}");
    let read = afbc_scenario::parse("mine.toml", &text, "mine").map_err(|error| error.to_string());
    if let Err(mistakes) = &read {
        for line in mistakes.lines() {
            assert!(line.starts_with("mine.toml:") && line.len() < 500, "{mistakes}");
        }
    }
    read.map(|scenario| scenario.trajectory)
}

/// Numbers of every magnitude between `least` and `most`, with either sign.
fn sized(least: f64, most: f64) -> impl Strategy<Value = f64> {
    (prop::bool::ANY, least.ln()..most.ln()).prop_map(|(minus, size)| if minus { -size.exp() } else { size.exp() })
}

fn positive(least: f64, most: f64) -> impl Strategy<Value = f64> {
    sized(least, most).prop_map(f64::abs)
}

fn anywhere(least_m: f64, most_m: f64) -> impl Strategy<Value = Vector3<f64>> {
    [sized(least_m, most_m), sized(least_m, most_m), sized(least_m, most_m)].prop_map(Vector3::from)
}

/// Places whose steps are of any size, nearly zero, straight on, or back.
fn places() -> impl Strategy<Value = Vec<Place>> {
    let step = prop_oneof![
        2 => anywhere(0.3, 3.0),
        1 => anywhere(1e-16, 1e-2),
        1 => anywhere(1e-3, 1e3),
        1 => Just(Vector3::zeros()),
        1 => Just(Vector3::x()),
        1 => Just(-Vector3::x()),
    ];
    let steps = prop::collection::vec((step, -7.0..7.0), 1..9);
    (anywhere(1e-3, 5e3), steps).prop_map(|(first_m, steps)| {
        let mut places = vec![(first_m, 0.0)];
        for (step_m, yaw_rad) in steps {
            let next_m = places[places.len() - 1].0 + step_m;
            places.push((next_m.map(|x| x.clamp(-1e4, 1e4)), yaw_rad));
        }
        places
    })
}

fn minimum_snap(places: &[Place], speed_m_s: f64, acceleration_m_s2: f64) -> Result<Trajectory, String> {
    let mut text = format!(
        "kind = \"minimum-snap\"\nspeed_max_m_s = {speed_m_s:?}\nacceleration_max_m_s2 = {acceleration_m_s2:?}\n"
    );
    for (position_m, yaw_rad) in places {
        let [x, y, z] = (*position_m).into();
        writeln!(text, "[[trajectory.waypoint]]\nposition_m = [{x:?}, {y:?}, {z:?}]\nyaw_rad = {yaw_rad:?}").unwrap();
    }
    read(&text)
}

/// Largest speed and acceleration from differences of positions, 2,000 per piece.
fn by_differences(trajectory: &Trajectory) -> [f64; 2] {
    let Trajectory::Polynomials(pieces) = trajectory else { panic!("{trajectory:?}") };
    let mut peaks = [0.0_f64; 2];
    for piece in pieces {
        // Times within the piece and relative to its start, where positions and times are exact to the last bits.
        let h = piece.duration_s / 2_000.0;
        let places: Vec<_> = (0..=2_000).map(|k| piece.at(piece.start_s + h * f64::from(k)).position_m).collect();
        for three in places.windows(3) {
            let speed = (three[2] - three[0]).norm() / (2.0 * h);
            let acceleration = (three[2] - three[1] * 2.0 + three[0]).norm() / (h * h);
            // Rounding error of positions, and of times, during which the path moves on.
            let rounding = 4.0 * f64::EPSILON * (three[1].norm() + speed * piece.end_s());
            peaks = [peaks[0].max(speed - rounding / h), peaks[1].max(acceleration - 4.0 * rounding / (h * h))];
        }
    }
    peaks
}

/// Returns the smallest turn from one heading to another.
fn short_turn(from_rad: f64, to_rad: f64) -> f64 {
    let turn_rad = (to_rad - from_rad).rem_euclid(TAU);
    if turn_rad > PI { turn_rad - TAU } else { turn_rad }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    /// Through any places there is a path that keeps its limits, ends within a flight and stays near the places; or
    /// none is returned.
    #[test]
    fn minimum_snap_keeps_its_limits_or_is_refused(
        places in places(),
        speed_m_s in positive(0.01, 100.0),
        acceleration_m_s2 in positive(0.01, 100.0),
    ) {
        let legs = places.windows(2).map(|pair| (pair[1].0 - pair[0].0).norm());
        let (shortest_m, longest_m) = legs.fold((f64::MAX, 0.0), |(a, b), m| (f64::min(a, m), f64::max(b, m)));
        let read = minimum_snap(&places, speed_m_s, acceleration_m_s2);
        if shortest_m < LEG_MIN_M {
            let told = read.unwrap_err();
            prop_assert!(told.contains("waypoint.position_m: ") && told.contains("leave one of the two out"), "{told}");
            return Ok(());
        }
        let trajectory = match read {
            Ok(trajectory) => trajectory,
            Err(told) => {
                // A path through similar distances is refused only if it takes too long.
                let seconds = 10.0 * (longest_m / speed_m_s + (longest_m / acceleration_m_s2).sqrt()) * 8.0;
                prop_assert!(longest_m > 5.0 * shortest_m || seconds > LONGEST_S, "{told}");
                return Ok(());
            }
        };
        let Trajectory::Polynomials(pieces) = &trajectory else { panic!("{trajectory:?}") };
        prop_assert!(trajectory.end_s().unwrap() <= LONGEST_S);
        let [speed, acceleration] = by_differences(&trajectory);
        prop_assert!(speed <= speed_m_s * (1.0 + 1e-9), "{speed} of {speed_m_s}");
        prop_assert!(acceleration <= acceleration_m_s2 * (1.0 + 1e-9), "{acceleration} of {acceleration_m_s2}");
        let mut heading_rad = places[0].1;
        for (piece, pair) in pieces.iter().zip(places.windows(2)) {
            let [start, end] = [piece.start_s, piece.end_s()].map(|t| piece.at(t));
            for (at, (position_m, _)) in [start, end].iter().zip(pair) {
                prop_assert!((at.position_m - position_m).norm() < 1e-6 * longest_m, "{at:?}, not {position_m}");
            }
            // The heading turns the short way round from the previous heading.
            heading_rad += short_turn(heading_rad, pair[1].1);
            prop_assert!((end.yaw_rad - heading_rad).abs() < 1e-6, "{} not {heading_rad}", end.yaw_rad);
            for k in 0..100 {
                let at = piece.at(piece.start_s + piece.duration_s * f64::from(k) / 100.0);
                prop_assert!((at.position_m - pair[0].0).norm() <= 5.01 * longest_m);
            }
        }
    }

    /// Waypoints with any distances, times and headings give a reference that a controller accepts and that turns the
    /// short way round; or they are refused.
    #[test]
    fn waypoints_are_for_a_controller_or_are_refused(
        places in places(),
        lengths_s in prop::collection::vec(positive(1e-6, 1e4), 9),
    ) {
        let (mut text, mut times_s) = ("kind = \"waypoints\"\n".to_owned(), Vec::new());
        for ((position_m, yaw_rad), length_s) in places.iter().zip(&lengths_s) {
            let time_s = times_s.last().copied().unwrap_or(0.0) + length_s;
            times_s.push(time_s);
            let [x, y, z] = (*position_m).into();
            let place = format!("position_m = [{x:?}, {y:?}, {z:?}]\nyaw_rad = {yaw_rad:?}");
            writeln!(text, "[[trajectory.waypoint]]\ntime_s = {time_s:?}\n{place}").unwrap();
        }
        let Ok(trajectory) = read(&text) else { return Ok(()) };
        prop_assert!(trajectory.end_s().unwrap() <= LONGEST_S);
        for (times_s, pair) in times_s.windows(2).zip(places.windows(2)) {
            let at = |share: f64| trajectory.at(times_s[0] + (times_s[1] - times_s[0]) * share);
            for k in 0..=100 {
                prop_assert!(at(f64::from(k) / 101.0).setpoint().is_plausible());
            }
            // In the middle of a leg, half of the turn is done.
            let turned_rad = 2.0 * (at(0.5).yaw_rad - at(0.0).yaw_rad);
            prop_assert!((turned_rad - short_turn(pair[0].1, pair[1].1)).abs() < 1e-6, "{turned_rad}");
        }
    }

    /// Circles, lemniscates and Lissajous figures of any size have the requested pace and are accepted by a controller
    /// at any time; or they are refused.
    #[test]
    fn curves_have_the_pace_asked_for_or_are_refused(
        centre_m in anywhere(1e-3, 1e4),
        size_m in positive(1e-3, 1e4),
        pace in positive(1e-3, 1e3),
        periods_s in [positive(0.1, LONGEST_S), positive(0.1, LONGEST_S), positive(0.1, LONGEST_S)],
        times in prop::collection::vec(0.0..1.0, 50),
    ) {
        let [x, y, z] = centre_m.into();
        let centre = format!("centre_m = [{x:?}, {y:?}, {z:?}]");
        let [a, b, c] = periods_s;
        let periods = format!("period_s = [{a:?}, {b:?}, {c:?}]");
        let lissajous = format!("amplitude_m = [{size_m:?}, -{size_m:?}, {size_m:?}]\n{periods}");
        for (kind, keys) in [
            ("circle", format!("radius_m = {size_m:?}\nacceleration_m_s2 = {pace:?}")),
            ("circle", format!("radius_m = {size_m:?}\nperiod_s = {a:?}")),
            ("lemniscate", format!("half_length_m = {:?}\nspeed_m_s = {pace:?}", size_m.max(0.01))),
            ("lissajous", lissajous),
        ] {
            let Ok(trajectory) = read(&format!("kind = \"{kind}\"\n{centre}\n{keys}\n")) else { continue };
            for share in &times {
                let at = trajectory.at(share * LONGEST_S);
                prop_assert!(at.setpoint().is_plausible(), "{at:?}");
                if keys.contains("acceleration") {
                    prop_assert!((at.acceleration_m_s2.norm() / pace - 1.0).abs() < 1e-9);
                }
                prop_assert!(kind != "lemniscate" || at.velocity_m_s.norm() < pace * (1.0 + 1e-9));
            }
        }
    }
}

/// A lap and a second path are joined, so that their common point appears twice. The second of the two points is
/// refused if they are closer than 1 mm. Otherwise the path is flown in less than 25 s.
#[test]
fn a_doubled_waypoint_is_refused_or_harmless() {
    for (apart_m, is_flown) in
        [(0.0, false), (1e-15, false), (1e-8, false), (9e-4, false), (1.1e-3, true), (0.01, true), (0.3, true)]
    {
        let xy =
            [(2.0, 0.0), (0.0, 2.0), (-2.0, 0.0), (0.0, -2.0), (2.0, -apart_m), (2.0, 0.0), (3.0, 1.0), (4.0, 0.0)];
        let read = minimum_snap(&xy.map(|(x, y)| (Vector3::new(x, y, 2.0), 0.0)), 2.0, 3.0);
        assert_eq!(read.is_ok(), is_flown, "{apart_m}: {read:?}");
        match read {
            Ok(lap) => assert!(lap.end_s().unwrap() < 25.0, "{lap:?}"),
            // The error names the sixth waypoint's position.
            Err(told) => assert!(told.starts_with("mine.toml:21: trajectory.waypoint.position_m: "), "{told}"),
        }
    }
}

/// From 3.1 to -3.1 the heading turns by 0.083 rad, in every kind with its own headings.
#[test]
fn headings_turn_the_short_way_round() {
    let folder = std::path::PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    std::fs::write(folder.join("turn.csv"), "time_s,x_m,y_m,z_m,yaw_rad\n0,0,0,1,3.1\n1,1,0,1,-3.1\n").unwrap();
    let zeros = |count| ",0".repeat(count);
    let names = ["x", "y", "z", "yaw"].map(|axis| (0..8).map(|n| format!(",{axis}^{n}")).collect::<String>());
    let rows = [3.1, -3.1].map(|yaw| format!("1{},{yaw}{}\n", zeros(24), zeros(7)));
    std::fs::write(folder.join("pieces.csv"), format!("duration{}\n{}", names.concat(), rows.concat())).unwrap();
    let place = |x: f64, yaw: f64| format!("[[trajectory.waypoint]]\nposition_m = [{x}, 0, 1]\nyaw_rad = {yaw}\n");
    let [first, second] = [place(0.0, 3.1), place(1.0, -3.1)];
    let limits = "speed_max_m_s = 1\nacceleration_max_m_s2 = 1\n";
    let file = |name: &str| format!("kind = \"file\"\nfile = \"{}\"", folder.join(name).display());
    for keys in [
        format!("kind = \"waypoints\"\n{first}time_s = 0\n{second}time_s = 1\n"),
        format!("kind = \"minimum-snap\"\n{limits}{first}{second}"),
        file("turn.csv"),
        file("pieces.csv"),
    ] {
        let trajectory = read(&keys).unwrap();
        let end_s = trajectory.end_s().unwrap();
        for k in 0..=1_000 {
            let at = trajectory.at(end_s * f64::from(k) / 1_000.0);
            assert!((3.1 - 1e-9..TAU - 3.1 + 1e-9).contains(&at.yaw_rad), "{} in {keys}", at.yaw_rad);
        }
        assert!((trajectory.at(end_s + 1.0).yaw_rad - (TAU - 3.1)).abs() < 1e-9, "{keys}");
    }
}
