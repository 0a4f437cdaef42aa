//! Wilcoxon's signed rank test of paired differences, its effect size, and Holm's correction.

use libm::{erfc, sqrt};

/// Largest number of differences for which all assignments of signs are counted. With more, rank sums are nearly
/// normal.
const EXACT: usize = 100;

/// Wilcoxon's signed rank test, which asks whether paired differences are symmetric about zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SignedRank {
    /// Two-sided probability of a rank sum at least this extreme if the signs were random.
    pub p: f64,
    /// Matched-pairs rank-biserial correlation (Kerby 2014, *The simple difference formula*): the share of ranks with
    /// positive differences minus the share with negative ones. 1 if every difference is positive.
    pub effect: f64,
}

impl SignedRank {
    /// Tests `differences`, which may be infinite. NaN and zero, which stand for level pairs, do not count. Differences
    /// of equal size share the mean of their ranks. Up to a hundred differences, the probability counts every
    /// assignment of signs; beyond, it is that of the normal distribution with the variance of ties (Pratt, Gibbons
    /// 1981, *Concepts of nonparametric theory*, chapter 3).
    pub fn of(differences: &[f64]) -> Self {
        let mut sizes: Vec<(f64, bool)> =
            differences.iter().filter(|d| d.abs() > 0.0).map(|d| (d.abs(), *d > 0.0)).collect();
        sizes.sort_by(|a, b| a.0.total_cmp(&b.0));
        // Ranks are doubled, which makes them whole numbers.
        let (mut ranks, mut ties) = (Vec::with_capacity(sizes.len()), 0.0);
        for level in sizes.chunk_by(|a, b| a.0 == b.0) {
            let (before, count) = (ranks.len(), level.len());
            ranks.extend(core::iter::repeat_n(2 * before + count + 1, count));
            let count = count as f64;
            ties += count * count * count - count;
        }
        let total: usize = ranks.iter().sum();
        let positive: usize = ranks.iter().zip(&sizes).filter(|(_, (_, above))| *above).map(|(rank, _)| rank).sum();
        if total == 0 {
            return SignedRank { p: 1.0, effect: 0.0 };
        }
        let fewer = positive.min(total - positive);
        let p = if ranks.len() <= EXACT { 2.0 * at_most(&ranks, fewer) } else { normal(ranks.len(), fewer, ties) };
        SignedRank { p: p.min(1.0), effect: (2.0 * positive as f64 - total as f64) / total as f64 }
    }
}

/// Returns the probability that the sum of the positive `ranks` is at most `sum`, if their signs are random.
fn at_most(ranks: &[usize], sum: usize) -> f64 {
    let mut chance = vec![0.0; sum + 1];
    if let Some(none) = chance.first_mut() {
        *none = 1.0;
    }
    for rank in ranks {
        let without = chance.clone();
        let with = core::iter::repeat_n(0.0, *rank).chain(without.iter().copied());
        // Each difference is positive with probability 1/2, independently of the others.
        chance.iter_mut().zip(without.iter().zip(with)).for_each(|(to, (without, with))| *to = 0.5 * (without + with));
    }
    chance.iter().sum()
}

/// Returns the two-sided probability by the normal distribution. `sum` adds doubled ranks.
fn normal(count: usize, sum: usize, ties: f64) -> f64 {
    let n = count as f64;
    let variance = n * (n + 1.0) * (2.0 * n + 1.0) / 24.0 - ties / 48.0;
    let from_mean = n * (n + 1.0) / 4.0 - 0.5 * sum as f64;
    erfc(from_mean / sqrt(2.0 * variance))
}

