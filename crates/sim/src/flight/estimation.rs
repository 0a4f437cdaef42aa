//! The vehicle's own estimate in a simulation, made by the [front end](EstimatorFrontEnd) that flies on board, and its
//! errors.

use super::sensing::{CARRIED_S, VehicleInstruments, carried};
use afbc_estimator::{AidSource, Estimate, Estimator, ImuCalibration, OutputFilter};
use afbc_flight_core::{Inbox, Refusal};
use afbc_onboard::{Aged, EstimatorFrontEnd};
use afbc_plant::Truth;
use afbc_scenario::Scenario;
use afbc_types::{OutOfRange, Pose, State};
use nalgebra::{Quaternion, SMatrix, SVector, Vector3};

/// Time before t = 0 for which the vehicle rests in its initial attitude with its rotors still \[s\]. Meanwhile the
/// estimator levels itself, finds the gyroscope's bias and receives the other instruments.
pub const REST_S: f64 = 2.0;
/// Longest extra rest if the estimate is not valid yet at t = 0 \[s\].
const WAITS_S: u32 = 5;

/// A vehicle starts in the air if its feet are higher than this \[m\].
const CLEAR_M: f64 = 0.1;

/// Steps between two evaluations of [`EstimateErrors::nees`], which takes as long as the estimator.
const NEES_EVERY: u64 = 10;

/// Errors of an estimate: truth minus estimate at the same time. Rotations and their standard deviations are about the
/// axes of the earth frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EstimateErrors {
    /// Error of the position \[m\].
    pub position_error_m: Vector3<f32>,
    /// Standard deviation of the position, as the estimator states it \[m\].
    pub position_sigma_m: Vector3<f32>,
    /// Error of the velocity \[m/s\].
    pub velocity_error_m_s: Vector3<f32>,
    /// Standard deviation of the velocity, as the estimator states it \[m/s\].
    pub velocity_sigma_m_s: Vector3<f32>,
    /// Error of the attitude as a rotation vector \[rad\].
    pub attitude_error_rad: Vector3<f32>,
    /// Standard deviation of the attitude, as the estimator states it \[rad\].
    pub attitude_sigma_rad: Vector3<f32>,
    /// Normalised estimation error squared of the nine errors, e^T P^-1 e: nine on average if the estimator is
    /// consistent. It is evaluated every tenth step and held in between.
    pub nees: f32,
    /// True if attitude, heading, velocity and position are valid, so that the pilot has a state.
    pub valid: bool,
    /// The measurement that was fused or rejected in this step, if there was one.
    pub innovation: Option<Innovation>,
}

/// Agreement of a measurement with the estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Innovation {
    /// Kind of measurement.
    pub aid: AidSource,
    /// Normalised innovation squared, summed over the measurement's scalars. Its average equals their number if
    /// measurement and estimate are consistent.
    pub nis: f32,
    /// Number of scalars in the measurement.
    pub scalars: u8,
    /// True if the measurement was fused, false if the gate rejected it.
    pub fused: bool,
}

/// Instruments and estimator of a simulated vehicle.
#[derive(Clone)]
pub(super) struct SimulatedEstimator {
    sensing: VehicleInstruments,
    front_end: EstimatorFrontEnd,
    /// Inbox with the front end's output of this step.
    inbox: Inbox,
    step_s: f64,
    /// Number of steps since settling began, and number of settling steps before t = 0.
    steps: u64,
    settling: u64,
    /// Time of the last look \[s\], if there was one, and its result.
    last_s: Option<f64>,
    seen: EstimatorView,
}

/// The estimator's output for the pilot.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct EstimatorView {
    /// The state, if it is valid.
    pub(super) state: Option<State>,
    /// State of a vehicle whose attitude is valid, but not its position or velocity.
    pub(super) position_lost: Option<State>,
    /// Reason for which there is no valid state.
    pub(super) missing: Option<Refusal>,
    /// A tracker's pose, after the IMU has failed.
    pub(super) pose: Option<Aged<Pose>>,
    pub(super) estimated: EstimateErrors,
}

