//! Compares every figure of the monitor with its definition, and checks every trip, and that a healthy flight does not
//! trip.
#![allow(clippy::indexing_slicing, clippy::unwrap_used, missing_docs)] // a failed construction must stop the test

use afbc::monitor::{Monitor, MonitorBounds, MonitorFigures, TRIM_SHARE};
use afbc::{AdaptiveEstimate, CascadeMemory, Profile, Settings, Trip};
use afbc_types::{Axis, Inputs, Parameters, PerAxis};
use nalgebra::Matrix3;
use proptest::prelude::*;
use std::collections::BTreeSet;

const DT_S: f32 = 0.001;
const WEIGHT_N: f32 = 0.486 * 9.81;

fn bounds() -> MonitorBounds {
    MonitorBounds::new(&Profile::Flight.gains(), &Parameters::PAPER.to_f32(), &Profile::Flight.settings())
}

fn monitor(bounds: MonitorBounds) -> Monitor {
    Monitor::new(bounds, DT_S).unwrap()
}

/// Inputs of the monitor in a step.
#[derive(Clone, Copy, Default)]
struct Seen {
    inputs: PerAxis<f32>,
    distances: PerAxis<f32>,
    saturated: bool,
}

/// Returns a step of a hovering vehicle.
fn hover() -> Seen {
    Seen { inputs: PerAxis { z: WEIGHT_N, ..PerAxis::default() }, ..Seen::default() }
}

/// Processes one step with these estimates and inputs.
fn look(
    monitor: &Monitor,
    figures: &mut MonitorFigures,
    estimates: PerAxis<AdaptiveEstimate>,
    seen: &Seen,
) -> Option<Trip> {
    let mut cascade = CascadeMemory::default();
    let PerAxis { roll, pitch, yaw, z, .. } = seen.inputs;
    cascade.last.commanded = Inputs { roll_n: roll, pitch_n: pitch, yaw_n: yaw, thrust_n: z };
    (cascade.estimates, cascade.last.distances) = (estimates, seen.distances);
    monitor.watch(figures, &cascade, seen.saturated)
}

/// Returns the first trip within `steps` steps, and its step.
fn watch(
    monitor: &Monitor,
    steps: usize,
    mut step: impl FnMut(usize) -> (PerAxis<AdaptiveEstimate>, Seen),
) -> (MonitorFigures, Option<(usize, Trip)>) {
    let mut figures = MonitorFigures::default();
    for i in 0..steps {
        let (estimates, seen) = step(i);
        if let Some(trip) = look(monitor, &mut figures, estimates, &seen) {
            return (figures, Some((i + 1, trip)));
        }
    }
    (figures, None)
}

fn estimates(axis: Axis, estimate: AdaptiveEstimate) -> PerAxis<AdaptiveEstimate> {
    let mut estimates = PerAxis::default();
    estimates[axis] = estimate;
    estimates
}

fn input(axis: Axis, value: f32) -> Seen {
    let mut seen = hover();
    seen.inputs[axis] += value;
    seen
}

/// Estimates beyond their bound trip by name within the six steps of a round, while projection still leaves room for
/// Theta. Estimates just below never trip.
#[test]
fn an_estimate_out_of_bounds_trips_within_six_steps() {
    let bounds = bounds();
    let monitor = monitor(bounds);
    for axis in Axis::ALL {
        let (theta, delta) = (bounds.theta[axis], bounds.delta[axis]);
        assert!(theta < Profile::Flight.gains()[axis].safeguards.theta_max);
        let with = |theta: f32, delta: f32| {
            // |Theta_hat| of nine equal entries is three times each.
            let estimate = AdaptiveEstimate { theta: Matrix3::repeat(-theta / 3.0), delta };
            watch(&monitor, 60, |_| (estimates(axis, estimate), hover())).1
        };
        assert_eq!(with(0.999 * theta, 0.999 * delta), None, "{axis:?}");
        let (steps, trip) = with(1.001 * theta, 0.0).unwrap();
        assert!(steps <= 6 && trip == Trip::Theta(axis), "{trip:?} after {steps}");
        let (steps, trip) = with(0.0, 1.001 * delta).unwrap();
        assert!(steps <= 6 && trip == Trip::Delta(axis), "{trip:?} after {steps}");
    }
}

