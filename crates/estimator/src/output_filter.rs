//! Output filter: hides correction jumps and rotor vibration of the estimate from a controller.

use crate::estimate::{Estimate, Resets};
use afbc_control::math::{max, min, sqrt, tan, wrap_angle};
use afbc_types::{Parameters, ResetDelta, State};
use core::f32::consts::TAU;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Decay times (to 1/e) of the hidden offsets of position and velocity \[s\]: twice and once the period of a GNSS
/// receiver's fixes. While corrections keep one sign, as with a small tilt error, the output velocity is off by the sum
/// of the corrections within its decay time.
const POSITION_DECAY_S: f32 = 0.2;
const VELOCITY_DECAY_S: f32 = 0.1;
/// Largest decay rates of position \[m/s\] and velocity \[m/s2\], so that a receiver that jumps by metres does not look
/// like a gale.
const MOST_M_S: f32 = 1.0;
const MOST_M_S2: f32 = 3.0;
/// Quality factor of the notch: wide enough for rotors at different speeds and for a payload of half the weight.
const QUALITY: f32 = 1.0;
/// Corner frequency of the lead before the notch, divided by the notch frequency. It is above the frequencies of flown
/// paths, and so low that signals faster than the rotors grow by only 15 %.
const LEAD: f32 = 0.15;
/// Range of hover rotor speeds that get a notch \[rad/s\]. Faster rotors shake the velocity less: their effect on a
/// controller's attitude command falls with the square of the speed. Slower rotors would need a lead of 16 ms or more.
const NOTCH_MIN_RAD_S: f32 = 10.0 * TAU;
const NOTCH_MAX_RAD_S: f32 = 100.0 * TAU;

/// Time constant for hiding forces along body x and y at take-off \[s\], step time of a millisecond, and change of the
/// hidden share per step: it rises on the ground and falls in the air.
const FORCED_S: f32 = 0.4;
const STEP_S: f32 = 1e-3;
const UNHIDES: f32 = 1e-3;
/// Squared specific force above which something supports the vehicle: half of gravity \[m2/s4\].
const BORNE: f32 = 24.0;

/// Velocity caused by fast forces along body x and y: F/m times (T s/(1 + T s))^2/s, T = 0.4 s.
///
/// On its feet a vehicle cannot find the IMU's lever ([`crate::LeverArmEstimator`]), but the lever may make it tumble
/// at take-off. In the air only a lever makes such fast forces, so a controller need not see the velocity they cause;
/// but hiding it would delay the reaction to a gust. So the forces are hidden once the vehicle has stood for a second,
/// and no longer once it has been in the air for a second. A vehicle that is dropped before its motors turn has not
/// stood.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct FastForceVelocity {
    /// Slow part of the force, in body axes \[m/s2\].
    slow_m_s2: Vector3<f32>,
    /// Velocity caused by the fast forces, earth frame \[m/s\].
    velocity_m_s: Vector3<f32>,
    /// Hidden share, 0 to 1.
    share: f32,
}

/// Hides the jumps of position and velocity that measurements make: a controller would answer each fix with a kick. The
/// output follows the IMU and approaches the estimate within 0.2 s (velocity 0.1 s), or at 1 m/s and 3 m/s2 after
/// larger jumps, as when an aid comes back. A notch removes the rotors' vibration from the velocity, which a controller
/// would turn into commands of attitude and body rate. Attitude and rates pass unchanged.
///
/// After a position reset ([`Estimate::resets`]) a vehicle would fly by the jump. A filter that [hands resets
/// over](Self::handing_over) does not hide resets but reports them, and the source of the setpoints shifts the
/// setpoints in the same step.
///
/// The default has no notch and hides all jumps, and is the state before the first estimate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OutputFilter {
    notch: Option<VelocityNotch>,
    /// Time of the last estimate if its position was valid \[us\]: the lower 32 bits.
    last_us: Option<u32>,
    /// Estimate minus the output state.
    position_m: Vector3<f32>,
    velocity_m_s: Vector3<f32>,
    /// Memory of the notch, `None` before the first velocity.
    passed: Option<NotchMemory>,
    /// True if resets are handed over.
    hands_over: bool,
    /// Reset counts and yaw of the last estimate.
    last: Option<LastResets>,
    /// Reset that the last step found.
    reset: Option<ResetDelta>,
    forced: FastForceVelocity,
}

