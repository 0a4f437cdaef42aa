//! Connects the estimator to the vehicle, on board and in simulation. It selects and corrects the filter's
//! measurements, tracks contact with the ground and the local frame's origin, and passes the valid parts of the
//! estimate to the flight core.

use crate::imu_lanes::OtherSensors;
use crate::readings::{AIDS_MAX, Aged, Readings};
use crate::tick_record::{TickBefore, TickInputs};
use crate::vibration::Vibration;
use afbc_control::math::{max, min};
use afbc_estimator::{
    AidSet, Estimate, Estimator, ImuCalibration, ImuSample, InertialState, LeverArmEstimator, Measurement, Memory,
    OutputFilter, Stamped, VelocityNotch,
};
use afbc_flight_core::{Inbox, Refusal};
use afbc_types::{Mounting, Pose, PoseSigmas, SensorCalibration, State};
use nalgebra::Vector3;

/// Number of fixes averaged for the local frame's origin while the vehicle is at rest.
const FIXES: f32 = 10.0;
/// At rest, five fixes in a row that are 20 standard deviations off mean that the origin is wrong.
const ELSEWHERE: f32 = 20.0;
const MISLED: u8 = 5;
/// Change of height from which a vehicle is clear of the ground \[m\].
const CLEAR_M: f32 = 0.3;
/// Ticks with enough thrust to fly after which a vehicle counts as off the ground: three seconds.
const CARRIED: u16 = 3000;
/// Standard deviations of a tracker's pose that states none, typical for motion capture \[m, rad\].
const TRACKER: (f32, f32) = (0.003, 0.01);

/// Corrections of the vehicle's own readings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Corrections {
    imu: ImuCalibration,
    /// Offset \[uT\], diagonal and off-diagonal elements of the magnetometer's correction matrix; none if all are
    /// default.
    field: Option<[Vector3<f32>; 3]>,
}

impl Corrections {
    /// Returns the corrections for a mounting and a calibration.
    pub(crate) fn new(imu: &Mounting, calibration: &SensorCalibration) -> Self {
        let of_field = |of: &SensorCalibration| [of.mag_offset_ut, of.mag_scale, of.mag_off_diagonal];
        let field = of_field(calibration);
        Corrections {
            imu: ImuCalibration::calibrated(imu, calibration),
            field: (field != of_field(&SensorCalibration::DEFAULT)).then_some(field),
        }
    }
}

/// Tells whether a vehicle is clear of the ground. On the ground it turns about its feet, not about its centre of mass.
/// A vehicle that has never been on the ground is clear.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Clearance {
    /// True while the motors cannot carry the vehicle.
    on_ground: bool,
    /// Height at which the vehicle stood last \[m\]; none once it is clear of the ground.
    stood_m: Option<f32>,
    /// Number of ticks with enough thrust to fly, up to [`CARRIED`].
    carried: u16,
}

impl Clearance {
    #[inline]
    fn advance(&mut self, height_m: f32) {
        if self.on_ground {
            (self.stood_m, self.carried) = (Some(height_m), 0);
        } else {
            self.carried = self.carried.saturating_add(1).min(CARRIED);
            self.stood_m =
                self.stood_m.filter(|stood_m| (height_m - stood_m) * (height_m - stood_m) < CLEAR_M * CLEAR_M);
        }
    }

    fn is_clear(&self) -> bool {
        self.stood_m.is_none()
    }

    /// Returns true if the vehicle has presumably left the ground; it may hover too low to be clear.
    fn has_left(&self) -> bool {
        self.is_clear() || self.carried == CARRIED
    }
}

