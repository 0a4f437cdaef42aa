//! Accuracy.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::indexing_slicing, clippy::panic, missing_docs)] // tests
mod common;
use common::*;

#[test]
fn debug() {
    let truth = fly(eight, 20.0);
    for (name, sensors) in [("mocap", MOCAP), ("outdoor", OUTDOOR)] {
        let mut flight = Flight::new(&truth, ICM, sensors, 1);
        for i in 0..20000 {
            let e = flight.step();
            if i % 1000 == 999 && e.unready.is_none() {
                let err = flight.errors(&e);
                let n: Vec<f64> = (0..15).map(|k| err[k] / flight.covariance()[(k, k)].sqrt()).collect();
                println!("{name} {i} {:?} {:.1?}", flight.nees::<15>(&e), n);
                if i == 19999 { println!("{e:#?}"); }
            } else if i % 1000 == 999 { println!("{:?}", e.unready); }
        }
    }
}