/// Returns the probabilities adjusted for their number by Holm's step-down procedure (Holm 1979, *A simple sequentially
/// rejective multiple test procedure*). All that are then at most 0.05 are significant at the level 0.05.
pub fn holm(probabilities: &[f64]) -> Vec<f64> {
    let mut sorted: Vec<(usize, f64)> = probabilities.iter().copied().enumerate().collect();
    sorted.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut largest: f64 = 0.0;
    for (before, (_, p)) in sorted.iter_mut().enumerate() {
        largest = largest.max((probabilities.len() - before) as f64 * *p).min(1.0);
        *p = largest;
    }
    sorted.sort_by_key(|(place, _)| *place);
    sorted.into_iter().map(|(_, p)| p).collect()
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "tests")]
    use super::*;
    use afbc_plant::noise::{Noise, NoiseStream};

    fn close(a: f64, b: f64, within: f64) {
        assert!((a - b).abs() <= within * b.abs(), "{a} != {b}");
    }

    fn drawn(seed: u64, count: usize, shift: f64) -> Vec<f64> {
        let mut noise = Noise::new(seed, NoiseStream::Scenario);
        (0..count).map(|_| noise.normal() + shift).collect()
    }

    /// Computes p and the effect by definition: rank sums under all 2^n assignments of signs, with mean ranks found by
    /// counting.
    fn enumerated(differences: &[f64]) -> [f64; 2] {
        let kept: Vec<f64> = differences.iter().copied().filter(|d| *d != 0.0).collect();
        let rank = |of: &f64| {
            let smaller = kept.iter().filter(|d| d.abs() < of.abs()).count();
            let level = kept.iter().filter(|d| d.abs() == of.abs()).count();
            smaller as f64 + (level as f64 + 1.0) / 2.0
        };
        let ranks: Vec<f64> = kept.iter().map(rank).collect();
        let signed = |positive: &dyn Fn(usize) -> bool| {
            ranks.iter().enumerate().map(|(i, rank)| if positive(i) { *rank } else { -*rank }).sum::<f64>()
        };
        let seen = signed(&|i| kept.get(i).is_some_and(|d| *d > 0.0));
        let ways = 1_u32 << kept.len();
        let as_far = (0..ways).filter(|signs| signed(&|i| signs >> i & 1 == 1).abs() >= seen.abs()).count();
        [as_far as f64 / f64::from(ways), seen / ranks.iter().sum::<f64>()]
    }

    #[test]
    fn it_is_the_share_of_all_assignments_of_signs() {
        let lost = f64::INFINITY;
        for seed in 0..40 {
            let mut differences = drawn(seed, 1 + seed as usize % 14, 0.5);
            if seed % 3 == 0 {
                // Adds ties, zeros and vehicles lost by one of the two contenders.
                differences.iter_mut().for_each(|d| *d = (2.0 * *d).round());
                differences.extend([lost, -lost]);
            }
            let SignedRank { p, effect } = SignedRank::of(&differences);
            if differences.iter().all(|d| *d == 0.0) {
                assert_eq!((p, effect), (1.0, 0.0));
                continue;
            }
            let [share, correlation] = enumerated(&differences);
            close(p, share, 1e-12);
            assert!((effect - correlation).abs() < 1e-12, "{effect} != {correlation}");
        }
    }

    /// Compares with scipy 1.17.1. The first is the example of Wilcoxon 1945 in scipy's documentation, `wilcoxon([6, 8,
    /// 14, 16, 23, 24, 28, 29, 41, -48, 49, 56, 60, -67, 75]).pvalue`. Then `wilcoxon(range(1, 11)).pvalue` and
    /// `wilcoxon([-1, 2, 3, 4, 5, 6, 7, 8, 9, 10]).pvalue`. With `x = [sin(i * i) + 0.2 for i in range(1, 151)]`,
    /// `wilcoxon(x, method="approx").pvalue` and, with ties and zeros, `wilcoxon([round(2 * v) for v in x],
    /// method="approx").pvalue`.
    #[test]
    fn it_agrees_with_scipy() {
        let maize = [6., 8., 14., 16., 23., 24., 28., 29., 41., -48., 49., 56., 60., -67., 75.];
        close(SignedRank::of(&maize).p, 0.041_259_765_625, 1e-15);
        assert_eq!(SignedRank::of(&maize).effect, 0.6);
        let ten: Vec<f64> = (1..=10).map(f64::from).collect();
        close(SignedRank::of(&ten).p, 0.001_953_125, 1e-15);
        let one_behind = [-1., 2., 3., 4., 5., 6., 7., 8., 9., 10.];
        close(SignedRank::of(&one_behind).p, 0.003_906_25, 1e-15);
        let many: Vec<f64> = (1..=150).map(|i| libm::sin(f64::from(i * i)) + 0.2).collect();
        close(SignedRank::of(&many).p, 0.000_290_130_362_880_264_94, 1e-9);
        let ties: Vec<f64> = many.iter().map(|value| libm::rint(2.0 * value)).collect();
        close(SignedRank::of(&ties).p, 0.000_432_203_092_284_870_86, 1e-9);
    }

    /// At the largest exact count, the normal distribution agrees with counting. The result does not depend on the
    /// order, and reversing all signs only reverses the sign of the effect.
    #[test]
    fn many_differences_are_judged_as_few_are() {
        let differences = drawn(7, EXACT, 0.2);
        let exact = SignedRank::of(&differences);
        let sum = (0.5 * (1.0 - exact.effect.abs()) * (EXACT * (EXACT + 1)) as f64).round() as usize;
        assert!((normal(EXACT, sum, 0.0) - exact.p).abs() < 1e-3, "{} or {}", normal(EXACT, sum, 0.0), exact.p);
        for count in [EXACT / 3, 3 * EXACT] {
            let differences = drawn(8, count, 0.2);
            let forth = SignedRank::of(&differences);
            let back: Vec<f64> = differences.iter().rev().map(|d| -d).collect();
            let back = SignedRank::of(&back);
            assert_eq!((forth.p, forth.effect), (back.p, -back.effect));
        }
    }

    /// With random differences, the share of significant results does not exceed the level.
    #[test]
    fn chance_is_seldom_significant() {
        for count in [8, 12, 150] {
            let significant = (0..2000).filter(|seed| SignedRank::of(&drawn(100 + seed, count, 0.0)).p <= 0.05).count();
            // The bound is 5 % of 2000 tests, plus three standard deviations.
            assert!(significant <= 130, "{count}: {significant}");
            let found = (0..200).filter(|seed| SignedRank::of(&drawn(100 + seed, count, 1.5)).p <= 0.05).count();
            assert!(found >= 180, "{count}: {found}");
        }
    }

    /// Holm's own example, adjusted by `statsmodels.stats.multitest.multipletests(p, method="holm")[1]`.
    #[test]
    fn corrections_are_those_of_holm() {
        let adjusted = holm(&[0.01, 0.04, 0.03, 0.005]);
        for (adjusted, expected) in adjusted.iter().zip([0.03, 0.06, 0.06, 0.02]) {
            close(*adjusted, expected, 1e-12);
        }
        assert_eq!(holm(&[]), Vec::<f64>::new());
        assert_eq!(holm(&[0.7, 0.9]), [1.0, 1.0]);
        // The definition: the largest product, over all q not larger than p, of q and the number of probabilities not
        // smaller than q.
        let mut noise = Noise::new(5, NoiseStream::Scenario);
        let all: Vec<f64> = (0..20).map(|_| noise.uniform() * noise.uniform()).collect();
        for (p, adjusted) in all.iter().zip(holm(&all)) {
            let of = |q: &f64| q * all.iter().filter(|other| *other >= q).count() as f64;
            let expected = all.iter().filter(|q| *q <= p).map(of).fold(0.0, f64::max);
            close(adjusted, expected.min(1.0), 1e-12);
        }
        let untouched = holm(&[*all.first().unwrap()]);
        assert_eq!(untouched.first(), all.first());
    }
}
