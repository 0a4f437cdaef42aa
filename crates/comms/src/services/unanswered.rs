//! Refuses unsupported messages that MAVLink has no answer for, by an occasional text.

use afbc_mavlink::UnansweredRequest;

/// Time between two texts about the same kind of message \[us\].
const QUIET_US: u64 = 20_000_000;

/// The last refused kind of message, and its time \[us\].
#[derive(Clone, Copy, Debug, Default)]
pub struct Unanswered(Option<(UnansweredRequest, u64)>);

impl Unanswered {
    /// Returns the text that refuses a message at `now_us`. Returns none if the same text was sent a short time ago.
    pub fn text(&mut self, request: UnansweredRequest, now_us: u64) -> Option<&'static str> {
        let said =
            |(last, at_us): &(UnansweredRequest, u64)| *last == request && now_us.saturating_sub(*at_us) < QUIET_US;
        if self.0.as_ref().is_some_and(said) {
            return None;
        }
        self.0 = Some((request, now_us));
        Some(match request {
            UnansweredRequest::Corrections => "refused: RTK corrections are not supported",
            UnansweredRequest::Tune => "refused: the vehicle has no buzzer",
            UnansweredRequest::Follow => "refused: follow-me is not supported",
            UnansweredRequest::Shell => "refused: the vehicle has no shell",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_is_told_now_and_then() {
        use UnansweredRequest::{Corrections, Follow, Shell, Tune};
        let mut unanswered = Unanswered::default();
        for (request, word) in [(Corrections, "RTK"), (Tune, "buzzer"), (Follow, "follow-me"), (Shell, "shell")] {
            assert!(unanswered.text(request, 5).is_some_and(|text| text.contains(word)));
            assert_eq!(unanswered.text(request, QUIET_US + 4), None);
            assert!(unanswered.text(request, QUIET_US + 5).is_some());
        }
    }
}