/// The estimator with its state, and everything between it and the vehicle. Until the first inertial sample, the
/// vehicle flies on states from the link. From then on, poses from the link, alone or in states, are measurements for
/// the estimator. While the inertial sensor has failed, poses go to the flight core's observer instead
/// ([`afbc_flight_core::observer`]).
///
/// With a tracker, the local frame is the tracker's frame. Without one, its origin is the vehicle's position at the
/// first usable GNSS fix: a fix that comes while the estimator runs and is accurate enough for a valid position. All
/// fixes are converted to the local frame. With a tracker, the conversion makes the first fix agree with the estimate.
///
/// While the vehicle is at rest, further fixes correct the origin, not the position. Otherwise their error, which
/// wanders by metres within minutes, would appear as motion. If the first fix was far off, the fifth later fix in a row
/// that is far away moves the origin to match these fixes.
#[derive(Clone, Debug)]
pub struct EstimatorFrontEnd {
    estimator: Estimator,
    memory: Memory,
    output_filter: OutputFilter,
    corrections: Corrections,
    /// Offset of the inertial sensor from its configured place, estimated in flight.
    lever: LeverArmEstimator,
    clearance: Clearance,
    /// The last sample, corrected for the mounting.
    last: Option<ImuSample>,
    vibration: Vibration,
    /// True after the first sample.
    senses: bool,
    /// True if the inertial sensor worked in the last tick.
    works: bool,
    /// Local frame's origin in the receiver's frame, from the first usable fix on \[m\].
    origin_m: Option<Vector3<f32>>,
    /// True if the receiver's frame is the local frame, independent of the fixes.
    origin_is_known: bool,
    /// Number of fixes averaged in the origin, up to [`FIXES`].
    fixes: f32,
    /// Number of fixes in a row that were far off while the vehicle was at rest.
    elsewhere: u8,
    /// Estimated position and velocity before the first fix; zero as long as no position was measured \[m, m/s\].
    told: [Vector3<f32>; 2],
    /// Estimated position of a vehicle at rest; none while it moves \[m\].
    stands_m: Option<Vector3<f32>>,
}

impl EstimatorFrontEnd {
    /// Creates the front end, for an inertial sensor with the mounting `imu` and other sensors without errors.
    pub fn new(estimator: Estimator, output_filter: OutputFilter, imu: ImuCalibration) -> Self {
        Self::corrected(estimator, output_filter, Corrections { imu, field: None })
    }

    /// Creates the front end with these corrections.
    pub(crate) fn corrected(estimator: Estimator, output_filter: OutputFilter, corrections: Corrections) -> Self {
        EstimatorFrontEnd {
            estimator,
            memory: Memory::default(),
            lever: lever_arm_estimator(&output_filter),
            clearance: Clearance::default(),
            output_filter,
            corrections,
            last: None,
            vibration: Vibration::default(),
            senses: false,
            works: true,
            origin_m: None,
            origin_is_known: false,
            fixes: 0.0,
            elsewhere: 0,
            told: [Vector3::zeros(); 2],
            stands_m: None,
        }
    }

    /// Makes the receiver's frame the local frame, as in a simulation with a known map: fixes are not converted.
    #[must_use]
    pub fn with_known_origin(self) -> Self {
        EstimatorFrontEnd { origin_is_known: true, ..self }
    }

    /// Returns the filter's state, for evaluation.
    pub fn memory(&self) -> &Memory {
        &self.memory
    }

    /// Returns the estimate of the tick at `now_us`, or none before the first sample. For logs.
    #[must_use]
    pub fn estimate(&self, now_us: u64) -> Option<Estimate> {
        self.senses.then(|| self.estimator.estimate(&self.memory, now_us))
    }

    /// Returns the local frame's origin in the receiver's frame, from the first usable fix on \[m\].
    #[must_use]
    pub fn origin_m(&self) -> Option<Vector3<f32>> {
        if self.origin_is_known { Some(Vector3::zeros()) } else { self.origin_m }
    }

    /// Returns the last tick's sample, calibrated and at the centre of mass. `inputs` are that tick's inputs.
    pub(crate) fn sample(&self, inputs: &TickInputs) -> Option<ImuSample> {
        // Without a mounting and errors to correct, no corrected sample is stored.
        inputs.readings.sample(inputs.time_us).map(|read| self.last.unwrap_or(read))
    }

