//! Aiding sensors: what each said last, and whether it is believed.

use nalgebra::Vector3;

/// What an aiding sensor measures. A fix of several kinds is judged kind by kind: a receiver whose position jumps may
/// still have a good velocity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Aid {
    /// Position from a tracker.
    TrackerPosition,
    /// Attitude from a tracker.
    TrackerAttitude,
    /// Horizontal position from a GNSS receiver.
    GnssPosition,
    /// Height from a GNSS receiver.
    GnssHeight,
    /// Velocity from a GNSS receiver.
    GnssVelocity,
    /// Height from a barometer.
    Height,
    /// Heading, from a magnetometer or given as such.
    Heading,
}

impl Aid {
    /// All kinds.
    pub const ALL: [Aid; 7] = [
        Aid::TrackerPosition,
        Aid::TrackerAttitude,
        Aid::GnssPosition,
        Aid::GnssHeight,
        Aid::GnssVelocity,
        Aid::Height,
        Aid::Heading,
    ];
}

/// Record of one kind of aid.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AidRecord {
    /// Normalised innovation squared of the last measurement, whether it was accepted or not: the sum over its scalars
    /// of innovation^2 / variance. Of a rejected one with three coordinates, it is a lower bound.
    pub nis: f32,
    /// Number of scalars in `nis`; its expectation.
    pub scalars: u8,
    /// Number of measurements fused, up to `u32::MAX`.
    pub accepted: u32,
    /// Number of measurements rejected by the gate, up to `u32::MAX`.
    pub rejected: u32,
    /// Time of the last measurement that was fused \[us\].
    pub accepted_us: Option<u64>,
    /// Time of the first of the measurements that were all rejected, up to now \[us\].
    pub rejected_since_us: Option<u64>,
    /// Time of the newest measurement looked at \[us\].
    pub(crate) newest_us: Option<u64>,
}

impl AidRecord {
    /// True if a measurement of the last `time_us` was fused.
    #[must_use]
    pub fn is_live(&self, now_us: u64, time_us: u64) -> bool {
        self.accepted_us.is_some_and(|at_us| now_us.saturating_sub(at_us) <= time_us)
    }

    pub(crate) fn accept(&mut self, at_us: u64) {
        self.accepted = self.accepted.saturating_add(1);
        self.accepted_us = Some(at_us);
        self.rejected_since_us = None;
    }

    /// Records a rejection, and returns the time for which there was nothing else \[us\].
    pub(crate) fn reject(&mut self, at_us: u64) -> u64 {
        self.rejected = self.rejected.saturating_add(1);
        at_us.saturating_sub(*self.rejected_since_us.get_or_insert(at_us))
    }
}

/// The pose that a tracker repeats.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Repeated {
    pose: Option<(Vector3<f32>, [f32; 4])>,
    since_us: u64,
    /// Whether what it did to the velocity has been doubted.
    pub(crate) doubted: bool,
}

impl Repeated {
    /// Returns the time for which a tracker has sent this pose, the same in every bit \[us\]; a position alone has no
    /// attitude.
    pub(crate) fn lasts_us(&mut self, position: &Vector3<f32>, attitude: &[f32; 4], at_us: u64) -> u64 {
        let pose = Some((*position, *attitude));
        if self.pose != pose {
            *self = Repeated { pose, since_us: at_us, doubted: false };
        }
        at_us.saturating_sub(self.since_us)
    }
}

/// When an aid that contradicts the state is followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Trust {
    /// While nothing else holds the state.
    Soon,
    /// After longer, since something else holds it meanwhile.
    Late,
    /// Not as long as others contradict it.
    Never,
}

