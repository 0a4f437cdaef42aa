//! The signing clock is stored right after a flight and every two minutes on the ground, never in the air.

use afbc_comms::services::signing::{SetupOutcome, Signing};
use afbc_mavlink::{SetupSigning, SigningKey};
use proptest::prelude::*;

/// 26 November 2026 \[s\].
const TODAY_S: u32 = 375_700_000;

proptest! {
    /// Seconds pass on the ground and in the air. The stored clock is at most one second late.
    #[test]
    fn the_clock_is_kept_after_flights_and_every_two_minutes(
        phases in prop::collection::vec((any::<bool>(), 1..400_u32), 1..12),
        seconds in 0..100_u32,
    ) {
        let mut signing = Signing::default();
        let from_s = TODAY_S + seconds;
        let setup = SetupSigning { key: Some(SigningKey([42; 32])), time_10us: 100_000 * u64::from(from_s) };
        prop_assert_eq!(signing.set(0, &setup, false), SetupOutcome::Done("signing: on, key set"));
        // The key takes eight records, its check value and the clock one each.
        prop_assert_eq!((0..20).filter_map(|_| signing.record(0, false)).count(), 10);
        let (mut now_s, mut kept_s, mut was_armed) = (0, 0, false);
        for (armed, length_s) in phases {
            for _ in 0..length_s {
                now_s += 1;
                let record = signing.record(1_000_000 * u64::from(now_s), armed);
                let wanted = !armed && (was_armed || now_s - kept_s >= 120);
                prop_assert_eq!(record.is_some(), wanted, "{} s, kept at {} s", now_s, kept_s);
                if let Some(record) = record {
                    kept_s = now_s;
                    prop_assert_eq!((record.name.as_str(), record.bits), ("_SIGN_TIME", Some(from_s + now_s)));
                }
                was_armed = armed;
            }
        }
    }
}
