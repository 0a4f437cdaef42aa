//! Compares random numbers with their distribution, within five standard errors and with fixed seeds.

use afbc_plant::noise::{Noise, NoiseStream};

const N: usize = 2_000_000;

fn normals(seed: u64, stream: NoiseStream) -> Vec<f64> {
    let mut noise = Noise::new(seed, stream);
    (0..N).map(|_| noise.normal()).collect()
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    values.sum::<f64>() / N as f64
}

/// Checks that `found` is a mean of N numbers with the variance `variance`.
fn assert_mean(found: f64, expected: f64, variance: f64, what: &str) {
    let bound = 5.0 * (variance / N as f64).sqrt();
    assert!((found - expected).abs() < bound, "{what}: {found} is not {expected} within {bound}");
}

#[test]
fn normal_numbers_have_a_normal_distributions_moments() {
    let x = normals(1, NoiseStream::Wind);
    // E x^2n = (2n - 1)!!, and the variance of x^n is E x^2n - (E x^n)^2.
    assert_mean(mean(x.iter().copied()), 0.0, 1.0, "mean");
    assert_mean(mean(x.iter().map(|x| x * x)), 1.0, 2.0, "variance");
    assert_mean(mean(x.iter().map(|x| x.powi(3))), 0.0, 15.0, "third moment");
    assert_mean(mean(x.iter().map(|x| x.powi(4))), 3.0, 96.0, "fourth moment");
    assert_mean(mean(x.iter().map(|x| x.powi(6))), 15.0, 10_395.0 - 225.0, "sixth moment");
    assert_mean(mean(x.windows(2).map(|x| x[0] * x[1])), 0.0, 1.0, "neighbours");
}

#[test]
fn normal_numbers_have_a_normal_distributions_tails() {
    let x = normals(2, NoiseStream::Wind);
    // The limits pass through the cores and edges of the layers. They end beyond 3.654, where the tail is drawn
    // separately.
    for limit in [-4.5, -4.0, -3.654_152_9, -3.0, -1.0, -0.215, 0.0, 0.1, 0.5, 2.0, 3.5, 3.654_152_9, 3.8, 4.2] {
        let below = mean(x.iter().map(|&x| if x < limit { 1.0 } else { 0.0 }));
        let p = 0.5 * libm::erfc(-limit / core::f64::consts::SQRT_2);
        assert_mean(below, p, p * (1.0 - p), "share below");
    }
}

#[test]
fn uniform_numbers_are_uniform() {
    let mut noise = Noise::new(3, NoiseStream::Scenario);
    let x: Vec<f64> = (0..N).map(|_| noise.uniform()).collect();
    assert!(x.iter().all(|x| (0.0..1.0).contains(x)));
    assert_mean(mean(x.iter().copied()), 0.5, 1.0 / 12.0, "mean");
    assert_mean(mean(x.iter().map(|x| x * x)), 1.0 / 3.0, 1.0 / 5.0 - 1.0 / 9.0, "second moment");
}

#[test]
fn streams_and_seeds_are_independent_and_reproducible() {
    let x = normals(4, NoiseStream::Wind);
    assert_eq!(x, normals(4, NoiseStream::Wind));
    for other in [normals(4, NoiseStream::Sensors), normals(4, NoiseStream::Dropouts), normals(5, NoiseStream::Wind)] {
        assert_mean(mean(x.iter().zip(&other).map(|(x, y)| x * y)), 0.0, 1.0, "correlation");
    }
}

#[test]
fn several_at_once_are_those_one_by_one() {
    let (mut at_once, mut one_by_one) = (Noise::new(7, NoiseStream::Imu), Noise::new(7, NoiseStream::Imu));
    // So many numbers also reach the tails and the edges of the layers.
    for _ in 0..100_000 {
        let five: [f64; 5] = at_once.normals();
        assert_eq!(five, [(); 5].map(|()| one_by_one.normal()));
    }
    assert_eq!(at_once, one_by_one);
}

/// Flights are reproduced by seed, also by later versions: these bits must never change.
#[test]
fn random_numbers_never_change() {
    let mut noise = Noise::new(2026, NoiseStream::Sensors);
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for _ in 0..100_000 {
        hash = (hash ^ noise.normal().to_bits()).wrapping_mul(0x0100_0000_01b3);
    }
    assert_eq!(hash, 0x6a68_46ee_5eb6_521d, "{hash:#x}");
}
