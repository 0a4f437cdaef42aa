//! What messages bring for a tick.

use afbc_flight_core::{Inbox, Queue, Ticketed};
use afbc_guidance::{BatteryReading, Order, Orders};

/// Inputs of the flight core and of the guidance, written by what receives messages and taken by the control tick.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ControlInputs {
    /// For the flight core.
    pub inbox: Inbox,
    /// For the guidance.
    pub orders: Orders,
    /// The battery, if the shell measures it.
    pub battery: Option<BatteryReading>,
    /// True if there is something new in the orders: without it they are not copied.
    fresh: bool,
}

impl Default for ControlInputs {
    fn default() -> Self {
        Self::EMPTY
    }
}

impl ControlInputs {
    /// Nothing.
    pub const EMPTY: Self = {
        let given = Queue::new();
        let orders = Orders { target: None, sticks: None, leg: None, heard_us: None, fence: None, safe_m: None, given };
        ControlInputs { inbox: Inbox::EMPTY, orders, battery: None, fresh: false }
    };

    /// Returns the orders, to be changed.
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

    /// Brings the inputs of the last tick up to date for the next one, and removes what is handed over only once.
    #[inline]
    pub fn take_into(&mut self, taken: &mut ControlInputs) {
        self.inbox.take_into(&mut taken.inbox);
        taken.battery = self.battery;
        if self.fresh {
            self.move_orders(&mut taken.orders);
            self.fresh = false;
        }
    }

    /// Copies what is new, and keeps nothing: the tick has it.
    #[inline(never)]
    fn move_orders(&mut self, taken: &mut Orders) {
        let Orders { target, sticks, leg, heard_us, fence, safe_m, given } = &mut self.orders;
        replace(&mut taken.target, target);
        replace(&mut taken.sticks, sticks);
        replace(&mut taken.leg, leg);
        replace(&mut taken.heard_us, heard_us);
        replace(&mut taken.fence, fence);
        replace(&mut taken.safe_m, safe_m);
        // Those that the tick has not answered yet stay.
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

/// Queues an order; dropped if there is no place for it: whoever gives orders keeps count.
pub fn give(orders: &mut Orders, given: Ticketed<Order>) {
    let _ = orders.given.push_back(given);
}
