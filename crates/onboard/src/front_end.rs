//! What stands around the filter, on board and in simulation: which readings it gets when, the inertial sensor's
//! mounting, the ground, the local frame's origin, and what of the estimate reaches the flight core.

use crate::imu_lanes::OtherSensors;
use crate::readings::{AIDS_MAX, Aged, Readings};
use crate::tick_record::{TickBefore, TickInputs};
use crate::vibration::Vibration;
use afbc_control::math::{max, min};
use afbc_estimator::{
    Estimate, Estimator, ImuCalibration, ImuSample, Inertial, LeverFinder, Measurement, Memory, OutputFilter, Stamped,
    VelocityNotch,
};
use afbc_flight_core::{Inbox, Refusal};
use afbc_types::{Mounting, Pose, PoseSigmas, SensorCalibration, State};
use nalgebra::Vector3;

/// Number of fixes whose mean the local frame's origin is, at rest.
const FIXES: f32 = 10.0;
/// Fixes so many standard deviations off, of a vehicle at rest, and so many in a row, tell that its origin is wrong.
const ELSEWHERE: f32 = 20.0;
const MISLED: u8 = 5;
/// How far above or below where it stood a vehicle is clear of the ground \[m\].
const CLEAR_M: f32 = 0.3;
/// Ticks after which a vehicle that its motors can carry has left the ground: three seconds.
const CARRIED: u16 = 3000;
/// Standard deviations of a tracker's pose that does not say how good it is: a motion-capture system's \[m, rad\].
const TRACKER: (f32, f32) = (0.003, 0.01);

/// What is corrected of a vehicle's own readings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Corrections {
    imu: ImuCalibration,
    /// Offset \[uT\], diagonal and off-diagonal of the magnetometer's matrix, if it has errors.
    field: Option<[Vector3<f32>; 3]>,
}

impl Corrections {
    /// What follows from a mounting and a calibration.
    pub(crate) fn new(imu: &Mounting, calibration: &SensorCalibration) -> Self {
        let of_field = |of: &SensorCalibration| [of.mag_offset_ut, of.mag_scale, of.mag_off_diagonal];
        let field = of_field(calibration);
        Corrections {
            imu: ImuCalibration::calibrated(imu, calibration),
            field: (field != of_field(&SensorCalibration::DEFAULT)).then_some(field),
        }
    }
}

/// Whether a vehicle is clear of the ground, on whose feet it turns about these and not about its centre of mass. One
/// that has never been on the ground is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Clearance {
    /// True while the motors cannot carry it.
    on_ground: bool,
    /// Height at which it stands or has stood \[m\]; none from when it is clear of that on.
    stood_m: Option<f32>,
    /// Ticks for which the motors could carry it, up to [`CARRIED`].
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

    /// True if it has left the ground, as far as anybody knows: it may hover below what is clear.
    fn has_left(&self) -> bool {
        self.is_clear() || self.carried == CARRIED
    }
}

/// Estimator and memory of a vehicle. Until its first sample of an inertial sensor, the vehicle flies on the states
/// that come over the link; from then on their poses, and poses that come alone, are measurements like others. While
/// the inertial sensor has failed, poses are left to the flight core ([`afbc_flight_core::observer`]).
///
/// The local frame is that of the tracker's poses. Where there is none, its origin is where the vehicle stands at the
/// first usable fix of its GNSS receiver: one that comes when the estimator runs, and is good enough for a valid
/// position. All fixes are told in that frame; with a tracker, so that the first one agrees with the estimate. While
/// the vehicle is at rest, further fixes tell where the origin is, not where the vehicle is: their error wanders by
/// metres within minutes, which would be a motion of a vehicle that stands. If the first was wild, the fifth in a row
/// that is far from it moves the origin to where they are.
#[derive(Clone, Debug)]
pub struct EstimatorFrontEnd {
    estimator: Estimator,
    memory: Memory,
    output_filter: OutputFilter,
    corrections: Corrections,
    /// What the mounting does not say of the inertial sensor's place, and whether the flight shows it.
    lever: LeverFinder,
    clearance: Clearance,
    /// The last sample as corrected for the mounting.
    last: Option<ImuSample>,
    vibration: Vibration,
    /// True if there has been a sample.
    senses: bool,
    /// True if the inertial sensor worked in the last tick.
    works: bool,
    /// The local frame's origin in the receiver's frame, from the first usable fix on \[m\].
    origin_m: Option<Vector3<f32>>,
    /// True if the receiver's frame is the local one, whatever the fixes say.
    origin_is_known: bool,
    /// Number of fixes that have told it, up to [`FIXES`].
    fixes: f32,
    /// Number of fixes in a row that are elsewhere, of a vehicle at rest.
    elsewhere: u8,
    /// Estimated position and velocity until then, zero as long as nobody has told a position \[m, m/s\].
    told: [Vector3<f32>; 2],
    /// Estimated position of a vehicle at rest \[m\].
    stands_m: Option<Vector3<f32>>,
}

