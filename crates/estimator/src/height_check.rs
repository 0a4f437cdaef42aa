//! Decides by the [watch over the corrections](crate::height_watch) whether a GNSS receiver's height is fused.

use crate::aid::AidSource;
use crate::estimate::count;
use crate::estimator::Estimator;
use crate::history::PastState;
use crate::horizon::ObservedQuantity;
use crate::memory::Memory;
use crate::queue::AidObservation;
use crate::rotation::identity;
use afbc_control::math::min;
use nalgebra::Vector3;

/// Usual variance of the change of a receiver's slow error within the time that the watch remembers, as a share of the
/// receiver's variance.
const CHANGES: f32 = 0.5;
/// Usual variance of the change of a barometer's drift within the time that the watch remembers \[m2\].
const DRIFTS_M2: f32 = 1.0;
/// Beyond this many standard deviations, corrections of the height show that the receiver's height is wrong. The second
/// number applies once the height has been rejected for [`REJECTED_US`].
const FAR_SIGMAS: f32 = 4.0;
const FAR_REJECTED_SIGMAS: f32 = 2.0;
const REJECTED_US: u64 = 3_000_000;
/// A doubted height is fused again once it is within this many standard deviations of the estimate.
const NEAR_SIGMAS: f32 = 2.0;
/// Time since the last fusion within which barometer and velocity count as present \[us\].
const PRESENT_US: u64 = 1_000_000;

impl Estimator {
    /// Watches the height of a receiver's fix. Returns false if barometer and vertical velocity contradict the
    /// receiver's height. The estimated height is then moved back by the distance that the receiver's height has moved
    /// it.
    #[inline(never)]
    pub(crate) fn trusts_height(
        &self,
        memory: &mut Memory,
        part: &AidObservation,
        raw: &PastState,
        at_us: u64,
        since_us: u64,
    ) -> bool {
        let ObservedQuantity::Position(fix) = &part.target else { return true };
        // The state at the time of the fix. A fix is older than the present state.
        let Some(past) = memory.history.corrected(raw, self.settings.gravity_m_s2) else { return true };
        let (mut height, climb) = (past.position.z, past.velocity.z);
        memory.height_watch.advance((height, climb, memory.height_offset), min(since_us as f32 * 1e-6, 1e3));
        let live = |aid: AidSource| memory.aids.of(aid).is_live(at_us, PRESENT_US);
        let contradicted =
            live(AidSource::GnssVelocity) && live(AidSource::Height) && !live(AidSource::TrackerPosition);
        let watch = &mut memory.height_watch;
        if !contradicted || !memory.knows.height_offset {
            watch.doubts = false;
            return true;
        }
        let rejected_us =
            memory.aids.gnss_height.rejected_since_us.map_or(0, |since_us| at_us.saturating_sub(since_us));
        let sigmas = if rejected_us > REJECTED_US { FAR_REJECTED_SIGMAS } else { FAR_SIGMAS };
        let usual = CHANGES * part.variance.z + DRIFTS_M2;
        if watch.crept() > sigmas * sigmas * usual {
            let (lifted, offset) = (watch.lifted, watch.offset);
            watch.forget();
            watch.doubts = true;
            // Unlike other resets, this reset is not passed on to the guidance. The vehicle itself has followed the
            // wrong height and has to come back.
            let by = Vector3::new(0.0, 0.0, -lifted);
            memory.nominal.move_by(&by);
            memory.height_offset -= offset;
            memory.history.correct(&identity(), &Vector3::zeros(), &Vector3::zeros(), &by);
            height -= lifted;
            count(&mut memory.resets.height);
        }
        let watch = &mut memory.height_watch;
        if watch.doubts {
            let off = fix.z - height;
            let variance = part.variance.z + memory.covariance.variances().position.z;
            watch.doubts = off * off > NEAR_SIGMAS * NEAR_SIGMAS * variance;
        }
        !watch.doubts
    }
}
