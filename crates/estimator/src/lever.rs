//! The place of the inertial sensor, as the flight shows it.
//!
//! A sensor at r from the centre of mass feels f + d omega/dt x r + omega x (omega x r), and the filter integrates the
//! velocity of the sensor, v + omega x r. A quick velocity loop makes an attitude of omega x r: with the sensor 5 cm
//! below the centre of mass that takes as much as the damping of the attitude gives, and the vehicle tumbles. On a
//! multirotor nothing but a lever makes quick changes of the force along body x and y, for the thrust is along z and
//! drag follows the velocity. So the lever is found by least squares from forces and angular accelerations, and a
//! vehicle that begins to swing because of it shows it best.
//!
//! Both pass the same filters, so that neither is late: means over two cycles of eight samples, weighted as a triangle;
//! a Butterworth low-pass filter of fourth order at a third of the rotors' frequency, 15 Hz at most, since the rotors'
//! vibration looks like a lever; and a high-pass filter of first order at 3.3 Hz, for biases, wind, and drag, which
//! follows the velocity in a manoeuvre: at half of that it was taken for a lever in two of a hundred take-offs of the
//! paper's vehicle in winds of up to 5.6 m/s, and now, with the wait below, in two of 1,200; at 4 Hz vehicles with a
//! lever swing for too long. Only what turns the vehicle with more than 3 rad/s2 counts: no vibration does, and a
//! vehicle that hovers finds nothing. The force along each axis has a variance of its own, found from what the lever
//! does not explain. That along z is not heard: the thrust changes it, by far more than any lever does, and turns the
//! vehicle while it does.

use crate::measurement::ImuSample;
use afbc_control::math::{max, min, sqrt, tan};
use nalgebra::{Matrix3, Vector2, Vector3};

/// Sum of the squares of a sample's rates and force above which it is none: above those of any that is plausible, and
/// compared in one step.
const SQUARES_MAX: f32 = 1.3e7;
/// Samples in a cycle, of which each does a part of the work, and how long they take.
const CYCLE: u8 = 8;
const CYCLE_S: f32 = 8e-3;
/// Longest time between two samples \[us\]; after a longer one the filters begin anew.
const GAP_US: u64 = 10_000;
/// Corner of the low-pass filter: below the rotors' frequency by this factor, and at most so high \[rad/s\].
const BELOW_ROTORS: f32 = 3.0;
const CORNER_MAX_RAD_S: f32 = 94.0;
/// Qualities of a Butterworth filter's sections.
const QUALITIES: [f32; 2] = [0.541_196_1, 1.306_563];
/// Cycles in the air in which the filters settle, 0.3 s: rotors that speed up shake the vehicle below the corner.
const SETTLES: u8 = 40;
/// Share of a cycle in what is slow, which is taken off.
const SLOW: f32 = 0.16;
/// Squared angular acceleration from which on a force tells anything \[rad2/s4\].
const TELLS: f32 = 9.0;
/// Standard deviation of a lever before the flight \[m\], and its variance's growth with each force \[m2\].
const BEFORE_M: f32 = 0.05;
const WALK_M2: f32 = 1e-7;
/// Standard deviation of a force at first and at least \[m/s2\].
const FORCE_FIRST_M_S2: f32 = 0.3;
const FORCE_LEAST_M_S2: f32 = 0.1;
/// Share of a cycle in the variance of a force.
const SHARE: f32 = 0.02;
/// Forces that count as one: the filters leave so many alike.
const ALIKE: f32 = 5.0;
/// Standard deviations from which on a force is none of a lever.
const GATE: f32 = 5.0;
/// A lever is sure from so many standard deviations on, and from this length on \[m\].
const SURE: f32 = 5.0;
const SURE_M: f32 = 0.01;
/// Forces in a row after each of which it must be, 0.2 s of two axes: a single manoeuvre is no evidence.
const LASTS: f32 = 50.0;
/// Largest lever along an axis \[m\], and how fast a correction changes at most \[m/s\].
const MOST_M: f32 = 0.2;
const CHANGES_M_S: f32 = 2.0;

/// Finds in flight how far the inertial sensor is from where the vehicle's file says, and corrects its samples by that.
/// It corrects nothing until it is sure: from 1 cm and five standard deviations on, each axis by itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeverFinder {
    low_pass: [Section; 2],
    lever: Lever,
    /// None before the first sample, and after a gap.
    filters: Option<Filters>,
    /// Lever by which samples are corrected \[m\].
    corrected_m: Vector3<f32>,
    /// Time \[us\] and rates of the last sample.
    last: Option<(u64, Vector3<f32>)>,
}

/// What is known of the lever.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Lever {
    lever_m: Vector3<f32>,
    covariance: Matrix3<f32>,
    /// Variances of what the forces along x and y are beside it.
    variances: Vector2<f32>,
    /// Forces in a row after each of which it was known well enough, along each axis.
    lasts: Vector3<f32>,
    /// 1 along each axis on which it is sure, or else 0.
    sure: Vector3<f32>,
}

/// Band-pass filters of rates and force, in this order.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Filters {
    /// Samples of this cycle.
    part: u8,
    /// Sums of this cycle's samples, weighted by how late in it they are; and by how early, with the others of the
    /// cycle before.
    late: [Vector3<f32>; 2],
    sums: [Vector3<f32>; 2],
    /// Memories of the low-pass filter's sections.
    memories: [[[Vector3<f32>; 2]; 2]; 2],
    /// Its outputs, and those of the cycle before.
    smooth: [Vector3<f32>; 2],
    before: [Vector3<f32>; 2],
    /// Cycles in the air so far, up to [`SETTLES`].
    settled: u8,
    /// Slow parts of angular acceleration and force, and these without them. The force is what the lever leaves.
    slow: [Vector3<f32>; 2],
    quick: [Vector3<f32>; 2],
}