/// Reset counts and yaw of an estimate, to detect a reset in the next estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LastResets {
    positions: u32,
    headings: u32,
    yaw_rad: f32,
}

/// Memory of a notch: a low-pass of its input for the lead, and two sums.
#[derive(Clone, Copy, Debug, PartialEq)]
struct NotchMemory {
    slow_m_s: Vector3<f32>,
    sums: [Vector3<f32>; 2],
}

/// Second-order notch (bilinear transform) at one kilohertz on the velocity for the controller. Alone it would delay a
/// slow change by 1/(Q omega), 5 ms on the paper's vehicle, which a controller would see as a velocity error
/// proportional to the acceleration. A lead before it, 1 + s/(Q omega)/(1 + s/(LEAD omega)), cancels this delay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VelocityNotch {
    centre_rad_s: f32,
    /// b0 = b2.
    b0: f32,
    /// b1 = a1.
    b1: f32,
    a2: f32,
    /// Weight of a step in the low-pass of the lead.
    share: f32,
}

impl VelocityNotch {
    /// Creates a notch at this rotor speed \[rad/s\], `None` outside of 10 to 100 Hz.
    #[must_use]
    pub fn at(centre_rad_s: f32) -> Option<Self> {
        (NOTCH_MIN_RAD_S..=NOTCH_MAX_RAD_S).contains(&centre_rad_s).then(|| {
            let k = tan(0.5e-3 * centre_rad_s);
            let norm = 1.0 / (1.0 + k / QUALITY + k * k);
            let (b0, b1) = ((1.0 + k * k) * norm, 2.0 * (k * k - 1.0) * norm);
            VelocityNotch { centre_rad_s, b0, b1, a2: (1.0 - k / QUALITY + k * k) * norm, share: 2.0 * k * LEAD }
        })
    }

    /// Returns the rotor speed that the notch removes \[rad/s\].
    #[must_use]
    pub fn centre_rad_s(&self) -> f32 {
        self.centre_rad_s
    }

    /// Converts the memory of the previous notch `from`. For a constant velocity both sums are (b0 - a2) times the
    /// velocity, so a constant velocity passes without a step.
    fn take_over(&self, from: &Self, passed: &mut Option<NotchMemory>) {
        if let Some(NotchMemory { sums, .. }) = passed {
            // b0 - a2 is proportional to k/Q and above zero at every permitted speed.
            *sums = sums.map(|sum| sum * ((self.b0 - self.a2) / (from.b0 - from.a2)));
        }
    }

