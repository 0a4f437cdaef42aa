//! Tests the local frame of a vehicle with a GNSS receiver.
#![allow(clippy::expect_used, reason = "a test that cannot go on should say why")]

use afbc_estimator::{Estimator, ImuCalibration, Measurement, OutputFilter, Settings};
use afbc_flight_core::{Inbox, Refusal, Stamped};
use afbc_onboard::{Aged, EstimatorFrontEnd, Readings};
use afbc_types::{Pose, PoseSigmas, State};
use nalgebra::Vector3;
use proptest::prelude::*;

/// Largest noise of a fix per coordinate \[m\].
const NOISE_M: f32 = 0.05;

/// Returns pseudo-random numbers in -1..1, different for each time.
fn noise(ms: u64) -> Vector3<f32> {
    let number = |k: u64| ((ms * 3 + k).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40) as f32 / (1 << 23) as f32 - 1.0;
    Vector3::new(number(0), number(1), number(2))
}

fn fix(position_m: Vector3<f32>, velocity_m_s: Vector3<f32>, sigma_m: f32) -> Measurement {
    Measurement::Gnss {
        position_m,
        velocity_m_s,
        horizontal_sigma_m: sigma_m,
        vertical_sigma_m: sigma_m,
        speed_sigma_m_s: 0.05,
        climb_sigma_m_s: 0.05,
    }
}

/// A level vehicle that points north.
struct Bench {
    front_end: EstimatorFrontEnd,
    inbox: Inbox,
    /// Part of the estimate that is missing for flight.
    missing: Option<Refusal>,
    ms: u64,
}

impl Bench {
    fn new() -> Self {
        let front_end = Estimator::new(Settings::DEFAULT)
            .map(|estimator| EstimatorFrontEnd::new(estimator, OutputFilter::default(), ImuCalibration::default()))
            .expect("valid");
        Bench { front_end, inbox: Inbox::default(), missing: None, ms: 0 }
    }

    /// Runs a tick with this acceleration and fix.
    fn tick(&mut self, acceleration_m_s2: Vector3<f32>, fix: Option<Measurement>, age_us: u32) -> State {
        self.ms += 1;
        let force = acceleration_m_s2 + Vector3::new(0.0, 0.0, 9.81) + noise(self.ms) * 0.02;
        let imu = Some(Aged { value: [noise(self.ms + 1_000_000) * 1e-3, force], age_us: 0 });
        let heading = Measurement::Heading { heading_rad: 0.0, sigma_rad: 0.01 };
        let heading = self.ms.is_multiple_of(50).then_some(Aged { value: heading, age_us: 0 });
        let fix = fix.map(|value| Aged { value, age_us });
        let aids = if fix.is_some() { [fix, heading] } else { [heading, None] };
        let mut inbox = self.inbox.take();
        let state = self.front_end.tick(self.ms * 1000, &Readings { imu, aids }, &mut inbox);
        self.missing = inbox.missing();
        state.expect("it has a sample").state
    }

    /// Stands for `time_ms` at `place_m` in the receiver's frame, with ten noisy fixes per second.
    fn stand(&mut self, time_ms: u64, place_m: Vector3<f32>, sigma_m: f32) -> State {
        let mut state = State::default();
        for _ in 0..time_ms {
            let at = place_m + noise(self.ms + 5_000_000) * NOISE_M;
            let fix = self.ms.is_multiple_of(100).then(|| fix(at, Vector3::zeros(), sigma_m));
            state = self.tick(Vector3::zeros(), fix, 0);
        }
        state
    }

    /// Sends a tracker's pose at `place_m` in the local frame.
    fn pose(&mut self, place_m: Vector3<f32>) {
        let position_m = place_m + noise(self.ms + 9_000_000) * 1e-4;
        let pose = Pose { position_m, attitude: [1.0, 0.0, 0.0, 0.0], sigmas: PoseSigmas::UNKNOWN };
        self.inbox.put_pose(Stamped { value: pose, at_us: self.ms * 1000 });
    }
}

