//! Sends telemetry at intervals, and messages on request, within the rate of the link.
//!
//! Stations set the interval of each stream. All streams share a budget of bytes per second. If the budget is too small
//! for all streams, the stream that is latest in proportion to its interval is sent first. So all rates shrink by the
//! same factor.

use afbc_mavlink::DataStream;
use heapless::Deque;

/// Numbers of MAVLink messages.
pub mod id {
    #![allow(missing_docs, reason = "the names of the messages")]
    pub const HEARTBEAT: u32 = 0;
    pub const SYS_STATUS: u32 = 1;
    pub const SYSTEM_TIME: u32 = 2;
    pub const GPS_RAW_INT: u32 = 24;
    pub const ATTITUDE: u32 = 30;
    pub const ATTITUDE_QUATERNION: u32 = 31;
    pub const LOCAL_POSITION_NED: u32 = 32;
    pub const GLOBAL_POSITION_INT: u32 = 33;
    pub const MISSION_CURRENT: u32 = 42;
    pub const GPS_GLOBAL_ORIGIN: u32 = 49;
    pub const RC_CHANNELS: u32 = 65;
    pub const VFR_HUD: u32 = 74;
    pub const POSITION_TARGET_LOCAL_NED: u32 = 85;
    pub const HIL_ACTUATOR_CONTROLS: u32 = 93;
    pub const HIGHRES_IMU: u32 = 105;
    pub const BATTERY_STATUS: u32 = 147;
    pub const AUTOPILOT_VERSION: u32 = 148;
    pub const ESTIMATOR_STATUS: u32 = 230;
    pub const HOME_POSITION: u32 = 242;
    pub const EXTENDED_SYS_STATE: u32 = 245;
    pub const ESC_INFO: u32 = 290;
    pub const ESC_STATUS: u32 = 291;
    pub const PROTOCOL_VERSION: u32 = 300;
    pub const DEBUG_FLOAT_ARRAY: u32 = 350;
    pub const ORBIT_EXECUTION_STATUS: u32 = 360;
    pub const ACTUATOR_OUTPUT_STATUS: u32 = 375;
    pub const AVAILABLE_MODES: u32 = 435;
    pub const CURRENT_MODE: u32 = 436;
}

/// Streams with their default intervals \[us\]; 0 for off. `docs/reference/mavlink.md` has the same list.
pub const DEFAULTS: [(u32, u32); 23] = [
    (id::SYS_STATUS, 1_000_000),
    (id::SYSTEM_TIME, 1_000_000),
    (id::GPS_RAW_INT, 1_000_000),
    (id::ATTITUDE, 20_000),
    (id::ATTITUDE_QUATERNION, 100_000),
    (id::LOCAL_POSITION_NED, 20_000),
    (id::GLOBAL_POSITION_INT, 100_000),
    (id::MISSION_CURRENT, 1_000_000),
    (id::GPS_GLOBAL_ORIGIN, 0),
    (id::VFR_HUD, 250_000),
    (id::POSITION_TARGET_LOCAL_NED, 250_000),
    (id::BATTERY_STATUS, 1_000_000),
    (id::ESTIMATOR_STATUS, 1_000_000),
    (id::HOME_POSITION, 1_000_000),
    (id::EXTENDED_SYS_STATE, 200_000),
    (id::DEBUG_FLOAT_ARRAY, 100_000),
    (id::ACTUATOR_OUTPUT_STATUS, 1_000_000),
    (id::CURRENT_MODE, 1_000_000),
    (id::ORBIT_EXECUTION_STATUS, 500_000),
    (id::HIGHRES_IMU, 0),
    (id::RC_CHANNELS, 500_000),
    (id::ESC_INFO, 1_000_000),
    (id::ESC_STATUS, 100_000),
];
/// Shortest interval \[us\]: one tick.
pub const INTERVAL_MIN_US: u32 = 1_000;
/// Messages that can be requested but not streamed. HEARTBEAT has a fixed rate.
const ONCE: [u32; 4] = [id::HEARTBEAT, id::AUTOPILOT_VERSION, id::PROTOCOL_VERSION, id::AVAILABLE_MODES];
/// Largest number of queued requests for messages.
pub const REQUESTS_MAX: usize = 16;
/// Bytes that streams may send at once after a pause \[1e-3 bytes\]. Texts and replies may use as many again. Together
/// with answers and one frame that just fitted this is less than 1 kB, the size of the board's transmit buffer.
const BURST: i64 = 300_000;

