//! Announces aiding sensors that the estimator ignores in flight, and that it uses them again.

use crate::failsafes::Notice;
use afbc_estimator::{AidSet, AidSource};
use afbc_mavlink::MavSeverity;

/// An ignored sensor counts as used again after this many ticks without being ignored. A sensor that is ignored on and
/// off is thus announced once.
const USED_TICKS: u64 = 5000;

/// Texts for a kind of measurement: it is ignored, it is used again.
const fn texts(aid: AidSource) -> [&'static str; 2] {
    match aid {
        AidSource::TrackerPosition => ["tracker position disagrees with other sensors", "tracker position used again"],
        AidSource::TrackerAttitude => ["tracker attitude disagrees with other sensors", "tracker attitude used again"],
        AidSource::GnssPosition => ["GNSS position disagrees with other sensors", "GNSS position used again"],
        AidSource::GnssHeight => ["GNSS height disagrees with other sensors", "GNSS height used again"],
        AidSource::GnssVelocity => ["GNSS velocity disagrees with other sensors", "GNSS velocity used again"],
        AidSource::Height => ["barometer disagrees with other sensors", "barometer used again"],
        AidSource::Heading => ["compass disagrees with other sensors", "compass used again"],
    }
}

/// Aiding sensors that are announced as ignored.
#[derive(Default)]
pub(crate) struct IgnoredAids {
    /// Number of the last tick in which each announced kind was ignored, in the order of [`AidSource::ALL`].
    last: [Option<u64>; AidSource::ALL.len()],
    /// True if a kind may be announced as ignored.
    any: bool,
}

impl IgnoredAids {
    /// Returns the notices about sensors that are ignored or used again from the tick numbered `tick` on. On the ground
    /// nothing is announced.
    pub(crate) fn watch(&mut self, ignored: AidSet, airborne: bool, tick: u64) -> impl Iterator<Item = Notice> {
        // In most ticks there is nothing to do.
        let is_busy = self.any || airborne && ignored != AidSet::default();
        if is_busy {
            self.any = airborne && (ignored != AidSet::default() || self.last.iter().any(Option::is_some));
        }
        let watched = if is_busy { self.last.as_mut_slice() } else { &mut [] };
        watched.iter_mut().zip(AidSource::ALL).filter_map(move |(last, aid)| {
            let [contradicts, used] = texts(aid);
            match *last {
                _ if !airborne => {
                    *last = None;
                    None
                }
                None if ignored.contains(aid) => {
                    *last = Some(tick);
                    Some((MavSeverity::MAV_SEVERITY_WARNING, contradicts))
                }
                Some(_) if ignored.contains(aid) => {
                    *last = Some(tick);
                    None
                }
                Some(at) if tick.saturating_sub(at) >= USED_TICKS => {
                    *last = None;
                    Some((MavSeverity::MAV_SEVERITY_INFO, used))
                }
                _ => None,
            }
        })
    }
}
