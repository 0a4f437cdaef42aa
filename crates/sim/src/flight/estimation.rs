//! The vehicle's own estimate, by the [front end](EstimatorFrontEnd) that flies on board, and how good it is.

use super::sensing::{CARRIED_S, Sensing, carried};
use afbc_estimator::{Aid, Estimate, Estimator, ImuCalibration, OutputFilter};
use afbc_flight_core::{Inbox, Refusal};
use afbc_onboard::{Aged, EstimatorFrontEnd};
use afbc_plant::Truth;
use afbc_scenario::Scenario;
use afbc_types::{OutOfRange, Pose, State};
use nalgebra::{Quaternion, SMatrix, SVector, Vector3};

/// Time before t = 0 for which a vehicle stands at rest in the attitude of its start, its rotors still, while the
/// estimator levels itself, finds the gyroscope's bias and hears the other instruments \[s\].
pub const REST_S: f64 = 2.0;
/// Time by which it rests longer, at most, if the estimate is not valid then: nobody starts on none \[s\].
const WAITS_S: u32 = 5;

/// Height of a vehicle's feet at the start from which on it starts in the air \[m\].
const CLEAR_M: f64 = 0.1;

/// Steps between two evaluations of [`Estimated::nees`], which costs as much as the estimator.
const NEES_EVERY: u64 = 10;

/// An estimate against the truth of the same time. Each error is truth less estimate; rotations are about the axes of
/// the earth frame, as are their standard deviations.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimated {
    /// Error of the position \[m\].
    pub position_error_m: Vector3<f32>,
    /// Its standard deviation, as the estimator states it \[m\].
    pub position_sigma_m: Vector3<f32>,
    /// Error of the velocity \[m/s\].
    pub velocity_error_m_s: Vector3<f32>,
    /// Its standard deviation \[m/s\].
    pub velocity_sigma_m_s: Vector3<f32>,
    /// Error of the attitude, a rotation vector \[rad\].
    pub attitude_error_rad: Vector3<f32>,
    /// Its standard deviation \[rad\].
    pub attitude_sigma_rad: Vector3<f32>,
    /// Normalised estimation error squared of these nine, e^T P^-1 e: nine on the average if the estimator is
    /// consistent. That of the last multiple of 10 ms.
    pub nees: f32,
    /// True if attitude, heading, velocity and position are valid: the pilot has the state.
    pub valid: bool,
    /// The measurement that was judged in this step, if there was one.
    pub innovation: Option<Innovation>,
}

/// How a measurement agreed with the estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Innovation {
    /// What it measures.
    pub aid: Aid,
    /// Normalised innovation squared, the sum over its scalars: as many as these on the average if both are consistent.
    pub nis: f32,
    /// Number of scalars.
    pub scalars: u8,
    /// Whether it was fused; the gate rejected it otherwise.
    pub fused: bool,
}

/// Instruments and estimator of a vehicle.
#[derive(Clone)]
pub(super) struct SimulatedEstimator {
    sensing: Sensing,
    front_end: EstimatorFrontEnd,
    /// What the front end has put into it in this step.
    inbox: Inbox,
    step_s: f64,
    /// Steps since the beginning of settling, and how many of these there are before t = 0.
    steps: u64,
    settling: u64,
    /// Time of the last look \[s\], if there was one, and what it saw.
    last_s: Option<f64>,
    seen: Look,
}

/// What reaches the pilot.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Look {
    /// The state, if it is valid.
    pub(super) state: Option<State>,
    /// The state of a vehicle that knows its attitude, but not all of the rest.
    pub(super) position_lost: Option<State>,
    /// What the estimate misses for a valid state.
    pub(super) missing: Option<Refusal>,
    /// A tracker's pose, once the inertial sensor has failed.
    pub(super) pose: Option<Aged<Pose>>,
    pub(super) estimated: Estimated,
}