/// A message that a station has requested.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Requested {
    /// Number of the message.
    pub message: u32,
    /// Index of the message (`param2` of the request).
    pub index: u32,
}

#[derive(Clone, Copy, Debug)]
struct Stream {
    /// Interval between two messages \[us\]; 0 for off.
    interval_us: u32,
    /// Time at which the next message is due \[us\].
    due_us: u64,
}

/// Telemetry streams, queued requests and the link's budget.
#[derive(Clone, Debug)]
pub struct Streams {
    streams: [Stream; DEFAULTS.len()],
    /// True if a simulator has requested rotor commands, which do not count against the budget.
    rotors: bool,
    requested: Deque<Requested, REQUESTS_MAX>,
    bytes_per_s: u32,
    /// Bytes that may be sent now \[1e-3 bytes\]. Negative if more was sent than the budget allows.
    room: i64,
}

impl Streams {
    /// Creates the default streams for a link of `bytes_per_s`.
    pub fn new(bytes_per_s: u32) -> Self {
        // The first messages are spread over several ticks.
        let mut phase_us = 0;
        let streams = DEFAULTS.map(|(_, interval_us)| {
            phase_us += 1_000;
            Stream { interval_us, due_us: phase_us }
        });
        Streams { streams, rotors: false, requested: Deque::new(), bytes_per_s, room: BURST }
    }

    /// Returns the rate of the link without the share of rotor commands \[bytes/s\].
    pub fn bytes_per_s(&self) -> u32 {
        if self.rotors { self.bytes_per_s / 9 * 5 } else { self.bytes_per_s }
    }

    /// Returns true if rotor commands are sent.
    pub fn rotors(&self) -> bool {
        self.rotors
    }

    /// Sets the interval of a message: 0 for the default, -1 for off. Returns false if there is no such stream.
    pub fn set(&mut self, message: u32, interval_us: i32, now_us: u64) -> bool {
        if message == id::HIL_ACTUATOR_CONTROLS {
            self.rotors = interval_us > 0;
            return true;
        }
        let Some((stream, default_us)) = self.stream(message) else { return false };
        stream.interval_us = match u32::try_from(interval_us) {
            Ok(0) => default_us,
            Ok(interval_us) => interval_us.max(INTERVAL_MIN_US),
            Err(_) => 0,
        };
        // The new interval counts from now if the old due time is later.
        stream.due_us = stream.due_us.min(now_us.saturating_add(stream.interval_us.into()));
        true
    }

    /// Returns the interval of a message \[us\]: -1 if it is off, 0 if there is no such stream.
    pub fn interval_us(&self, message: u32) -> i32 {
        if message == id::HIL_ACTUATOR_CONTROLS {
            return if self.rotors { INTERVAL_MIN_US as i32 } else { -1 };
        }
        let place = DEFAULTS.iter().position(|(other, _)| *other == message);
        match place.and_then(|place| self.streams.get(place)) {
            None => 0,
            Some(Stream { interval_us: 0, .. }) => -1,
            Some(stream) => stream.interval_us as i32,
        }
    }

    /// Handles REQUEST_DATA_STREAM of older stations: sets the rates of the messages in a `MAV_DATA_STREAM` group.
    /// Returns the new rate, 0 for an unknown group.
    pub fn set_group(&mut self, request: DataStream, now_us: u64) -> DataStream {
        // A rate of 0 turns the group off.
        let interval_us = 1_000_000_i32.checked_div(request.rate_hz.into()).unwrap_or(-1);
        let group: &[u32] = match request.group {
            2 => &[id::SYS_STATUS, id::BATTERY_STATUS, id::GPS_RAW_INT, id::MISSION_CURRENT],
            3 => &[id::RC_CHANNELS],
            6 => &[id::LOCAL_POSITION_NED, id::GLOBAL_POSITION_INT],
            10 => &[id::ATTITUDE, id::ATTITUDE_QUATERNION],
            11 => &[id::VFR_HUD],
            12 => &[id::EXTENDED_SYS_STATE, id::ESTIMATOR_STATUS, id::ACTUATOR_OUTPUT_STATUS],
            0 => &[
                id::SYS_STATUS,
                id::GPS_RAW_INT,
                id::ATTITUDE,
                id::LOCAL_POSITION_NED,
                id::GLOBAL_POSITION_INT,
                id::VFR_HUD,
                id::EXTENDED_SYS_STATE,
            ],
            _ => &[],
        };
        for message in group {
            self.set(*message, interval_us, now_us);
        }
        DataStream { rate_hz: if group.is_empty() { 0 } else { request.rate_hz }, ..request }
    }

