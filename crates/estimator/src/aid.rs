//! Records of the aiding sensors and of the gate: when each aid was fused or rejected, and when a rejected aid is
//! followed.

use nalgebra::Vector3;

/// An aid whose measurements arrive counts as ignored if none of them was fused for this time \[us\].
const IGNORED_US: u64 = 1_200_000;

/// Kind of measurement from an aiding sensor. Each kind in a fix passes its own gate: a receiver whose position jumps
/// may still measure a good velocity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum AidSource {
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
    /// Heading, from a magnetometer or measured directly.
    Heading,
}

impl AidSource {
    /// All kinds.
    pub const ALL: [AidSource; 7] = [
        AidSource::TrackerPosition,
        AidSource::TrackerAttitude,
        AidSource::GnssPosition,
        AidSource::GnssHeight,
        AidSource::GnssVelocity,
        AidSource::Height,
        AidSource::Heading,
    ];
}

/// Set of kinds of aid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AidSet(u8);

impl AidSet {
    /// Returns the set with this kind added.
    #[must_use]
    pub const fn with(self, aid: AidSource) -> Self {
        AidSet(self.0 | 1 << aid as u8)
    }

    /// Adds this kind or takes it out.
    pub(crate) fn set(&mut self, aid: AidSource, is_in: bool) {
        let bit = 1 << aid as u8;
        self.0 = if is_in { self.0 | bit } else { self.0 & !bit };
    }

    /// Returns true if this kind is in the set.
    #[must_use]
    pub const fn contains(self, aid: AidSource) -> bool {
        self.0 & 1 << aid as u8 != 0
    }
}

/// Fusion record of one kind of aid.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AidRecord {
    /// Normalised innovation squared of the last measurement, accepted or rejected: the sum of innovation^2 / variance
    /// over its scalars. For a rejected measurement of three coordinates it is a lower bound.
    pub nis: f32,
    /// Number of scalars summed in `nis`, which is also the expected value of `nis`.
    pub scalars: u8,
    /// Number of measurements fused, up to `u32::MAX`.
    pub accepted: u32,
    /// Number of measurements rejected by the gate, up to `u32::MAX`.
    pub rejected: u32,
    /// Time of the last fused measurement \[us\].
    pub accepted_us: Option<u64>,
    /// Time of the first rejection since the last accepted measurement \[us\].
    pub rejected_since_us: Option<u64>,
    /// Time of the newest measurement received \[us\].
    pub(crate) newest_us: Option<u64>,
}

impl AidRecord {
    /// Returns true if a measurement was fused within the last `time_us`.
    #[must_use]
    pub fn is_live(&self, now_us: u64, time_us: u64) -> bool {
        self.accepted_us.is_some_and(|at_us| now_us.saturating_sub(at_us) <= time_us)
    }

    pub(crate) fn accept(&mut self, at_us: u64) {
        self.accepted = self.accepted.saturating_add(1);
        self.accepted_us = Some(at_us);
        self.rejected_since_us = None;
    }

    /// Returns true if the last measurement was not fused, and none has been for [`IGNORED_US`] before the one at
    /// `at_us`. An aid that was never fused is not ignored: it has not started.
    pub(crate) fn is_ignored(&self, at_us: u64) -> bool {
        let (Some(newest_us), Some(accepted_us)) = (self.newest_us, self.accepted_us) else { return false };
        newest_us > accepted_us && at_us.saturating_sub(accepted_us) > IGNORED_US
    }

    /// Counts a rejection and returns the time since the first rejection in this row \[us\].
    pub(crate) fn reject(&mut self, at_us: u64) -> u64 {
        self.rejected = self.rejected.saturating_add(1);
        at_us.saturating_sub(*self.rejected_since_us.get_or_insert(at_us))
    }
}

/// Detector of a tracker that repeats the same pose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct FrozenPoseDetector {
    pose: Option<(Vector3<f32>, [f32; 4])>,
    since_us: u64,
    /// True once the velocity's variance was raised because of this repeated pose.
    pub(crate) doubted: bool,
}

impl FrozenPoseDetector {
    /// Returns the time for which the tracker has sent exactly this pose \[us\]. Pass zeros as `attitude` for a
    /// position without attitude.
    pub(crate) fn lasts_us(&mut self, position: &Vector3<f32>, attitude: &[f32; 4], at_us: u64) -> u64 {
        let pose = Some((*position, *attitude));
        if self.pose != pose {
            *self = FrozenPoseDetector { pose, since_us: at_us, doubted: false };
        }
        at_us.saturating_sub(self.since_us)
    }
}

