//! Flights on the vehicle's own estimate: its accuracy and its consistency in the closed loop.
//! `docs/reference/estimation.md` shows the figures; `--nocapture` prints them.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs)] // a failed flight must stop the test

use afbc_plant::instruments::{FailureKind, InstrumentFault};
use afbc_scenario::contender::{Contender, ControllerKind};
use afbc_scenario::trajectory::Trajectory;
use afbc_scenario::{Outage, Scenario, built_in};
use afbc_sim::flight::{EstimateErrors, Sample, World, fly};
use afbc_sim::metrics::{Accumulator, AidSource, EstimateMetrics, Metrics, SETTLED_S};
use nalgebra::{Vector3, Vector4};

fn scenario(name: &str) -> Scenario {
    built_in(name).unwrap().read().unwrap()
}

fn afbc(scenario: &Scenario) -> &Contender {
    scenario.contender(ControllerKind::Afbc).unwrap()
}

/// Flies under AFBC, which must not lose the vehicle.
fn flown(scenario: &Scenario, mut observe: impl FnMut(&Sample)) -> Metrics {
    let mut metrics = Accumulator::default();
    let lost = fly(scenario, afbc(scenario), |sample| {
        metrics.add(sample);
        observe(sample);
    });
    assert_eq!(lost.unwrap(), None, "{}, seed {}", scenario.name, scenario.seed);
    metrics.finish()
}

/// Returns the mean squared errors of the estimate and the largest tracking errors, over flights with the seeds 1 to
/// `flights`.
fn accuracy(scenario: &Scenario, flights: u64) -> (EstimateMetrics, Vector4<f64>) {
    let mut sum = EstimateMetrics::default();
    let mut tracking = Vector4::zeros();
    for seed in 1..=flights {
        let metrics = flown(&Scenario { seed, ..scenario.clone() }, |_| ());
        let estimate = metrics.estimate.unwrap();
        assert_eq!(estimate.valid_ratio, 1.0, "seed {seed}");
        let square = |v: &Vector3<f64>| v.component_mul(v) / flights as f64;
        sum.position_m += square(&estimate.position_m);
        sum.velocity_m_s += square(&estimate.velocity_m_s);
        sum.attitude_rad += square(&estimate.attitude_rad);
        tracking = tracking.sup(&metrics.rmse);
    }
    let root = |v: Vector3<f64>| v.map(f64::sqrt);
    let [position_m, velocity_m_s, attitude_rad] = [sum.position_m, sum.velocity_m_s, sum.attitude_rad].map(root);
    (EstimateMetrics { position_m, velocity_m_s, attitude_rad, ..sum }, tracking)
}

/// The vehicle flies the paper's trajectory with motion capture.
#[test]
fn indoors() {
    let (estimate, tracking) = accuracy(&scenario("mocap"), 10);
    let (p, v, a) = (estimate.position_m.norm(), estimate.velocity_m_s.norm(), estimate.attitude_rad.norm());
    println!("mocap: {p:.5} m, {v:.4} m/s, {:.3} deg; tracking at most {tracking:.4}", a.to_degrees());
    assert!(p <= 0.003 && v <= 0.02 && a.to_degrees() <= 0.3, "{p} m, {v} m/s, {a} rad");
    assert!(tracking.max() <= 0.01, "{tracking}");
}

/// The vehicle flies the paper's trajectory with GNSS, barometer and magnetometer. No filter can know the receiver's
/// slow error, so the position is as good as the receiver's. Where the receiver's error is noise, the position error is
/// less than half of it.
#[test]
fn outdoors() {
    let scenario = scenario("outdoor");
    let (estimate, _) = accuracy(&scenario, 20);
    let own_m = |scenario: &Scenario| {
        let gnss = scenario.instruments.gnss.unwrap();
        (2.0 * (gnss.horizontal_m * gnss.horizontal_m + gnss.noise_m * gnss.noise_m)).sqrt()
    };
    let report = |name: &str, scenario: &Scenario, estimate: &EstimateMetrics| {
        let (h, v) = (estimate.position_m.xy().norm(), estimate.velocity_m_s.norm());
        let tilt = estimate.attitude_rad.xy().norm().to_degrees();
        let heading = estimate.attitude_rad.z.to_degrees();
        let own_m = own_m(scenario);
        println!(
            "{name}: horizontal {h:.3} m of {own_m:.3} m, {v:.4} m/s, tilt {tilt:.3} deg, heading {heading:.2} deg"
        );
        assert!(v <= 0.15 && tilt <= 1.0 && heading <= 3.0, "{name}: {v} m/s, {tilt} deg, {heading} deg");
        h / own_m
    };
    let share = report("outdoor", &scenario, &estimate);
    assert!(share <= 1.0, "{share}");
    let mut fast = scenario;
    fast.instruments.gnss.as_mut().unwrap().horizontal_m = 0.0;
    fast.instruments.gnss.as_mut().unwrap().vertical_m = 0.0;
    let (estimate, _) = accuracy(&fast, 20);
    let share = report("outdoor, a receiver without slow error", &fast, &estimate);
    assert!(share <= 0.5, "{share}");
}

