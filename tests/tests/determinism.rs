//! Repeated flights give the same bits in every number of every sample. Repeated property tests draw the same cases.
#![allow(clippy::unwrap_used, missing_docs)] // a failed flight must stop the test

use afbc::Profile;
use afbc_plant::PlantModel;
use afbc_scenario::Scenario;
use afbc_scenario::case::Case;
use afbc_scenario::contender::{Contender, ControllerKind};
use afbc_scenario::paper::scenario;
use afbc_sim::flight::{Sample, fly};
use afbc_types::Axis;
use proptest::prelude::{ProptestConfig, Rng as _};
use proptest::test_runner::{RngSeed, TestRunner};

/// Returns every number of a sample.
fn numbers(sample: &Sample) -> impl Iterator<Item = u64> {
    let (m, r, a, t) = (&sample.motion, &sample.reference, &sample.action, &sample.trace);
    let wide = [sample.time_s, r.yaw_rad, r.yaw_rate_rad_s, r.yaw_acceleration_rad_s2].into_iter().chain(
        [
            m.position_m,
            m.velocity_m_s,
            m.attitude_rad,
            m.rates_rad_s,
            r.position_m,
            r.velocity_m_s,
            r.acceleration_m_s2,
            r.jerk_m_s3,
            r.snap_m_s4,
        ]
        .into_iter()
        .flat_map(<[f64; 3]>::from),
    );
    let u = &t.inputs;
    let learnt = Axis::ALL.into_iter().flat_map(|axis| {
        let (e, estimate) = (&t.errors[axis], sample.estimates.unwrap_or_default()[axis]);
        let theta: [[f32; 3]; 3] = estimate.theta.into();
        [e.e1, e.e1_dot, e.e2, estimate.delta].into_iter().chain(theta.into_iter().flatten())
    });
    let narrow = [u.roll_n, u.pitch_n, u.yaw_n, u.thrust_n]
        .into_iter()
        .chain(t.virtual_m_s2)
        .chain(t.desired_rad)
        .chain(t.filtered.into_iter().flat_map(|f| [f.angle, f.rate]))
        .chain(<[f32; 8]>::from(a.speeds.0))
        .chain(<[f32; 8]>::from(a.forces.0))
        .chain(learnt);
    let wide: Vec<u64> = wide.map(f64::to_bits).collect();
    let narrow: Vec<u64> = narrow.map(|x| u64::from(x.to_bits())).collect();
    wide.into_iter().chain(narrow)
}

/// Returns a hash of all bits of a flight (FNV-1a) and the number of its samples.
fn digest(scenario: &Scenario, contender: &Contender) -> (u64, usize) {
    let (mut hash, mut samples) = (0xcbf2_9ce4_8422_2325_u64, 0);
    fly(scenario, contender, |sample| {
        samples += 1;
        for number in numbers(sample) {
            hash = (hash ^ number).wrapping_mul(0x0000_0100_0000_01b3);
        }
    })
    .unwrap();
    (hash, samples)
}

#[test]
fn two_flights_are_the_same_to_the_bit() {
    for model in [PlantModel::Simplified, PlantModel::RigidBody] {
        for kind in ControllerKind::ALL {
            let contender = &Contender::of(kind, Profile::Paper);
            let mut scenario = scenario(model, Case::DEFAULT).unwrap();
            scenario.duration_s = 25.0; // beyond both kinds of gusts, with uncertain parameters
            let first = digest(&scenario, contender);
            assert_eq!(first.1, 25_001);
            assert_eq!(digest(&scenario, contender), first, "{} {}", model.name(), kind.name());
            // Another thread flies while this thread waits.
            let elsewhere = std::thread::scope(|scope| scope.spawn(|| digest(&scenario, contender)).join().unwrap());
            assert_eq!(elsewhere, first);
            // The digest detects a difference in the last bit of a number.
            scenario.initial.position_m.z = scenario.initial.position_m.z.next_up();
            assert_ne!(digest(&scenario, contender).0, first.0, "the digest misses a changed bit");
        }
    }
}

/// `.cargo/config.toml` sets the seed of all property tests of the workspace. `scripts/soak` uses other seeds.
#[test]
fn property_tests_draw_the_same_cases_every_time() {
    let config = ProptestConfig::with_cases(1);
    assert!(matches!(config.rng_seed, RngSeed::Fixed(_)), "run it by cargo, from within the workspace");
    let draw = || TestRunner::new(config.clone()).rng().next_u64();
    assert_eq!(draw(), draw());
}
