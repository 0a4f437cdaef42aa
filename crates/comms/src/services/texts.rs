//! Status texts (STATUSTEXT) for stations.

use afbc_guidance::OrderRefusal;
use afbc_guidance::notice::Severity;
use afbc_mavlink::{Address, Downlink, MavSeverity, StatusText};
use heapless::{Deque, String};

/// Largest number of queued texts. Further texts are dropped.
const TEXTS_MAX: usize = 12;
/// Longest text \[bytes\].
const LENGTH_MAX: usize = 50;

/// A text of at most 50 bytes. Longer texts are truncated.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Words(String<LENGTH_MAX>);

impl Words {
    /// Creates a text.
    pub fn of(text: &str) -> Self {
        Words::default().and(text)
    }

    /// Appends a text.
    pub fn and(mut self, text: &str) -> Self {
        for letter in text.chars() {
            self.0.push(letter).ok();
        }
        self
    }

    /// Appends a number, without `core::fmt`, which would need 10 kB of flash.
    pub fn number(self, number: u32) -> Self {
        let higher = if number > 9 { self.number(number / 10) } else { self };
        let digit = char::from_digit(number % 10, 10).unwrap_or('0');
        higher.and(digit.encode_utf8(&mut [0; 4]))
    }

    /// Appends a station as "system/component".
    pub fn station(self, station: Address) -> Self {
        self.number(station.system.into()).and("/").number(station.component.into())
    }

    fn text(&self) -> StatusText {
        StatusText::from(self.0.as_str())
    }
}

/// Queue of texts.
#[derive(Clone, Debug, Default)]
pub(crate) struct Texts(Deque<(MavSeverity, StatusText), TEXTS_MAX>);

impl Texts {
    /// Queues a text.
    pub(crate) fn put(&mut self, severity: MavSeverity, text: &str) {
        self.0.push_back((severity, StatusText::from(text))).ok();
    }

    /// Queues composed words.
    pub(crate) fn say(&mut self, severity: MavSeverity, words: &Words) {
        self.0.push_back((severity, words.text())).ok();
    }

    /// Removes and returns the oldest text.
    pub(crate) fn next(&mut self) -> Option<Downlink> {
        let (severity, text) = self.0.pop_front()?;
        Some(Downlink::Text { severity, text })
    }
}

/// Returns the MAVLink severity of a notice.
pub(crate) fn urgency(severity: Severity) -> MavSeverity {
    match severity {
        Severity::Critical => MavSeverity::MAV_SEVERITY_CRITICAL,
        Severity::Error => MavSeverity::MAV_SEVERITY_ERROR,
        Severity::Warning => MavSeverity::MAV_SEVERITY_WARNING,
        Severity::Notice => MavSeverity::MAV_SEVERITY_NOTICE,
        Severity::Info => MavSeverity::MAV_SEVERITY_INFO,
    }
}

/// Returns the reason of a refused order, in words.
pub(crate) fn reason(declined: OrderRefusal) -> &'static str {
    match declined {
        OrderRefusal::NoPosition => "refused: position unknown",
        OrderRefusal::NotArmed => "refused: not armed",
        OrderRefusal::OnGround => "refused: on the ground",
        OrderRefusal::InFlight => "refused: in flight",
        OrderRefusal::NoTargets => "refused: no fresh targets",
        OrderRefusal::NoSticks => "refused: no fresh input from the sticks",
        OrderRefusal::NoMission => "refused: no mission, or item does not exist",
        OrderRefusal::OutsideFence => "refused: outside the geofence",
        OrderRefusal::OutOfRange => "refused: target or value out of range",
        OrderRefusal::Failsafe => "refused: a failsafe is active",
        _ => "refused",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written() {
        for (number, text) in [(0, "0"), (7, "7"), (10, "10"), (u32::MAX, "4294967295")] {
            assert_eq!(Words::default().number(number), Words::of(text));
        }
        let station = Address { system: 255, component: 190 };
        assert_eq!(Words::of("by ").station(station).and("!"), Words::of("by 255/190!"));
    }

    #[test]
    fn longer_texts_are_cut_off() {
        let long = Words::of("0123456789012345678901234567890123456789").and("01234567890123456789");
        assert_eq!(long, Words::of("01234567890123456789012345678901234567890123456789"));
    }

    #[test]
    fn every_reason_is_reported_in_other_words() {
        let all = [
            (OrderRefusal::NoPosition, "position"),
            (OrderRefusal::NotArmed, "not armed"),
            (OrderRefusal::OnGround, "on the ground"),
            (OrderRefusal::InFlight, "in flight"),
            (OrderRefusal::NoTargets, "targets"),
            (OrderRefusal::NoSticks, "sticks"),
            (OrderRefusal::NoMission, "mission"),
            (OrderRefusal::OutsideFence, "geofence"),
            (OrderRefusal::OutOfRange, "out of range"),
            (OrderRefusal::Failsafe, "failsafe"),
        ];
        for (declined, word) in all {
            let text = reason(declined);
            assert!(text.starts_with("refused: ") && text.contains(word) && text.len() <= LENGTH_MAX, "{text}");
        }
    }

    #[test]
    fn severities_are_those_of_mavlink() {
        use Severity::{Critical, Error, Info, Notice, Warning};
        let numbers = [Critical, Error, Warning, Notice, Info].map(|severity| urgency(severity) as u8);
        assert_eq!(numbers, [2, 3, 4, 5, 6]);
    }

    /// Texts are sent in order. Texts that do not fit into the queue are dropped.
    #[test]
    fn texts_wait_in_order() {
        let mut texts = Texts::default();
        let info = MavSeverity::MAV_SEVERITY_INFO;
        texts.put(info, "first");
        for number in 0..20 {
            texts.say(MavSeverity::MAV_SEVERITY_ERROR, &Words::default().number(number));
        }
        assert_eq!(texts.next(), Some(Downlink::Text { severity: info, text: StatusText::from("first") }));
        for number in 0..TEXTS_MAX as u32 - 1 {
            let text = Words::default().number(number).text();
            assert_eq!(texts.next(), Some(Downlink::Text { severity: MavSeverity::MAV_SEVERITY_ERROR, text }));
        }
        assert_eq!(texts.next(), None);
    }
}