impl SimulatedEstimator {
    /// Creates the estimator of `scenario`, settled in `truth`; none if the scenario has no IMU.
    ///
    /// # Errors
    /// Returns the first setting that is out of range.
    pub(super) fn new(scenario: &Scenario, step_s: f64, truth: &Truth) -> Result<Option<Box<Self>>, OutOfRange> {
        let mut settled = None;
        for waits_s in 0..=WAITS_S {
            // Start anew with each longer rest: carrying the vehicle to its start must end at t = 0, so a finished rest
            // cannot be extended.
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

    /// Creates an unsettled estimator that will rest for `waits_s` longer than [`REST_S`].
    fn at_rest(scenario: &Scenario, step_s: f64, waits_s: f64) -> Result<Option<Box<Self>>, OutOfRange> {
        let Some(sensing) = VehicleInstruments::new(scenario, step_s)? else { return Ok(None) };
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
            seen: EstimatorView::default(),
        })))
    }

    /// Simulates the vehicle's rest and its way to its start. Returns true if the estimate is valid at the end.
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

    /// Returns the estimate for the pilot. While the vehicle is held, the result stays the same.
    pub(super) fn look(&mut self, truth: &Truth) -> &EstimatorView {
        if self.last_s != Some(truth.time_s) {
            self.seen = self.see(truth);
            self.last_s = Some(truth.time_s);
        }
        &self.seen
    }

    fn see(&mut self, truth: &Truth) -> EstimatorView {
        // The count is read before the step: a count that grows during the step shows the measurement that was judged.
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
        let estimated = EstimateErrors {
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
        EstimatorView { state, position_lost, missing: inbox.missing(), pose, estimated }
    }

    /// Returns the number of fused and of rejected measurements for each aid.
    fn judged(&self) -> [(u32, u32); AidSource::ALL.len()] {
        AidSource::ALL
            .map(|aid| self.front_end.memory().aids().of(aid))
            .map(|record| (record.accepted, record.rejected))
    }

    /// Returns the measurement that was fused or rejected since the counts `before`. The filter judges one measurement
    /// per step; of several, the first is returned.
    fn innovation(&self, before: &[(u32, u32); AidSource::ALL.len()]) -> Option<Innovation> {
        let (aid, (accepted, _)) = AidSource::ALL.into_iter().zip(before).find(|(aid, (accepted, rejected))| {
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
        // The default estimate is invalid in all parts, so nobody flies on a missing estimate.
        self.front_end.tick(now_us, readings, &mut self.inbox).unwrap_or_default()
    }

    /// Returns the normalised estimation error squared of rotation, velocity and position; NaN if the covariance is not
    /// positive definite.
    fn nees(&self, estimate: &Estimate, truth: &Truth) -> f64 {
        let rows = self.front_end.memory().covariance_of_motion();
        let at = |i: usize, j: usize| rows.get(i).and_then(|row| row.get(j)).map_or(f64::NAN, |&cell| f64::from(cell));
        // Scale to correlations, so that the units do not matter.
        let covariance = SMatrix::<f64, 9, 9>::from_fn(at);
        let scale = covariance.diagonal().map(libm::sqrt);
        let correlation = covariance.component_div(&(scale * scale.transpose()));
        let e = errors(estimate, truth).component_div(&scale);
        correlation.cholesky().map_or(f64::NAN, |factor| factor.solve(&e).dot(&e))
    }
}

/// Returns the conversion to the clock of a vehicle that settles for `settling` steps. The clock starts one step
/// earlier, so no time is zero.
fn clock_us(settling: u64, step_s: f64) -> impl Fn(f64) -> u64 {
    let begins_s = (settling as f64 + 1.0) * step_s;
    move |time_s| ((time_s + begins_s) * 1e6).round().max(0.0) as u64
}

/// Returns true if a pilot may fly on the estimate.
fn is_valid(estimate: &Estimate) -> bool {
    let validity = &estimate.validity;
    validity.attitude && validity.heading && validity.velocity && validity.position
}

/// Returns truth minus estimate in the order of the covariance: rotation about the axes of the earth frame \[rad\],
/// velocity \[m/s\], position \[m\].
fn errors(estimate: &Estimate, truth: &Truth) -> SVector<f64, 9> {
    let [w, x, y, z] = estimate.attitude.map(f64::from);
    let turn = truth.attitude * Quaternion::new(w, -x, -y, -z);
    // Take the shorter way round: q and -q are the same rotation.
    let turn = if turn.w < 0.0 { -turn } else { turn };
    let sine = turn.vector().norm();
    // angle/sin(angle/2) tends to 2 for a small angle.
    let per_sine = if sine > 1e-9 { 2.0 * libm::atan2(sine, turn.w) / sine } else { 2.0 };
    let mut errors = SVector::<f64, 9>::zeros();
    errors.fixed_rows_mut::<3>(0).copy_from(&(turn.vector() * per_sine));
    errors.fixed_rows_mut::<3>(3).copy_from(&(truth.velocity_m_s - estimate.state.velocity_m_s.cast()));
    errors.fixed_rows_mut::<3>(6).copy_from(&(truth.position_m - estimate.state.position_m.cast()));
    errors
}