/// Records of all kinds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Aids {
    /// Position from a tracker.
    pub tracker_position: AidRecord,
    /// Attitude from a tracker.
    pub tracker_attitude: AidRecord,
    /// Horizontal position from a GNSS receiver.
    pub gnss_position: AidRecord,
    /// Height from a GNSS receiver.
    pub gnss_height: AidRecord,
    /// Velocity from a GNSS receiver.
    pub gnss_velocity: AidRecord,
    /// Height from a barometer.
    pub height: AidRecord,
    /// Heading.
    pub heading: AidRecord,
}

impl Aids {
    /// Returns the record of one kind.
    #[must_use]
    pub fn of(&self, aid: Aid) -> &AidRecord {
        match aid {
            Aid::TrackerPosition => &self.tracker_position,
            Aid::TrackerAttitude => &self.tracker_attitude,
            Aid::GnssPosition => &self.gnss_position,
            Aid::GnssHeight => &self.gnss_height,
            Aid::GnssVelocity => &self.gnss_velocity,
            Aid::Height => &self.height,
            Aid::Heading => &self.heading,
        }
    }

    pub(crate) fn of_mut(&mut self, aid: Aid) -> &mut AidRecord {
        match aid {
            Aid::TrackerPosition => &mut self.tracker_position,
            Aid::TrackerAttitude => &mut self.tracker_attitude,
            Aid::GnssPosition => &mut self.gnss_position,
            Aid::GnssHeight => &mut self.gnss_height,
            Aid::GnssVelocity => &mut self.gnss_velocity,
            Aid::Height => &mut self.height,
            Aid::Heading => &mut self.heading,
        }
    }

    /// Whether an aid that was rejected for a while is to be followed, by what the others that were fused within the
    /// last `time_us` say; `fast` if a receiver's velocity was.
    pub(crate) fn trust(&self, aid: Aid, fast: bool, now_us: u64, time_us: u64) -> Trust {
        let live = |other: &AidRecord| other.is_live(now_us, time_us);
        let tracker = live(&self.tracker_position);
        let never_if = |doubts: bool, else_late: bool| match (doubts, else_late) {
            (true, _) => Trust::Never,
            (_, true) => Trust::Late,
            (false, false) => Trust::Soon,
        };
        match aid {
            Aid::TrackerPosition => never_if(live(&self.gnss_position), fast),
            Aid::GnssPosition => never_if(tracker, fast),
            // Two that know the height by different means agree that it has not changed.
            Aid::GnssHeight => never_if(tracker || fast && live(&self.height), fast),
            // Its position is off by metres: it holds the velocity, but not for long.
            Aid::GnssVelocity => never_if(tracker, live(&self.gnss_position)),
            Aid::TrackerAttitude => never_if(live(&self.heading), false),
            // Motion shows a heading: the bank of yaw filters corrects the one that the field contradicts.
            Aid::Heading => never_if(live(&self.tracker_attitude) || fast, true),
            // A reset of it sets the barometer's offset alone, which no other aid measures.
            Aid::Height => Trust::Soon,
        }
    }

    /// True if position or velocity was fused within the last `time_us`.
    #[inline]
    pub(crate) fn holds_velocity(&self, now_us: u64, time_us: u64) -> bool {
        [&self.tracker_position, &self.gnss_position, &self.gnss_velocity]
            .into_iter()
            .any(|aid| aid.is_live(now_us, time_us))
    }

    /// True if position was fused within the last `time_us`.
    #[inline]
    pub(crate) fn holds_position(&self, now_us: u64, time_us: u64) -> bool {
        [&self.tracker_position, &self.gnss_position].into_iter().any(|aid| aid.is_live(now_us, time_us))
    }
}

/// True if an innovation of this size is accepted: nu^2 <= gate^2 s in every coordinate.
pub(crate) fn passes(innovation: &Vector3<f32>, variance: &Vector3<f32>, gate_squared: f32) -> bool {
    let inside = |nu: f32, s: f32| nu * nu <= gate_squared * s;
    inside(innovation.x, variance.x) && inside(innovation.y, variance.y) && inside(innovation.z, variance.z)
}