/// The mean distance follows its definition, 1 - exp(-t/1 s) for a constant error of either sign. Beyond its bound, the
/// monitor trips and names the axis.
#[test]
fn large_errors_trip_when_they_last() {
    let bounds = bounds();
    let monitor = monitor(bounds);
    for (axis, sign) in Axis::ALL.into_iter().flat_map(|axis| [(axis, 1.0), (axis, -1.0)]) {
        let bound = bounds.error[axis];
        let with = |e1: f32, steps| {
            let mut seen = hover();
            seen.distances[axis] = sign * e1;
            watch(&monitor, steps, |_| (PerAxis::default(), seen))
        };
        assert_eq!(with(0.99 * bound, 20_000).1, None, "{axis:?}");
        let (steps, trip) = with(2.0 * bound, 20_000).1.unwrap();
        assert_eq!(trip, Trip::Error(axis));
        // 1 - exp(-t) = 1/2 at 0.693 s; a round is six steps.
        assert!((680..=710).contains(&steps), "{axis:?} after {steps}");
        let figure = with(0.9 * bound, 1500).0.error[axis];
        assert!((figure / (0.9 * bound * (1.0 - (-1.5_f32).exp())) - 1.0).abs() < 0.01, "{axis:?}: {figure}");
    }
}

/// With feed-forward, the bounds are shares of what carries the vehicle, below the projection's. Without it, the
/// estimates also hold the weight, and only the projection bounds them.
#[test]
fn bounds_of_estimates_are_shares_of_what_carries_the_vehicle() {
    let (gains, vehicle) = (Profile::Flight.gains(), Parameters::PAPER.to_f32());
    for feed_forward in [true, false] {
        let settings = Settings { feed_forward, ..Profile::Flight.settings() };
        let bounds = MonitorBounds::new(&gains, &vehicle, &settings);
        for axis in Axis::ALL {
            let projection = 0.95 * gains[axis].safeguards.theta_max;
            let carries = if matches!(axis, Axis::X | Axis::Y) { 9.81 } else { WEIGHT_N };
            let wanted = if feed_forward { projection.min(TRIM_SHARE[axis] * carries) } else { projection };
            assert!((bounds.theta[axis] / wanted - 1.0).abs() < 1e-6, "{axis:?}");
        }
    }
}

#[test]
fn lasting_saturation_trips_and_moments_of_it_do_not() {
    let monitor = monitor(bounds());
    let with = |saturated: fn(usize) -> bool| {
        let seen = |i| Seen { saturated: saturated(i), ..hover() };
        watch(&monitor, 20_000, |i| (PerAxis::default(), seen(i)))
    };
    // 1 - exp(-t) = 0.9 at 2.303 s.
    let (steps, trip) = with(|_| true).1.unwrap();
    assert!((2295..=2310).contains(&steps) && trip == Trip::Saturation, "{trip:?} after {steps}");
    // The rotors saturate in five of six steps, then for two whole seconds of every five. Neither trips.
    let (figures, trip) = with(|i| !i.is_multiple_of(6));
    assert_eq!(trip, None);
    assert!((figures.saturation_share - 5.0 / 6.0).abs() < 0.01, "{}", figures.saturation_share);
    assert_eq!(with(|i| i % 5000 < 2000).1, None);
}

/// There are two reversals per period of an oscillation larger than the threshold. More than the bound trip by name. Of
/// U3 only oscillations count that a vehicle can follow: faster ones are vibration of the rotors, however large. The
/// other inputs trip at any frequency.
#[test]
fn limit_cycles_are_counted_and_vibration_about_yaw_is_not() {
    let bounds = bounds();
    let monitor = monitor(bounds);
    let sine = |axis, hz: f32, amplitude: f32| {
        let at = move |i: usize| amplitude * (core::f32::consts::TAU * hz * i as f32 * DT_S).sin();
        watch(&monitor, 10_000, |i| (PerAxis::default(), input(axis, at(i))))
    };
    for (index, axis) in [Axis::Roll, Axis::Pitch, Axis::Yaw, Axis::Z].into_iter().enumerate() {
        let large = bounds.swing_n;
        assert_eq!(sine(axis, 7.0, large).1, None, "{axis:?}: 14 swings a second");
        let rate_hz = sine(axis, 7.0, large).0.swings[index].rate_hz;
        assert!((rate_hz - 14.0).abs() < 1.2, "{axis:?}: {rate_hz}");
        assert_eq!(sine(axis, 0.5, 50.0 * large).1, None, "{axis:?}: a manoeuvre");
        assert_eq!(sine(axis, 10.0, 0.49 * large).1, None, "{axis:?}: small");
        let trips = |hz: f32, amplitude| {
            let (steps, trip) = sine(axis, hz, amplitude).1.unwrap();
            assert_eq!(trip, Trip::LimitCycle(axis), "{hz} Hz");
            // The time follows from 1 - exp(-t) = 16/(2 hz). The margin covers the first periods.
            let within_s = -(1.0 - 16.0 / (2.0 * hz)).ln() + 0.35;
            assert!(steps as f32 * DT_S < within_s, "{axis:?}, {hz} Hz: {steps} steps");
        };
        for (hz, amplitude) in [(9.0, large), (9.0, 100.0 * large), (12.0, 1.5 * large), (15.0, 2.0 * large)] {
            trips(hz, amplitude);
        }
        // The vibration of the rotors does not trip the monitor, at all speeds that have a notch.
        for hz in [28.0, 33.0, 50.0, 77.0, 100.0, 166.0, 167.5, 200.0, 330.0] {
            let amplitude = 4.0 * large;
            if axis == Axis::Yaw {
                assert_eq!(sine(axis, hz, amplitude).1, None, "{hz} Hz");
            } else {
                trips(hz, amplitude);
            }
        }
        // The input chatters between consecutive steps: 0, large, 0, large ...
        let chatter = |i: usize| if i.is_multiple_of(2) { 0.0 } else { 1.01 * large };
        let trip = watch(&monitor, 10_000, |i| (PerAxis::default(), input(axis, chatter(i)))).1;
        if axis == Axis::Yaw {
            assert_eq!(trip, None);
        } else {
            assert!(trip.is_some_and(|(steps, trip)| steps < 30 && trip == Trip::LimitCycle(axis)), "{trip:?}");
        }
    }
}