    /// Filters the next value. The first one passes unchanged.
    #[inline]
    fn pass(&self, passed: &mut Option<NotchMemory>, input: &Vector3<f32>) -> Vector3<f32> {
        let VelocityNotch { b0, b1, a2, share, .. } = *self;
        let NotchMemory { slow_m_s, sums: [first, second] } =
            passed.get_or_insert_with(|| NotchMemory { slow_m_s: *input, sums: [input * (b0 - a2); 2] });
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
    /// Creates the filter for a vehicle with these nominal parameters and number of rotors.
    #[must_use]
    pub fn of(vehicle: &Parameters<f32>, rotors: usize) -> Self {
        Self::new(sqrt(vehicle.weight_n() / (rotors as f32 * vehicle.thrust_factor_n_s2)))
    }

    /// Creates the filter for rotors that turn at this speed in hover \[rad/s\].
    fn new(hover_rad_s: f32) -> Self {
        OutputFilter { notch: VelocityNotch::at(hover_rad_s), ..OutputFilter::default() }
    }

    /// Returns this filter with resets handed over ([`reset`](Self::reset)) instead of hidden.
    #[must_use]
    pub fn handing_over(self) -> Self {
        OutputFilter { hands_over: true, ..self }
    }

    /// Returns the reset of position and heading in the last step, `None` without a reset or if this filter does not
    /// hand resets over.
    #[must_use]
    pub fn reset(&self) -> Option<&ResetDelta> {
        self.reset.as_ref()
    }

    /// Returns the notch, if there is one.
    #[must_use]
    pub fn notch(&self) -> Option<&VelocityNotch> {
        self.notch.as_ref()
    }

    /// Moves the notch from the next step on; does nothing without a notch. A constant velocity passes without a step.
    /// Call it seldom and outside of [`step`](Self::step): for a period or two the memory still belongs to the old
    /// frequency.
    pub fn move_notch(&mut self, to: &VelocityNotch) {
        if let Some(notch) = &mut self.notch {
            to.take_over(notch, &mut self.passed);
            *notch = *to;
        }
    }

    /// Takes the specific force and the attitude of a sample; call it before [`step`](Self::step). Once the vehicle has
    /// stood, this hides the velocity caused by forces along body x and y.
    pub fn update_fast_forces(&mut self, specific_force_m_s2: &Vector3<f32>, [w, x, y, z]: [f32; 4], in_the_air: bool) {
        let FastForceVelocity { slow_m_s2, velocity_m_s, share } = &mut self.forced;
        let stands = !in_the_air && specific_force_m_s2.norm_squared() > BORNE;
        *share = if stands { min(*share + UNHIDES, 1.0) } else { max(*share - UNHIDES, 0.0) };
        if *share > 0.0 && specific_force_m_s2.norm_squared().is_finite() {
            let lateral_m_s2 = Vector3::new(specific_force_m_s2.x, specific_force_m_s2.y, 0.0);
            let quick_m_s2 = lateral_m_s2 - *slow_m_s2;
            *slow_m_s2 += quick_m_s2 * (STEP_S / FORCED_S);
            let to_earth = UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z));
            *velocity_m_s += to_earth * quick_m_s2 * STEP_S - *velocity_m_s * (STEP_S / FORCED_S);
        }
    }

    /// Stops hiding forces.
    pub fn stop_hiding(&mut self) {
        self.forced = FastForceVelocity::default();
    }

    /// Returns the state to output for this estimate; call it every millisecond. Nothing is hidden in the first
    /// estimate with a valid position.
    #[must_use = "the state is its result"]
    #[inline]
    pub fn step(&mut self, estimate: &Estimate) -> State {
        let mut state = estimate.state;
        self.reset = None;
        if self.hands_over {
            self.detect_resets(estimate);
        }
        if !estimate.validity.position {
            let OutputFilter { notch, hands_over, last, reset, forced, .. } = *self;
            *self = OutputFilter { notch, hands_over, last, reset, forced, ..OutputFilter::default() };
            return state;
        }
        // A reset that is handed over is not hidden as well.
        let moved_m = estimate.moved_m - self.reset.map_or(Vector3::zeros(), |reset| reset.position_m);
        if let Some(last_us) = self.last_us {
            let dt_s = (estimate.at_us as u32).wrapping_sub(last_us) as f32 * 1e-6;
            let stays = |hidden: &Vector3<f32>, decay_s: f32, most: f32| {
                // Within 0 and 1 for any time step: the divisor is at least `decay_s`, and the numerator at most
                // `decay_s`.
                1.0 - min(dt_s, decay_s) / max(decay_s, sqrt(hidden.norm_squared()) / most)
            };
            self.position_m = self.position_m * stays(&self.position_m, POSITION_DECAY_S, MOST_M_S) + moved_m;
            self.velocity_m_s =
                self.velocity_m_s * stays(&self.velocity_m_s, VELOCITY_DECAY_S, MOST_M_S2) + estimate.moved_m_s;
        }
        self.last_us = Some(estimate.at_us as u32);
        state.position_m -= self.position_m;
        state.velocity_m_s -= self.velocity_m_s + self.forced.velocity_m_s * self.forced.share;
        if let Some(notch) = &self.notch {
            state.velocity_m_s = notch.pass(&mut self.passed, &state.velocity_m_s);
        }
        state
    }

    /// Detects resets since the last estimate.
    #[inline]
    fn detect_resets(&mut self, estimate: &Estimate) {
        let Resets { position, heading, .. } = estimate.resets;
        let now = LastResets { positions: position, headings: heading, yaw_rad: estimate.state.attitude_rad.z };
        if let Some(last) = self.last.replace(now)
            && (last.positions, last.headings) != (position, heading)
        {
            // Includes the vehicle's own turn within the millisecond: a hundredth of a radian at most.
            let yaw_rad = if last.headings == heading { 0.0 } else { wrap_angle(now.yaw_rad - last.yaw_rad) };
            let position_m = if last.positions == position { Vector3::zeros() } else { estimate.moved_m };
            self.reset = Some(ResetDelta { position_m, yaw_rad });
        }
    }
}

