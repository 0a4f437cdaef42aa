//! Uploads of missions, fences and rally points. The vehicle requests them item by item.

use crate::retry::{RetriedRequest, RetryAction, RetryPolicy};
use afbc_mavlink::{MissionItem, MissionMessage, MissionResult, MissionType};
use std::collections::VecDeque;

/// Result of an upload.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UploadEnd {
    /// The vehicle has accepted all plans.
    Accepted,
    /// The vehicle has refused this plan, and keeps its old one.
    Refused(MissionType, MissionResult),
    /// The vehicle does not answer while this plan is being uploaded.
    Silent(MissionType),
}

/// Plans that are still to be uploaded; the first one is in progress.
pub(crate) struct Uploads {
    plans: VecDeque<(MissionType, Vec<MissionItem>)>,
    retry_policy: RetryPolicy,
    request: RetriedRequest,
    /// Last message sent; it is repeated if no answer comes.
    said: Option<MissionMessage>,
    /// Number of items of the first plan that the vehicle has requested.
    asked: usize,
    end: Option<UploadEnd>,
}

impl Default for Uploads {
    fn default() -> Self {
        let (retry_policy, request) = (RetryPolicy::ONCE, RetriedRequest::new(RetryPolicy::ONCE, 0));
        Uploads { plans: VecDeque::new(), retry_policy, request, said: None, asked: 0, end: None }
    }
}

impl Uploads {
    /// Replaces the current upload; returns the first message to send.
    pub(crate) fn begin(
        &mut self,
        plans: impl IntoIterator<Item = (MissionType, Vec<MissionItem>)>,
        retry_policy: RetryPolicy,
        now_ms: u64,
    ) -> Option<MissionMessage> {
        (self.plans, self.retry_policy, self.end) = (plans.into_iter().collect(), retry_policy, None);
        self.offer(now_ms)
    }

    /// Returns how the upload ended; only the first call returns it.
    pub(crate) fn take_end(&mut self) -> Option<UploadEnd> {
        self.end.take()
    }

    fn offer(&mut self, now_ms: u64) -> Option<MissionMessage> {
        self.asked = 0;
        let count = self.plans.front().map(|(plan, items)| MissionMessage::Count(items.len() as u16, *plan));
        if count.is_none() {
            self.end = Some(UploadEnd::Accepted);
        }
        self.say(count, now_ms)
    }

    fn say(&mut self, message: Option<MissionMessage>, now_ms: u64) -> Option<MissionMessage> {
        (self.said, self.request) = (message, RetriedRequest::new(self.retry_policy, now_ms));
        message
    }

    fn end(&mut self, end: UploadEnd) {
        self.plans.clear();
        self.end = Some(end);
    }

    /// Handles a message of the vehicle; returns the reply.
    pub(crate) fn hear(&mut self, message: &MissionMessage, now_ms: u64) -> Option<MissionMessage> {
        let (plan, items) = self.plans.front()?;
        let plan = *plan;
        match *message {
            MissionMessage::Request(number, asked) if asked == plan => {
                let item = *items.get(usize::from(number))?;
                self.asked = self.asked.max(usize::from(number) + 1);
                self.say(Some(MissionMessage::Item(item, plan)), now_ms)
            }
            // An acknowledgement before all items were requested answers an earlier upload.
            MissionMessage::Ack(MissionResult::ACCEPTED, of) if of == plan && self.asked == items.len() => {
                self.plans.pop_front();
                self.offer(now_ms)
            }
            MissionMessage::Ack(result, of) if of == plan && result != MissionResult::ACCEPTED => {
                self.end(UploadEnd::Refused(plan, result));
                None
            }
            _ => None,
        }
    }

    /// Returns the message that is due to be repeated.
    pub(crate) fn update(&mut self, now_ms: u64) -> Option<MissionMessage> {
        let plan = self.plans.front()?.0;
        match self.request.due(now_ms) {
            RetryAction::Nothing => None,
            RetryAction::Again => self.said,
            RetryAction::GiveUp => {
                self.end(UploadEnd::Silent(plan));
                None
            }
        }
    }
}