    /// Returns true if a message can be requested.
    pub fn knows(message: u32) -> bool {
        ONCE.contains(&message) || DEFAULTS.iter().any(|(known, _)| *known == message)
    }

    /// Queues a requested message. Returns false if the queue is full.
    pub fn request(&mut self, requested: Requested) -> bool {
        self.requested.push_back(requested).is_ok()
    }

    /// Queues a message before all others. Drops the message if the queue is full.
    pub(crate) fn request_first(&mut self, requested: Requested) {
        self.requested.push_front(requested).ok();
    }

    /// Begins a tick: adds the bytes that the link carries in 1 ms to the budget.
    pub fn tick(&mut self) {
        // Bytes per second are thousandths of bytes per millisecond.
        self.room = (self.room + i64::from(self.bytes_per_s())).min(BURST);
    }

    /// Returns true if texts and replies may be sent. They may overdraw the budget by one burst.
    pub fn has_room(&self) -> bool {
        self.room > -BURST
    }

    /// Returns true if this many bytes can be sent without delaying the streams.
    pub(crate) fn spares(&self, bytes: usize) -> bool {
        self.room >= 1000 * bytes as i64
    }

    /// Subtracts sent bytes from the budget, whether they belong to a stream or not.
    pub fn spend(&mut self, bytes: usize) {
        self.room -= 1000 * bytes as i64;
    }

    /// Returns the next message to be sent at `now_us` if the budget allows, and schedules its stream again.
    pub fn next(&mut self, now_us: u64) -> Option<Requested> {
        if self.room <= 0 {
            return None;
        }
        if let Some(requested) = self.requested.pop_front() {
            return Some(requested);
        }
        // Lateness of a stream, in thousandths of its interval.
        let late = |stream: &Stream| {
            let late_us = now_us.checked_sub(stream.due_us).filter(|_| stream.interval_us > 0)?;
            Some((late_us.saturating_mul(1000) + 1).checked_div(stream.interval_us.into()).unwrap_or(0))
        };
        let mut latest: Option<(u64, u32, &mut Stream)> = None;
        for (stream, (message, _)) in self.streams.iter_mut().zip(DEFAULTS) {
            if let Some(late) = late(stream)
                && latest.as_ref().is_none_or(|(other, ..)| late > *other)
            {
                latest = Some((late, message, stream));
            }
        }
        let (_, message, stream) = latest?;
        // A stream that is on time keeps its phase. Missed messages are not sent later.
        let interval_us = u64::from(stream.interval_us);
        let next_us = stream.due_us.saturating_add(interval_us);
        stream.due_us = if next_us > now_us { next_us } else { now_us.saturating_add(interval_us) };
        Some(Requested { message, index: 0 })
    }

    fn stream(&mut self, message: u32) -> Option<(&mut Stream, u32)> {
        let mut streams = self.streams.iter_mut().zip(DEFAULTS);
        streams.find(|(_, (other, _))| *other == message).map(|(stream, (_, default_us))| (stream, default_us))
    }
}

#[cfg(test)]
#[allow(clippy::expect_used, clippy::indexing_slicing, reason = "a test that cannot go on should say why")]
mod tests {
    extern crate std;
    use super::*;
    use std::collections::BTreeMap;

    /// Returns how often each message is sent in `seconds` if each message has `bytes`.
    fn counts(streams: &mut Streams, from_us: u64, seconds: u64, bytes: usize) -> BTreeMap<u32, u64> {
        let mut counts = BTreeMap::new();
        for tick in 1..=1000 * seconds {
            streams.tick();
            while let Some(Requested { message, .. }) = streams.next(from_us + 1000 * tick) {
                streams.spend(bytes);
                *counts.entry(message).or_default() += 1;
            }
        }
        counts
    }

    #[test]
    fn a_wide_link_carries_every_stream_at_its_rate() {
        let counts = counts(&mut Streams::new(1_000_000), 0, 10, 50);
        for (message, interval_us) in DEFAULTS {
            let expected = 10_000_000_u64.checked_div(interval_us.into()).unwrap_or(0);
            assert_eq!(counts.get(&message).copied().unwrap_or(0), expected, "message {message}");
        }
    }