    /// Returns the last tick's measurements as the estimator got them: corrected and in the local frame. Leaves out
    /// fixes before the first usable one. `readings` are that tick's readings.
    pub(crate) fn local(&self, readings: &Readings, before: &TickBefore) -> [Option<Measurement>; AIDS_MAX] {
        let mut local = readings.aids.map(|aid| aid.map(|aid| aid.value));
        for aid in &mut local {
            let stands_m = aid.as_ref().and_then(|aid| self.usable(aid)).and(before.stands_m);
            match (aid.as_mut(), &self.corrections.field) {
                (Some(Measurement::Gnss { position_m, .. }), _) if !self.origin_is_known => match self.origin_m {
                    Some(origin_m) => *position_m = stands_m.unwrap_or(*position_m - origin_m),
                    None => *aid = None,
                },
                (Some(Measurement::MagneticField { field, .. }), Some(errors)) => *field = corrected(field, errors),
                _ => (),
            }
        }
        local
    }

    /// Returns the position of a vehicle at rest, to which the next tick sets usable fixes, and true if the inertial
    /// sensor works.
    pub(crate) fn before(&self) -> (Option<Vector3<f32>>, bool) {
        (self.stands_m, self.works)
    }

    /// Returns true after the first sample.
    pub(crate) fn senses(&self) -> bool {
        self.senses
    }

    /// Returns true if the motors could not carry the vehicle in the last tick.
    pub(crate) fn is_on_ground(&self) -> bool {
        self.clearance.on_ground
    }

    /// Returns the estimate at the time of the last sample, or none before the first.
    pub fn inertial(&self) -> Option<InertialState> {
        self.memory.inertial(self.estimator.settings(), self.corrections.imu.to_body())
    }

    /// Returns the corrected measurements of the other sensors in these readings, for the check of the inertial
    /// sensors.
    pub fn other_sensors(&self, readings: &Readings) -> OtherSensors {
        let mut others = OtherSensors::default();
        for Aged { value, age_us } in readings.aids.iter().flatten() {
            match value {
                Measurement::Gnss { velocity_m_s, speed_sigma_m_s: sigma, climb_sigma_m_s, .. } => {
                    others.velocity = Some(([*velocity_m_s, Vector3::new(*sigma, *sigma, *climb_sigma_m_s)], *age_us));
                }
                Measurement::MagneticField { field, .. } => {
                    let errors = self.corrections.field.as_ref();
                    others.field = Some(errors.map_or(*field, |errors| corrected(field, errors)));
                }
                _ => (),
            }
        }
        others
    }

    /// Returns true while vibration of the accelerometer is too high.
    pub fn is_shaken(&self) -> bool {
        self.vibration.is_high()
    }

    /// Returns the aiding sensors that contradict the estimate ([`Memory::ignored`]).
    pub fn ignored(&self) -> AidSet {
        self.memory.ignored()
    }

    /// Returns the estimated offset of the inertial sensor, for evaluation.
    #[must_use]
    pub fn lever(&self) -> &LeverArmEstimator {
        &self.lever
    }

    /// Moves the notch filter for the flight core's velocity and rates, from the next tick on
    /// ([`OutputFilter::move_notch`]).
    pub fn move_notch(&mut self, to: &VelocityNotch) {
        self.output_filter.move_notch(to);
    }

    /// Returns the notch filter for the flight core's velocity and rates, if there is one.
    pub fn notch(&self) -> Option<&VelocityNotch> {
        self.output_filter.notch()
    }

    /// Sets whether the motors cannot carry the vehicle ([`Memory::set_on_ground`]).
    pub fn set_on_ground(&mut self, on_ground: bool) {
        self.memory.set_on_ground(on_ground);
        self.clearance.on_ground = on_ground;
    }

    /// Declares the vehicle to be in the air: a simulation has placed it there.
    pub fn set_clear_of_ground(&mut self) {
        self.clearance = Clearance::default();
        self.output_filter.stop_hiding();
        self.lever.settle();
    }

    /// Replaces the estimator. If the inertial sensor's mounting or a sensor's calibration changes, the estimate starts
    /// again, at rest.
    pub(crate) fn adopt(&mut self, estimator: &Estimator, output_filter: &OutputFilter, corrections: &Corrections) {
        (self.estimator, self.output_filter) = (*estimator, *output_filter);
        if self.corrections != *corrections {
            (self.corrections, self.last) = (*corrections, None);
            self.lever = lever_arm_estimator(output_filter);
            self.memory.align_again();
            self.stands_m = None;
        }
    }