impl EstimatorFrontEnd {
    /// Creates it with nothing read, for an inertial sensor that is mounted as `imu` says, and other sensors without
    /// errors.
    pub fn new(estimator: Estimator, output_filter: OutputFilter, imu: ImuCalibration) -> Self {
        Self::corrected(estimator, output_filter, Corrections { imu, field: None })
    }

    /// The same with these corrections.
    pub(crate) fn corrected(estimator: Estimator, output_filter: OutputFilter, corrections: Corrections) -> Self {
        EstimatorFrontEnd {
            estimator,
            memory: Memory::default(),
            lever: lever_finder(&output_filter),
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

    /// The same in a world whose map is the local frame: fixes are taken as they are.
    #[must_use]
    pub fn with_known_origin(self) -> Self {
        EstimatorFrontEnd { origin_is_known: true, ..self }
    }

    /// Returns what the filter knows, for whoever judges it.
    pub fn memory(&self) -> &Memory {
        &self.memory
    }

    /// Returns the estimate after a tick at `now_us`, as that tick had it; none before the first sample. For logs.
    #[must_use]
    pub fn estimate(&self, now_us: u64) -> Option<Estimate> {
        self.senses.then(|| self.estimator.estimate(&self.memory, now_us))
    }

    /// Returns the local frame's origin in the receiver's frame, from the first usable fix on \[m\].
    #[must_use]
    pub fn origin_m(&self) -> Option<Vector3<f32>> {
        if self.origin_is_known { Some(Vector3::zeros()) } else { self.origin_m }
    }

    /// Returns the sample of the last tick, which took these inputs, calibrated and at the centre of mass.
    pub(crate) fn sample(&self, inputs: &TickInputs) -> Option<ImuSample> {
        // A sensor without mounting and errors leaves no corrected one.
        inputs.readings.sample(inputs.time_us).map(|read| self.last.unwrap_or(read))
    }

    /// Returns the measurements of the last tick, which had these readings, as it took them: corrected and in the local
    /// frame; none of a fix before a usable one.
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

    /// Returns where a vehicle at rest stands, by which the next tick takes fixes, and whether the estimator is offered
    /// what that tick reads once there is a sample.
    pub(crate) fn before(&self) -> (Option<Vector3<f32>>, bool) {
        (self.stands_m, self.works)
    }

    /// True once there was a sample.
    pub(crate) fn senses(&self) -> bool {
        self.senses
    }

    /// True if the motors could not carry the vehicle in the last tick.
    pub(crate) fn is_on_ground(&self) -> bool {
        self.clearance.on_ground
    }

    /// Returns what the estimate is at the time of the last sample, once there is one.
    pub fn inertial(&self) -> Option<Inertial> {
        self.memory.inertial(self.estimator.settings(), self.corrections.imu.to_body())
    }

    /// Returns what is measured beside the inertial sensor in a tick with these readings, corrected.
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

    /// True while the accelerometer is shaken more than is acceptable.
    pub fn is_shaken(&self) -> bool {
        self.vibration.is_high()
    }

    /// Returns what the flight has shown of the inertial sensor's place, for whoever judges it.
    #[must_use]
    pub fn lever(&self) -> &LeverFinder {
        &self.lever
    }

    /// Moves the output's notch from the next tick on ([`OutputFilter::move_notch`]).
    pub fn move_notch(&mut self, to: &VelocityNotch) {
        self.output_filter.move_notch(to);
    }

    /// Returns the output's notch, if there is one.
    pub fn notch(&self) -> Option<&VelocityNotch> {
        self.output_filter.notch()
    }

    /// Sets whether the motors cannot carry the vehicle ([`Memory::set_on_ground`]).
    pub fn set_on_ground(&mut self, on_ground: bool) {
        self.memory.set_on_ground(on_ground);
        self.clearance.on_ground = on_ground;
    }

    /// Tells that the vehicle is in the air, wherever it stood before: a simulation carries it there.
    pub fn set_clear_of_ground(&mut self) {
        self.clearance = Clearance::default();
        self.output_filter.unhide();
        self.lever.settle();
    }

    /// Goes on with another estimator. If the inertial sensor is mounted otherwise, or a sensor is corrected otherwise,
    /// the estimate starts again, from rest.
    pub(crate) fn adopt(&mut self, estimator: &Estimator, output_filter: &OutputFilter, corrections: &Corrections) {
        (self.estimator, self.output_filter) = (*estimator, *output_filter);
        if self.corrections != *corrections {
            (self.corrections, self.last) = (*corrections, None);
            self.lever = lever_finder(output_filter);
            self.memory.align_again();
            self.stands_m = None;
        }
    }

    /// Takes the readings of a tick at `now_us`, puts what the vehicle knows into `inbox`, and returns the estimate;
    /// none before the first sample.
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
            self.output_filter.feel(&sample.specific_force_m_s2, estimate.attitude, self.clearance.has_left());
        }
        publish(&estimate, self.output_filter.step(&estimate), now_us, inbox);
        inbox.hand_over(self.output_filter.reset());
        Some(estimate)
    }