/// Returns results of a hover in which the tracker fails for `gap_s`: the largest distance from the reference, and the
/// largest changes of the inputs per step before the failure and after the tracker's return.
fn without_tracker(failure: FailureKind, gap_s: f64, seed: u64) -> (f64, f64, f64) {
    let mut scenario = scenario("mocap");
    let position_m = Vector3::new(0.0, 0.0, 2.0);
    scenario.trajectory = Trajectory::Hover { position_m, yaw_rad: 0.0 };
    scenario.initial.position_m = position_m;
    scenario.initial.attitude_rad = Vector3::zeros();
    scenario.initial.velocity_m_s = Vector3::zeros();
    (scenario.duration_s, scenario.seed) = (20.0, seed);
    let [start_s, end_s] = [10.0, 10.0 + gap_s];
    scenario.instrument_faults = vec![InstrumentFault { failure, start_s, end_s, rise_s: 0.0 }];
    let (mut far_m, mut before, mut after) = (0.0_f64, 0.0_f64, 0.0_f64);
    let mut last: Option<Vector4<f64>> = None;
    flown(&scenario, |sample| {
        let u = afbc_sim::metrics::inputs(sample);
        let change = last.replace(u).map_or(0.0, |last| (u - last).amax());
        if (SETTLED_S..start_s).contains(&sample.time_s) {
            before = before.max(change);
        } else if sample.time_s >= start_s {
            far_m = far_m.max((sample.motion.position_m - position_m).norm());
            after = after.max(if sample.time_s >= end_s { change } else { 0.0 });
            assert!(sample.estimated.unwrap().valid, "{} s", sample.time_s);
        }
    });
    (far_m, before, after)
}

#[test]
fn the_tracker_is_gone_in_hover() {
    let (lost, frozen) = (FailureKind::TrackerLost, FailureKind::TrackerFrozen);
    for (failure, gap_s, most_m) in [(lost, 1.0, 0.2), (lost, 3.0, 1.5), (frozen, 3.0, 1.5)] {
        let flights: Vec<_> = (1..=20).map(|seed| without_tracker(failure, gap_s, seed)).collect();
        let far_m = flights.iter().fold(0.0_f64, |far_m, flight| far_m.max(flight.0));
        let before = flights.iter().fold(0.0_f64, |most, flight| most.max(flight.1));
        let after = flights.iter().fold(0.0_f64, |most, flight| most.max(flight.2));
        // Vibration changes the inputs too. The tracker's return must not change them more.
        println!(
            "{} for {gap_s} s: {far_m:.3} m; inputs change by {before:.4} N before, {after:.4} N after",
            failure.name()
        );
        assert!(far_m <= most_m, "{gap_s} s: {far_m} m");
        // A frozen pose is believed for 0.2 s against the inertial sensor. The vehicle is 0.4 m off by then and flies
        // back faster than after a lost tracker.
        let most = if matches!(failure, FailureKind::TrackerFrozen) { 0.35 } else { 1.2 * before };
        assert!(after <= most, "{gap_s} s: {after} N after {before} N");
    }
}

/// If a tracker never returns, or repeats itself for ever, the position becomes invalid after 5 s, and the controller
/// gets none.
#[test]
fn a_tracker_gone_for_good_is_admitted() {
    admitted(FailureKind::TrackerLost);
    admitted(FailureKind::TrackerFrozen);
}

