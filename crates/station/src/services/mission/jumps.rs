//! Jumps of a mission, which are over after a number of repetitions.

use crate::services::items::{JUMP, JUMPS_MAX};
use afbc_link::MissionItem;
use heapless::Vec;

/// How often each jump that has begun is still made.
#[derive(Clone, Debug, Default)]
pub(super) struct Jumps(Vec<(u16, u16), JUMPS_MAX>);

impl Jumps {
    /// Begins anew.
    pub(super) fn clear(&mut self) {
        self.0.clear();
    }

    /// Returns the item that follows a jump: where it leads, or the next one once it is over.
    pub(super) fn next(&self, item: &MissionItem, target: u16) -> u16 {
        if self.left(item) == Some(0) { item.number.saturating_add(1) } else { target }
    }

    /// Notes that an item is done: if it is a jump, it has been made, or it was over and begins anew.
    pub(super) fn made(&mut self, item: &MissionItem) {
        let (true, Some(left)) = (item.command == JUMP, self.left(item)) else { return };
        self.0.retain(|(number, _)| *number != item.number);
        if let Some(left) = left.checked_sub(1) {
            // There is room for every jump.
            self.0.push((item.number, left)).ok();
        }
    }

    /// Returns how often a jump is still made; none for ever.
    fn left(&self, item: &MissionItem) -> Option<u16> {
        let [_, repeats, ..] = item.parameters;
        let begun = self.0.iter().find(|(number, _)| *number == item.number);
        (repeats >= 0.0).then(|| begun.map_or(repeats as u16, |(_, left)| *left))
    }
}
