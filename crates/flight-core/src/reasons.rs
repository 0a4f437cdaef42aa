//! Everything that speaks against arming, as a set.

use crate::refusal::Refusal;

/// Reasons against arming, in the order of [`Refusal::ARMING`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Reasons(u32);

impl Reasons {
    /// Nothing.
    pub const NONE: Self = Reasons(0);

    /// Adds a reason, if it applies.
    pub const fn note(&mut self, applies: bool, reason: Refusal) {
        if applies {
            // Below 32: the link's numbers from there on are refusals of the guidance.
            self.0 |= 1 << reason as u32;
        }
    }

    /// Returns these reasons and `others`.
    #[must_use]
    pub const fn and(self, others: Reasons) -> Self {
        Reasons(self.0 | others.0)
    }

    /// True if nothing speaks against it.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// True if this one is among them.
    pub const fn contains(self, reason: Refusal) -> bool {
        self.0 & (1 << reason as u32) != 0
    }

    /// Returns them in order.
    pub fn iter(self) -> impl Iterator<Item = Refusal> {
        Refusal::ARMING.into_iter().filter(move |reason| self.contains(*reason))
    }

    /// Returns the answer to [`Request::Arm`](crate::Request::Arm).
    ///
    /// # Errors
    /// The first of them in the order of [`Refusal::ARMING`], or else any.
    pub fn verdict(self) -> Result<(), Refusal> {
        if self.is_empty() {
            return Ok(());
        }
        // What is not in the order is a reason all the same.
        let any = || Refusal::ALL.into_iter().find(|reason| self.contains(*reason));
        // A bit of no refusal can only have been read from a log.
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