    /// All rates shrink by the same factor, and the link is fully used but not overloaded.
    #[test]
    fn rates_shrink_on_a_narrow_link() {
        let wanted: u64 = DEFAULTS.iter().filter_map(|(_, us)| 60_000_000_u64.checked_div((*us).into())).sum();
        for share in [2, 5, 10] {
            let bytes_per_s = (50 * wanted / 60 / share) as u32;
            let counts = counts(&mut Streams::new(bytes_per_s), 0, 60, 50);
            let sent: u64 = counts.values().sum();
            assert!((50 * sent).abs_diff(60 * u64::from(bytes_per_s)) < 1000, "{sent}");
            for (message, interval_us) in DEFAULTS {
                let Some(full) = 60_000_000_u64.checked_div(interval_us.into()) else { continue };
                let count = counts[&message];
                assert!(count + 2 >= full / share / 2 && count <= full, "message {message}: {count} of {full}");
            }
        }
    }

    #[test]
    fn intervals_are_set_and_reported() {
        let mut streams = Streams::new(1_000_000);
        assert_eq!(streams.interval_us(id::ATTITUDE), 20_000);
        assert!(streams.set(id::ATTITUDE, 5_000, 0));
        assert!(streams.set(id::SYS_STATUS, -1, 0));
        assert_eq!([id::ATTITUDE, id::SYS_STATUS, 9999].map(|it| streams.interval_us(it)), [5_000, -1, 0]);
        let first = counts(&mut streams, 0, 10, 10);
        assert_eq!((first.get(&id::ATTITUDE), first.get(&id::SYS_STATUS)), (Some(&2000), None));
        assert!(streams.set(id::ATTITUDE, 0, 10_000_000) && streams.set(id::SYS_STATUS, 0, 10_000_000));
        assert!(!streams.set(9999, 1000, 0) && !streams.set(id::AUTOPILOT_VERSION, 1000, 0));
        let second = counts(&mut streams, 10_000_000, 10, 10);
        assert!((500..=501).contains(&second[&id::ATTITUDE]) && second[&id::SYS_STATUS] >= 10);
        // The shortest interval is a tick.
        assert!(streams.set(id::ATTITUDE, 1, 0));
        assert_eq!(streams.interval_us(id::ATTITUDE), 1_000);
        assert_eq!(streams.interval_us(id::HIL_ACTUATOR_CONTROLS), -1);
        assert!(streams.set(id::HIL_ACTUATOR_CONTROLS, 1000, 0) && streams.rotors());
    }

    #[test]
    fn requests_go_first_and_wait_for_room() {
        let mut streams = Streams::new(1_000);
        let version = Requested { message: id::AUTOPILOT_VERSION, index: 0 };
        (0..REQUESTS_MAX).for_each(|_| assert!(streams.request(version)));
        assert!(!streams.request(version));
        streams.spend(400);
        assert_eq!(streams.next(0), None);
        (0..101).for_each(|_| streams.tick());
        assert_eq!(streams.next(0), Some(version));
    }

    #[test]
    fn older_stations_set_rates_of_groups() {
        let mut streams = Streams::new(1_000_000);
        for (group, rate_hz, reported_hz) in [(10, 4, 4), (6, 0, 0), (200, 9, 0)] {
            let reported = streams.set_group(DataStream { group, rate_hz }, 0);
            assert_eq!(reported, DataStream { group, rate_hz: reported_hz });
        }
        assert_eq!(streams.interval_us(id::ATTITUDE), 250_000);
        assert_eq!(streams.interval_us(id::GLOBAL_POSITION_INT), -1);
        assert_eq!(streams.interval_us(id::VFR_HUD), 250_000);
    }