#[cfg(test)]
#[allow(clippy::expect_used, reason = "a test that cannot go on should say why")]
mod tests {
    use super::{LEAD, NOTCH_MAX_RAD_S, OutputFilter, VelocityNotch};
    use crate::estimate::{Estimate, Validity};
    use afbc_types::{Parameters, ResetDelta};
    use nalgebra::Vector3;

    /// Returns an estimate of a vehicle at 1 m/s whose position is off by `error_m` and was moved by `moved_m` in this
    /// step.
    fn estimate(ms: u64, error_m: f32, moved_m: f32) -> Estimate {
        let mut estimate = Estimate { at_us: 1000 * ms, ..Estimate::default() };
        estimate.validity = Validity { position: true, ..Validity::default() };
        estimate.state.velocity_m_s.x = 1.0;
        estimate.state.position_m.x = 1e-3 * ms as f32 + error_m;
        estimate.moved_m.x = moved_m;
        estimate
    }

    /// Returns the largest output velocity after eight seconds, for an input of 1 m/s that oscillates at `rad_s`.
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

    /// A jump of metres decays at 1 m/s and no faster.
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

    /// A reset passes at once and exactly, and is reported with its size. An offset that was already hidden keeps
    /// decaying.
    #[test]
    fn what_is_handed_over_is_not_hidden() {
        for hands_over in [true, false] {
            let filter = OutputFilter::new(200.0);
            let mut filter = if hands_over { filter.handing_over() } else { filter };
            let mut last = None;
            for ms in 0..3000 {
                let mut estimate = estimate(ms, 0.0, 0.0);
                // The estimate makes a correction, then a position reset, then a heading reset across the half turn.
                let jumps = [(1000, 0.1), (1050, -40.0)];
                estimate.state.position_m.x += jumps.iter().filter(|(at, _)| ms >= *at).map(|(_, by)| by).sum::<f32>();
                estimate.moved_m.x = jumps.iter().filter(|(at, _)| ms == *at).map(|(_, by)| by).sum();
                estimate.resets.position = 3 + u32::from(ms >= 1050);
                estimate.state.attitude_rad.z = if ms >= 1100 { -3.0 } else { 3.0 };
                estimate.resets.heading = u32::from(ms >= 1100);
                let told_m = filter.step(&estimate).position_m.x;
                let expected = match ms {
                    1050 if hands_over => Some(ResetDelta { position_m: Vector3::x() * -40.0, yaw_rad: 0.0 }),
                    1100 if hands_over => {
                        let yaw_rad = core::f32::consts::TAU - 6.0;
                        Some(ResetDelta { position_m: Vector3::zeros(), yaw_rad })
                    }
                    _ => None,
                };
                let off = |reset: &ResetDelta, expected: &ResetDelta| {
                    (reset.position_m - expected.position_m).norm() + (reset.yaw_rad - expected.yaw_rad).abs()
                };
                let fits = match (filter.reset(), &expected) {
                    (Some(reset), Some(expected)) => off(reset, expected) < 1e-5,
                    (reset, expected) => reset.is_none() && expected.is_none(),
                };
                assert!(fits, "{ms} ms: {:?}", filter.reset());
                let by_m = expected.map_or(0.0, |reset| reset.position_m.x);
                if let Some(last_m) = last.replace(told_m) {
                    let step_m: f32 = told_m - last_m - by_m;
                    assert!(step_m.abs() < 2.1e-3, "{hands_over}, {ms} ms: {step_m} m");
                }
            }
        }
    }

