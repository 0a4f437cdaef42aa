//! Keeps the notch filter in the law's velocity at the rotors' speed.

use afbc_control::math::{max, min};
use afbc_estimator::VelocityNotch;
use afbc_types::{ROTORS_MAX, Stamped};

/// Shortest time between two moves of the notch \[us\].
const EVERY_US: u64 = 10_000;
/// Age from which a measured speed is ignored \[us\].
const STALE_US: u64 = 100_000;
/// Relative difference between the rotors' mean speed and the notch from which it moves. The notch's gain there is
/// 0.02.
const DIFFERS: f32 = 0.01;
/// Bounds of the notch, relative to the speed in the vehicle's file.
const LEAST: f32 = 0.5;
const GREATEST: f32 = 2.0;

/// Moves the [notch](VelocityNotch) to the mean of the measured rotor speeds, within half to twice the speed in the
/// vehicle's file. The notch stays at that speed while the vehicle is disarmed, and while a rotor has not been measured
/// for 0.1 s.
#[derive(Clone, Debug, PartialEq)]
pub struct NotchFollower {
    /// The notch in the vehicle's file, if there is one.
    home: Option<VelocityNotch>,
    /// Present speed of the notch.
    now_rad_s: f32,
    moved_us: u64,
}

impl NotchFollower {
    /// Creates the follower for a vehicle with this notch.
    #[must_use]
    pub fn new(home: Option<VelocityNotch>) -> Self {
        NotchFollower { home, now_rad_s: home.map_or(0.0, |home| home.centre_rad_s()), moved_us: 0 }
    }

    /// Changes the notch in the vehicle's file. Only for a disarmed vehicle.
    pub fn adopt(&mut self, home: Option<VelocityNotch>) {
        self.home = home;
    }

    /// Returns the notch to use from the next tick on, or none if it does not move. `speeds` are the measured speeds of
    /// the vehicle's rotors \[rad/s\], with their times. If `follows` is false, the notch returns to the speed in the
    /// vehicle's file.
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
            // `clamp` is not used, because its panic message prints numbers, which would take 24 kB of flash.
            let wanted_rad_s = max(LEAST * home_rad_s, min(mean_rad_s, GREATEST * home_rad_s));
            if (wanted_rad_s - self.now_rad_s).abs() <= DIFFERS * self.now_rad_s {
                return None;
            }
            // A speed that no notch may have leaves the notch where it is.
            notch = VelocityNotch::at(wanted_rad_s)?;
        }
        if notch.centre_rad_s() == self.now_rad_s {
            return None;
        }
        (self.now_rad_s, self.moved_us) = (notch.centre_rad_s(), now_us);
        Some(notch)
    }
}

/// Returns the mean of the speeds, or none if there are none or one of them is missing or old.
fn mean(now_us: u64, speeds: impl IntoIterator<Item = Option<Stamped<f32>>>) -> Option<f32> {
    let (mut sum, mut count) = (0.0, 0.0);
    for speed in speeds.into_iter().take(ROTORS_MAX) {
        sum += speed.filter(|speed| u64::from(speed.age_us(now_us)) <= STALE_US)?.value;
        count += 1.0;
    }
    (count > 0.0).then(|| sum / count)
}
