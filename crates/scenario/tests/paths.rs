//! Tests users' paths: minimum snap through waypoints, samples and polynomials from files.
#![allow(clippy::unwrap_used, clippy::panic, clippy::indexing_slicing, reason = "tests")]

use afbc_scenario::trajectory::minimum_snap::{PaceLimits, distance_m, minimum_snap};
use afbc_scenario::trajectory::polynomial::{PolynomialCoefficients, PolynomialPiece, peaks};
use afbc_scenario::trajectory::{Reference, SAMPLES, Trajectory};
use core::f64::consts::TAU;
use proptest::prelude::*;
use std::fs;
use std::path::PathBuf;

const LIMITS: PaceLimits = PaceLimits { speed_m_s: 3.0, acceleration_m_s2: 4.0 };

fn places() -> impl Strategy<Value = Vec<[f64; 4]>> {
    let place = (-20.0..20.0, -20.0..20.0, 0.5..20.0, -3.0..3.0)
        .prop_map(|(x, y, z, yaw): (f64, f64, f64, f64)| [x, y, z, yaw]);
    // If distances differ by a factor of more than five, there may be no path close to the places.
    prop::collection::vec(place, 2..12).prop_filter("distances alike", |places| {
        let lengths_m = places.windows(2).map(|pair| distance_m(&pair[0], &pair[1]));
        let (shortest_m, longest_m) = lengths_m.fold((50.0, 0.5), |(a, b), m| (f64::min(a, m), f64::max(b, m)));
        longest_m < 5.0 * shortest_m
    })
}

/// Returns the derivative of this order at `s`, computed term by term.
fn derivative(coefficients: &PolynomialCoefficients, order: i32, s: f64) -> f64 {
    let falling = |power: i32| (0..order).map(|k| f64::from(power - k)).product::<f64>();
    (order..8).map(|power| coefficients[power as usize] * falling(power) * s.powi(power - order)).sum()
}

/// Returns the integral of the squared snap of x, y, z, by Simpson's rule.
fn cost(pieces: &[PolynomialPiece]) -> f64 {
    let of_piece = |piece: &PolynomialPiece| {
        let snap = |s: f64| (0..3).map(|i| derivative(&piece.coefficients[i], 4, s).powi(2)).sum::<f64>();
        let h = piece.duration_s / 32.0;
        (0..16)
            .map(|i| f64::from(2 * i) * h)
            .map(|s| h / 3.0 * (snap(s) + 4.0 * snap(s + h) + snap(s + 2.0 * h)))
            .sum::<f64>()
    };
    pieces.iter().map(of_piece).sum()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// The path goes from rest to rest through every place, has six continuous derivatives, and reaches one of the
    /// limits.
    #[test]
    fn minimum_snap_is_smooth_and_as_fast_as_allowed(places in places()) {
        let pieces = minimum_snap(&places, 2.0, LIMITS).unwrap();
        prop_assert_eq!(pieces.len(), places.len() - 1);
        let trajectory = Trajectory::Polynomials(pieces.clone());
        let (first, last) = (pieces[0], pieces[pieces.len() - 1]);
        for (t, place) in [(first.start_s - 1.0, places[0]), (last.end_s() + 1.0, places[places.len() - 1])] {
            let at = trajectory.at(t);
            prop_assert_eq!(at, Reference::rest(at.position_m, at.yaw_rad));
            prop_assert!((at.position_m - nalgebra::Vector3::new(place[0], place[1], place[2])).norm() < 1e-6);
        }
        for (piece, place) in pieces.iter().zip(&places) {
            for (axis, value) in place.iter().enumerate() {
                // Headings are equal up to whole turns.
                let whole = if axis == 3 { TAU * ((piece.coefficients[axis][0] - value) / TAU).round() } else { 0.0 };
                prop_assert!((piece.coefficients[axis][0] - value - whole).abs() < 1e-9);
            }
        }
        for pair in pieces.windows(2) {
            for axis in 0..4 {
                for order in 0..7 {
                    let end = derivative(&pair[0].coefficients[axis], order, pair[0].duration_s);
                    let begin = derivative(&pair[1].coefficients[axis], order, 0.0);
                    let scale = pair[0].coefficients[axis].iter().fold(1.0, |most: f64, c| most.max(c.abs())) * 1e3;
                    prop_assert!((end - begin).abs() < 1e-6 * scale, "{axis} {order}: {end} {begin}");
                }
            }
        }
        let [speed, acceleration, ..] = peaks(&pieces, SAMPLES);
        prop_assert!(speed <= LIMITS.speed_m_s && acceleration <= LIMITS.acceleration_m_s2);
        prop_assert!(speed > 0.99 * LIMITS.speed_m_s || acceleration > 0.99 * LIMITS.acceleration_m_s2);
    }

    /// No other motion through the same places at the same times has less snap: a bump in two neighbouring pieces,
    /// which keeps places and three derivatives at the outer ends, costs more.
    #[test]
    fn no_bump_lessens_the_snap(
        places in places(),
        at in 0_usize..12,
        size in prop_oneof![-0.3..-0.01, 0.01..0.3_f64],
    ) {
        let pieces = minimum_snap(&places, 0.0, LIMITS).unwrap();
        let mut bumped = pieces.clone();
        let at = at % bumped.len();
        // A bump (s (T - s))^4 in one piece would need degree eight. Instead the velocity at the knot between two
        // pieces is changed.
        prop_assume!(at + 1 < bumped.len());
        let [left, right] = [bumped[at].duration_s, bumped[at + 1].duration_s];
        let knot = |t: f64| -> PolynomialCoefficients {
            // A polynomial of degree seven with velocity 1 at 0 and all other end conditions zero.
            [0.0, 1.0, 0.0, 0.0, -20.0 / t.powi(3), 45.0 / t.powi(4), -36.0 / t.powi(5), 10.0 / t.powi(6)]
        };
        for (i, c) in knot(right).iter().enumerate() {
            bumped[at + 1].coefficients[0][i] += size * c;
        }
        // The previous piece gets the same polynomial of degree seven, mirrored in time.
        let mirrored = knot(left);
        let shifted = |power: i32| {
            let binomial = |n: i32, k: i32| (0..k).map(|i| f64::from(n - i) / f64::from(i + 1)).product::<f64>();
            let sign = -(-1.0_f64).powi(power);
            let part = |n: i32| sign * mirrored[n as usize] * binomial(n, power) * left.powi(n - power);
            (power..8).map(part).sum::<f64>()
        };
        for power in 0..8 {
            bumped[at].coefficients[0][power as usize] += size * shifted(power);
        }
        prop_assert!(cost(&bumped) > cost(&pieces), "{} {}", cost(&bumped), cost(&pieces));
    }
}