/// Section of a low-pass filter (bilinear transform), once in a cycle. b1 = 2 b0, b2 = b0.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Section {
    b0: f32,
    a1: f32,
    a2: f32,
}

impl Section {
    fn new(corner_rad_s: f32, quality: f32) -> Self {
        let k = tan(0.5 * CYCLE_S * corner_rad_s);
        let norm = 1.0 / (1.0 + k / quality + k * k);
        Section { b0: k * k * norm, a1: 2.0 * (k * k - 1.0) * norm, a2: (1.0 - k / quality + k * k) * norm }
    }

    /// Returns the memory of one whose input has always been the same.
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

impl LeverFinder {
    /// Creates the one of a vehicle whose rotors turn at this speed in hover \[rad/s\].
    #[must_use]
    pub fn new(hover_rad_s: f32) -> Self {
        let corner_rad_s = max(1.0, min(hover_rad_s / BELOW_ROTORS, CORNER_MAX_RAD_S));
        LeverFinder {
            low_pass: QUALITIES.map(|quality| Section::new(corner_rad_s, quality)),
            lever: Lever {
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

    /// Returns the lever by which samples are corrected \[m\].
    #[must_use]
    pub fn corrected_m(&self) -> Vector3<f32> {
        self.corrected_m
    }

    /// Returns the lever as far as it is known, and its standard deviations \[m\].
    #[must_use]
    pub fn found_m(&self) -> [Vector3<f32>; 2] {
        [self.lever.lever_m, self.lever.covariance.diagonal().map(|variance| sqrt(max(variance, 0.0)))]
    }

    /// Lets the filters settle anew, as after a jump of the force that no flight has.
    pub fn settle(&mut self) {
        self.filters = None;
    }

    /// Takes a sample in the body's axes, and returns it corrected. It learns of one that was taken in the air only: on
    /// its feet a vehicle turns about them.
    #[inline(never)]
    #[must_use]
    pub fn correct(&mut self, sample: ImuSample, in_the_air: bool) -> ImuSample {
        // One that is no number spoils no other, and neither does a time that goes back.
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

    /// Returns a sample without what the lever adds. A lever that changes takes the velocity along, omega x r.
    fn corrected(&mut self, sample: ImuSample, dt_s: f32, change: &Vector3<f32>) -> ImuSample {
        let most_m = CHANGES_M_S * dt_s;
        let missing_m = self.lever.lever_m.component_mul(&self.lever.sure) - self.corrected_m;
        let step_m = missing_m.map(|part| max(-most_m, min(most_m, part)));
        self.corrected_m += step_m;
        let (omega, r, per_s) = (sample.rates_rad_s, &self.corrected_m, 1.0 / dt_s);
        let lever_m_s2 = change.cross(r) * per_s + omega.cross(&(step_m * per_s + omega.cross(r)));
        ImuSample { specific_force_m_s2: sample.specific_force_m_s2 - lever_m_s2, ..sample }
    }

    /// Does a sample's part of the work.
    fn learn(&mut self, sample: &ImuSample, in_the_air: bool) {
        let inputs = [sample.rates_rad_s, sample.specific_force_m_s2];
        let LeverFinder { low_pass, lever, filters, .. } = self;
        let filters = filters.get_or_insert_with(|| Filters::settled(low_pass, &inputs));
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
            axis @ 2..=3 if filters.settled == SETTLES => lever.hear(axis, &mut filters.quick),
            CYCLE => filters.low_pass(low_pass),
            _ => (),
        }
    }
}

impl Filters {
    /// Those whose inputs have always been these.
    fn settled([first, second]: &[Section; 2], inputs: &[Vector3<f32>; 2]) -> Self {
        // Of the cycle before, 0 + 1 + ... + 7 times.
        let weights = 0.5 * f32::from(CYCLE) * (f32::from(CYCLE) - 1.0);
        let [_, force] = *inputs;
        Filters {
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

    /// Ends a cycle.
    fn low_pass(&mut self, low_pass: &[Section; 2]) {
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

    /// Takes off what is slow, and of the force what this lever makes of it.
    fn high_pass(&mut self, r: &Vector3<f32>) {
        let [[rates, force], [rates_before, force_before]] = [self.smooth, self.before];
        // Both in the middle between two cycles.
        let omega = (rates + rates_before) * 0.5;
        let acceleration = (rates - rates_before) * (1.0 / CYCLE_S);
        let rest = (force + force_before) * 0.5 - acceleration.cross(r) - omega.cross(&omega.cross(r));
        for ((quick, slow), now) in self.quick.iter_mut().zip(&mut self.slow).zip([acceleration, rest]) {
            *quick = now - *slow;
            *slow += *quick * SLOW;
        }
    }
}

impl Lever {
    /// Takes the force along body x or y: parts 2 and 3 of a cycle.
    fn hear(&mut self, part: u8, [acceleration, rests]: &mut [Vector3<f32>; 2]) {
        let a = *acceleration;
        // Of a x r.
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
                // As a square, so that it stays symmetric.
                let root = of_row / sqrt(expected);
                *p -= root * root.transpose();
                let before_m = self.lever_m;
                self.lever_m = (before_m + of_row * (rest / expected)).map(|part| max(-MOST_M, min(MOST_M, part)));
                // The forces along the other axes are less its change, too.
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
