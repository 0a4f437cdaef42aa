//! Questions that are repeated until an answer comes.

/// Number of tries of a question, and time to wait for each answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RetryPolicy {
    /// Time until the next try, or until giving up \[ms\].
    pub answer_ms: u64,
    /// Number of tries.
    pub tries: u32,
}

impl RetryPolicy {
    /// Asks once, for a link that loses nothing.
    pub const ONCE: Self = RetryPolicy { answer_ms: 3_000, tries: 1 };
    /// Asks three times.
    pub const REPEATED: Self = RetryPolicy { answer_ms: 1_000, tries: 3 };
}

/// Action that is due for a question.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RetryAction {
    Nothing,
    Again,
    GiveUp,
}

/// A question that has been asked and may be repeated.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RetriedRequest {
    retry_policy: RetryPolicy,
    tries_left: u32,
    since_ms: u64,
    wait_ms: u64,
}

impl RetriedRequest {
    pub(crate) fn new(retry_policy: RetryPolicy, now_ms: u64) -> Self {
        let tries_left = retry_policy.tries.saturating_sub(1);
        RetriedRequest { retry_policy, tries_left, since_ms: now_ms, wait_ms: retry_policy.answer_ms }
    }

    /// Returns the time since the last try or sign of progress \[ms\].
    pub(crate) fn waited_ms(&self, now_ms: u64) -> u64 {
        now_ms.saturating_sub(self.since_ms)
    }

    /// Notes that a part of the answer has come.
    pub(crate) fn progresses(&mut self, now_ms: u64) {
        self.since_ms = now_ms;
    }

    /// Notes that the vehicle is working on it: the question is not repeated, and the next sign may take the time of
    /// all tries.
    pub(crate) fn goes_on(&mut self, now_ms: u64) {
        (self.tries_left, self.since_ms) = (0, now_ms);
        self.wait_ms = self.retry_policy.answer_ms.saturating_mul(self.retry_policy.tries.into());
    }

    pub(crate) fn due(&mut self, now_ms: u64) -> RetryAction {
        if self.waited_ms(now_ms) < self.wait_ms {
            return RetryAction::Nothing;
        }
        if self.tries_left == 0 {
            return RetryAction::GiveUp;
        }
        (self.tries_left, self.since_ms) = (self.tries_left - 1, now_ms);
        RetryAction::Again
    }
}