impl SimulatedEstimator {
    /// Creates the one of `scenario`, if it has an inertial sensor, which has settled in `truth`.
    ///
    /// # Errors
    /// The first setting out of range.
    pub(super) fn new(scenario: &Scenario, step_s: f64, truth: &Truth) -> Result<Option<Box<Self>>, OutOfRange> {
        let mut settled = None;
        for waits_s in 0..=WAITS_S {
            // Anew each time: the carrying has to end at t = 0, so a rest cannot be made longer once it is over.
            let Some(mut navigator) = Self::at_rest(scenario, step_s, f64::from(waits_s))? else { return Ok(None) };
            let is_ready = navigator.settle(truth);
            settled = Some(navigator);
            if is_ready {
                break;
            }
        }
        let feet_m = scenario.realism.contact.map_or(f64::NEG_INFINITY, |contact| contact.foot_depth_m);
        if let Some(navigator) = settled.as_mut().filter(|_| truth.position_m.z > feet_m + CLEAR_M) {
            navigator.front_end.set_clear_of_ground();
        }
        Ok(settled)
    }

    /// Creates one that will rest for `waits_s` longer than usual.
    fn at_rest(scenario: &Scenario, step_s: f64, waits_s: f64) -> Result<Option<Box<Self>>, OutOfRange> {
        let Some(sensing) = Sensing::new(scenario, step_s)? else { return Ok(None) };
        let settings = scenario.estimation(step_s);
        let filter = OutputFilter::of(&scenario.vehicle.to_f32(), scenario.rotors.len());
        let calibration = ImuCalibration::new(&scenario.mounting().to_f32());
        let front_end = EstimatorFrontEnd::new(Estimator::new(settings)?, filter, calibration);
        Ok(Some(Box::new(SimulatedEstimator {
            sensing,
            front_end: front_end.with_known_origin(),
            inbox: Inbox::EMPTY,
            step_s,
            steps: 0,
            settling: ((REST_S + waits_s + CARRIED_S) / step_s).round() as u64,
            last_s: None,
            seen: Look::default(),
        })))
    }

    /// Lets the vehicle stand at rest, and carries it to its start. True if the estimate is valid then.
    fn settle(&mut self, start: &Truth) -> bool {
        let mut is_ready = false;
        for step in 0..self.settling {
            let time_s = (step as f64 - self.settling as f64) * self.step_s;
            self.front_end.set_on_ground(time_s <= -CARRIED_S);
            let estimate = self.step(&carried(start, time_s));
            is_ready = is_valid(&estimate);
        }
        self.front_end.set_on_ground(false);
        is_ready
    }

    /// Returns what reaches the pilot, and how good it is. The same again as long as the vehicle is held.
    pub(super) fn look(&mut self, truth: &Truth) -> &Look {
        if self.last_s != Some(truth.time_s) {
            self.seen = self.see(truth);
            self.last_s = Some(truth.time_s);
        }
        &self.seen
    }

    fn see(&mut self, truth: &Truth) -> Look {
        // Before the step: a number that is larger after it counts what was judged in it.
        let judged = self.judged();
        let estimate = self.step(truth);
        let valid = is_valid(&estimate);
        let nees = if self.last_s.is_some() && !self.steps.is_multiple_of(NEES_EVERY) {
            self.seen.estimated.nees
        } else {
            self.nees(&estimate, truth) as f32
        };
        let errors = errors(&estimate, truth).cast::<f32>();
        let part = |i: usize| Vector3::from(errors.fixed_rows::<3>(i));
        let estimated = Estimated {
            attitude_error_rad: part(0),
            attitude_sigma_rad: estimate.sigmas.attitude_rad,
            velocity_error_m_s: part(3),
            velocity_sigma_m_s: estimate.sigmas.velocity_m_s,
            position_error_m: part(6),
            position_sigma_m: estimate.sigmas.position_m,
            nees,
            valid,
            innovation: self.innovation(&judged),
        };
        let now_us = clock_us(self.settling, self.step_s)(truth.time_s);
        let inbox = &self.inbox;
        let pose = inbox.pose().map(|pose| Aged { value: pose.value, age_us: pose.age_us(now_us) });
        let state = inbox.state().map(|state| state.value);
        let position_lost = inbox.position_lost().map(|state| state.value);
        Look { state, position_lost, missing: inbox.missing(), pose, estimated }
    }

