//! At rest no memory of a law holds a subnormal number.
#![allow(clippy::unwrap_used, missing_docs, reason = "a controller that cannot be built must stop the test")]

mod harness;
#[path = "../../afbc/tests/common/rest.rs"]
mod rest;

use afbc_peers::{Dfbc, Geometric, Indi, L1, Pid, dfbc, geometric, indi, l1, pid};
use harness::{SETTINGS, vehicle};
use rest::leaves_nothing_subnormal;

#[test]
fn pid() {
    for (name, gains) in [("PID by hand", pid::Gains::PAPER_VEHICLE), ("PID, tuned", pid::Gains::TUNED)] {
        leaves_nothing_subnormal(name, &Pid::new(vehicle(), SETTINGS, gains).unwrap());
    }
}

#[test]
fn geometric() {
    use geometric::Gains;
    for (name, gains) in
        [("Lee", Gains::LEE_2010), ("Goodarzi", Gains::GOODARZI_2013), ("geometric, tuned", Gains::TUNED)]
    {
        leaves_nothing_subnormal(name, &Geometric::new(vehicle(), SETTINGS, gains).unwrap());
    }
}

#[test]
fn indi() {
    for (name, gains) in [("INDI by hand", indi::Gains::PAPER_VEHICLE), ("INDI, tuned", indi::Gains::TUNED)] {
        leaves_nothing_subnormal(name, &Indi::new(vehicle(), SETTINGS, gains).unwrap());
    }
}

#[test]
fn l1() {
    for (name, gains) in [("L1 by hand", l1::Gains::BY_HAND), ("L1, tuned", l1::Gains::TUNED)] {
        leaves_nothing_subnormal(name, &L1::new(vehicle(), SETTINGS, gains).unwrap());
    }
}

#[test]
fn dfbc() {
    for (name, gains) in [("DFBC by hand", dfbc::Gains::PAPER_VEHICLE), ("DFBC, tuned", dfbc::Gains::TUNED)] {
        leaves_nothing_subnormal(name, &Dfbc::new(vehicle(), SETTINGS, gains).unwrap());
    }
}
