//! What a controller shall not feel of an estimate: jumps of its corrections, and the rotors' vibration.

use crate::estimate::Estimate;
use afbc_control::math::{max, min, sqrt, tan};
use afbc_types::{Parameters, State};
use core::f32::consts::TAU;
use nalgebra::Vector3;

/// Times in which what is hidden of position and velocity decays to 1/e \[s\]: twice and once as long as a GNSS
/// receiver's fixes are apart. While corrections keep one direction, as they do where the tilt is off by a little, the
/// velocity is off by what they add up to in its time.
const POSITION_DECAY_S: f32 = 0.2;
const VELOCITY_DECAY_S: f32 = 0.1;
/// Fastest approach of position \[m/s\] and velocity \[m/s2\]: a receiver that jumps by metres must not look like a
/// gale.
const MOST_M_S: f32 = 1.0;
const MOST_M_S2: f32 = 3.0;
/// Quality of the notch: wide enough for rotors at different speeds and for a load of half the weight.
const QUALITY: f32 = 1.0;
/// Corner of the lead before the notch, over the notch's speed: above that of the paths, and so low that what is
/// quicker than the rotors grows by 15 % only.
const LEAD: f32 = 0.15;
/// Rotor speeds in hover that have a notch \[rad/s\]. Quicker rotors shake the velocity less, by the square of their
/// speed as far as a law makes an attitude of it; slower ones would take a lead of 16 ms or more.
const NOTCH_MIN_RAD_S: f32 = 10.0 * TAU;
const NOTCH_MAX_RAD_S: f32 = 100.0 * TAU;

/// Hides the jumps of position and velocity that measurements make: the state goes on as the inertial sensor says, and
/// approaches the estimate within 0.2 s (velocity 0.1 s), or at 1 m/s and 3 m/s2 from further away, as when an aid
/// comes back. A law would answer each fix with a kick. A notch removes the rotors' vibration from the velocity, which
/// a law would turn into commands of attitude and body rate. Attitude and rates pass unchanged.
///
/// The default has no notch, and is that before the first estimate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OutputFilter {
    notch: Option<VelocityNotch>,
    /// Time of the last estimate, if its position was valid \[us\]: its lower 32 bits.
    last_us: Option<u32>,
    /// Estimate less the state that was output.
    position_m: Vector3<f32>,
    velocity_m_s: Vector3<f32>,
    /// What the notch keeps, once there was a velocity.
    passed: Option<Passed>,
}

/// What a notch has kept of its inputs: a low-pass of them, for the lead, and two sums.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Passed {
    slow_m_s: Vector3<f32>,
    sums: [Vector3<f32>; 2],
}

/// Notch of second order (bilinear transform) at one kilohertz, in the velocity that a controller gets. It would delay
/// a slow change by 1/(Q omega), 5 ms on the paper's vehicle, which a law takes for a velocity that is off by as much
/// of the acceleration. A lead before it, 1 + s/(Q omega)/(1 + s/(LEAD omega)), makes up for that.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VelocityNotch {
    centre_rad_s: f32,
    /// b0 = b2.
    b0: f32,
    /// b1 = a1.
    b1: f32,
    a2: f32,
    /// Share of the way to its input that the slow value of the lead goes in a step.
    share: f32,
}

impl VelocityNotch {
    /// Creates the one at this rotor speed; none outside of 10 to 100 Hz \[rad/s\].
    #[must_use]
    pub fn at(centre_rad_s: f32) -> Option<Self> {
        (NOTCH_MIN_RAD_S..=NOTCH_MAX_RAD_S).contains(&centre_rad_s).then(|| {
            let k = tan(0.5e-3 * centre_rad_s);
            let norm = 1.0 / (1.0 + k / QUALITY + k * k);
            let (b0, b1) = ((1.0 + k * k) * norm, 2.0 * (k * k - 1.0) * norm);
            VelocityNotch { centre_rad_s, b0, b1, a2: (1.0 - k / QUALITY + k * k) * norm, share: 2.0 * k * LEAD }
        })
    }

    /// Returns the rotor speed that it removes \[rad/s\].
    #[must_use]
    pub fn centre_rad_s(&self) -> f32 {
        self.centre_rad_s
    }

