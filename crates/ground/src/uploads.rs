//! Uploads of missions, fences and rally points, which the vehicle asks for item by item.

use crate::repeated::{Due, Patience, Repeated};
use afbc_link::{Mission, MissionItem, MissionResult, Plan};
use std::collections::VecDeque;

/// How an upload has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UploadEnd {
    /// The vehicle has all plans.
    Accepted,
    /// It does not want one of them, and keeps what it had.
    Refused(Plan, MissionResult),
    /// It does not answer.
    Silent(Plan),
}

/// Plans on their way, the first one now.
pub(crate) struct Uploads {
    plans: VecDeque<(Plan, Vec<MissionItem>)>,
    patience: Patience,
    repeated: Repeated,
    /// What was said last, which is repeated.
    said: Option<Mission>,
    /// Number of items of the first plan up to the last one asked for.
    asked: usize,
    end: Option<UploadEnd>,
}

impl Default for Uploads {
    fn default() -> Self {
        let (patience, repeated) = (Patience::ONCE, Repeated::new(Patience::ONCE, 0));
        Uploads { plans: VecDeque::new(), patience, repeated, said: None, asked: 0, end: None }
    }
}

impl Uploads {
    /// Replaces what is on its way; returns what is to be said.
    pub(crate) fn begin(
        &mut self,
        plans: impl IntoIterator<Item = (Plan, Vec<MissionItem>)>,
        patience: Patience,
        now_ms: u64,
    ) -> Option<Mission> {
        (self.plans, self.patience, self.end) = (plans.into_iter().collect(), patience, None);
        self.offer(now_ms)
    }

    /// Returns how it has ended, once.
    pub(crate) fn take_end(&mut self) -> Option<UploadEnd> {
        self.end.take()
    }

    fn offer(&mut self, now_ms: u64) -> Option<Mission> {
        self.asked = 0;
        let count = self.plans.front().map(|(plan, items)| Mission::Count(items.len() as u16, *plan));
        if count.is_none() {
            self.end = Some(UploadEnd::Accepted);
        }
        self.say(count, now_ms)
    }

    fn say(&mut self, message: Option<Mission>, now_ms: u64) -> Option<Mission> {
        (self.said, self.repeated) = (message, Repeated::new(self.patience, now_ms));
        message
    }

    fn end(&mut self, end: UploadEnd) {
        self.plans.clear();
        self.end = Some(end);
    }

    /// Returns the answer.
    pub(crate) fn hear(&mut self, message: &Mission, now_ms: u64) -> Option<Mission> {
        let (plan, items) = self.plans.front()?;
        let plan = *plan;
        match *message {
            Mission::Request(number, asked) if asked == plan => {
                let item = *items.get(usize::from(number))?;
                self.asked = self.asked.max(usize::from(number) + 1);
                self.say(Some(Mission::Item(item, plan)), now_ms)
            }
            // Nobody has all items who has not asked for them: that answers an earlier upload.
            Mission::Ack(MissionResult::ACCEPTED, of) if of == plan && self.asked == items.len() => {
                self.plans.pop_front();
                self.offer(now_ms)
            }
            Mission::Ack(result, of) if of == plan && result != MissionResult::ACCEPTED => {
                self.end(UploadEnd::Refused(plan, result));
                None
            }
            _ => None,
        }
    }

    /// Returns what is to be repeated.
    pub(crate) fn turn(&mut self, now_ms: u64) -> Option<Mission> {
        let plan = self.plans.front()?.0;
        match self.repeated.due(now_ms) {
            Due::Nothing => None,
            Due::Again => self.said,
            Due::GiveUp => {
                self.end(UploadEnd::Silent(plan));
                None
            }
        }
    }
}
