//! Consistency: the filter's errors are as large as it says, in a hundred flights with other noise and other biases.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)] // tests

mod common;

use afbc_estimator::Aid;
use common::{Flight, ICM, MOCAP, OUTDOOR, Sensors, eight, fly};

const RUNS: usize = 100;

/// Bounds of the mean of `count` chi-square numbers with `degrees` of freedom each, of 95 %: normal, since many.
fn bounds(degrees: f64, count: f64) -> (f64, f64) {
    let half = 1.96 * (2.0 * degrees / count).sqrt();
    (degrees - half, degrees + half)
}

fn inside(name: &str, mean: f64, degrees: f64, count: f64) {
    let (low, high) = bounds(degrees, count);
    println!("{name}: mean {mean:.3}, 95 % bounds {low:.3} to {high:.3}");
    assert!(mean > low && mean < high, "{name}: mean {mean} is not within {low} to {high}");
}

/// Flies `RUNS` times; checks NEES of `N` states and NIS of `aids`.
fn check<const N: usize>(name: &str, sensors: Sensors, aids: &[Aid]) {
    const TIMES: [usize; 8] = [5000, 6000, 8000, 10_000, 12_000, 14_000, 17_000, 20_000];
    let truth = fly(eight, 20.0);
    let mut nees = [0.0; TIMES.len()];
    let mut squares = [0.0; N];
    let mut nis = vec![(0.0, 0.0); aids.len()];
    for run in 0..RUNS {
        let mut flight = Flight::new(&truth, ICM, sensors, 1000 + run as u64);
        let mut fused = vec![0; aids.len()];
        for ms in 1..=20_000 {
            let estimate = flight.step();
            for ((aid, fused), nis) in aids.iter().zip(&mut fused).zip(&mut nis) {
                let record = flight.memory.aids().of(*aid);
                if record.accepted > *fused {
                    *fused = record.accepted;
                    if ms > 3000 {
                        *nis = (nis.0 + f64::from(record.nis), nis.1 + f64::from(record.scalars));
                    }
                }
                assert_eq!(record.rejected, 0, "{name}, run {run}: {aid:?}");
            }
            if let Some(i) = TIMES.iter().position(|time| *time == ms) {
                nees[i] += flight.nees::<N>(&estimate) / RUNS as f64;
                let (e, p) = (flight.errors(&estimate), flight.covariance());
                for (k, square) in squares.iter_mut().enumerate() {
                    *square += e[k] * e[k] / p[(k, k)] / (RUNS * TIMES.len()) as f64;
                }
            }
        }
    }
    println!("{name}: mean squared error over variance, state by state: {squares:.2?}");
    for (time, mean) in TIMES.iter().zip(&nees) {
        inside(&format!("{name}, NEES at {time} ms"), *mean, N as f64, RUNS as f64);
    }
    // One state by itself may be off by chance: 4 sigma of as many independent flights.
    let half = 4.0 * (2.0 / RUNS as f64).sqrt();
    for (state, square) in squares.iter().enumerate() {
        assert!((square - 1.0).abs() < half, "{name}, state {state}: {square}");
    }
    for (aid, (sum, scalars)) in aids.iter().zip(&nis) {
        inside(&format!("{name}, NIS of {aid:?} per scalar"), sum / scalars, 1.0, *scalars);
    }
}

#[test]
fn mocap() {
    check::<15>("mocap", MOCAP, &[Aid::TrackerPosition, Aid::TrackerAttitude]);
}

#[test]
fn outdoor() {
    check::<16>("outdoor", OUTDOOR, &[Aid::GnssPosition, Aid::GnssVelocity, Aid::Height, Aid::Heading]);
}