    /// Changes what `from`, which it follows, has kept: for a constant velocity both sums are b0 - a2 times that
    /// velocity, which so goes on without a step.
    fn take_over(&self, from: &Self, passed: &mut Option<Passed>) {
        if let Some(Passed { sums, .. }) = passed {
            // b0 - a2 is k/Q times the norm: above zero at every speed that has a notch.
            *sums = sums.map(|sum| sum * ((self.b0 - self.a2) / (from.b0 - from.a2)));
        }
    }

    /// Filters one more value; the first one passes as it is.
    #[inline]
    fn pass(&self, passed: &mut Option<Passed>, input: &Vector3<f32>) -> Vector3<f32> {
        let VelocityNotch { b0, b1, a2, share, .. } = *self;
        let Passed { slow_m_s, sums: [first, second] } =
            passed.get_or_insert_with(|| Passed { slow_m_s: *input, sums: [input * (b0 - a2); 2] });
        let quick = input - *slow_m_s;
        *slow_m_s += quick * share;
        let led = input + quick * (LEAD / QUALITY);
        let through = led * b0;
        let output = through + *first;
        (*first, *second) = ((led - output) * b1 + *second, through - output * a2);
        output
    }
}

impl OutputFilter {
    /// Creates the one for a vehicle with these nominal parameters and this number of rotors.
    #[must_use]
    pub fn of(vehicle: &Parameters<f32>, rotors: usize) -> Self {
        Self::new(sqrt(vehicle.weight_n() / (rotors as f32 * vehicle.thrust_factor_n_s2)))
    }

    /// Creates the one for rotors that turn at this speed in hover \[rad/s\].
    fn new(hover_rad_s: f32) -> Self {
        OutputFilter { notch: VelocityNotch::at(hover_rad_s), ..OutputFilter::default() }
    }

    /// Returns the notch, if there is one.
    #[must_use]
    pub fn notch(&self) -> Option<&VelocityNotch> {
        self.notch.as_ref()
    }

    /// Moves the notch from the next step on, without a step in a constant velocity; nothing without one. Beside
    /// [`step`](Self::step), and seldom: what the sums know of the vibration is that of the old place for a period or
    /// two.
    pub fn move_notch(&mut self, to: &VelocityNotch) {
        if let Some(notch) = &mut self.notch {
            to.take_over(notch, &mut self.passed);
            *notch = *to;
        }
    }

    /// Returns the state to output for this estimate; to be called every millisecond. Nothing is hidden of an estimate
    /// whose position has not been valid before.
    #[must_use = "the state is its result"]
    #[inline]
    pub fn step(&mut self, estimate: &Estimate) -> State {
        let mut state = estimate.state;
        if !estimate.validity.position {
            *self = OutputFilter { notch: self.notch, ..OutputFilter::default() };
            return state;
        }
        if let Some(last_us) = self.last_us {
            let dt_s = (estimate.at_us as u32).wrapping_sub(last_us) as f32 * 1e-6;
            let stays = |hidden: &Vector3<f32>, decay_s: f32, most: f32| {
                // Within 0 and 1 after any time: the divisor is at least the decay, and the time at most.
                1.0 - min(dt_s, decay_s) / max(decay_s, sqrt(hidden.norm_squared()) / most)
            };
            self.position_m = self.position_m * stays(&self.position_m, POSITION_DECAY_S, MOST_M_S) + estimate.moved_m;
            self.velocity_m_s =
                self.velocity_m_s * stays(&self.velocity_m_s, VELOCITY_DECAY_S, MOST_M_S2) + estimate.moved_m_s;
        }
        self.last_us = Some(estimate.at_us as u32);
        state.position_m -= self.position_m;
        state.velocity_m_s -= self.velocity_m_s;
        if let Some(notch) = &self.notch {
            state.velocity_m_s = notch.pass(&mut self.passed, &state.velocity_m_s);
        }
        state
    }
}

#[cfg(test)]
#[allow(clippy::expect_used, reason = "a test that cannot go on should say why")]
mod tests {
    use super::{LEAD, NOTCH_MAX_RAD_S, OutputFilter, VelocityNotch};
    use crate::estimate::{Estimate, Validity};
    use afbc_types::Parameters;

    /// An estimate of a vehicle at 1 m/s whose position is off by `error_m`, and was moved by `moved_m`.
    fn estimate(ms: u64, error_m: f32, moved_m: f32) -> Estimate {
        let mut estimate = Estimate { at_us: 1000 * ms, ..Estimate::default() };
        estimate.validity = Validity { position: true, ..Validity::default() };
        estimate.state.velocity_m_s.x = 1.0;
        estimate.state.position_m.x = 1e-3 * ms as f32 + error_m;
        estimate.moved_m.x = moved_m;
        estimate
    }

