//! Limits of the profile `flight` in the paper's flight, with realistic rotors and a noisy state.

use afbc::Profile;
use afbc_scenario::contender::{Contender, ControllerKind};
use afbc_scenario::{Scenario, built_in};
use afbc_sim::run::FlightResult;

fn hardware() -> Scenario {
    built_in("hardware").unwrap().read().unwrap()
}

fn fly(kind: ControllerKind, profile: Profile, scenario: &Scenario) -> FlightResult {
    FlightResult::fly(scenario, &Contender::of(kind, profile), u64::MAX).unwrap()
}

#[test]
fn the_profile_flight_tracks_within_2_5_mm_and_does_not_chatter() {
    for seed in 1..=3 {
        let scenario = Scenario { seed, ..hardware() };
        let run = fly(ControllerKind::Afbc, Profile::Flight, &scenario);
        assert_eq!(run.lost, None, "seed {seed}");
        let (rmse, delta_u) = (run.metrics.rmse, run.metrics.mean_abs_delta_u);
        println!("seed {seed}: RMSE {rmse:?}, mean |dU| {delta_u:?}");
        assert!(rmse.x <= 0.0025 && rmse.y <= 0.0025 && rmse.z <= 0.0025 && rmse.w <= 0.0015, "seed {seed}: {rmse}");
        assert!(delta_u.x <= 0.011 && delta_u.y <= 0.011 && delta_u.w <= 0.015, "seed {seed}: {delta_u}");
    }
}

#[test]
fn it_is_three_times_better_than_backstepping_with_either_set_of_gains() {
    let scenario = hardware();
    let afbc = fly(ControllerKind::Afbc, Profile::Flight, &scenario).metrics.rmse;
    for profile in Profile::ALL {
        let baseline = fly(ControllerKind::Backstepping, profile, &scenario).metrics.rmse;
        assert!(baseline.x >= 3.0 * afbc.x && baseline.y >= 3.0 * afbc.y, "{profile:?}: {baseline} and {afbc}");
    }
}

#[test]
fn the_profile_paper_chatters_on_the_same_flight() {
    let run = fly(ControllerKind::Afbc, Profile::Paper, &hardware());
    assert!(run.lost.is_some() || run.metrics.mean_abs_delta_u.w > 0.2, "{:?}", run.metrics);
}