fn place() -> impl Strategy<Value = Vector3<f32>> {
    [-20_000.0_f32..20_000.0, -20_000.0_f32..20_000.0, -500.0_f32..9_000.0].prop_map(Vector3::from)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// Wherever the receiver's frame has its origin, and wherever the vehicle moved before the first fix, it then
    /// stands at zero. Later motion is measured correctly.
    #[test]
    fn it_stands_at_zero(place_m in place(), [x, y, z] in [-8.0_f32..8.0, -8.0_f32..8.0, 0.0_f32..8.0]) {
        let by_m = Vector3::new(x, y, z);
        let push = |ms: u64| if ms < 1000 { by_m } else { -by_m };
        let mut bench = Bench::new();
        for ms in 0..4000 {
            bench.tick(if ms < 2000 { Vector3::zeros() } else { push(ms - 2000) }, None, 0);
        }
        let state = bench.stand(4000, place_m, 0.5);
        // The tolerance covers the noise of the first fix, and rounding: 2 mm at 20 km.
        prop_assert!(state.position_m.amax() < 2.0 * NOISE_M + 0.01, "{}", state.position_m);
        // The vehicle moves from rest to rest in two seconds.
        let (mut velocity, mut moved) = (Vector3::zeros(), Vector3::zeros());
        let mut state = State::default();
        for ms in 0..2000 {
            let acceleration = push(ms);
            velocity += acceleration * 1e-3;
            moved += velocity * 1e-3;
            let fix = (ms % 100 == 0).then(|| fix(place_m + moved, velocity, 0.5));
            state = bench.tick(acceleration, fix, 0);
        }
        prop_assert!((state.position_m - by_m).amax() < 0.15, "{}, not {by_m}", state.position_m);
    }

    /// A first fix from anywhere, and single outliers later, do no harm.
    #[test]
    fn a_wild_fix_does_no_harm(place_m in place(), wild_m in place(), later in 100_u64..3000, x in -8.0_f32..8.0) {
        prop_assume!((place_m - wild_m).norm() > 200.0);
        let mut bench = Bench::new();
        bench.stand(2000, Vector3::repeat(f32::NAN), 0.5);
        bench.tick(Vector3::zeros(), Some(fix(wild_m, Vector3::zeros(), 0.5)), 0);
        bench.stand(later, place_m, 0.5);
        bench.tick(Vector3::zeros(), Some(fix(wild_m, Vector3::zeros(), 0.5)), 0);
        bench.stand(2000, place_m, 0.5);
        prop_assert_eq!(bench.missing, None);
        let push = Vector3::new(x, 0.0, 0.0);
        let (mut velocity, mut moved) = (Vector3::zeros(), Vector3::zeros());
        let mut state = State::default();
        for ms in 0..2000 {
            let acceleration = if ms < 1000 { push } else { -push };
            velocity += acceleration * 1e-3;
            moved += velocity * 1e-3;
            let fix = (ms % 100 == 0).then(|| fix(place_m + moved, velocity, 0.5));
            state = bench.tick(acceleration, fix, 0);
        }
        prop_assert!((state.position_m - push).amax() < 0.25, "{}, not {push}", state.position_m);
    }

    /// With a tracker the local frame is the tracker's, wherever the receiver's is, even if the first fix comes late
    /// and in motion.
    #[test]
    fn the_trackers_frame_stays(place_m in place(), local_m in place(), speed in -3.0_f32..3.0) {
        const LATE_MS: u32 = 200;
        let mut bench = Bench::new();
        let mut local_m = local_m * 1e-3;
        for ms in 0..3000 {
            if ms % 10 == 0 {
                bench.pose(local_m);
            }
            bench.tick(Vector3::zeros(), None, 0);
        }
        let mut velocity = Vector3::zeros();
        let mut worst_m: f32 = 0.0;
        for ms in 0..6000 {
            // Accelerates for one second. Later the first fix comes, and then the tracker is lost.
            let acceleration = Vector3::new(if ms < 1000 { speed } else { 0.0 }, 0.0, 0.0);
            velocity += acceleration * 1e-3;
            local_m += velocity * 1e-3;
            if ms % 10 == 0 && ms < 2000 {
                bench.pose(local_m);
            }
            let was_m = local_m - velocity * (LATE_MS as f32 * 1e-3);
            let fix = (ms >= 1500 && ms % 100 == 0).then(|| fix(place_m + was_m, velocity, 0.05));
            let state = bench.tick(acceleration, fix, 1000 * LATE_MS);
            if ms > 1500 {
                worst_m = worst_m.max((state.position_m - local_m).amax());
            }
        }
        prop_assert!(worst_m < 0.15, "{worst_m} m");
    }

    /// An unusable fix does not set the origin: before the start, not finite, or too inaccurate for a valid position.
    #[test]
    fn only_a_usable_fix_sets_it(place_m in place(), other_m in place()) {
        let mut bench = Bench::new();
        bench.stand(500, other_m, 0.5);
        for poor in [
            fix(other_m, Vector3::zeros(), Settings::DEFAULT.position_sigma_max_m + 0.1),
            fix(Vector3::new(f32::NAN, 0.0, 0.0), Vector3::zeros(), 0.5),
            fix(other_m, Vector3::new(0.0, f32::INFINITY, 0.0), 0.5),
            fix(other_m, Vector3::zeros(), f32::NAN),
            fix(other_m, Vector3::zeros(), 0.0),
        ] {
            for _ in 0..1000 {
                let fix = bench.ms.is_multiple_of(100).then_some(poor);
                bench.tick(Vector3::zeros(), fix, 0);
            }
            prop_assert_eq!(bench.missing, Some(Refusal::PositionUnknown));
        }
        let state = bench.stand(2000, place_m, 0.5);
        prop_assert_eq!(bench.missing, None);
        prop_assert!(state.position_m.amax() < 2.0 * NOISE_M + 0.01, "{}", state.position_m);
    }
}