fn admitted(failure: FailureKind) {
    let mut scenario = scenario("mocap");
    scenario.instrument_faults = vec![InstrumentFault { failure, start_s: 1.0, end_s: f64::INFINITY, rise_s: 0.0 }];
    let mut world = World::new(&scenario, 0.001).unwrap();
    let mut lost_s = None;
    for _ in 0..8000 {
        let view = world.look();
        assert_eq!(view.state.is_some(), view.estimated.unwrap().valid);
        if view.state.is_none() {
            lost_s.get_or_insert(view.time_s);
        }
        // The vehicle falls freely here, which does not matter to the estimator.
        world.advance(&Default::default());
    }
    let lost_s = lost_s.unwrap();
    assert!((5.0..7.0).contains(&lost_s), "{lost_s} s");
}

/// While the tracker is silent at first, the vehicle rests.
#[test]
fn nobody_starts_without_an_estimate() {
    let mut scenario = scenario("mocap");
    let tracker = scenario.instruments.tracker.as_mut().unwrap();
    (tracker.loss.rate_hz, tracker.loss.mean_s) = (0.5, 1.0);
    for seed in 1..=100 {
        let view = World::new(&Scenario { seed, ..scenario.clone() }, 0.001).unwrap().look();
        assert!(view.state.is_some() && view.time_s == 0.0, "seed {seed}");
    }
}

/// Looking at a world repeatedly does not take new measurements.
#[test]
fn looking_twice_changes_nothing() {
    let mut world = World::new(&scenario("outdoor"), 0.001).unwrap();
    let first = world.look();
    let second = world.look();
    assert_eq!((first.state, first.estimated), (second.state, second.estimated));
    assert!(first.state.is_some(), "it has settled before t = 0");
}

/// An outage of the link stops the tracker's measurements, not the estimate.
#[test]
fn an_outage_is_not_one_of_the_estimate() {
    let mut scenario = scenario("mocap");
    scenario.duration_s = 12.0;
    scenario.outages = vec![Outage { start_s: 6.0, end_s: 7.0 }];
    let (mut within, mut before) = (0.0_f32, 0.0_f32);
    flown(&scenario, |sample| {
        let estimated = sample.estimated.unwrap();
        assert!(estimated.valid);
        let sigma = estimated.position_sigma_m.max();
        if (SETTLED_S..6.0).contains(&sample.time_s) {
            before = before.max(sigma);
        } else if sample.time_s < 7.0 {
            within = within.max(sigma);
        }
    });
    assert!(within > 3.0 * before, "{within} m and {before} m");
}

#[test]
fn every_law_flies_on_it() {
    for name in ["mocap", "outdoor"] {
        let scenario = Scenario { duration_s: 15.0, ..scenario(name) };
        assert_eq!(scenario.contenders.len(), ControllerKind::ALL.len());
        for contender in &scenario.contenders {
            let mut estimates = 0;
            let lost = fly(&scenario, contender, |sample| estimates += u32::from(sample.estimated.is_some()));
            assert_eq!((lost.unwrap(), estimates), (None, 15_001), "{name}, {}", contender.name);
        }
    }
}

/// Neither twice the vibration nor fixes reach the inputs, and the monitor finds no limit cycle. Without the notch
/// filter, roll and pitch inputs would change by 50 mN per step.
#[test]
fn shaken_twice_as_much() {
    for name in ["mocap", "outdoor"] {
        let mut scenario = Scenario { duration_s: 20.0, ..scenario(name) };
        let imu = scenario.instruments.imu.as_mut().unwrap();
        (imu.gyro.vibration_rad_s, imu.accel.vibration_m_s2) = (0.04, 2.0);
        let contender = afbc(&scenario).clone().monitored();
        for seed in 1..=4 {
            let mut metrics = Accumulator::default();
            let mut trips = false;
            let lost = fly(&Scenario { seed, ..scenario.clone() }, &contender, |sample| {
                metrics.add(sample);
                trips |= sample.action.health.fallback.is_some();
            });
            let [roll, pitch, yaw, thrust] = metrics.finish().mean_abs_delta_u.map(|change_n| 1e3 * change_n).into();
            println!("{name}, seed {seed}: {roll:.1}, {pitch:.1}, {yaw:.1}, {thrust:.1} mN a step");
            assert_eq!((lost.unwrap(), trips), (None, false), "{name}, seed {seed}");
            assert!(roll.max(pitch) <= 25.0 && thrust <= 10.0, "{name}, seed {seed}: {roll}, {pitch}, {thrust} mN");
        }
    }
}

