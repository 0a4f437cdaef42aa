//! What stations send without waiting for an answer, and the vehicle has no use for: it says so, now and then.

use afbc_link::UnansweredWish;

/// Time between two texts about the same \[us\].
const QUIET_US: u64 = 20_000_000;

/// What has been said last, and when.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unanswered(Option<(UnansweredWish, u64)>);

impl Unanswered {
    /// Returns what is to be said of a wish at `now_us`; nothing if that was said a short time ago.
    pub fn text(&mut self, wish: UnansweredWish, now_us: u64) -> Option<&'static str> {
        let said = |(last, at_us): &(UnansweredWish, u64)| *last == wish && now_us.saturating_sub(*at_us) < QUIET_US;
        if self.0.as_ref().is_some_and(said) {
            return None;
        }
        self.0 = Some((wish, now_us));
        Some(match wish {
            UnansweredWish::Corrections => "refused: RTK corrections are not used",
            UnansweredWish::Tune => "refused: there is no buzzer",
            UnansweredWish::Follow => "refused: targets are not followed",
            UnansweredWish::Shell => "refused: there is no shell",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_is_told_now_and_then() {
        use UnansweredWish::{Corrections, Follow, Shell, Tune};
        let mut unanswered = Unanswered::default();
        for (wish, word) in [(Corrections, "RTK"), (Tune, "buzzer"), (Follow, "followed"), (Shell, "shell")] {
            assert!(unanswered.text(wish, 5).is_some_and(|text| text.contains(word)));
            assert_eq!(unanswered.text(wish, QUIET_US + 4), None);
            assert!(unanswered.text(wish, QUIET_US + 5).is_some());
        }
    }
}
