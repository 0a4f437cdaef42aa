//! Finds the IMU's distance from the centre of mass in flight, and corrects its samples.
//!
//! An IMU at r from the centre of mass measures f + d omega/dt x r + omega x (omega x r), and the filter integrates the
//! velocity of the IMU, v + omega x r. A fast velocity loop turns omega x r into an attitude command. With the IMU 5 cm
//! below the centre of mass this cancels the attitude's damping, and the vehicle tumbles. On a multirotor only a lever
//! makes fast changes of the force along body x and y: the thrust is along z, and drag follows the velocity. So the
//! lever is found by least squares from forces and angular accelerations. A vehicle that begins to oscillate because of
//! the lever shows it best.
//!
//! Forces and angular accelerations pass the same filters, so their delays are equal. First a mean over two cycles of
//! eight samples with triangular weights. Then a fourth-order Butterworth low-pass at a third of the rotor frequency,
//! 15 Hz at most, because rotor vibration looks like a lever. Then a first-order high-pass at 3.3 Hz against biases,
//! wind and drag, which follows the velocity in a manoeuvre. With half that corner, drag was taken for a lever in two
//! of a hundred take-offs of the paper's vehicle in winds of up to 5.6 m/s. With 3.3 Hz and the wait below, that
//! happens in two of 1,200; at 4 Hz a vehicle with a lever oscillates for too long. Only angular accelerations above 3
//! rad/s2 count: no vibration reaches that, and a hovering vehicle finds nothing. Each axis has its own force variance,
//! estimated from the residual. The force along z is not used: the thrust changes it far more than any lever, while it
//! turns the vehicle.

use crate::measurement::ImuSample;
use afbc_control::math::{max, min, sqrt, tan};
use nalgebra::{Matrix3, Vector2, Vector3};

/// Limit for the sum of the squared rates and forces of a sample; larger samples are invalid. Every plausible sample is
/// below it, and one comparison is enough.
const SQUARES_MAX: f32 = 1.3e7;
/// Samples per cycle, each of which does a part of the work, and the duration of a cycle.
const CYCLE: u8 = 8;
const CYCLE_S: f32 = 8e-3;
/// Longest gap between two samples \[us\]. After a longer gap the filters start again.
const GAP_US: u64 = 10_000;
/// Corner of the low-pass filter: the rotor frequency divided by this factor, and at most this frequency \[rad/s\].
const BELOW_ROTORS: f32 = 3.0;
const CORNER_MAX_RAD_S: f32 = 94.0;
/// Quality factors of the Butterworth filter's sections.
const QUALITIES: [f32; 2] = [0.541_196_1, 1.306_563];
/// Number of cycles in the air before the lever is estimated, 0.3 s: rotors that speed up vibrate below the corner.
const SETTLES: u8 = 40;
/// Weight of one cycle in the slow part that the high-pass filter subtracts.
const SLOW: f32 = 0.16;
/// Squared angular acceleration above which a force is used \[rad2/s4\].
const TELLS: f32 = 9.0;
/// Standard deviation of the lever before the flight \[m\], and growth of its variance with each force \[m2\].
const BEFORE_M: f32 = 0.05;
const WALK_M2: f32 = 1e-7;
/// Initial and smallest standard deviation of a force \[m/s2\].
const FORCE_FIRST_M_S2: f32 = 0.3;
const FORCE_LEAST_M_S2: f32 = 0.1;
/// Weight of one cycle in the variance of a force.
const SHARE: f32 = 0.02;
/// Number of consecutive forces that count as one, because the filters correlate them.
const ALIKE: f32 = 5.0;
/// Gate in standard deviations: a force with a larger residual is not caused by a lever.
const GATE: f32 = 5.0;
/// The lever is used once it exceeds this many standard deviations and this length \[m\].
const SURE: f32 = 5.0;
const SURE_M: f32 = 0.01;
/// Number of forces in a row that must confirm the lever, 0.2 s of two axes: one manoeuvre is not enough.
const LASTS: f32 = 50.0;
/// Largest lever along an axis \[m\], and its largest rate of change \[m/s\].
const MOST_M: f32 = 0.2;
const CHANGES_M_S: f32 = 2.0;

