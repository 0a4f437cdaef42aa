//! Measures the accelerometer's vibration as PX4 does, so that PX4's limits apply.

use nalgebra::Vector3;

/// Number of samples in one mean: 5 ms.
const SAMPLES: u8 = 5;
/// Weight of the newest change in the vibration level.
const SHARE: f32 = 0.01;
/// Level above which vibration is too high, the end of the green range in PX4's Flight Review, and level below which it
/// is acceptable again \[m/s2\].
pub const HIGH_M_S2: f32 = 4.905;
const FINE_M_S2: f32 = 4.0;
/// Number of 5 ms means for which the level must be too high. A landing also shakes the vehicle, but only briefly.
const LASTS: u8 = 200;

/// Vibration level: mean length of the change between two 5 ms means, like PX4's `accel_vibration_metric`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Vibration {
    sum_m_s2: Vector3<f32>,
    samples: u8,
    last_m_s2: Option<Vector3<f32>>,
    level_m_s2: f32,
    above: u8,
    high: bool,
}

impl Vibration {
    /// Takes a sample of the specific force, one per millisecond.
    #[inline]
    pub(crate) fn take(&mut self, force_m_s2: &Vector3<f32>) {
        self.sum_m_s2 += force_m_s2;
        self.samples += 1;
        if self.samples == SAMPLES {
            self.judge();
        }
    }

    #[inline(never)]
    fn judge(&mut self) {
        let mean_m_s2 = self.sum_m_s2 * (1.0 / f32::from(SAMPLES));
        (self.sum_m_s2, self.samples) = (Vector3::zeros(), 0);
        let Some(last_m_s2) = self.last_m_s2.replace(mean_m_s2) else { return };
        let change_m_s2 = afbc_control::math::sqrt((mean_m_s2 - last_m_s2).norm_squared());
        self.level_m_s2 += SHARE * (change_m_s2 - self.level_m_s2);
        self.above = if self.level_m_s2 > HIGH_M_S2 { self.above.saturating_add(1).min(LASTS) } else { 0 };
        self.high = self.above == LASTS || self.high && self.level_m_s2 > FINE_M_S2;
    }

    /// Returns true while vibration is too high.
    pub(crate) fn is_high(&self) -> bool {
        self.high
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::{FINE_M_S2, HIGH_M_S2, Vibration};
    use nalgebra::Vector3;

    /// Applies a vibration of this amplitude and frequency along one axis for `ms` milliseconds. Returns the level.
    fn shaken(vibration: &mut Vibration, amplitude_m_s2: f32, hz: f32, ms: usize) -> f32 {
        for tick in 0..ms {
            let x = amplitude_m_s2 * (core::f32::consts::TAU * hz * 1e-3 * tick as f32).sin();
            vibration.take(&Vector3::new(x, 0.0, 9.81));
        }
        vibration.level_m_s2
    }

    /// The level is the mean of |2 sin(pi f T) sinc(f T) A sin|, T = 5 ms.
    #[test]
    fn the_level_is_px4s() {
        for hz in [7.0_f32, 33.0, 61.0] {
            let angle = core::f32::consts::PI * hz * 5e-3;
            let of_mean = angle.sin() / (5.0 * (angle / 5.0).sin());
            let expected = 10.0 * 2.0 * angle.sin() * of_mean * core::f32::consts::FRAC_2_PI;
            let level = shaken(&mut Vibration::default(), 10.0, hz, 5000);
            assert!((level / expected - 1.0).abs() < 0.05, "{hz} Hz: {level}, not {expected}");
        }
    }

    #[test]
    fn a_second_above_counts_and_a_bump_does_not() {
        let mut vibration = Vibration::default();
        let level = shaken(&mut vibration, 7.3, 33.0, 5000);
        assert!(level > FINE_M_S2 && level < HIGH_M_S2 && !vibration.is_high(), "{level}");
        shaken(&mut vibration, 200.0, 33.0, 50);
        shaken(&mut vibration, 0.0, 33.0, 900);
        assert!(!vibration.is_high());
        shaken(&mut vibration, 9.0, 33.0, 3000);
        assert!(vibration.is_high());
        shaken(&mut vibration, 7.3, 33.0, 5000);
        assert!(vibration.is_high(), "until it is fine");
        shaken(&mut vibration, 1.0, 33.0, 5000);
        assert!(!vibration.is_high());
    }
}
