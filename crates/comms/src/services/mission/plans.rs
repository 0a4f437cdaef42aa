//! Storage for the items of all plans: mission, fence and rally points, one after the other.

use crate::services::items::ITEMS_MAX;
use afbc_mavlink::{MissionItem, MissionType};
use heapless::Vec;

/// The items of all plans.
#[derive(Clone, Debug, Default)]
pub(super) struct PlanItems {
    items: Vec<MissionItem, ITEMS_MAX>,
    /// Number of the fence's items and of rally points. All other items are the mission's.
    fence: u8,
    rally: u8,
}

impl PlanItems {
    /// Returns the index of a plan's first item, and the number of items. Returns none for an unknown plan.
    fn place(&self, plan: MissionType) -> Option<(usize, usize)> {
        let (fence, rally) = (usize::from(self.fence), usize::from(self.rally));
        let mission = self.items.len().saturating_sub(fence + rally);
        Some(match plan {
            MissionType::MISSION => (0, mission),
            MissionType::FENCE => (mission, fence),
            MissionType::RALLY => (mission + fence, rally),
            _ => return None,
        })
    }

    /// Returns the items of a plan.
    pub(super) fn of(&self, plan: MissionType) -> &[MissionItem] {
        self.place(plan).and_then(|(begin, count)| self.items.get(begin..begin + count)).unwrap_or_default()
    }

    /// Returns the number of items that a plan can have, given the items of the other plans.
    pub(super) fn room(&self, plan: MissionType) -> usize {
        ITEMS_MAX - (self.items.len() - self.of(plan).len())
    }

    /// Replaces the items of a plan. Returns false and changes nothing if there is no room.
    pub(super) fn replace(&mut self, plan: MissionType, items: &[MissionItem]) -> bool {
        let Some((begin, count)) = self.place(plan).filter(|_| items.len() <= self.room(plan)) else { return false };
        // The plan's items are rotated to the end of the list, replaced there, and rotated back. A second list would
        // need much stack.
        let (mission, others) = (plan == MissionType::MISSION, self.items.len() - count);
        if let Some(rest) = self.items.get_mut(begin..) {
            rest.rotate_left(count.min(rest.len()));
        }
        self.items.truncate(others);
        // There is room.
        self.items.extend_from_slice(items).ok();
        if let Some(rest) = self.items.get_mut(begin..) {
            rest.rotate_right(items.len().min(rest.len()));
        }
        if !mission {
            *(if plan == MissionType::FENCE { &mut self.fence } else { &mut self.rally }) = items.len() as u8;
        }
        true
    }
}
