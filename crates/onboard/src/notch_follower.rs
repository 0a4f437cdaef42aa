//! The notch in the velocity that a law gets, where the rotors are.

use afbc_control::math::{max, min};
use afbc_estimator::VelocityNotch;
use afbc_types::{ROTORS_MAX, Stamped};

/// Time between two moves of the notch, at least \[us\].
const EVERY_US: u64 = 10_000;
/// Age at which a measured speed is none any more \[us\].
const STALE_US: u64 = 100_000;
/// Share by which the rotors' mean speed differs from the notch's before it moves: its gain there is 0.02.
const DIFFERS: f32 = 0.01;
/// Bounds of the notch, in speeds of the vehicle's file.
const LEAST: f32 = 0.5;
const GREATEST: f32 = 2.0;

/// Lets the [notch](VelocityNotch) stand at the mean of the measured rotor speeds: from half to twice that of the
/// vehicle's file, at which it stands while the vehicle is disarmed, and while a rotor has not been measured for 0.1 s.
#[derive(Clone, Debug, PartialEq)]
pub struct NotchFollower {
    /// The vehicle's own notch, if it has one.
    home: Option<VelocityNotch>,
    /// Where it stands.
    now_rad_s: f32,
    moved_us: u64,
}

impl NotchFollower {
    /// Creates it for a vehicle with this notch.
    #[must_use]
    pub fn new(home: Option<VelocityNotch>) -> Self {
        NotchFollower { home, now_rad_s: home.map_or(0.0, |home| home.centre_rad_s()), moved_us: 0 }
    }

    /// Goes on with another notch of the vehicle's own, which is disarmed.
    pub fn adopt(&mut self, home: Option<VelocityNotch>) {
        self.home = home;
    }

    /// Returns where the notch is to stand from the next tick on, if that is elsewhere. `speeds` are the measured ones
    /// of the vehicle's rotors \[rad/s\], with their times; it is at its own place unless it `follows` them.
    pub fn look(
        &mut self,
        now_us: u64,
        follows: bool,
        speeds: impl IntoIterator<Item = Option<Stamped<f32>>>,
    ) -> Option<VelocityNotch> {
        let home = self.home.as_ref()?;
        if now_us.saturating_sub(self.moved_us) < EVERY_US {
            return None;
        }
        let home_rad_s = home.centre_rad_s();
        let mean = mean(now_us, speeds).filter(|_| follows);
        let mut notch = *home;
        if let Some(mean_rad_s) = mean {
            // Not `clamp`, whose panic prints numbers: 24 kB of flash.
            let wanted_rad_s = max(LEAST * home_rad_s, min(mean_rad_s, GREATEST * home_rad_s));
            if (wanted_rad_s - self.now_rad_s).abs() <= DIFFERS * self.now_rad_s {
                return None;
            }
            // One that would be out of its own bounds stays where it is.
            notch = VelocityNotch::at(wanted_rad_s)?;
        }
        if notch.centre_rad_s() == self.now_rad_s {
            return None;
        }
        (self.now_rad_s, self.moved_us) = (notch.centre_rad_s(), now_us);
        Some(notch)
    }
}

/// Returns the mean of fresh speeds; none if one is not, or there are none.
fn mean(now_us: u64, speeds: impl IntoIterator<Item = Option<Stamped<f32>>>) -> Option<f32> {
    let (mut sum, mut count) = (0.0, 0.0);
    for speed in speeds.into_iter().take(ROTORS_MAX) {
        sum += speed.filter(|speed| u64::from(speed.age_us(now_us)) <= STALE_US)?.value;
        count += 1.0;
    }
    (count > 0.0).then(|| sum / count)
}