    /// Runs the estimator on the readings of a tick at `now_us`, puts the result into `inbox`, and returns the
    /// estimate, or none before the first sample.
    #[inline(always)]
    pub fn tick(&mut self, now_us: u64, readings: &Readings, inbox: &mut Inbox) -> Option<Estimate> {
        let sample = readings.sample(now_us).map(|sample| {
            let at_its_place = self.corrections.imu.apply(&mut self.last, sample);
            self.lever.correct(at_its_place, self.clearance.is_clear())
        });
        self.senses |= sample.is_some();
        if let Some(sample) = &sample {
            self.vibration.take(&sample.specific_force_m_s2);
        }
        if !self.senses {
            return None;
        }
        for aid in readings.aids.iter().flatten() {
            let Some(aid) = self.localized(*aid) else { continue };
            let timed = aid.timed(now_us);
            if self.works {
                self.memory.offer(&timed);
            } else {
                leave(&timed, inbox);
            }
        }
        if let Some(Stamped { value, at_us }) = inbox.pose().filter(|_| self.works) {
            self.memory.offer(&Stamped { value: tracker_aid(value), at_us: *at_us });
            inbox.clear_pose();
        }
        let estimate = self.estimator.step(&mut self.memory, now_us, sample.as_ref());
        self.works = estimate.imu.is_usable();
        if self.origin_m.is_none() && estimate.resets.position > 0 {
            self.told = [estimate.state.position_m, estimate.state.velocity_m_s];
        }
        self.clearance.advance(estimate.state.position_m.z);
        self.stands_m = estimate.at_rest.then_some(estimate.state.position_m);
        if let Some(sample) = &sample {
            self.output_filter.update_fast_forces(
                &sample.specific_force_m_s2,
                estimate.attitude,
                self.clearance.has_left(),
            );
        }
        publish(&estimate, self.output_filter.step(&estimate), now_us, inbox);
        inbox.hand_over(self.output_filter.reset());
        Some(estimate)
    }

    /// Returns a measurement corrected and in the local frame, or none for a fix before the first usable one.
    #[inline(always)]
    fn localized(&mut self, aid: Aged<Measurement>) -> Option<Aged<Measurement>> {
        match (aid.value, &self.corrections.field) {
            (Measurement::Gnss { .. }, _) if !self.origin_is_known => self.located(aid),
            (Measurement::MagneticField { field, sigma }, Some(errors)) => {
                Some(Aged { value: Measurement::MagneticField { field: corrected(&field, errors), sigma }, ..aid })
            }
            _ => Some(aid),
        }
    }

    #[inline(never)]
    fn located(&mut self, mut aid: Aged<Measurement>) -> Option<Aged<Measurement>> {
        let sigmas_m = self.usable(&aid.value);
        let Measurement::Gnss { position_m, .. } = &mut aid.value else { return Some(aid) };
        if self.origin_m.is_none() {
            let [here_m, velocity_m_s] = self.told;
            // A fix is older than the tick: it is compared with the position at its own time.
            let there_m = here_m - velocity_m_s * (aid.age_us as f32 * 1e-6);
            self.origin_m = sigmas_m.map(|_| *position_m - there_m);
        }
        let origin_m = self.origin_m.as_mut()?;
        *position_m -= *origin_m;
        if let (Some(sigmas_m), Some(stands_m)) = (sigmas_m, self.stands_m) {
            let off_m = *position_m - stands_m;
            self.elsewhere = if off_m.amax() > ELSEWHERE * sigmas_m.amax() { self.elsewhere + 1 } else { 0 };
            if self.elsewhere == MISLED {
                // The origin came from a fix that was far off, so the average starts again.
                *origin_m += off_m;
                (self.fixes, self.elsewhere) = (1.0, 0);
            } else {
                // Limits the influence of an outlier to one standard deviation.
                let by_m = off_m.zip_map(&sigmas_m, |by_m, sigma_m| max(-sigma_m, min(by_m, sigma_m)));
                self.fixes = (self.fixes + 1.0).min(FIXES);
                *origin_m += by_m / self.fixes;
            }
            *position_m = stands_m;
        }
        Some(aid)
    }