#[test]
fn the_same_flight_twice() {
    let estimates = || {
        let mut all: Vec<EstimateErrors> = Vec::new();
        let scenario = Scenario { duration_s: 2.0, ..scenario("outdoor") };
        flown(&scenario, |sample| all.extend(sample.estimated));
        all
    };
    let first = estimates();
    assert_eq!(first.len(), 2001);
    assert!(first == estimates());
}

/// Means over the flights of a Monte Carlo study.
#[derive(Default)]
struct Consistency {
    /// NEES of the nine coordinates at each of [`TIMES_S`].
    nees: [f64; TIMES_S.len()],
    /// Squared error divided by the variance of attitude, velocity and position, for each coordinate, at these times.
    ratios: [Vector3<f64>; 3],
    /// Sum of normalised innovations squared, number of scalars and number of rejected measurements, for each aid.
    nis: [(f64, u64, u64); AidSource::ALL.len()],
}

const FLIGHTS: u64 = 100;
const TIMES_S: [f64; 4] = [6.0, 8.0, 10.0, 12.0];

fn monte_carlo(scenario: &Scenario) -> Consistency {
    let mut sum = Consistency::default();
    for seed in 1..=FLIGHTS {
        let scenario = Scenario { seed, duration_s: 12.0, ..scenario.clone() };
        let metrics = flown(&scenario, |sample| {
            let Some(i) = TIMES_S.iter().position(|time_s| (sample.time_s - time_s).abs() < 1e-6) else { return };
            let e = sample.estimated.unwrap();
            sum.nees[i] += f64::from(e.nees) / FLIGHTS as f64;
            let pairs = [
                (e.attitude_error_rad, e.attitude_sigma_rad),
                (e.velocity_error_m_s, e.velocity_sigma_m_s),
                (e.position_error_m, e.position_sigma_m),
            ];
            for (ratio, (error, sigma)) in sum.ratios.iter_mut().zip(pairs) {
                let normal = error.component_div(&sigma).cast::<f64>();
                *ratio += normal.component_mul(&normal) / (FLIGHTS as usize * TIMES_S.len()) as f64;
            }
        });
        for (sum, aid) in sum.nis.iter_mut().zip(metrics.estimate.unwrap().aids) {
            *sum = (sum.0 + aid.nis * aid.scalars as f64, sum.1 + aid.scalars, sum.2 + aid.rejected);
        }
    }
    println!("{}: NEES {:.2?}", scenario.name, sum.nees);
    for (name, ratio) in ["attitude", "velocity", "position"].iter().zip(&sum.ratios) {
        println!("  {name}: squared error over variance {:.2?}", ratio.as_slice());
    }
    for (aid, (nis, scalars, rejected)) in
        AidSource::ALL.iter().zip(&sum.nis).filter(|(_, (_, scalars, _))| *scalars > 0)
    {
        println!("  {aid:?}: NIS per scalar {:.3} of {scalars}, rejected {rejected}", nis / *scalars as f64);
    }
    sum
}

impl Consistency {
    fn nis(&self, aid: AidSource) -> f64 {
        let (sum, scalars, _) = self.nis[AidSource::ALL.iter().position(|one| *one == aid).unwrap()];
        sum / scalars as f64
    }
}

/// True if the mean over the flights of chi-square numbers with `degrees` of freedom is within its 95 % bounds. The
/// mean of so many is nearly normal.
fn is_consistent(mean: f64, degrees: f64) -> bool {
    (mean - degrees).abs() <= 1.96 * (2.0 * degrees / FLIGHTS as f64).sqrt()
}

#[test]
fn consistent_indoors() {
    let found = monte_carlo(&scenario("mocap"));
    for (nees, time_s) in found.nees.iter().zip(TIMES_S) {
        assert!(is_consistent(*nees, 9.0), "{nees} at {time_s} s");
    }
    for aid in [AidSource::TrackerPosition, AidSource::TrackerAttitude] {
        assert!((0.9..1.05).contains(&found.nis(aid)), "{aid:?}: {}", found.nis(aid));
    }
}

