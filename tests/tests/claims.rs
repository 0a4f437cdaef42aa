//! Checks the paper's three claims by flights with all four signs of the uncertainty and both models of the vehicle.

use afbc_plant::{Environment, Gust, GustKind, Motion, PlantModel};
use afbc_report::claims::VANISHED;
use afbc_report::claims::claims;
use afbc_scenario::Scenario;
use afbc_scenario::case::{Case, Reading, Uncertainty};
use afbc_scenario::contender::ControllerKind;
use afbc_scenario::paper::scenario;
use afbc_scenario::trajectory::Trajectory;
use afbc_sim::flight::Sample;
use afbc_sim::flown::ScenarioFlight;
use afbc_sim::metrics::{self, Metrics};
use afbc_sim::run::FlightResult;
use nalgebra::{Vector3, Vector4};

fn fly_both(scenario: &Scenario) -> Vec<ScenarioFlight> {
    let fly = |contender| ScenarioFlight {
        scenario: scenario.clone(),
        run: FlightResult::fly(scenario, contender, 10).unwrap(),
    };
    scenario.contenders.iter().map(fly).collect()
}

/// Returns all default readings of the paper: four signs, two models.
fn readings() -> impl Iterator<Item = Scenario> {
    Uncertainty::ALL.into_iter().flat_map(|uncertainty| {
        [PlantModel::Simplified, PlantModel::RigidBody].map(move |model| {
            scenario(model, Case { reading: Some(Reading::Persistent), uncertainty: Some(uncertainty) }).unwrap()
        })
    })
}

fn below(a: Vector4<f64>, b: Vector4<f64>) -> bool {
    a.iter().zip(b.iter()).all(|(a, b)| a < b)
}

/// Returns the mean and largest |error| over the last 5 s.
fn late(run: &FlightResult) -> (Vector4<f64>, Vector4<f64>) {
    let late = run.log.iter().filter(|sample| sample.time_s >= 55.0);
    let errors: Vec<_> = late.map(|sample| metrics::tracking_error(sample).abs()).collect();
    let largest = errors.iter().fold(Vector4::zeros(), |largest: Vector4<f64>, error| largest.sup(error));
    (errors.iter().sum::<Vector4<f64>>() / errors.len() as f64, largest)
}

/// Checks the figures themselves, without the code of [`claims`].
#[test]
fn the_flights_bear_the_claims_out() {
    for scenario in readings() {
        let [afbc, baseline] = <[ScenarioFlight; 2]>::try_from(fly_both(&scenario)).unwrap().map(|flown| flown.run);
        let case = scenario.case.unwrap();
        let place = format!("{} {case:?}", scenario.model.name());
        assert_eq!((afbc.lost, baseline.lost), (None, None), "{place}");
        let (a, b): (&Metrics, &Metrics) = (&afbc.metrics, &baseline.metrics);

        // "Null error is achieved in all outputs for the AFBC controller ... which is not the case for backstepping".
        // The average over the last 5 s hides zero crossings and chatter. There, AFBC's errors are millimetres, with
        // psi still decaying after the gust at 45 s, and backstepping's are decimetres. A start 1e-6 m away changes
        // AFBC's figures by up to 1.3 mm and 6 mrad, since chatter amplifies it, and does not change backstepping's.
        let (mean, largest) = late(&afbc);
        let kept = b.final_error.abs();
        assert!(below(mean, Vector4::new(0.01, 0.01, 0.002, 0.07)), "{place}: AFBC is left with {mean}");
        assert!(below(Vector4::new(0.3, 0.3, 0.03, 0.3), kept), "{place}: backstepping ends with {kept}");
        assert!(below(largest, late(&baseline).1 * 0.5), "{place}: {largest} against {}", late(&baseline).1);

        // "Better tracking performances".
        assert!(below(a.rmse, b.rmse), "{place}: RMSE {} against {}", a.rmse, b.rmse);
        // "Input signals are less smooth".
        assert!(
            below(b.mean_abs_delta_u, a.mean_abs_delta_u),
            "{place}: {} against {}",
            a.mean_abs_delta_u,
            b.mean_abs_delta_u
        );
    }
}

#[test]
fn the_claims_as_reported_hold() {
    for scenario in readings() {
        let flown = fly_both(&scenario);
        let claims = claims(&flown);
        assert_eq!(claims.len(), 3);
        for claim in &claims {
            assert!(claim.holds, "{} {:?}: {claim:?}", scenario.model.name(), scenario.case);
        }
        // The evidence contains the figures: the RMSE of both laws along x, to the millimetre.
        let tracking = claims.iter().find(|claim| claim.statement.contains("tracks better")).unwrap();
        for run in [&flown[0].run, &flown[1].run] {
            let figure = format!("x {:.3}", run.metrics.rmse.x);
            assert!(tracking.evidence.contains(&figure), "{figure} in {}", tracking.evidence);
        }
    }
}

