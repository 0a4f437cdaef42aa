//! Watches a GNSS receiver's height against the barometer and the vertical velocity.
//!
//! The filter follows a receiver's height within seconds, because its slow error counts as constant for so long. An
//! error that creeps would take the height along, and the barometer's offset the other way. Then both corrections add
//! up: the height has moved farther than the velocity says, and the offset has changed by as much. A barometer that
//! drifts moves only its offset, and a wrong velocity only the height.

use afbc_control::math::{max, min};

/// Time in which the watch forgets corrections: the usual time of a receiver's slow error \[s\].
const FORGETS_S: f32 = 100.0;
/// Longest time between two fixes over which corrections are summed \[s\].
const APART_S: f32 = 1.0;

/// Recent corrections of the height.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct HeightWatch {
    /// Sum of the recent corrections of the height, beyond what the velocity explains \[m\].
    pub(crate) lifted: f32,
    /// Sum of the recent changes of the barometer's offset \[m\].
    pub(crate) offset: f32,
    /// Height \[m\], climb rate \[m/s\] and barometer offset \[m\] at the last fix.
    last: Option<(f32, f32, f32)>,
    /// True while the receiver's height is not fused.
    pub(crate) doubts: bool,
}

impl HeightWatch {
    /// Forgets everything, after a reset of height or offset.
    pub(crate) fn forget(&mut self) {
        *self = HeightWatch::default();
    }

    /// Takes the state at a fix, `since_s` after the last fix.
    pub(crate) fn advance(&mut self, now: (f32, f32, f32), since_s: f32) {
        let last = self.last.replace(now).filter(|_| since_s < APART_S);
        let kept = max(1.0 - since_s * (1.0 / FORGETS_S), 0.0);
        (self.lifted, self.offset) = (self.lifted * kept, self.offset * kept);
        if let Some((height, climb, offset)) = last {
            self.lifted += now.0 - height - 0.5 * (now.1 + climb) * since_s;
            self.offset += now.2 - offset;
        }
    }

    /// Returns the square of the error that the sums of height corrections and of barometer offsets both show \[m2\].
    pub(crate) fn crept(&self) -> f32 {
        if self.lifted * self.offset < 0.0 { min(self.lifted * self.lifted, self.offset * self.offset) } else { 0.0 }
    }
}