/// Returns a folder for a test's files.
fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::create_dir_all(&folder).unwrap();
    folder
}

fn scenario(folder: &std::path::Path, path: &str, keys: &str) -> Result<Trajectory, String> {
    fs::write(folder.join("path.csv"), path).unwrap();
    let text = format!("[trajectory]\nkind = \"file\"\nfile = \"path.csv\"\n{keys}");
    fs::write(folder.join("scenario.toml"), text).unwrap();
    let scenario = afbc_scenario::load(&folder.join("scenario.toml"));
    scenario.map(|scenario| scenario.trajectory).map_err(|error| error.to_string())
}

/// Samples of a known path give a path that follows it; the more derivatives are known, the closer.
#[test]
fn samples_become_the_path_that_they_come_from() {
    let folder = folder("samples");
    let known = Trajectory::Paper;
    let write = |columns: &str, every_s: f64| {
        let mut text = format!("time_s,x_m,y_m,z_m{columns},note\n");
        for i in 0..=(20.0 / every_s) as u32 {
            let t = f64::from(i) * every_s;
            let Reference { position_m: x, velocity_m_s: v, acceleration_m_s2: a, yaw_rad, .. } = known.at(t);
            text += &format!("{t},{},{},{}", x.x, x.y, x.z);
            if columns.contains("vx") {
                text += &format!(",{},{},{}", v.x, v.y, v.z);
            }
            if columns.contains("ax") {
                text += &format!(",{},{},{}", a.x, a.y, a.z);
            }
            text += &format!(",{yaw_rad},free\n");
        }
        text
    };
    let mut errors = Vec::new();
    for columns in
        [",psi_rad", ",vx_m_s,vy_m_s,vz_m_s,psi_rad", ",vx_m_s,vy_m_s,vz_m_s,ax_m_s2,ay_m_s2,az_m_s2,yaw_rad"]
    {
        let read = scenario(&folder, &write(columns, 1.0), "").unwrap();
        let error = |t: f64| {
            let (own, known) = (read.at(t), known.at(t));
            assert!((own.velocity_m_s - known.velocity_m_s).norm() < 0.02, "{t}");
            assert!((own.yaw_rad - known.yaw_rad).abs() < 1e-2);
            (own.position_m - known.position_m).norm()
        };
        errors.push((20..180).map(|i| error(0.1 * f64::from(i) + 0.05)).fold(0.0, f64::max));
    }
    assert!(errors[0] < 1e-3 && errors.is_sorted_by(|a, b| a > b), "{errors:?}");
    // A path with another start and twice the pace has the same places at twice the speed.
    let slow = scenario(&folder, &write(",psi_rad", 1.0), "").unwrap();
    let fast = scenario(&folder, &write(",psi_rad", 1.0), "start_s = 3.0\npace = 2.0").unwrap();
    for t in [0.5, 4.25, 9.75] {
        let (slow, fast) = (slow.at(2.0 * t), fast.at(3.0 + t));
        assert!((slow.position_m - fast.position_m).norm() < 1e-9);
        assert!((2.0 * slow.velocity_m_s - fast.velocity_m_s).norm() < 1e-9);
        assert!((4.0 * slow.acceleration_m_s2 - fast.acceleration_m_s2).norm() < 1e-9);
    }
}

