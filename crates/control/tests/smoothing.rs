//! Properties of the low-pass filters on the inputs.
#![allow(clippy::unwrap_used, missing_docs)] // filters that cannot be built must stop the test

use afbc_control::{Settings, Smoother, Smoothing};
use afbc_types::{Declared, Inputs};
use proptest::prelude::*;

fn smoothing(bandwidth_rad_s: f32) -> Smoothing {
    let mut smoothing = Smoothing::DEFAULT;
    smoothing
        .visit_mut(&mut |_, value| {
            if let afbc_types::Value::Single([bandwidth]) = value {
                *bandwidth = bandwidth_rad_s;
            }
            Ok::<(), ()>(())
        })
        .unwrap();
    smoothing
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
    /// The solution of dU/dt = w (U_law - U) with U_law held over each step, in `f64`.
    #[test]
    fn the_filters_are_first_order_lags(
        w in prop_oneof![1.0_f32..1e4, Just(0.0)],
        dt_s in Settings::DT.range.min as f32..=Settings::DT.range.max as f32,
        first in inputs(), held in inputs(), steps in 1..200,
    ) {
        let smoother = Smoother::new(&smoothing(w), dt_s).unwrap();
        let mut last = None;
        prop_assert_eq!(smoother.advance(&mut last, &first), first);
        let mut filtered = first;
        for _ in 0..steps {
            filtered = smoother.advance(&mut last, &held);
        }
        let left = if w > 0.0 { (-f64::from(w) * f64::from(dt_s) * f64::from(steps)).exp() } else { 0.0 };
        for (from, to, now) in [
            (first.roll_n, held.roll_n, filtered.roll_n),
            (first.pitch_n, held.pitch_n, filtered.pitch_n),
            (first.yaw_n, held.yaw_n, filtered.yaw_n),
            (first.thrust_n, held.thrust_n, filtered.thrust_n),
        ] {
            let exact = f64::from(to) + (f64::from(from) - f64::from(to)) * left;
            prop_assert!((f64::from(now) - exact).abs() < 0.02, "{now} instead of {exact}");
        }
    }

    /// An input that is not finite passes, and leaves nothing behind.
    #[test]
    fn nothing_stays_of_an_input_that_is_not_finite(
        w in 1.0_f32..1e4, before in inputs(), after in inputs(), which in 0..3,
    ) {
        let smoother = Smoother::new(&smoothing(w), 0.001).unwrap();
        let mut last = None;
        let _ = smoother.advance(&mut last, &before);
        let wrong = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY].get(which as usize).copied().unwrap();
        let _ = smoother.advance(&mut last, &Inputs { pitch_n: wrong, ..before });
        prop_assert_eq!(smoother.advance(&mut last, &after), after);
    }
}

/// Without bandwidths the inputs pass to the bit, and a bandwidth out of range is refused by its name.
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
    ] {
        assert_eq!(Smoother::new(&smoothing, 0.001).unwrap_err().range.name, name);
    }
}
