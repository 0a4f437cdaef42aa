//! Set of reasons against arming.

use crate::refusal::Refusal;

/// Set of reasons against arming, listed in the order of [`Refusal::ARMING`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Reasons(u32);

impl Reasons {
    /// No reasons.
    pub const NONE: Self = Reasons(0);

    /// Adds a reason if it applies.
    pub const fn note(&mut self, applies: bool, reason: Refusal) {
        if applies {
            // Flight-core reasons are below 32. From 32 on, the link's numbers are refusals of the guidance.
            self.0 |= 1 << reason as u32;
        }
    }

    /// Returns these reasons and `others`.
    #[must_use]
    pub const fn and(self, others: Reasons) -> Self {
        Reasons(self.0 | others.0)
    }

    /// True if there is no reason.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// True if the set contains this reason.
    pub const fn contains(self, reason: Refusal) -> bool {
        self.0 & (1 << reason as u32) != 0
    }

    /// Returns the reasons in order.
    pub fn iter(self) -> impl Iterator<Item = Refusal> {
        Refusal::ARMING.into_iter().filter(move |reason| self.contains(*reason))
    }

    /// Returns the answer to [`Request::Arm`](crate::Request::Arm).
    ///
    /// # Errors
    /// The first reason in the order of [`Refusal::ARMING`], or else any other one.
    pub fn verdict(self) -> Result<(), Refusal> {
        if self.is_empty() {
            return Ok(());
        }
        // A reason that is not in the order still counts.
        let any = || Refusal::ALL.into_iter().find(|reason| self.contains(*reason));
        // Only a log can contain a bit without a reason.
        Err(self.iter().next().or_else(any).unwrap_or(Refusal::Unhealthy))
    }
}

impl From<Refusal> for Reasons {
    fn from(reason: Refusal) -> Self {
        let mut reasons = Reasons::NONE;
        reasons.note(true, reason);
        reasons
    }
}