/// Finds in flight how far the IMU is from the position in the vehicle file, and corrects the samples. An axis is
/// corrected only once its lever is certain: above 1 cm and five standard deviations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeverArmEstimator {
    low_pass: [BiquadSection; 2],
    lever: LeverArm,
    /// Filters, `None` before the first sample and after a gap.
    filters: Option<LeverArmFilters>,
    /// Lever that the correction uses \[m\].
    corrected_m: Vector3<f32>,
    /// Time \[us\] and rates of the last sample.
    last: Option<(u64, Vector3<f32>)>,
}

/// Estimate of the lever.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LeverArm {
    lever_m: Vector3<f32>,
    covariance: Matrix3<f32>,
    /// Variances of the forces along x and y that the lever does not explain.
    variances: Vector2<f32>,
    /// Number of forces in a row that have confirmed the lever, per axis.
    lasts: Vector3<f32>,
    /// 1 for each axis whose lever is certain, otherwise 0.
    sure: Vector3<f32>,
}

/// Band-pass filters of rates and force, in this order.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LeverArmFilters {
    /// Number of samples in this cycle.
    part: u8,
    /// Weighted sums for the triangular mean: `late` has this cycle's samples with rising weights; `sums` has the
    /// previous cycle's and this cycle's with falling weights.
    late: [Vector3<f32>; 2],
    sums: [Vector3<f32>; 2],
    /// Memories of the low-pass filter's sections.
    memories: [[[Vector3<f32>; 2]; 2]; 2],
    /// Low-pass outputs of this cycle and of the previous cycle.
    smooth: [Vector3<f32>; 2],
    before: [Vector3<f32>; 2],
    /// Number of cycles in the air so far, up to [`SETTLES`].
    settled: u8,
    /// Slow and fast parts of angular acceleration and force. The force is the residual after the lever's effect.
    slow: [Vector3<f32>; 2],
    quick: [Vector3<f32>; 2],
}

/// Section of the low-pass filter (bilinear transform), run once per cycle. b1 = 2 b0, b2 = b0.
#[derive(Clone, Copy, Debug, PartialEq)]
struct BiquadSection {
    b0: f32,
    a1: f32,
    a2: f32,
}

impl BiquadSection {
    fn new(corner_rad_s: f32, quality: f32) -> Self {
        let k = tan(0.5 * CYCLE_S * corner_rad_s);
        let norm = 1.0 / (1.0 + k / quality + k * k);
        BiquadSection { b0: k * k * norm, a1: 2.0 * (k * k - 1.0) * norm, a2: (1.0 - k / quality + k * k) * norm }
    }

    /// Returns the memory after a long constant input.
    fn settled(&self, input: &Vector3<f32>) -> [Vector3<f32>; 2] {
        [input * (1.0 - self.b0), input * (self.b0 - self.a2)]
    }

    fn pass(&self, [first, second]: &mut [Vector3<f32>; 2], input: &Vector3<f32>) -> Vector3<f32> {
        let through = input * self.b0;
        let output = through + *first;
        (*first, *second) = (through * 2.0 - output * self.a1 + *second, through - output * self.a2);
        output
    }
}

impl LeverArmEstimator {
    /// Creates the finder for a vehicle whose rotors turn at this speed in hover \[rad/s\].
    #[must_use]
    pub fn new(hover_rad_s: f32) -> Self {
        let corner_rad_s = max(1.0, min(hover_rad_s / BELOW_ROTORS, CORNER_MAX_RAD_S));
        LeverArmEstimator {
            low_pass: QUALITIES.map(|quality| BiquadSection::new(corner_rad_s, quality)),
            lever: LeverArm {
                lever_m: Vector3::zeros(),
                covariance: Matrix3::from_diagonal_element(BEFORE_M * BEFORE_M),
                variances: Vector2::repeat(FORCE_FIRST_M_S2 * FORCE_FIRST_M_S2),
                lasts: Vector3::zeros(),
                sure: Vector3::zeros(),
            },
            filters: None,
            corrected_m: Vector3::zeros(),
            last: None,
        }
    }