proptest! {
    /// White noise below the threshold (four times as much on U3) with estimates and errors within bounds does not
    /// trip.
    #[test]
    fn a_healthy_flight_does_not_trip(seed: u32, share in 0.0_f32..0.99, saturated: bool) {
        let bounds = bounds();
        let mut random = seed;
        let mut noise = || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (random >> 8) as f32 / (1 << 23) as f32 - 1.0
        };
        let (_, trip) = watch(&monitor(bounds), 3000, |i| {
            let estimates = PerAxis::from_fn(|axis| AdaptiveEstimate {
                theta: Matrix3::repeat(share * bounds.theta[axis] / 3.0 * noise()),
                delta: share * bounds.delta[axis],
            });
            let mut seen = hover();
            seen.inputs.roll += 0.49 * bounds.swing_n * noise();
            seen.inputs.pitch += 0.49 * bounds.swing_n * noise();
            seen.inputs.yaw += 4.0 * bounds.swing_n * noise();
            seen.inputs.z += 0.49 * bounds.swing_n * noise();
            seen.distances = PerAxis::from_fn(|axis| share * bounds.error[axis] * noise());
            seen.saturated = saturated && i.is_multiple_of(2);
            (estimates, seen)
        });
        prop_assert_eq!(trip, None);
    }

    /// The monitor's norms equal the norms of the estimates. Each step updates one subsystem.
    #[test]
    fn norms_are_those_of_the_estimates(theta in prop::array::uniform9(-0.1_f32..0.1), delta in 0.0_f32..0.05) {
        let estimate = AdaptiveEstimate { theta: Matrix3::from_row_slice(&theta), delta };
        let monitor = monitor(bounds());
        let mut figures = MonitorFigures::default();
        for axis in Axis::ALL.into_iter().chain(Axis::ALL) {
            look(&monitor, &mut figures, PerAxis::from_fn(|_| estimate), &hover());
            let (looked_at, norm) = figures.latest();
            prop_assert_eq!(looked_at, axis);
            prop_assert_eq!(norm.delta, delta);
            prop_assert!((norm.theta_squared - estimate.theta.norm_squared()).abs() <= 1e-6 * norm.theta_squared);
        }
    }
}

#[test]
fn every_reason_is_its_own_and_fits_a_status_text() {
    let mut trips = vec![Trip::Saturation];
    trips.extend(Axis::ALL.into_iter().flat_map(|axis| [Trip::Theta(axis), Trip::Delta(axis), Trip::Error(axis)]));
    trips.extend([Axis::Roll, Axis::Pitch, Axis::Yaw, Axis::Z].map(Trip::LimitCycle));
    let reasons: BTreeSet<_> = trips.iter().map(|trip| trip.reason()).collect();
    assert_eq!(reasons.len(), trips.len());
    assert!(reasons.iter().all(|reason| reason.len() <= 50 && reason.is_ascii()));
}

#[test]
fn bounds_out_of_range_are_refused_by_name() {
    type Set = fn(&mut MonitorBounds, f32);
    let cases: [(afbc_types::Declaration, Set); 6] = [
        (MonitorBounds::THETA, |b, v| b.theta.yaw = v),
        (MonitorBounds::DELTA, |b, v| b.delta.x = v),
        (MonitorBounds::ERROR, |b, v| b.error.roll = v),
        (MonitorBounds::SAT_SHARE, |b, v| b.saturation_share = v),
        (MonitorBounds::SWING, |b, v| b.swing_n = v),
        (MonitorBounds::SWINGS, |b, v| b.swings_hz = v),
    ];
    for (afbc_types::Declaration { range, .. }, set) in cases {
        let with = |value| {
            let mut bounds = bounds();
            set(&mut bounds, value);
            Monitor::new(bounds, DT_S).map(|_| ()).map_err(|error| error.range.name)
        };
        assert_eq!((with(range.min as f32), with(range.max as f32)), (Ok(()), Ok(())));
        for bad in [-1.0, 1e10, f32::NAN, f32::INFINITY] {
            assert_eq!(with(bad), Err(range.name), "{bad}");
        }
    }
}
