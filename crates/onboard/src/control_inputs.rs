//! Inputs that messages bring for a control tick.

use afbc_flight_core::{Inbox, Queue, Ticketed};
use afbc_guidance::{BatteryReading, Order, Orders};

/// Inputs of the flight core and the guidance. The message services write them, and the control tick takes them.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ControlInputs {
    /// Inputs of the flight core.
    pub inbox: Inbox,
    /// Inputs of the guidance.
    pub orders: Orders,
    /// Reading of the battery, if the shell measures it.
    pub battery: Option<BatteryReading>,
    /// True if the orders have changed. Unchanged orders are not copied.
    fresh: bool,
}

impl Default for ControlInputs {
    fn default() -> Self {
        Self::EMPTY
    }
}

impl ControlInputs {
    /// No inputs.
    pub const EMPTY: Self = {
        let given = Queue::new();
        let orders = Orders { target: None, sticks: None, leg: None, heard_us: None, fence: None, safe_m: None, given };
        ControlInputs { inbox: Inbox::EMPTY, orders, battery: None, fresh: false }
    };

    /// Returns the orders for changing, and marks them as changed.
    pub fn order(&mut self) -> &mut Orders {
        self.fresh = true;
        &mut self.orders
    }

    /// Merges `update` into these inputs.
    pub fn merge(&mut self, update: &ControlInputs) {
        self.inbox.merge(&update.inbox);
        self.battery = update.battery.or(self.battery);
        if !update.fresh {
            return;
        }
        self.fresh = true;
        let Orders { target, sticks, leg, heard_us, fence, safe_m, given } = &update.orders;
        let mine = &mut self.orders;
        mine.target = target.or(mine.target);
        mine.sticks = sticks.or(mine.sticks);
        mine.leg = leg.or(mine.leg);
        mine.heard_us = heard_us.or(mine.heard_us);
        mine.fence = fence.or(mine.fence);
        mine.safe_m = safe_m.or(mine.safe_m);
        for given in given {
            give(mine, *given);
        }
    }

    /// Updates `taken`, the last tick's inputs, for the next tick. Removes inputs that are handed over only once.
    #[inline]
    pub fn take_into(&mut self, taken: &mut ControlInputs) {
        self.inbox.take_into(&mut taken.inbox);
        taken.battery = self.battery;
        if self.fresh {
            self.move_orders(&mut taken.orders);
            self.fresh = false;
        }
    }

    /// Moves changed orders into `taken`.
    #[inline(never)]
    fn move_orders(&mut self, taken: &mut Orders) {
        let Orders { target, sticks, leg, heard_us, fence, safe_m, given } = &mut self.orders;
        replace(&mut taken.target, target);
        replace(&mut taken.sticks, sticks);
        replace(&mut taken.leg, leg);
        replace(&mut taken.heard_us, heard_us);
        replace(&mut taken.fence, fence);
        replace(&mut taken.safe_m, safe_m);
        // Orders that the tick has not answered yet stay in `taken`.
        while let Some(given) = given.pop_front() {
            give(taken, given);
        }
    }
}

fn replace<T>(old: &mut Option<T>, new: &mut Option<T>) {
    if new.is_some() {
        *old = new.take();
    }
}

/// Queues an order. Drops the order if the queue is full; the sender must keep count.
pub fn give(orders: &mut Orders, given: Ticketed<Order>) {
    let _ = orders.given.push_back(given);
}
