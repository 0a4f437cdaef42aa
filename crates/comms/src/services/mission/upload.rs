//! An upload in progress.

use crate::services::items::ITEMS_MAX;
use afbc_mavlink::{Address, MissionItem, MissionType};
use heapless::Vec;

/// Time after which an item is requested again \[us\].
pub(super) const PATIENCE_US: u64 = 400_000;
/// Number of times an item is requested.
pub(super) const TRIES: u8 = 6;

#[derive(Clone, Debug)]
pub(super) struct Upload {
    pub(super) plan: MissionType,
    pub(super) from: Address,
    pub(super) items: Vec<MissionItem, ITEMS_MAX>,
    count: u16,
    asked_us: u64,
    tries: u8,
}

/// Action that is due.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reminder {
    None,
    Ask(u16),
    GiveUp,
}

impl Upload {
    /// Creates an upload of `count` items. The caller requests the first item now.
    pub(super) fn new(plan: MissionType, count: u16, from: Address, now_us: u64) -> Self {
        Upload { plan, from, items: Vec::new(), count, asked_us: now_us, tries: 1 }
    }

    /// Returns the number of the next item expected.
    pub(super) fn wanted(&self) -> u16 {
        self.items.len() as u16
    }

    /// Takes the expected item. Returns the number of the next item, if there is one.
    pub(super) fn put(&mut self, item: MissionItem, now_us: u64) -> Option<u16> {
        self.items.push(item).ok();
        (self.asked_us, self.tries) = (now_us, 1);
        Some(self.wanted()).filter(|wanted| *wanted < self.count)
    }

    /// Returns the action that is due at `now_us`.
    pub(super) fn remind(&mut self, now_us: u64) -> Reminder {
        if now_us.saturating_sub(self.asked_us) < PATIENCE_US {
            return Reminder::None;
        }
        if self.tries >= TRIES {
            return Reminder::GiveUp;
        }
        (self.asked_us, self.tries) = (now_us, self.tries + 1);
        Reminder::Ask(self.wanted())
    }
}