    /// Returns a measurement corrected and in the local frame; none for a fix before a usable one.
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
            // A fix is of some time ago: it belongs to where the vehicle was then.
            let there_m = here_m - velocity_m_s * (aid.age_us as f32 * 1e-6);
            self.origin_m = sigmas_m.map(|_| *position_m - there_m);
        }
        let origin_m = self.origin_m.as_mut()?;
        *position_m -= *origin_m;
        if let (Some(sigmas_m), Some(stands_m)) = (sigmas_m, self.stands_m) {
            let off_m = *position_m - stands_m;
            self.elsewhere = if off_m.amax() > ELSEWHERE * sigmas_m.amax() { self.elsewhere + 1 } else { 0 };
            if self.elsewhere == MISLED {
                // The origin was that of a wild one.
                *origin_m += off_m;
                (self.fixes, self.elsewhere) = (1.0, 0);
            } else {
                // A wild one moves it no more than others.
                let by_m = off_m.zip_map(&sigmas_m, |by_m, sigma_m| max(-sigma_m, min(by_m, sigma_m)));
                self.fixes = (self.fixes + 1.0).min(FIXES);
                *origin_m += by_m / self.fixes;
            }
            *position_m = stands_m;
        }
        Some(aid)
    }

    /// Returns the standard deviations of a usable fix \[m\].
    fn usable(&self, fix: &Measurement) -> Option<Vector3<f32>> {
        let Measurement::Gnss { horizontal_sigma_m, vertical_sigma_m, .. } = *fix else { return None };
        let sigma_max_m = self.estimator.settings().position_sigma_max_m;
        let is_good = horizontal_sigma_m <= sigma_max_m && vertical_sigma_m <= sigma_max_m;
        let sigmas_m = Vector3::new(horizontal_sigma_m, horizontal_sigma_m, vertical_sigma_m);
        (self.memory.runs() && is_good && fix.is_plausible()).then_some(sigmas_m)
    }
}

/// Returns the finder for the rotors that the filter's notch is for; without one they are quick.
fn lever_finder(output_filter: &OutputFilter) -> LeverFinder {
    LeverFinder::new(output_filter.notch().map_or(f32::MAX, VelocityNotch::centre_rad_s))
}

/// Returns a magnetometer's reading without its errors \[uT\].
#[inline(never)]
fn corrected(read_ut: &Vector3<f32>, errors: &[Vector3<f32>; 3]) -> Vector3<f32> {
    let [mag_offset_ut, mag_scale, mag_off_diagonal] = *errors;
    SensorCalibration { mag_offset_ut, mag_scale, mag_off_diagonal, ..SensorCalibration::DEFAULT }.field(read_ut)
}

/// Leaves a tracker's pose to the flight core.
#[cold]
#[inline(never)]
fn leave(timed: &Stamped<Measurement>, inbox: &mut Inbox) {
    if let Some(value) = pose(&timed.value) {
        inbox.put_pose(Stamped { value, at_us: timed.at_us });
    }
}

/// Puts the filtered `state` of an `estimate` into `inbox` as far as it is valid. The link's state stands only
/// while the estimate has no attitude: after the inertial sensor has failed.
#[inline(always)]
fn publish(estimate: &Estimate, state: State, now_us: u64, inbox: &mut Inbox) {
    let stamped = Stamped { value: state, at_us: now_us };
    let validity = &estimate.validity;
    // The first that is missing is why: without a heading, for one, no position can be held.
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

/// Returns the pose that a measurement is, if it is one.
fn pose(measurement: &Measurement) -> Option<Pose> {
    let Measurement::Pose { position_m, attitude, position_sigma_m, attitude_sigma_rad } = *measurement else {
        return None;
    };
    let sigmas = PoseSigmas { position_m: Some(position_sigma_m), attitude_rad: Some(attitude_sigma_rad) };
    Some(Pose { position_m, attitude, sigmas })
}

/// Returns the measurement that the estimator makes of a tracker's pose.
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