    /// Resets without a valid position are reported too: a descent holds heading and height.
    #[test]
    fn resets_without_a_position_are_handed_over_too() {
        let mut filter = OutputFilter::default().handing_over();
        for ms in 0..100 {
            let mut estimate = estimate(ms, 0.0, if ms == 50 { -5.0 } else { 0.0 });
            estimate.validity.position = ms > 50;
            estimate.resets.position = u32::from(ms >= 50);
            let state = filter.step(&estimate);
            assert_eq!(state.position_m, estimate.state.position_m, "{ms} ms: nothing is hidden");
            assert_eq!(filter.reset().map(|reset| reset.position_m.x), (ms == 50).then_some(-5.0), "{ms} ms");
        }
    }

    /// An acceleration passes unchanged.
    #[test]
    fn nothing_else_is_eased() {
        let mut output_filter = OutputFilter::default();
        for ms in 0..100 {
            let mut estimate = estimate(ms, 0.0, 0.0);
            estimate.state.velocity_m_s.z = 0.1 * ms as f32;
            assert_eq!(output_filter.step(&estimate), estimate.state);
        }
    }

    /// A vehicle that leaves the ground and oscillates because its IMU is below the centre of mass: the output has a
    /// quarter of that velocity at first, and all of it a second later. A force that stays is in the output within two
    /// seconds.
    #[test]
    fn a_lever_is_hidden_at_take_off() {
        let mut output_filter = OutputFilter::default();
        let level = [1.0, 0.0, 0.0, 0.0];
        let mut told = |ms: u64, swings: bool, in_the_air: bool| {
            let (time_s, rad_s) = (1e-3 * ms as f32, 27.0_f32);
            let (speed, force) =
                if swings { ((rad_s * time_s).sin(), rad_s * (rad_s * time_s).cos()) } else { (time_s, 1.0) };
            output_filter.update_fast_forces(&Vector3::new(force, 0.0, 9.81), level, in_the_air);
            let mut estimate = estimate(ms, 0.0, 0.0);
            estimate.state.velocity_m_s.x = speed;
            (output_filter.step(&estimate).velocity_m_s.x, speed)
        };
        let mut largest = [0.0_f32; 2];
        for ms in 0..10_000 {
            let (told, _) = told(ms, true, ms > 5_000);
            let part = match ms {
                3_000..=5_000 => 0,
                8_000.. => 1,
                _ => continue,
            };
            if let Some(largest) = largest.get_mut(part) {
                *largest = largest.max(told.abs());
            }
        }
        assert!(largest[0] < 0.27 && (largest[1] - 1.0).abs() < 0.01, "{largest:?}");
        for ms in 10_000..14_000 {
            let (told, speed) = told(ms, false, false);
            assert!(ms < 13_000 || (told - speed).abs() < 0.02, "{ms} ms: {told}, not {speed}");
        }
    }

    /// The first valid position, and the first after a loss, pass at once.
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

    /// The gain is the product of the analogue notch's gain, (omega^2 - x^2)/(omega^2 - x^2 + j x omega/Q), and the
    /// lead's gain, within 2 %.
    #[test]
    fn the_notch_hides_the_rotors_and_passes_the_flight() {
        for hover_rad_s in [65.0, 195.0, 600.0_f32] {
            for ratio in [0.1, 0.2, 0.5, 0.8, 1.0, 1.25, 2.0] {
                let gain = told(OutputFilter::new(hover_rad_s), ratio * hover_rad_s);
                // The bilinear transform warps the frequency ratio.
                let ratio_bent = (5e-4 * ratio * hover_rad_s).tan() / (5e-4 * hover_rad_s).tan();
                let pole = 1.0 - ratio_bent * ratio_bent;
                // Gain of the lead: 1 + LEAD/Q (1 - share z^-1/(1 - (1 - share) z^-1)), z = exp(j angle).
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

    /// A steady acceleration or a slow oscillation passes with the right velocity.
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
                    // The bound is a fifth of the error that the delay would make without compensation.
                    let most_m_s = 0.2 * 1.5 / hover_rad_s + 2e-4;
                    assert!(turned_m_s.abs() < most_m_s, "{hover_rad_s} rad/s, {ms} ms: {turned_m_s} m/s");
                }
            }
        }
    }

    /// A notch that follows the rotor speed removes the vibration as well as a fixed one. A constant velocity passes
    /// unchanged, however often and far the notch moves.
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