/// A claim without support fails. Making each figure worse in turn makes exactly its own claim fail.
#[test]
fn a_claim_falls_with_its_figures() {
    let honest = fly_both(&scenario(PlantModel::Simplified, Case::DEFAULT).unwrap());
    let holds = |change: &dyn Fn(&mut FlightResult, &FlightResult)| {
        let mut flown = honest.clone();
        change(&mut flown[0].run, &honest[1].run);
        claims(&flown).iter().map(|claim| claim.holds).collect::<Vec<_>>()
    };
    // Adds an error along one axis during the last 5 s, as a share of the error that backstepping has there.
    let left = |run: &mut FlightResult, baseline: &FlightResult, axis: usize, share: f64| {
        let late = |sample: &&Sample| sample.time_s >= 55.0;
        let kept: Vec<f64> = baseline.log.iter().filter(late).map(|s| metrics::tracking_error(s)[axis].abs()).collect();
        let error = share * kept.iter().sum::<f64>() / kept.len() as f64;
        for sample in run.log.iter_mut().filter(|sample| late(&&**sample)) {
            match axis {
                3 => sample.motion.attitude_rad.z = sample.reference.yaw_rad + error,
                _ => sample.motion.position_m[axis] = sample.reference.position_m[axis] + error,
            }
        }
    };
    assert_eq!(holds(&|_, _| ()), [true, true, true]);
    for axis in 0..4 {
        assert_eq!(holds(&|a, b| left(a, b, axis, VANISHED + 0.01)), [false, true, true]);
        assert_eq!(holds(&|a, b| left(a, b, axis, -VANISHED - 0.01)), [false, true, true]);
        assert_eq!(holds(&|a, b| left(a, b, axis, VANISHED - 0.01)), [true, true, true]);
        assert_eq!(holds(&|a, b| a.metrics.rmse[axis] = b.metrics.rmse[axis] * 1.01), [true, false, true]);
        assert_eq!(holds(&|a, _| a.metrics.rmse[axis] = f64::NAN), [true, false, true]);
        let smoother = |a: &mut FlightResult, b: &FlightResult| {
            a.metrics.mean_abs_delta_u[axis] = b.metrics.mean_abs_delta_u[axis] * 0.99;
        };
        assert_eq!(holds(&smoother), [true, true, false]);
    }
    // Without flights of both laws, there are no claims.
    assert_eq!(claims(&honest[..1]).len(), 0);
    let mut other = honest.clone();
    other[1].scenario.name = "another".into();
    assert_eq!(claims(&other).len(), 0);
    assert_eq!(claims(&[]).len(), 0);
}

#[test]
fn no_claim_holds_if_a_vehicle_is_lost() {
    let forces = Case { reading: Some(Reading::Forces), ..Case::DEFAULT };
    let flown = fly_both(&scenario(PlantModel::Simplified, forces).unwrap());
    assert!(flown.iter().all(|flown| flown.run.lost.is_some()));
    assert!(claims(&flown).iter().all(|claim| !claim.holds));
}

/// Backstepping's remaining error in closed form: with f and g known except for A, (13) comes to rest where (1 +
/// alpha_1 alpha_2) e_1 = A. In hover with a persistent gust along x, with alpha_1 = 1 and alpha_2 = 2, the error is
/// A/3.
#[test]
fn backstepping_keeps_an_offset_of_the_gust_over_one_plus_both_gains() {
    for size in [0.3, 1.2, -0.9] {
        let mut scenario = scenario(PlantModel::Simplified, Case { reading: None, uncertainty: None }).unwrap();
        let position_m = Vector3::new(1.0, -2.0, 3.0);
        scenario.trajectory = Trajectory::Hover { position_m, yaw_rad: 0.0 };
        scenario.initial = Motion { position_m, ..Motion::default() };
        scenario.duration_s = 40.0;
        let gust =
            Gust { axis: afbc_types::Axis::X, kind: GustKind::Acceleration, size, start_s: 1.0, end_s: f64::INFINITY };
        scenario.environment = Environment::new(scenario.vehicle, vec![], vec![gust]).unwrap();

        let run =
            FlightResult::fly(&scenario, scenario.contender(ControllerKind::Backstepping).unwrap(), u64::MAX).unwrap();
        let offset = size / (1.0 + 1.0 * 2.0);
        // The vehicle holds its height, so the thrust is the weight divided by the cosine of the tilt, as (40) assumes,
        // and g tan(theta) is u5. Only rounding remains: that of f32 positions of 1 m (6e-8) times alpha_1 alpha_2. The
        // cosine of a yaw of 0 is exact. After 39 s the transient has decayed.
        let error = run.metrics.final_error;
        assert!((error.x - offset).abs() <= 1e-6, "{} m for {offset} m", error.x);
        assert!(error.y.abs() < 1e-6 && error.w.abs() < 1e-6, "{error}");

        // AFBC keeps no error, since adaptation removes it. After 39 s the error is below a twentieth of the offset.
        let run = FlightResult::fly(&scenario, scenario.contender(ControllerKind::Afbc).unwrap(), u64::MAX).unwrap();
        assert!(run.metrics.final_error.x.abs() < 0.05 * offset.abs(), "{} m of {offset} m", run.metrics.final_error.x);
    }
}
