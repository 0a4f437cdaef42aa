//! Brings samples into the order of time.

/// Samples that are further apart than this do not belong to the same flight \[us\].
const APART_US: u64 = 600_000_000;

/// Keeps as many samples as possible whose times rise strictly, so that one absurd time costs one sample. Returns these
/// and the number of dropped samples.
pub(crate) fn rising<T>(samples: Vec<T>, at_us: impl Fn(&T) -> u64) -> (Vec<T>, usize) {
    let all = samples.len();
    let times: Vec<u64> = samples.iter().map(&at_us).collect();
    let keep = longest_rising(&times);
    let samples: Vec<T> = samples.into_iter().zip(keep).filter_map(|(sample, keep)| keep.then_some(sample)).collect();
    // A jump of the times by more than [`APART_US`] comes from a clock that was set or is wrong: only the longest run
    // is kept.
    let mut runs: Vec<Vec<T>> = Vec::new();
    let mut last_us = None;
    for sample in samples {
        let now_us = at_us(&sample);
        match runs.last_mut() {
            // The times rise, so no difference is negative.
            Some(run) if last_us.is_some_and(|last_us| now_us - last_us < APART_US) => run.push(sample),
            _ => runs.push(vec![sample]),
        }
        last_us = Some(now_us);
    }
    let longest = runs.into_iter().max_by_key(Vec::len).unwrap_or_default();
    let skipped = all - longest.len();
    (longest, skipped)
}

/// Marks a longest strictly rising subsequence.
fn longest_rising(times: &[u64]) -> Vec<bool> {
    // `ends` has for each length the sample at which a subsequence of that length ends soonest; `before` has each
    // sample's predecessor.
    let mut ends: Vec<(u64, usize)> = Vec::new();
    let mut before: Vec<Option<usize>> = Vec::with_capacity(times.len());
    for (index, &time) in times.iter().enumerate() {
        let length = ends.partition_point(|(end, _)| *end < time);
        before.push(length.checked_sub(1).and_then(|shorter| ends.get(shorter)).map(|(_, index)| *index));
        match ends.get_mut(length) {
            Some(end) => *end = (time, index),
            None => ends.push((time, index)),
        }
    }
    let mut keep = vec![false; times.len()];
    let mut at = ends.last().map(|(_, index)| *index);
    while let Some(index) = at {
        if let Some(keep) = keep.get_mut(index) {
            *keep = true;
        }
        at = before.get(index).copied().flatten();
    }
    keep
}

#[cfg(test)]
mod tests {
    use super::rising;

    fn kept(times: &[u64]) -> Vec<u64> {
        rising(times.to_vec(), |time| *time).0
    }

    #[test]
    fn one_wrong_time_costs_one_sample() {
        let good: Vec<u64> = (0..1000).map(|i| 4000 * i).collect();
        assert_eq!(kept(&good), good);
        for wrong in [0, 1, 2_000_001, u64::MAX, u64::MAX - 1] {
            for at in [0_usize, 1, 500, 998, 999] {
                let mut times = good.clone();
                if let Some(time) = times.get_mut(at) {
                    *time = wrong;
                }
                let kept = kept(&times);
                assert!(kept.len() >= 999, "{wrong} at {at}: {}", kept.len());
                assert!(kept.iter().zip(kept.iter().skip(1)).all(|(a, b)| a < b));
            }
        }
    }

    #[test]
    fn a_clock_set_anew_keeps_the_longer_part() {
        let times: Vec<u64> = (0..300).chain(100_000..100_500).chain(0..200).collect();
        assert_eq!(kept(&times).len(), 800);
        let apart: Vec<u64> = (0..300).chain((0..500).map(|i| 7_000_000_000 + i)).collect();
        assert_eq!(kept(&apart).len(), 500);
        assert!(kept(&[]).is_empty());
        assert_eq!(kept(&[5, 5, 5]), [5]);
    }
}
