//! Counts the repetitions of a mission's jumps.

use crate::services::items::{JUMP, JUMPS_MAX};
use afbc_mavlink::MissionItem;
use heapless::Vec;

/// Numbers of the jump items that have been made, each with its repetitions left.
#[derive(Clone, Debug, Default)]
pub(super) struct Jumps(Vec<(u16, u16), JUMPS_MAX>);

impl Jumps {
    /// Resets all jumps.
    pub(super) fn clear(&mut self) {
        self.0.clear();
    }

    /// Returns the item that follows a jump: its target, or the next item once no repetitions are left.
    pub(super) fn next(&self, item: &MissionItem, target: u16) -> u16 {
        if self.left(item) == Some(0) { item.number.saturating_add(1) } else { target }
    }

    /// Notes that an item is done. A jump uses up one repetition, or is reset if none were left.
    pub(super) fn made(&mut self, item: &MissionItem) {
        let (true, Some(left)) = (item.command == JUMP, self.left(item)) else { return };
        self.0.retain(|(number, _)| *number != item.number);
        if let Some(left) = left.checked_sub(1) {
            // There is room for every jump.
            self.0.push((item.number, left)).ok();
        }
    }

    /// Returns the number of repetitions left. Returns none for an endless jump.
    fn left(&self, item: &MissionItem) -> Option<u16> {
        let [_, repeats, ..] = item.parameters;
        let begun = self.0.iter().find(|(number, _)| *number == item.number);
        (repeats >= 0.0).then(|| begun.map_or(repeats as u16, |(_, left)| *left))
    }
}
