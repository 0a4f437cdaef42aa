//! Properties of the filters on the inputs.
#![allow(clippy::unwrap_used, missing_docs)] // filters that cannot be built must stop the test

use afbc_control::{Settings, Smoother, Smoothing};
use afbc_types::Inputs;
use proptest::prelude::*;

fn smoothing(bandwidth_rad_s: f32, lead_s: f32) -> Smoothing {
    Smoothing {
        smooth_tilt_rad_s: bandwidth_rad_s,
        smooth_yaw_rad_s: bandwidth_rad_s,
        smooth_lift_rad_s: bandwidth_rad_s,
        lead_s,
    }
}

fn inputs() -> impl Strategy<Value = Inputs> {
    let any = || -1e3_f32..1e3;
    (any(), any(), any(), any()).prop_map(|(roll_n, pitch_n, yaw_n, thrust_n)| Inputs {
        roll_n,
        pitch_n,
        yaw_n,
        thrust_n,
    })
}

proptest! {
    /// Step response: with q = exp(-w dt) and k = 1 - q, a share of q^n (1 + n k (1 - T w)) is left after n steps. For
    /// U3, which has no lead, q^n (1 + n k) is left.
    #[test]
    fn the_filters_have_two_poles_and_a_lead(
        w in prop_oneof![1.0_f32..1e4, Just(0.0)], lead_s in prop_oneof![Just(0.0_f32), 0.0_f32..0.1],
        dt_s in Settings::DT.range.min as f32..=Settings::DT.range.max as f32,
        first in inputs(), held in inputs(), steps in 1..200,
    ) {
        let smoother = Smoother::new(&smoothing(w, lead_s), dt_s).unwrap();
        let mut last = None;
        prop_assert_eq!(smoother.advance(&mut last, &first), first);
        let mut filtered = first;
        for _ in 0..steps {
            filtered = smoother.advance(&mut last, &held);
        }
        let (w, n) = (f64::from(w), f64::from(steps));
        let q = (-w * f64::from(dt_s)).exp();
        let left = |lead_s: f32| match w > 0.0 {
            true => q.powf(n) * (1.0 + n * (1.0 - q) * (1.0 - f64::from(lead_s) * w)),
            false => 0.0,
        };
        for (from, to, now, lead_s) in [
            (first.roll_n, held.roll_n, filtered.roll_n, lead_s),
            (first.pitch_n, held.pitch_n, filtered.pitch_n, lead_s),
            (first.yaw_n, held.yaw_n, filtered.yaw_n, 0.0),
            (first.thrust_n, held.thrust_n, filtered.thrust_n, lead_s),
        ] {
            let step = f64::from(from) - f64::from(to);
            let exact = f64::from(to) + step * left(lead_s);
            let allowed = 1e-3 * (1.0 + f64::from(lead_s) * w) * (1.0 + step.abs());
            prop_assert!((f64::from(now) - exact).abs() < allowed, "{now} instead of {exact}");
        }
    }

    /// The filters of a vehicle that is k times slower act the same on a clock that is k times slower.
    #[test]
    fn slower_filters_are_the_same_on_a_slower_clock(
        tilt in 1.0_f32..500.0, yaw in 1.0_f32..500.0, lift in 1.0_f32..500.0, lead_s in 0.0_f32..0.1,
        slowness in 1.0_f32..4.0, inputs in prop::collection::vec(inputs(), 1..50),
    ) {
        let smoothing =
            Smoothing { smooth_tilt_rad_s: tilt, smooth_yaw_rad_s: yaw, smooth_lift_rad_s: lift, lead_s };
        let quick = Smoother::new(&smoothing, 0.001).unwrap();
        let slow = Smoother::new(&smoothing.slowed(slowness), 0.001 * slowness).unwrap();
        let (mut before, mut after) = (None, None);
        for inputs in inputs {
            let (a, b) = (quick.advance(&mut before, &inputs), slow.advance(&mut after, &inputs));
            let allowed = 1e-2 * (1.0 + lead_s * tilt.max(lift));
            for (a, b) in [(a.roll_n, b.roll_n), (a.pitch_n, b.pitch_n), (a.yaw_n, b.yaw_n), (a.thrust_n, b.thrust_n)] {
                prop_assert!((a - b).abs() <= allowed, "{a} became {b}");
            }
        }
        // Without filters, slowing changes nothing.
        prop_assert_eq!(Smoothing::DEFAULT.slowed(slowness), Smoothing::DEFAULT);
    }

    /// White noise of the inputs is reduced from step to step as by the impulse response k^2 (n + 1) q^n.
    #[test]
    fn noise_becomes_as_much_less_as_the_filter_says(w in prop_oneof![Just(300.0_f32), 100.0_f32..500.0], seed: u64) {
        let smoother = Smoother::new(&smoothing(w, 0.0), 0.001).unwrap();
        let (mut last, mut before) = (None, [Inputs::default(); 2]);
        let (mut raw, mut filtered) = (0.0_f64, 0.0_f64);
        let mut random = seed;
        for step in 0..40_000 {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let inputs = Inputs { pitch_n: (random >> 40) as f32 / (1 << 24) as f32 - 0.5, ..Inputs::default() };
            let now = [inputs, smoother.advance(&mut last, &inputs)];
            // By then, the first input's effect has decayed.
            let counts = if step > 1000 { 1.0 } else { 0.0 };
            raw += counts * f64::from(now[0].pitch_n - before[0].pitch_n).powi(2);
            filtered += counts * f64::from(now[1].pitch_n - before[1].pitch_n).powi(2);
            before = now;
        }
        let k = 1.0 - (-f64::from(w) * 1e-3).exp();
        let response = |n: i32| k * k * f64::from(n + 1) * (1.0 - k).powi(n);
        let squares: f64 = (0..400).map(|n| (response(n) - if n > 0 { response(n - 1) } else { 0.0 }).powi(2)).sum();
        let (ratio, wanted) = ((filtered / raw).sqrt(), (0.5 * squares).sqrt());
        prop_assert!((0.95..1.05).contains(&(ratio / wanted)), "{ratio} instead of {wanted}");
        prop_assert!((w - 300.0).abs() > 1.0 || (0.055..0.06).contains(&wanted), "{wanted}");
    }

    /// Twice the inputs give twice the filtered inputs, at any size, and no input affects another.
    #[test]
    fn the_filters_are_linear_and_apart(
        w in 1.0_f32..500.0, lead_s in 0.0_f32..0.02, inputs in prop::collection::vec(inputs(), 2..20),
    ) {
        let smoother = Smoother::new(&smoothing(w, lead_s), 0.001).unwrap();
        let size = 2.0_f32.powi(90);
        let times = |of: &Inputs, size: f32| Inputs {
            roll_n: size * of.roll_n,
            pitch_n: size * of.pitch_n,
            yaw_n: size * of.yaw_n,
            thrust_n: size * of.thrust_n,
        };
        let (mut plain, mut large, mut alone) = (None, None, None);
        for inputs in &inputs {
            let wanted = smoother.advance(&mut plain, inputs);
            prop_assert_eq!(smoother.advance(&mut large, &times(inputs, size)), times(&wanted, size));
            let only = smoother.advance(&mut alone, &Inputs { thrust_n: 0.0, roll_n: 0.0, ..*inputs });
            prop_assert_eq!(only, Inputs { thrust_n: 0.0, roll_n: 0.0, ..wanted });
        }
    }

    /// An input that is not finite passes, and leaves no trace in the memory.
    #[test]
    fn nothing_stays_of_an_input_that_is_not_finite(
        w in 1.0_f32..1e4, before in inputs(), after in inputs(), which in 0..3,
    ) {
        let smoother = Smoother::new(&smoothing(w, 0.01), 0.001).unwrap();
        let mut last = None;
        let _ = smoother.advance(&mut last, &before);
        let wrong = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY].get(which as usize).copied().unwrap();
        let _ = smoother.advance(&mut last, &Inputs { pitch_n: wrong, ..before });
        prop_assert_eq!(smoother.advance(&mut last, &after), after);
    }
}

/// Without bandwidths, the inputs pass unchanged. A bandwidth out of range is refused by its name.
#[test]
fn no_filter_is_no_filter() {
    let none = Smoother::new(&Smoothing::DEFAULT, 0.001).unwrap();
    let (a, b) = (Inputs { roll_n: 0.1, ..Inputs::default() }, Inputs { roll_n: 0.7, ..Inputs::default() });
    let mut last = None;
    assert_eq!(none.advance(&mut last, &a), a);
    assert_eq!(none.advance(&mut last, &b), b);
    for (smoothing, name) in [
        (Smoothing { smooth_tilt_rad_s: -1.0, ..Smoothing::DEFAULT }, "smooth_tilt_rad_s"),
        (Smoothing { smooth_yaw_rad_s: f32::NAN, ..Smoothing::DEFAULT }, "smooth_yaw_rad_s"),
        (Smoothing { smooth_lift_rad_s: 2e4, ..Smoothing::DEFAULT }, "smooth_lift_rad_s"),
        (Smoothing { lead_s: 0.6, ..Smoothing::DEFAULT }, "lead_s"),
    ] {
        assert_eq!(Smoother::new(&smoothing, 0.001).unwrap_err().range.name, name);
    }
}
