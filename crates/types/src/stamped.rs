//! A value with its time.

/// A value with its time on the vehicle's clock.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Stamped<T> {
    /// The value.
    pub value: T,
    /// Time since power-up \[us\].
    pub at_us: u64,
}

impl<T> Stamped<T> {
    /// Returns the age at `now_us`, at most `u32::MAX` (71 minutes). A stamp in the future is invalid, and also counts
    /// as `u32::MAX` old.
    pub fn age_us(&self, now_us: u64) -> u32 {
        // For a stamp in the future, the difference wraps to nearly 2^64, which does not fit `u32`.
        u32::try_from(now_us.wrapping_sub(self.at_us)).unwrap_or(u32::MAX)
    }
}