    /// Returns the lever that the correction uses \[m\].
    #[must_use]
    pub fn corrected_m(&self) -> Vector3<f32> {
        self.corrected_m
    }

    /// Returns the estimated lever and its standard deviations \[m\].
    #[must_use]
    pub fn found_m(&self) -> [Vector3<f32>; 2] {
        [self.lever.lever_m, self.lever.covariance.diagonal().map(|variance| sqrt(max(variance, 0.0)))]
    }

    /// Restarts the filters, for example after a jump of the force that cannot happen in flight.
    pub fn settle(&mut self) {
        self.filters = None;
    }

    /// Takes a sample in body axes and returns it corrected. The lever is estimated only in the air: on its feet a
    /// vehicle turns about them and not about the centre of mass.
    #[inline(never)]
    #[must_use]
    pub fn correct(&mut self, sample: ImuSample, in_the_air: bool) -> ImuSample {
        // A sample with NaN or a time that goes back affects no later sample.
        let squares = sample.rates_rad_s.norm_squared() + sample.specific_force_m_s2.norm_squared();
        let now = (squares < SQUARES_MAX).then_some((sample.at_us, sample.rates_rad_s));
        let since = now.and(core::mem::replace(&mut self.last, now));
        let since = since.map(|(at_us, rates)| (sample.at_us.saturating_sub(at_us), sample.rates_rad_s - rates));
        let Some((us, change)) = since.filter(|(us, _)| (1..=GAP_US).contains(us)) else {
            self.filters = None;
            return sample;
        };
        self.learn(&sample, in_the_air);
        if self.lever.sure.sum() == 0.0 {
            return sample;
        }
        self.corrected(sample, us as f32 * 1e-6, &change)
    }

    /// Returns the sample without the lever's effect. While the lever changes, its velocity omega x r changes too.
    fn corrected(&mut self, sample: ImuSample, dt_s: f32, change: &Vector3<f32>) -> ImuSample {
        let most_m = CHANGES_M_S * dt_s;
        let missing_m = self.lever.lever_m.component_mul(&self.lever.sure) - self.corrected_m;
        let step_m = missing_m.map(|part| max(-most_m, min(most_m, part)));
        self.corrected_m += step_m;
        let (omega, r, per_s) = (sample.rates_rad_s, &self.corrected_m, 1.0 / dt_s);
        let lever_m_s2 = change.cross(r) * per_s + omega.cross(&(step_m * per_s + omega.cross(r)));
        ImuSample { specific_force_m_s2: sample.specific_force_m_s2 - lever_m_s2, ..sample }
    }

    /// Does this sample's part of the work of a cycle.
    fn learn(&mut self, sample: &ImuSample, in_the_air: bool) {
        let inputs = [sample.rates_rad_s, sample.specific_force_m_s2];
        let LeverArmEstimator { low_pass, lever, filters, .. } = self;
        let filters = filters.get_or_insert_with(|| LeverArmFilters::settled(low_pass, &inputs));
        let (late, early) = (f32::from(filters.part), f32::from(CYCLE.saturating_sub(filters.part)));
        for ((input, rising), falling) in inputs.iter().zip(&mut filters.late).zip(&mut filters.sums) {
            *rising += input * late;
            *falling += input * early;
        }
        filters.part = filters.part.saturating_add(1);
        if !in_the_air {
            filters.settled = 0;
        }
        match filters.part {
            1 => filters.high_pass(&lever.lever_m),
            axis @ 2..=3 if filters.settled == SETTLES => lever.update(axis, &mut filters.quick),
            CYCLE => filters.low_pass(low_pass),
            _ => (),
        }
    }
}

