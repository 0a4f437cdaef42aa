//! At rest no memory of a law holds a subnormal number.
#![allow(clippy::unwrap_used, missing_docs)] // a controller that cannot be built must stop the test

#[path = "common/rest.rs"]
mod rest;

use afbc::integral::IntegralBackstepping;
use afbc::monitor::Bounds;
use afbc::{Adaptive, Backstepping, Controller, Guarded, Profile};
use afbc_types::{Parameters, PerAxis};
use rest::leaves_nothing_subnormal;

#[test]
fn afbc() {
    for profile in Profile::ALL {
        let law = Adaptive::new(profile.gains()).unwrap();
        let controller = Controller::new(Parameters::PAPER.to_f32(), profile.settings(), law).unwrap();
        leaves_nothing_subnormal(&format!("AFBC, {}", profile.name()), &controller);
    }
}

#[test]
fn backstepping() {
    let vehicle = Parameters::PAPER.to_f32();
    for profile in Profile::ALL {
        let gains = profile.gains();
        let law = Backstepping::new(&vehicle, PerAxis::from_fn(|axis| gains[axis].backstepping)).unwrap();
        let controller = Controller::new(vehicle, profile.settings(), law).unwrap();
        leaves_nothing_subnormal(&format!("backstepping, {}", profile.name()), &controller);
    }
}

#[test]
fn integral_backstepping() {
    let vehicle = Parameters::PAPER.to_f32();
    for profile in Profile::ALL {
        let law = IntegralBackstepping::new(&vehicle, profile.gains().map(|gains| gains.into())).unwrap();
        let controller = Controller::new(vehicle, profile.settings(), law).unwrap();
        leaves_nothing_subnormal(&format!("integral backstepping, {}", profile.name()), &controller);
    }
}

#[test]
fn monitor() {
    let (vehicle, gains, settings) = (Parameters::PAPER.to_f32(), Profile::Flight.gains(), Profile::Flight.settings());
    let guarded = |bounds| Guarded::new(vehicle, settings, gains, bounds).unwrap();
    let bounds = Bounds::new(&gains, &vehicle, &settings);
    leaves_nothing_subnormal("under its monitor", &guarded(bounds));
    let hasty = Bounds { error: PerAxis { z: 0.01, ..bounds.error }, ..bounds };
    leaves_nothing_subnormal("under a hasty monitor", &guarded(hasty));
    let lax = Bounds { error: PerAxis::from_fn(|_| 1e9), ..bounds };
    leaves_nothing_subnormal("under a lax monitor", &guarded(lax));
}