    /// Largest velocity told, after eight seconds, of one that turns with 1 m/s at this speed.
    fn told(output_filter: OutputFilter, rad_s: f32) -> f32 {
        let mut output_filter = output_filter;
        let told = (0..10_000).map(|ms: u64| {
            let mut estimate = estimate(ms, 0.0, 0.0);
            estimate.state.velocity_m_s.x = (rad_s * 1e-3 * ms as f32).sin();
            output_filter.step(&estimate).velocity_m_s.x.abs()
        });
        told.skip(8_000).fold(0.0, f32::max)
    }

    #[test]
    fn a_return_is_eased_and_then_forgotten() {
        let mut output_filter = OutputFilter::default();
        for ms in 0..3000 {
            let back = ms >= 1000;
            let (error_m, moved_m) = if back { (0.0, if ms == 1000 { -0.1 } else { 0.0 }) } else { (0.1, 0.0) };
            let told = output_filter.step(&estimate(ms, error_m, moved_m)).position_m.x - 1e-3 * ms as f32;
            let expected = if back { 0.1 * (-1e-3 * (ms - 1000) as f32 / 0.2).exp() } else { 0.1 };
            assert!((told - expected).abs() < 2e-3, "{ms} ms: {told} m, not {expected} m");
        }
    }

    /// A return from far away is no gale: 1 m/s and no more.
    #[test]
    fn a_jump_of_metres_is_a_walk() {
        let mut output_filter = OutputFilter::default();
        let mut last = None;
        for ms in 0..6000 {
            let (error_m, moved_m) = if ms >= 100 { (4.0, if ms == 100 { 4.0 } else { 0.0 }) } else { (0.0, 0.0) };
            let told = output_filter.step(&estimate(ms, error_m, moved_m)).position_m.x;
            assert!(last.replace(told).is_none_or(|last| told - last < 2.01e-3), "{ms} ms: {told} m");
        }
        assert!(last.is_some_and(|last| (last - 9.999).abs() < 0.01), "{last:?}");
    }

    /// A vehicle that accelerates is told as it is.
    #[test]
    fn nothing_else_is_eased() {
        let mut output_filter = OutputFilter::default();
        for ms in 0..100 {
            let mut estimate = estimate(ms, 0.0, 0.0);
            estimate.state.velocity_m_s.z = 0.1 * ms as f32;
            assert_eq!(output_filter.step(&estimate), estimate.state);
        }
    }

    /// The first fix, and the first after the position was lost, are told at once.
    #[test]
    fn the_first_position_is_not_eased() {
        for mut output_filter in [OutputFilter::default(), OutputFilter::new(200.0)] {
            for ms in 0..100 {
                let (error_m, moved_m) = if ms < 50 { (5.0, 0.0) } else { (0.0, if ms == 50 { -5.0 } else { 0.0 }) };
                let mut estimate = estimate(ms, error_m, moved_m);
                estimate.validity.position = ms >= 50;
                let state = output_filter.step(&estimate);
                assert!((state.position_m - estimate.state.position_m).norm() < 1e-6);
                assert!((state.velocity_m_s - estimate.state.velocity_m_s).norm() < 1e-4);
            }
        }
    }

