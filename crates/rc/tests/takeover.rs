//! A stick ends an autonomous mode when it is moved far enough from its position at the beginning of the mode.
#![allow(clippy::indexing_slicing, missing_docs, reason = "tests")]

use afbc_guidance::{FlightMode, Order};
use afbc_rc::{Channels, PilotInputs, RadioLink, RadioPilot, RadioSettings};
use proptest::prelude::*;

/// Returns the deflection of a stick: 500 us to either side of 1500 us, with a dead band of 10 us.
fn share(us: u16) -> f64 {
    let off_us = f64::from(us) - 1500.0;
    off_us.signum() * ((off_us.abs() - 10.0) / 490.0).clamp(0.0, 1.0)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_stick_that_is_moved_takes_over(
        began in prop::array::uniform4(1_000..=2_000_u16),
        stick in 0..4_usize,
        to in 1_000..=2_000_u16,
        tenths in 1..=8_u8,
        mode in prop::sample::select(vec![FlightMode::Return, FlightMode::Mission, FlightMode::Position]),
        armed in any::<bool>(),
        source in prop::sample::select(vec![0_u32, 1, 4, 5]),
    ) {
        let mut settings = RadioSettings::DEFAULT;
        settings.modes.override_share = 0.1 * f32::from(tenths);
        settings.receiver.source = source;
        let mut us = [1_000; 16];
        us[..4].copy_from_slice(&began);
        let (mut link, mut pilot, mut now_us) = (RadioLink::default(), RadioPilot::default(), 0);
        let mut frames = |us: [u16; 16], count: u32| {
            let mut orders = Vec::new();
            for _ in 0..count {
                now_us += 4_000;
                link.take(&Channels::of(us), now_us);
                orders.extend(pilot.step(&settings, &mut link, &PilotInputs { now_us, armed, mode }).order);
            }
            orders
        };
        prop_assert_eq!(frames(us, 200), []);
        us[stick] = to;
        let off = (share(to) - share(began[stick])).abs();
        prop_assume!((off - f64::from(settings.modes.override_share)).abs() > 1e-6);
        let is_taken = armed && mode != FlightMode::Position && matches!(source, 0 | 5)
            && off > f64::from(settings.modes.override_share);
        let wanted = if is_taken { vec![Order::Select(FlightMode::Position)] } else { vec![] };
        prop_assert_eq!(frames(us, 50), wanted);
    }
}