/// A wrapping heading turns on without a jump.
#[test]
fn headings_do_not_jump() {
    let folder = folder("headings");
    let rows: String = (0..40)
        .map(|i| {
            let yaw = 0.4 * f64::from(i);
            let wrapped = libm::atan2(libm::sin(yaw), libm::cos(yaw));
            format!("{},0,0,1,{wrapped}\n", f64::from(i) * 0.5)
        })
        .collect();
    let read = scenario(&folder, &format!("time_s,x_m,y_m,z_m,yaw_rad\n{rows}"), "").unwrap();
    for i in 10..190 {
        assert!((read.at(0.1 * f64::from(i)).yaw_rate_rad_s - 0.8).abs() < 0.05, "{i}");
    }
}

/// Flies the Crazyflie's polynomials with the columns of its tools.
#[test]
fn polynomials_are_flown_as_they_are() {
    let folder = folder("polynomials");
    let head = std::iter::once("duration".to_owned())
        .chain(["x", "y", "z", "yaw"].iter().flat_map(|axis| (0..8).map(move |n| format!("{axis}^{n}"))))
        .collect::<Vec<_>>()
        .join(",");
    let row = |duration: f64, x: [f64; 3]| {
        format!("{duration},{},{},{},0,0,0,0,0,{}1{}\n", x[0], x[1], x[2], "0,".repeat(8), ",0".repeat(15))
    };
    // The first piece is x = 0.5 t^2 for 2 s. The second continues at 2 m/s: x = 2 + 2 t.
    let text = format!("{head}\n{}{}", row(2.0, [0.0, 0.0, 0.5]), row(1.0, [2.0, 2.0, 0.0]));
    let read = scenario(&folder, &text, "").unwrap();
    assert_eq!(
        (read.at(1.0).position_m.x, read.at(1.0).velocity_m_s.x, read.at(1.0).acceleration_m_s2.x),
        (0.5, 1.0, 1.0)
    );
    assert_eq!((read.at(2.5).position_m.x, read.at(2.5).velocity_m_s.x, read.at(2.5).position_m.z), (3.0, 2.0, 1.0));
    let broken = format!("{head}\n{}{}", row(2.0, [0.0, 0.0, 0.5]), row(1.0, [2.5, 2.0, 0.0]));
    let refused = scenario(&folder, &broken, "").unwrap_err();
    assert!(refused.contains("path.csv:3: duration: the piece begins 0.500 m"), "{refused}");
}

/// Tabs, and semicolons with decimal commas, as spreadsheets write in countries with decimal commas.
#[test]
fn a_path_may_be_separated_otherwise() {
    let folder = folder("separated");
    let commas = "time_s,x_m,y_m,z_m\n0,0,0,1\n0.5,0.25,-1e-1,1\n1,1,0,1.5\n";
    let expected = scenario(&folder, commas, "").unwrap();
    for separated in [
        commas.replace(',', ";"),
        commas.replace(',', "\t"),
        commas.replace(',', ";").replace('.', ","),
        commas.replace(',', " \t ").replace('.', ","),
    ] {
        assert_eq!(scenario(&folder, &separated, "").unwrap(), expected, "{separated}");
    }
}

/// A mistake in a file is reported in one line with the file's name, line and column.
#[test]
fn what_is_wrong_is_told_in_one_line() {
    let folder = folder("wrong");
    for (path, problem) in [
        ("", "path.csv"),
        ("time_s,x_m,y_m\n0,0,0\n1,0,0\n", "the column z_m is missing"),
        ("time_s,x_m,y_m,z_m\n0,0,0,1\n", "fewer than two lines"),
        ("time_s,x_m,y_m,z_m\n0,0,0,1\n1,a,0,1\n", "path.csv:3: x_m: \"a\" is no number"),
        ("time_s,x_m,y_m,z_m\n0,0,0,1\n1,nan,0,1\n", "path.csv:3: x_m: \"nan\""),
        ("time_s,x_m,y_m,z_m\n0,0,0,1\n1,1e9,0,1\n", "path.csv:3: x_m: \"1e9\""),
        ("time_s,x_m,y_m,z_m\n0,0,0,1\n1,0,0\n", "path.csv:3: the line has 3 values, but the first line names 4"),
        ("time_s,x_m,y_m,z_m\n1,0,0,1\n1,0,0,1\n", "path.csv:3: time_s: 1 is not later than 1"),
        ("time_s,x_m,y_m,z_m\n-1,0,0,1\n1,0,0,1\n", "the path begins at -1 s; set start_s"),
        ("time_s,x_m,y_m,z_m\n0,0,0,1\n0.001,9000,0,1\n", "more than a controller accepts"),
        ("duration,x^0\n1,0\n", "its columns must be duration"),
    ] {
        let refused = scenario(&folder, path, "").unwrap_err();
        assert!(refused.contains(problem) && !refused.contains('\n'), "{refused}");
    }
    fs::write(folder.join("scenario.toml"), "[trajectory]\nkind = \"file\"\nfile = \"none.csv\"\n").unwrap();
    let refused = afbc_scenario::load(&folder.join("scenario.toml")).unwrap_err().to_string();
    assert!(refused.contains("scenario.toml:3: trajectory.file:") && refused.contains("none.csv"), "{refused}");
}