/// No error may be larger than the estimate says: no error, no position off by the receiver's slow error, no innovation
/// except those that the document explains.
#[test]
fn consistent_outdoors() {
    let slow = scenario("outdoor");
    let mut fast = slow.clone();
    fast.name = "outdoor, a receiver without slow error".into();
    fast.instruments.gnss.as_mut().unwrap().horizontal_m = 0.0;
    fast.instruments.gnss.as_mut().unwrap().vertical_m = 0.0;
    for (scenario, height) in [(&slow, 1.3), (&fast, 1.02)] {
        let found = monte_carlo(scenario);
        let name = &scenario.name;
        // The variances are slightly too large, to allow for vibration. So NEES may be below its lower bound, but never
        // above its upper bound.
        let most = 9.0 + 1.96 * (18.0 / FLIGHTS as f64).sqrt();
        assert!(found.nees.iter().all(|nees| (6.0..most).contains(nees)), "{name}: {:?}", found.nees);
        assert!(found.ratios.iter().all(|ratio| ratio.max() <= 1.3), "{name}: {:?}", found.ratios);
        // 95 % bounds for 21 000 scalars.
        assert!(
            (0.981..1.019).contains(&found.nis(AidSource::GnssPosition)),
            "{name}: {}",
            found.nis(AidSource::GnssPosition)
        );
        assert!(
            (0.9..1.019).contains(&found.nis(AidSource::GnssVelocity)),
            "{name}: {}",
            found.nis(AidSource::GnssVelocity)
        );
        assert!((0.98..height).contains(&found.nis(AidSource::Height)), "{name}: {}", found.nis(AidSource::Height));
        assert!((0.7..1.019).contains(&found.nis(AidSource::Heading)), "{name}: {}", found.nis(AidSource::Heading));
    }
}

/// Flights are long: by default a tenth of an hour each, and ten hours with `HOURS=10`. The covariance stays positive
/// and bounded, and no error grows beyond its standard deviation.
#[test]
fn hours_of_flight() {
    let hours: f64 = std::env::var("HOURS").map_or(0.1, |hours| hours.parse().unwrap());
    // Outdoors the heading's standard deviation grows while the field is doubted.
    for (name, sigma_rad, sigma_m, nees_max) in [("mocap", 0.05, 0.01, 10.0), ("outdoor", 0.08, 3.0, 12.0)] {
        let scenario = Scenario { duration_s: 3600.0 * hours, ..scenario(name) };
        let (mut checks, mut far, mut nees, mut sigmas) = (0.0, Vec::from([0.0; 9]), 0.0, [0.0_f32; 3]);
        let mut turned = Vector3::<f32>::zeros();
        flown(&scenario, |sample| {
            let e = sample.estimated.unwrap();
            // NEES is NaN if the covariance is not positive.
            assert!(e.valid && e.nees.is_finite(), "{name}, {} s: {e:?}", sample.time_s);
            if sample.time_s < SETTLED_S || (sample.time_s + 0.5).fract() > 0.0005 {
                return;
            }
            let pairs = [
                (e.attitude_error_rad, e.attitude_sigma_rad),
                (e.velocity_error_m_s, e.velocity_sigma_m_s),
                (e.position_error_m, e.position_sigma_m),
            ];
            let ratios = pairs.iter().flat_map(|(error, sigma)| error.component_div(sigma).data.0[0]);
            turned = turned.sup(&e.attitude_error_rad.abs());
            for (i, ratio) in ratios.enumerate() {
                assert!(ratio.abs() < 6.0, "{name}, {} s, state {i}: {ratio} sigma", sample.time_s);
                far[i] += f64::from(u8::from(ratio.abs() > 3.0));
            }
            let largest = [e.attitude_sigma_rad.max(), e.velocity_sigma_m_s.max(), e.position_sigma_m.max()];
            sigmas.iter_mut().zip(largest).for_each(|(most, sigma)| *most = most.max(sigma));
            (checks, nees) = (checks + 1.0, nees + f64::from(e.nees));
        });
        let nees = nees / checks;
        println!("{name}, {hours} h: NEES {nees:.2}, largest sigma {sigmas:.3?}, attitude off by {turned:.4?} rad");
        println!("  of {checks} beyond 3 sigma {far:?}");
        // By chance, one error in 370 exceeds three standard deviations. Outdoors, errors last for minutes.
        assert!(far.iter().all(|far| *far <= 10.0 + 0.01 * checks), "{name}: {far:?} of {checks}");
        assert!(sigmas[0] < sigma_rad && sigmas[1] < 0.1 && sigmas[2] < sigma_m, "{name}: {sigmas:?}");
        assert!(nees < nees_max && turned.xy().max() < 0.02 && turned.z < 0.12, "{name}: {nees}, {turned} rad");
    }
}