    /// Returns the numbers of measurements fused and rejected, by aid.
    fn judged(&self) -> [(u32, u32); Aid::ALL.len()] {
        Aid::ALL.map(|aid| self.front_end.memory().aids().of(aid)).map(|record| (record.accepted, record.rejected))
    }

    /// Returns the measurement that was judged since these were `before`. The filter judges one in a step; if it ever
    /// were two, the first counts.
    fn innovation(&self, before: &[(u32, u32); Aid::ALL.len()]) -> Option<Innovation> {
        let (aid, (accepted, _)) = Aid::ALL.into_iter().zip(before).find(|(aid, (accepted, rejected))| {
            let record = self.front_end.memory().aids().of(*aid);
            (record.accepted, record.rejected) != (*accepted, *rejected)
        })?;
        let record = self.front_end.memory().aids().of(aid);
        let fused = record.accepted != *accepted;
        Some(Innovation { aid, nis: record.nis, scalars: record.scalars, fused })
    }

    /// Reads the instruments and runs the estimator.
    fn step(&mut self, truth: &Truth) -> Estimate {
        let at_us = clock_us(self.settling, self.step_s);
        let now_us = at_us(truth.time_s);
        let readings = self.sensing.read(truth, at_us);
        self.steps += 1;
        self.inbox = Inbox::EMPTY;
        // Nothing of the default is valid, so that nobody flies on an estimate that there is not.
        self.front_end.tick(now_us, readings, &mut self.inbox).unwrap_or_default()
    }

    /// Returns the normalised estimation error squared of rotation, velocity and position; not a number if the
    /// covariance is not positive.
    fn nees(&self, estimate: &Estimate, truth: &Truth) -> f64 {
        let rows = self.front_end.memory().covariance_of_motion();
        let at = |i: usize, j: usize| rows.get(i).and_then(|row| row.get(j)).map_or(f64::NAN, |&cell| f64::from(cell));
        // Scaled, so that units do not matter.
        let covariance = SMatrix::<f64, 9, 9>::from_fn(at);
        let scale = covariance.diagonal().map(libm::sqrt);
        let correlation = covariance.component_div(&(scale * scale.transpose()));
        let e = errors(estimate, truth).component_div(&scale);
        correlation.cholesky().map_or(f64::NAN, |factor| factor.solve(&e).dot(&e))
    }
}

/// The clock of a vehicle that settles for so many steps. It begins a step before: no time of it is zero.
fn clock_us(settling: u64, step_s: f64) -> impl Fn(f64) -> u64 {
    let begins_s = (settling as f64 + 1.0) * step_s;
    move |time_s| ((time_s + begins_s) * 1e6).round().max(0.0) as u64
}

/// True if a pilot may fly on it.
fn is_valid(estimate: &Estimate) -> bool {
    let validity = &estimate.validity;
    validity.attitude && validity.heading && validity.velocity && validity.position
}

/// Truth less estimate, in the order of the covariance: rotation about the axes of the earth frame \[rad\], velocity
/// \[m/s\], position \[m\].
fn errors(estimate: &Estimate, truth: &Truth) -> SVector<f64, 9> {
    let [w, x, y, z] = estimate.attitude.map(f64::from);
    let turn = truth.attitude * Quaternion::new(w, -x, -y, -z);
    // The shorter way round: q and -q are the same rotation.
    let turn = if turn.w < 0.0 { -turn } else { turn };
    let sine = turn.vector().norm();
    // angle/sin(angle/2), whose limit is 2.
    let per_sine = if sine > 1e-9 { 2.0 * libm::atan2(sine, turn.w) / sine } else { 2.0 };
    let mut errors = SVector::<f64, 9>::zeros();
    errors.fixed_rows_mut::<3>(0).copy_from(&(turn.vector() * per_sine));
    errors.fixed_rows_mut::<3>(3).copy_from(&(truth.velocity_m_s - estimate.state.velocity_m_s.cast()));
    errors.fixed_rows_mut::<3>(6).copy_from(&(truth.position_m - estimate.state.position_m.cast()));
    errors
}