/// How long an aid must contradict the state before the state is reset to that aid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ResetDelay {
    /// A short time, because no other aid holds the state.
    Soon,
    /// The aid waits for the full reacquire time, because another aid holds the state meanwhile.
    Late,
    /// The aid never resets the state while the contradicting aids are alive.
    Never,
}

/// Fusion records of all kinds of aid.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AidRecords {
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

impl AidRecords {
    /// Returns the record of this kind of aid.
    #[must_use]
    pub fn of(&self, aid: AidSource) -> &AidRecord {
        match aid {
            AidSource::TrackerPosition => &self.tracker_position,
            AidSource::TrackerAttitude => &self.tracker_attitude,
            AidSource::GnssPosition => &self.gnss_position,
            AidSource::GnssHeight => &self.gnss_height,
            AidSource::GnssVelocity => &self.gnss_velocity,
            AidSource::Height => &self.height,
            AidSource::Heading => &self.heading,
        }
    }

    pub(crate) fn of_mut(&mut self, aid: AidSource) -> &mut AidRecord {
        match aid {
            AidSource::TrackerPosition => &mut self.tracker_position,
            AidSource::TrackerAttitude => &mut self.tracker_attitude,
            AidSource::GnssPosition => &mut self.gnss_position,
            AidSource::GnssHeight => &mut self.gnss_height,
            AidSource::GnssVelocity => &mut self.gnss_velocity,
            AidSource::Height => &mut self.height,
            AidSource::Heading => &mut self.heading,
        }
    }

    /// Returns when a rejected aid is to be followed, judged by the aids that were fused within the last `time_us`.
    /// `fast` is true if a receiver's velocity was fused within that time.
    pub(crate) fn reset_delay(&self, aid: AidSource, fast: bool, now_us: u64, time_us: u64) -> ResetDelay {
        let live = |other: &AidRecord| other.is_live(now_us, time_us);
        let tracker = live(&self.tracker_position);
        let never_if = |doubts: bool, else_late: bool| match (doubts, else_late) {
            (true, _) => ResetDelay::Never,
            (_, true) => ResetDelay::Late,
            (false, false) => ResetDelay::Soon,
        };
        match aid {
            AidSource::TrackerPosition => never_if(live(&self.gnss_position), fast),
            AidSource::GnssPosition => never_if(tracker, fast),
            // Barometer and receiver velocity measure the height in different ways. If both agree with the state, the
            // height is right.
            AidSource::GnssHeight => never_if(tracker || fast && live(&self.height), fast),
            // The receiver's position is off by metres, so it holds the velocity only for a short time.
            AidSource::GnssVelocity => never_if(tracker, live(&self.gnss_position)),
            AidSource::TrackerAttitude => never_if(live(&self.heading), false),
            // Motion shows the heading: the bank of yaw filters resets a heading that contradicts the motion.
            AidSource::Heading => never_if(live(&self.tracker_attitude) || fast, true),
            // A height reset changes only the barometer's offset, which no other aid measures.
            AidSource::Height => ResetDelay::Soon,
        }
    }

    /// Returns true if a position or velocity was fused within the last `time_us`.
    #[inline]
    pub(crate) fn holds_velocity(&self, now_us: u64, time_us: u64) -> bool {
        [&self.tracker_position, &self.gnss_position, &self.gnss_velocity]
            .into_iter()
            .any(|aid| aid.is_live(now_us, time_us))
    }

    /// Returns true if a position was fused within the last `time_us`.
    #[inline]
    pub(crate) fn holds_position(&self, now_us: u64, time_us: u64) -> bool {
        [&self.tracker_position, &self.gnss_position].into_iter().any(|aid| aid.is_live(now_us, time_us))
    }
}

/// Returns true if the innovation passes the gate: nu^2 <= gate^2 s in every coordinate.
pub(crate) fn passes(innovation: &Vector3<f32>, variance: &Vector3<f32>, gate_squared: f32) -> bool {
    let inside = |nu: f32, s: f32| nu * nu <= gate_squared * s;
    inside(innovation.x, variance.x) && inside(innovation.y, variance.y) && inside(innovation.z, variance.z)
}