    /// Each group sets the requested rate for its own messages and no others.
    #[test]
    fn each_group_has_its_messages() {
        use id::*;
        let groups: [(u8, &[u32]); 7] = [
            (
                0,
                &[
                    SYS_STATUS,
                    GPS_RAW_INT,
                    ATTITUDE,
                    LOCAL_POSITION_NED,
                    GLOBAL_POSITION_INT,
                    VFR_HUD,
                    EXTENDED_SYS_STATE,
                ],
            ),
            (2, &[SYS_STATUS, BATTERY_STATUS, GPS_RAW_INT, MISSION_CURRENT]),
            (3, &[RC_CHANNELS]),
            (6, &[LOCAL_POSITION_NED, GLOBAL_POSITION_INT]),
            (10, &[ATTITUDE, ATTITUDE_QUATERNION]),
            (11, &[VFR_HUD]),
            (12, &[EXTENDED_SYS_STATE, ESTIMATOR_STATUS, ACTUATOR_OUTPUT_STATUS]),
        ];
        for group in 0..=20 {
            let messages = groups.iter().find(|(other, _)| *other == group).map_or(&[][..], |(_, messages)| messages);
            let mut streams = Streams::new(1_000_000);
            let reported = streams.set_group(DataStream { group, rate_hz: 7 }, 0);
            assert_eq!(reported.rate_hz, if messages.is_empty() { 0 } else { 7 });
            for (message, default_us) in DEFAULTS {
                let expected = if messages.contains(&message) { 142_857 } else { default_us as i32 };
                let expected = if expected == 0 { -1 } else { expected };
                assert_eq!(streams.interval_us(message), expected, "group {group}, message {message}");
            }
        }
    }

    /// Sent bytes are subtracted from the budget, which grows with time up to a burst. Rotor commands leave 5/9 of the
    /// rate.
    #[test]
    fn the_budget_is_what_the_link_carries() {
        let mut streams = Streams::new(9_000);
        assert!(streams.set(id::HIL_ACTUATOR_CONTROLS, 1000, 0));
        assert_eq!((streams.bytes_per_s(), streams.interval_us(id::HIL_ACTUATOR_CONTROLS)), (5_000, 1_000));
        assert!(streams.set(id::HIL_ACTUATOR_CONTROLS, 0, 0) && !streams.rotors());
        assert_eq!(streams.bytes_per_s(), 9_000);
        for spent in [0, 299, 300, 301, 599, 600, 601] {
            let mut streams = Streams::new(9_000);
            streams.spend(spent);
            assert_eq!(streams.has_room(), spent < 600, "{spent}");
            assert_eq!(streams.next(1_000_000).is_some(), spent < 300, "{spent}");
        }
        // Each tick adds 9 bytes, up to 300.
        let mut streams = Streams::new(9_000);
        streams.spend(300);
        (0..10).for_each(|_| streams.tick());
        streams.spend(89);
        assert!(streams.next(1_000_000).is_some());
        streams.spend(1);
        assert!(streams.next(1_000_000).is_none());
        (0..1000).for_each(|_| streams.tick());
        streams.spend(300);
        assert!(streams.next(1_000_000).is_none());
    }

    /// After a gap a stream sends one message, not all that were missed. On time it keeps its phase.
    #[test]
    fn phases_are_kept_and_gaps_are_not_made_up_for() {
        let mut streams = Streams::new(1_000_000);
        for (message, _) in DEFAULTS {
            assert!(streams.set(message, if message == id::ATTITUDE { 10_000 } else { -1 }, 0));
        }
        let mut sent = std::vec::Vec::new();
        for now_us in (0..60_000).step_by(1_000).filter(|now_us| !(25_000..47_000).contains(now_us)) {
            while streams.next(now_us).is_some() {
                sent.push(now_us);
            }
        }
        assert_eq!(sent, [4_000, 14_000, 24_000, 47_000, 57_000]);
        // A shorter interval counts at once, a longer one after the next message.
        assert!(streams.set(id::ATTITUDE, 2_000, 57_000));
        assert_eq!([58_000, 59_000, 60_000].map(|now_us| streams.next(now_us).is_some()), [false, true, false]);
    }

    /// Some messages can be requested but not streamed. A request queued with `request_first` is sent before all
    /// others.
    #[test]
    fn what_can_be_requested_is_known() {
        for message in 0..500 {
            let known = DEFAULTS.iter().any(|(other, _)| *other == message) || [0, 148, 300, 435].contains(&message);
            assert_eq!(Streams::knows(message), known, "{message}");
        }
        let mut streams = Streams::new(1_000_000);
        let [first, second] = [0, 1].map(|index| Requested { message: id::AVAILABLE_MODES, index });
        assert!(streams.request(first));
        streams.request_first(second);
        assert_eq!([streams.next(0), streams.next(0)], [Some(second), Some(first)]);
    }
}