    /// Gain of the analogue notch, (omega^2 - x^2)/(omega^2 - x^2 + j x omega/Q), times that of the lead, within 2 %.
    #[test]
    fn the_notch_hides_the_rotors_and_passes_the_flight() {
        for hover_rad_s in [65.0, 195.0, 600.0_f32] {
            for ratio in [0.1, 0.2, 0.5, 0.8, 1.0, 1.25, 2.0] {
                let gain = told(OutputFilter::new(hover_rad_s), ratio * hover_rad_s);
                // As the bilinear transform bends it.
                let ratio_bent = (5e-4 * ratio * hover_rad_s).tan() / (5e-4 * hover_rad_s).tan();
                let pole = 1.0 - ratio_bent * ratio_bent;
                // 1 + LEAD/Q (1 - share z^-1/(1 - (1 - share) z^-1)), z = exp(j angle).
                let (share, angle) = (2.0 * LEAD * (5e-4 * hover_rad_s).tan(), 1e-3 * ratio * hover_rad_s);
                let (sin, cos) = angle.sin_cos();
                let denominator = (1.0 - (1.0 - share) * cos).hypot((1.0 - share) * sin);
                let (real, imaginary) = (1.0 - (1.0 - share) * cos + LEAD * (1.0 - cos), (1.0 - share + LEAD) * sin);
                let lead = real.hypot(imaginary) / denominator;
                let expected = lead * pole.abs() / pole.hypot(ratio_bent);
                assert!((gain - expected).abs() < 0.02, "{hover_rad_s} rad/s, {ratio}: {gain}, not {expected}");
            }
        }
        assert_eq!(
            OutputFilter::of(&Parameters::PAPER.to_f32(), 4),
            OutputFilter::new((0.486 * 9.81 / (4.0 * 2.984e-5_f32)).sqrt())
        );
        for hover_rad_s in [0.0, 30.0, NOTCH_MAX_RAD_S + 1.0, f32::NAN] {
            assert_eq!(OutputFilter::new(hover_rad_s), OutputFilter::default());
        }
    }

    /// A vehicle that speeds up steadily, or turns slowly, has the velocity that it is said to have.
    #[test]
    fn the_notch_delays_no_slow_change() {
        for hover_rad_s in [65.0, 195.0, 600.0] {
            let (mut ramp, mut turn) = (OutputFilter::new(hover_rad_s), OutputFilter::new(hover_rad_s));
            for ms in 0..10_000_u64 {
                let time_s = 1e-3 * ms as f32;
                let mut estimate = estimate(ms, 0.0, 0.0);
                estimate.state.velocity_m_s.x = 2.0 * time_s;
                let off_m_s = ramp.step(&estimate).velocity_m_s.x - 2.0 * time_s;
                estimate.state.velocity_m_s.x = (1.5 * time_s).sin();
                let turned_m_s = turn.step(&estimate).velocity_m_s.x - (1.5 * time_s).sin();
                if ms > 1_000 {
                    assert!(off_m_s.abs() < 1e-3, "{hover_rad_s} rad/s, {ms} ms: {off_m_s} m/s");
                    // A fifth of what the delay would make of it.
                    let most_m_s = 0.2 * 1.5 / hover_rad_s + 2e-4;
                    assert!(turned_m_s.abs() < most_m_s, "{hover_rad_s} rad/s, {ms} ms: {turned_m_s} m/s");
                }
            }
        }
    }

    /// A notch that moves with the rotors hides them as well as one that stands where they are; a constant velocity
    /// passes unchanged, however often and far it moves.
    #[test]
    fn a_notch_that_moves_follows_and_makes_no_step() {
        let (from, to) = (150.0_f32, 250.0_f32);
        let (mut filter, mut phase, mut worst) = (OutputFilter::new(from), 0.0_f32, 0.0_f32);
        for ms in 0..10_000 {
            let speed = from + (to - from) * (ms as f32 * 1e-4).min(1.0);
            phase = (phase + 1e-3 * speed) % core::f32::consts::TAU;
            if ms % 10 == 0 {
                filter.move_notch(&VelocityNotch::at(speed).expect("in range"));
            }
            let mut estimate = estimate(ms, 0.0, 0.0);
            estimate.state.velocity_m_s.x = phase.sin();
            let told = filter.step(&estimate).velocity_m_s.x;
            worst = if ms > 500 { worst.max(told.abs()) } else { 0.0 };
        }
        assert!(worst < 0.03, "{worst}");
        let stood = told(OutputFilter::new(from), to);
        assert!(stood > 0.4, "{stood}");

        let mut filter = OutputFilter::new(200.0);
        for ms in 0..5_000_u64 {
            let speed = if ms % 7 == 0 { 65.0 } else { 600.0 };
            filter.move_notch(&VelocityNotch::at(speed).expect("in range"));
            let mut estimate = estimate(ms, 0.0, 0.0);
            estimate.state.velocity_m_s.x = 5.0;
            assert!((filter.step(&estimate).velocity_m_s.x - 5.0).abs() < 1e-3, "{ms}");
        }
        let mut none = OutputFilter::default();
        none.move_notch(&VelocityNotch::at(200.0).expect("in range"));
        assert_eq!(none, OutputFilter::default());
    }
}