impl LeverArmFilters {
    /// Returns the filters after long constant inputs.
    fn settled([first, second]: &[BiquadSection; 2], inputs: &[Vector3<f32>; 2]) -> Self {
        // The weights of the previous cycle are 0 + 1 + ... + 7.
        let weights = 0.5 * f32::from(CYCLE) * (f32::from(CYCLE) - 1.0);
        let [_, force] = *inputs;
        LeverArmFilters {
            part: 0,
            late: [Vector3::zeros(); 2],
            sums: inputs.map(|input| input * weights),
            memories: inputs.map(|input| [first.settled(&input), second.settled(&input)]),
            smooth: *inputs,
            before: *inputs,
            settled: 0,
            slow: [Vector3::zeros(), force],
            quick: [Vector3::zeros(); 2],
        }
    }

    /// Ends a cycle: runs the low-pass filter on the weighted mean.
    fn low_pass(&mut self, low_pass: &[BiquadSection; 2]) {
        self.part = 0;
        self.before = self.smooth;
        for ((sum, memories), smooth) in self.sums.iter().zip(&mut self.memories).zip(&mut self.smooth) {
            *smooth = sum * (1.0 / (f32::from(CYCLE) * f32::from(CYCLE)));
            for (section, memory) in low_pass.iter().zip(memories) {
                *smooth = section.pass(memory, smooth);
            }
        }
        (self.sums, self.late) = (self.late, [Vector3::zeros(); 2]);
        self.settled = self.settled.saturating_add(1).min(SETTLES);
    }

    /// Removes the slow parts, and subtracts the lever's effect from the force.
    fn high_pass(&mut self, r: &Vector3<f32>) {
        let [[rates, force], [rates_before, force_before]] = [self.smooth, self.before];
        // Both values are at the middle between two cycles.
        let omega = (rates + rates_before) * 0.5;
        let acceleration = (rates - rates_before) * (1.0 / CYCLE_S);
        let rest = (force + force_before) * 0.5 - acceleration.cross(r) - omega.cross(&omega.cross(r));
        for ((quick, slow), now) in self.quick.iter_mut().zip(&mut self.slow).zip([acceleration, rest]) {
            *quick = now - *slow;
            *slow += *quick * SLOW;
        }
    }
}

impl LeverArm {
    /// Updates the lever with the force along body x (sample 2 of a cycle) or y (sample 3).
    fn update(&mut self, part: u8, [acceleration, rests]: &mut [Vector3<f32>; 2]) {
        let a = *acceleration;
        // Row of the cross product a x r.
        let (row, rest, variance) = match part {
            2 => (Vector3::new(0.0, -a.z, a.y), rests.x, &mut self.variances.x),
            _ => (Vector3::new(a.z, 0.0, -a.x), rests.y, &mut self.variances.y),
        };
        let mut left = rest;
        if row.norm_squared() > TELLS {
            let p = &mut self.covariance;
            let grown = p.diagonal().map(|variance| min(variance + WALK_M2, BEFORE_M * BEFORE_M));
            p.set_diagonal(&grown);
            let of_row = *p * row;
            let expected = row.dot(&of_row) + ALIKE * *variance;
            if rest * rest < GATE * GATE * expected {
                // The term is subtracted as a square, so that the matrix stays symmetric.
                let root = of_row / sqrt(expected);
                *p -= root * root.transpose();
                let before_m = self.lever_m;
                self.lever_m = (before_m + of_row * (rest / expected)).map(|part| max(-MOST_M, min(MOST_M, part)));
                // The force along the other axis must also see the changed lever.
                let explained = a.cross(&(self.lever_m - before_m));
                *rests -= explained;
                left = if part == 2 { rests.x } else { rests.y };
                let is_sure = |m: f32, variance: f32| m * m > max(SURE * SURE * variance, SURE_M * SURE_M);
                let variances = self.covariance.diagonal();
                let now = self.lever_m.zip_map(&variances, |m, variance| f32::from(u8::from(is_sure(m, variance))));
                self.lasts = (self.lasts + now).component_mul(&now);
                self.sure = self.sure.zip_map(&self.lasts, |sure, lasts| if lasts > LASTS { 1.0 } else { sure });
            }
        }
        *variance = max(*variance + SHARE * (left * left - *variance), FORCE_LEAST_M_S2 * FORCE_LEAST_M_S2);
    }
}