    /// Returns the standard deviations of a usable fix \[m\], or none for an unusable one.
    fn usable(&self, fix: &Measurement) -> Option<Vector3<f32>> {
        let Measurement::Gnss { horizontal_sigma_m, vertical_sigma_m, .. } = *fix else { return None };
        let sigma_max_m = self.estimator.settings().position_sigma_max_m;
        let is_good = horizontal_sigma_m <= sigma_max_m && vertical_sigma_m <= sigma_max_m;
        let sigmas_m = Vector3::new(horizontal_sigma_m, horizontal_sigma_m, vertical_sigma_m);
        (self.memory.runs() && is_good && fix.is_plausible()).then_some(sigmas_m)
    }
}

/// Returns the estimator for rotors at the notch's speed. Without a notch, the rotors count as fast.
fn lever_arm_estimator(output_filter: &OutputFilter) -> LeverArmEstimator {
    LeverArmEstimator::new(output_filter.notch().map_or(f32::MAX, VelocityNotch::centre_rad_s))
}

/// Returns a magnetometer's reading without its errors \[uT\].
#[inline(never)]
fn corrected(read_ut: &Vector3<f32>, errors: &[Vector3<f32>; 3]) -> Vector3<f32> {
    let [mag_offset_ut, mag_scale, mag_off_diagonal] = *errors;
    SensorCalibration { mag_offset_ut, mag_scale, mag_off_diagonal, ..SensorCalibration::DEFAULT }.field(read_ut)
}

/// Passes a tracker's pose to the flight core.
#[cold]
#[inline(never)]
fn leave(timed: &Stamped<Measurement>, inbox: &mut Inbox) {
    if let Some(value) = pose(&timed.value) {
        inbox.put_pose(Stamped { value, at_us: timed.at_us });
    }
}

/// Puts the filtered `state` of an `estimate` into `inbox`, as far as it is valid. Without a valid attitude, after a
/// failure of the inertial sensor, the state from the link remains.
#[inline(always)]
fn publish(estimate: &Estimate, state: State, now_us: u64, inbox: &mut Inbox) {
    let stamped = Stamped { value: state, at_us: now_us };
    let validity = &estimate.validity;
    // The first missing part is reported as the reason. Without a heading, for example, no position can be held.
    let missing = match (validity.attitude, validity.heading, validity.velocity && validity.position) {
        (true, true, true) => None,
        (false, ..) => Some(Refusal::AttitudeUnknown),
        (_, false, _) => Some(Refusal::HeadingUnknown),
        _ => Some(Refusal::PositionUnknown),
    };
    match missing {
        None => inbox.locate(stamped),
        Some(missing) => inbox.put_position_lost(Some(stamped).filter(|_| validity.attitude), missing),
    }
}

/// Returns the pose in a measurement, if it is one.
fn pose(measurement: &Measurement) -> Option<Pose> {
    let Measurement::Pose { position_m, attitude, position_sigma_m, attitude_sigma_rad } = *measurement else {
        return None;
    };
    let sigmas = PoseSigmas { position_m: Some(position_sigma_m), attitude_rad: Some(attitude_sigma_rad) };
    Some(Pose { position_m, attitude, sigmas })
}

/// Converts a tracker's pose to a measurement for the estimator.
#[must_use]
pub fn tracker_aid(pose: &Pose) -> Measurement {
    let (position_sigma_m, attitude_sigma_rad) = TRACKER;
    Measurement::Pose {
        position_m: pose.position_m,
        attitude: pose.attitude,
        position_sigma_m: pose.sigmas.position_m.unwrap_or(position_sigma_m),
        attitude_sigma_rad: pose.sigmas.attitude_rad.unwrap_or(attitude_sigma_rad),
    }
}
