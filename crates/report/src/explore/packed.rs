//! Compression of numbers and text.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

/// Compression level of zlib, 0 to 10; levels above 6 gain little.
const LEVEL: u8 = 6;

/// Compresses `bytes` with zlib and encodes them in Base64. Browsers unpack this without a library
/// (`DecompressionStream("deflate")`).
pub(super) fn text(bytes: &[u8]) -> String {
    STANDARD.encode(miniz_oxide::deflate::compress_to_vec_zlib(bytes, LEVEL))
}

/// Rounds the values to a grid of `steps` from `low` to `high`, and returns the difference of each to the one before:
/// integers that compress well. NaN counts as `low`; infinities give huge integers.
pub(super) fn deltas(values: impl Iterator<Item = f64>, low: f64, high: f64, steps: f64) -> Vec<i64> {
    let span = high - low;
    let grid = |value: f64| if span > 0.0 { ((value - low) / span * steps).round() as i64 } else { 0 };
    let difference = |before: &mut i64, value: f64| {
        let (now, last) = (grid(value), *before);
        *before = now;
        Some(now.saturating_sub(last))
    };
    values.scan(0, difference).collect()
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test that panics has failed")]
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn unpacked_it_is_the_same(bytes in prop::collection::vec(any::<u8>(), 0..2000)) {
            let zlib = STANDARD.decode(text(&bytes)).unwrap();
            prop_assert_eq!(miniz_oxide::inflate::decompress_to_vec_zlib(&zlib).unwrap(), bytes);
        }

        #[test]
        fn sums_are_the_values_within_half_a_step(
            values in prop::collection::vec(-3.0..9.0f64, 0..50), low in -3.0..0.0f64, span in 0.1..9.0f64,
        ) {
            let mut sum = 0;
            for (delta, value) in deltas(values.iter().copied(), low, low + span, 1e4).iter().zip(&values) {
                sum += delta;
                prop_assert!((low + sum as f64 / 1e4 * span - value).abs() <= 0.500_001e-4 * span);
            }
        }
    }

    #[test]
    fn values_that_are_no_numbers_stay_whole_numbers() {
        let hostile = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, 0.0];
        assert_eq!(deltas(hostile.into_iter(), 0.0, 1.0, 10.0).len(), hostile.len());
        assert_eq!(deltas(hostile.into_iter(), 1.0, 1.0, 10.0), [0; 5]);
    }
}
