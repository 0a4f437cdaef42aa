//! Tests the start of a scenario, which is made once for all contenders.
#![allow(clippy::unwrap_used, missing_docs)] // tests

use afbc::Profile;
use afbc_plant::Motion;
use afbc_scenario::contender::{Contender, ControllerKind};
use afbc_scenario::parse;
use afbc_sim::flight::{EstimateErrors, FlightStart, Sample, fly};
use core::ops::ControlFlow;

const FLIGHT: &str = r#"
duration_s = 0.3
profile = "flight"
rotors = { time_constant_s = 0.02, force_max_n = 3.0 }
drag = {}
wind = { turbulence = "light" }
[trajectory]
kind = "hover"
position_m = [0, 0, 1]
"#;
const ON_THE_ESTIMATE: &str = "[instruments]\nimu = \"icm-42688-p\"\ntracker = \"mocap-100\"\n";
const ON_SENSORS: &str = "[sensors]\nnoise = 0.001\n";

/// Every contender flies exactly as it does alone, whoever flew before: on its own estimate, which settles once, and on
/// noisy sensors.
#[test]
fn contenders_do_not_feel_who_flew_before() {
    for (name, sensors) in [("estimate", ON_THE_ESTIMATE), ("sensors", ON_SENSORS)] {
        let scenario = parse(name, &format!("{FLIGHT}{sensors}"), name).unwrap();
        let mut start = FlightStart::of(&scenario);
        let mut ends: Vec<Motion> = Vec::new();
        for kind in [ControllerKind::Afbc, ControllerKind::Pid, ControllerKind::Afbc] {
            let contender = Contender::of(kind, Profile::Flight);
            let (mut alone, mut after): (Vec<_>, Vec<_>) = (Vec::new(), Vec::new());
            let of = |motion: Motion, estimated: Option<EstimateErrors>| (motion, estimated);
            fly(&scenario, &contender, |sample| alone.push(of(sample.motion, sample.estimated))).unwrap();
            let mut observe = |sample: &Sample| {
                after.push(of(sample.motion, sample.estimated));
                ControlFlow::Continue(())
            };
            start.fly(&contender, &mut observe).unwrap();
            assert_eq!(alone, after, "{name}, {kind:?}");
            assert_eq!(alone.len(), 301);
            ends.extend(alone.last().map(|(motion, _)| *motion));
        }
        // Different laws end differently, so the test can tell flights apart.
        assert!(ends.first() == ends.last() && ends.first() != ends.get(1), "{ends:?}");
    }
}
