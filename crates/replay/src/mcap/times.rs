//! Finds impossible times in a log: a flipped bit in a time would make the file span centuries.

/// Number of following records that decide whether a record's time is too late.
const NEIGHBOURS: usize = 8;
/// A record may be logged this much later than a record with a later time \[us\]. A time may be arbitrarily old: a
/// topic's last value is logged when a log begins.
const LATE_US: u64 = 10_000_000;
/// Longest gap allowed before one of the last records, which have too few followers \[us\]. A gap as long as the log so
/// far is allowed, too.
const GAP_US: u64 = 60_000_000;

/// Marks the times, in the order of the file, that are far ahead of most of the following times. One of the last times
/// is also marked if it is far ahead of all times before it.
pub(super) fn ahead(times_us: &[u64]) -> Vec<bool> {
    let mut ends: Option<[u64; 2]> = None;
    let mark = |(index, &time_us): (usize, &u64)| {
        let behind = times_us.iter().skip(index + 1).take(NEIGHBOURS);
        let (mut earlier, mut all) = (0, 0);
        for other_us in behind {
            all += 1;
            earlier += usize::from(other_us.saturating_add(LATE_US) < time_us);
        }
        let is_last = |[first_us, last_us]: [u64; 2]| {
            all < NEIGHBOURS && time_us > last_us.saturating_add(GAP_US.max(last_us - first_us))
        };
        // A single following record decides nothing, since its own time may be the wrong one.
        let is_ahead = all > 1 && 2 * earlier > all || ends.is_some_and(is_last);
        if !is_ahead {
            let [first_us, last_us] = ends.unwrap_or([time_us; 2]);
            ends = Some([first_us.min(time_us), last_us.max(time_us)]);
        }
        is_ahead
    };
    times_us.iter().enumerate().map(mark).collect()
}

#[cfg(test)]
mod tests {
    use super::ahead;

    fn marked(times: &[u64]) -> Vec<usize> {
        ahead(times).into_iter().enumerate().filter_map(|(index, mark)| mark.then_some(index)).collect()
    }

    /// Flips every bit of every time, one at a time: the log hardly becomes longer.
    #[test]
    fn no_flipped_bit_makes_a_log_long() {
        let good: Vec<u64> = (0..200).map(|index| 300_000_000 + 10_000 * index).collect();
        assert!(marked(&good).is_empty());
        for (at, bit) in (0..good.len()).flat_map(|at| (0..64).map(move |bit| (at, bit))) {
            let mut times = good.clone();
            if let Some(time) = times.get_mut(at) {
                *time ^= 1 << bit;
            }
            let kept = times.iter().zip(ahead(&times)).filter(|(_, ahead)| !ahead).map(|(time, _)| *time);
            let last = kept.max().unwrap_or_default();
            assert!(last < 300_000_000 + 2_000_000 + 61_000_000, "bit {bit} of {at}: {last}");
            let others = marked(&times).into_iter().filter(|marked| *marked != at).count();
            assert_eq!(others, 0, "bit {bit} of {at}");
        }
    }

    /// Logs may have gaps of any length, old values of slow topics at the beginning, slow topics alone, or only a few
    /// messages.
    #[test]
    fn what_real_logs_have_is_kept() {
        let gap: Vec<u64> = (0..100).map(|index| 10_000 * index + if index < 50 { 0 } else { 3_600_000_000 }).collect();
        let slow: Vec<u64> = (0..20).map(|index| 600_000_000 * index).collect();
        let old: Vec<u64> = [900_000_000, 5_000_000, 7, 900_000_100, 800_000_000]
            .into_iter()
            .chain((0..50).map(|index| 900_001_000 + 4_000 * index))
            .collect();
        for times in [gap, slow, old, vec![5], vec![5, 6], vec![], vec![0; 20]] {
            assert!(marked(&times).is_empty(), "{times:?}");
        }
    }
}
