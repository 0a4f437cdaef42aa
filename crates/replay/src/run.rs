//! Runs the estimator on a recording.

use crate::compare::{Figures, rotation_between};
use crate::recording::{LoggedState, Recording};
use afbc_estimator::{
    AidRecords, DroppedMeasurements, Estimate, Estimator, ImuHealth, Memory, Resets, Settings, Sigmas, Unready,
};
use afbc_types::{OutOfRange, State};
use nalgebra::{Quaternion, Vector3};

/// Time between two steps \[us\].
const STEP_US: u64 = 1_000;
/// The estimator goes on stepping without samples for this long after a sample \[us\]: nothing changes later.
const WAIT_US: u64 = 400_000;
/// Nothing is compared across a gap in our estimate that is longer than this \[us\].
const GAP_US: u64 = 50_000;
/// Time between two rows if the log has no estimate \[us\].
const GRID_US: u64 = 20_000;
/// Estimates are compared from this long after the start on, or from the middle of the remaining log if that is sooner
/// \[s\].
const SETTLED_S: f64 = 10.0;
/// A vehicle at rest starts in the log's state if the estimator has not started by itself after this time \[us\].
const PATIENT_US: u64 = 5_000_000;
/// Above this speed the vehicle counts as flying, if the log has no landed flag \[m/s\].
const FLIES_M_S: f32 = 1.0;
/// If the log's position is further than this from ours, its unstated origin is not the first fix \[m\].
const ELSEWHERE_M: f32 = 10.0;
/// Largest age of a logged state from which the estimator is started \[us\].
const FRESH_US: u64 = 200_000;

/// How the estimator started.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EstimatorStart {
    /// The estimator started by itself, at rest, at this time of the recording \[s\].
    AtRest(f64),
    /// The estimator started in the log's state at this time of the recording \[s\]. The reason is set if the estimator
    /// did not start by itself at rest; it is none if the vehicle was in the air.
    FromLog(f64, Option<Unready>),
    /// The estimator did not start.
    Never(Unready),
}

/// Our estimate and the log's at one time.
#[derive(Clone, Copy, Debug)]
pub struct ReplayRow {
    /// Time from the recording's first sample on \[s\].
    pub time_s: f64,
    /// Our estimate, interpolated between two IMU samples; none before the start and in gaps.
    pub ours: Option<Estimate>,
    /// The log's estimate.
    pub logged: LoggedState,
}

impl ReplayRow {
    /// Returns the rotation from our attitude to the log's, about the axes of the earth frame \[rad\].
    #[must_use]
    pub fn rotation_rad(&self) -> Option<Vector3<f64>> {
        Some(rotation_between(&self.logged.attitude?, &self.ours?.attitude))
    }
}

/// Result of running the estimator on a recording.
#[derive(Clone, Debug)]
pub struct Replayed {
    /// Our estimate and the log's over time.
    pub rows: Vec<ReplayRow>,
    /// Differences between both estimates from [`from_s`](Self::from_s) on.
    pub figures: Figures,
    /// Time from which estimates are compared: ten seconds after the start, or half of the remaining log if that is
    /// less, unless the caller chose it \[s\].
    pub from_s: f64,
    /// Shift of the log's positions to agree with ours at `from_s`, if the log does not state its origin \[m\].
    pub moved_m: Option<Vector3<f32>>,
    /// How the estimator started.
    pub start: EstimatorStart,
    /// Statistics of the fused measurements.
    pub aids: AidRecords,
    /// Statistics of the measurements that were dropped before fusion.
    pub dropped: DroppedMeasurements,
    /// Resets of our estimate.
    pub resets: Resets,
    /// Health of the IMU at the end.
    pub imu: ImuHealth,
}

/// Runs the estimator on a recording. Estimates are compared from `from_s` on; its default is described at
/// [`Replayed::from_s`].
///
/// # Errors
/// Returns the setting that is out of range.
pub fn fly(recording: &Recording, from_s: Option<f64>) -> Result<Replayed, OutOfRange> {
    let flown = recording.settings.unwrap_or(Settings {
        declination_rad: recording.declination_rad,
        // EKF2 knows only white noise of a receiver.
        gnss_noise_m: Settings::GNSS_NOISE.range.max as f32,
        ..Settings::DEFAULT
    });
    let settings = Settings { mag_slow_rad: recording.mag_slow_rad.unwrap_or(flown.mag_slow_rad), ..flown };
    let first_us = recording.imu.first().map_or(0, |sample| sample.at_us);
    let mut run = EstimatorRun {
        estimator: Estimator::new(settings)?,
        memory: Memory::default(),
        recording,
        first_us,
        arrived: 0,
        start: EstimatorStart::Never(Unready::NoImu),
    };
    let duration_s = recording.duration_s();
    let settled_s = |began_s: f64| began_s + SETTLED_S.min(0.5 * (duration_s - began_s));
    let grid;
    let states = if recording.states.is_empty() {
        let last_us = recording.imu.last().map_or(0, |sample| sample.at_us);
        let times = (first_us..=last_us).step_by(GRID_US as usize);
        grid = times.map(|at_us| LoggedState { at_us, ..LoggedState::default() }).collect::<Vec<_>>();
        &grid
    } else {
        &recording.states
    };
    let mut states = states.iter().skip_while(|state| state.at_us < first_us).peekable();
    let mut rows = Vec::new();
    let (mut before, mut now_us, mut sampled_us) = (Estimate::default(), first_us, first_us);
    for sample in &recording.imu {
        while now_us + STEP_US < sample.at_us && now_us < sampled_us + WAIT_US {
            now_us += STEP_US;
            run.step(now_us, None);
        }
        (now_us, sampled_us) = (sample.at_us, sample.at_us);
        let now = run.step(now_us, Some(sample));
        while let Some(logged) = states.next_if(|state| state.at_us <= now_us) {
            let time_s = (logged.at_us - first_us) as f64 * 1e-6;
            rows.push(ReplayRow { time_s, ours: between(&before, &now, logged.at_us), logged: *logged });
        }
        before = now;
    }
    let from_s = from_s.unwrap_or(settled_s(run.began_s().unwrap_or_default()));
    let moved_m = if recording.knows_origin { None } else { moved(&mut rows, from_s) };
    let mut figures = Figures::default();
    for row in rows.iter().filter(|row| row.time_s >= from_s) {
        if let Some(ours) = &row.ours {
            figures.add(&row.logged, ours);
        }
    }
    Ok(Replayed {
        rows,
        figures,
        from_s,
        moved_m,
        start: run.start,
        aids: *run.memory.aids(),
        dropped: *run.memory.dropped(),
        resets: before.resets,
        imu: before.imu,
    })
}

/// Shifts the log's positions to agree with ours at the first compared time, if they are so far away that their origin
/// must be a different one. Returns the shift.
fn moved(rows: &mut [ReplayRow], from_s: f64) -> Option<Vector3<f32>> {
    let both = |row: &ReplayRow| {
        let ours = row.ours.filter(|ours| ours.validity.position)?;
        Some(ours.state.position_m - row.logged.position_m?)
    };
    let by = rows.iter().filter(|row| row.time_s >= from_s).find_map(both).filter(|by| by.norm() > ELSEWHERE_M)?;
    rows.iter_mut().filter_map(|row| row.logged.position_m.as_mut()).for_each(|position| *position += by);
    Some(by)
}

/// Returns the newest value at `now_us`.
fn last(values: &[(u64, bool)], now_us: u64) -> Option<bool> {
    let until = values.partition_point(|(at_us, _)| *at_us <= now_us);
    values.get(until.checked_sub(1)?).map(|(_, is)| *is)
}

/// State of a running replay.
struct EstimatorRun<'a> {
    estimator: Estimator,
    memory: Memory,
    recording: &'a Recording,
    first_us: u64,
    /// Number of measurements that have arrived so far.
    arrived: usize,
    start: EstimatorStart,
}

impl EstimatorRun<'_> {
    fn step(&mut self, now_us: u64, sample: Option<&afbc_estimator::ImuSample>) -> Estimate {
        while let Some(aiding) = self.recording.aiding.get(self.arrived).filter(|it| it.arrived_us <= now_us) {
            self.memory.offer(&aiding.measurement);
            self.arrived += 1;
        }
        if let Some(stands) = self.stands(now_us) {
            self.memory.set_on_ground(stands);
        }
        let began = self.memory.runs();
        let estimate = self.estimator.step(&mut self.memory, now_us, sample);
        if let Some(why) = estimate.unready {
            self.start = EstimatorStart::Never(why);
            self.start_from_log(now_us, why);
        } else if !began {
            self.start = EstimatorStart::AtRest(self.time_s(now_us));
        }
        estimate
    }

    /// Returns the log's landed flag or, if the log has none, its disarmed flag.
    fn stands(&self, now_us: u64) -> Option<bool> {
        let Recording { landed, disarmed, .. } = self.recording;
        let values = if landed.is_empty() { disarmed } else { landed };
        last(values, now_us)
    }

    fn time_s(&self, now_us: u64) -> f64 {
        now_us.saturating_sub(self.first_us) as f64 * 1e-6
    }

    fn began_s(&self) -> Option<f64> {
        match self.start {
            EstimatorStart::AtRest(time_s) | EstimatorStart::FromLog(time_s, _) => Some(time_s),
            EstimatorStart::Never(_) => None,
        }
    }

    /// Starts in the log's state if the vehicle flies, or if it has waited long enough at rest.
    fn start_from_log(&mut self, now_us: u64, why: Unready) {
        let states = &self.recording.states;
        let fresh = |state: &&LoggedState| state.at_us + FRESH_US >= now_us;
        let until = states.partition_point(|state| state.at_us <= now_us);
        let lately = || states.iter().take(until).rev().take_while(fresh);
        let velocity = lately().find_map(|state| state.velocity_m_s);
        let flies = match last(&self.recording.landed, now_us) {
            Some(landed) => !landed,
            None => velocity.is_some_and(|velocity| velocity.norm() > FLIES_M_S),
        };
        if !flies && now_us < self.first_us + PATIENT_US {
            return;
        }
        let Some([w, x, y, z]) = lately().find_map(|state| state.attitude) else { return };
        let position = lately().find_map(|state| state.position_m);
        let zero = Vector3::zeros();
        let (place, speed) = (position.unwrap_or(zero), velocity.unwrap_or(zero));
        let Some(state) = State::from_quaternion(place, speed, &Quaternion::new(w, x, y, z), zero) else { return };
        // Usual accuracy of such estimates. A position with 10 km counts as unknown, so that the first fix sets it.
        let sigmas = Sigmas {
            attitude_rad: Vector3::new(0.05, 0.05, 0.1),
            velocity_m_s: Vector3::repeat(if velocity.is_some() { 0.5 } else { 5.0 }),
            position_m: Vector3::repeat(if position.is_some() { 2.0 } else { 1e4 }),
            gyro_bias_rad_s: Vector3::repeat(0.02),
            accel_bias_m_s2: Vector3::repeat(0.2),
            height_offset_m: 0.0,
        };
        if self.estimator.start_at(&mut self.memory, now_us, &state, &sigmas) {
            self.start = EstimatorStart::FromLog(self.time_s(now_us), (!flies).then_some(why));
        }
    }
}

/// Returns our estimate at a time between two samples, with the uncertainty and validity of the second; none before the
/// start and in gaps.
fn between(before: &Estimate, now: &Estimate, at_us: u64) -> Option<Estimate> {
    if before.unready.is_some() || now.unready.is_some() {
        return None;
    }
    let (from_us, to_us) = (before.at_us, now.at_us);
    // A time of zero means the default estimate, before the first step.
    if !(from_us..=to_us).contains(&at_us) || to_us - from_us > GAP_US || from_us == 0 {
        return (to_us == at_us).then_some(*now);
    }
    let share = if to_us > from_us { (at_us - from_us) as f32 / (to_us - from_us) as f32 } else { 1.0 };
    let mix = |a: &Vector3<f32>, b: &Vector3<f32>| a + (b - a) * share;
    let quaternion = |q: [f32; 4]| Quaternion::new(q[0], q[1], q[2], q[3]);
    let (a, b) = (quaternion(before.attitude), quaternion(now.attitude));
    // Take the shorter way round: q and -q are the same rotation.
    let b = if a.dot(&b) < 0.0 { -b } else { b };
    let mixed = (a * (1.0 - share) + b * share).normalize();
    let mut ours = *now;
    ours.at_us = at_us;
    ours.attitude = [mixed.w, mixed.i, mixed.j, mixed.k];
    let (position, velocity) = (
        mix(&before.state.position_m, &now.state.position_m),
        mix(&before.state.velocity_m_s, &now.state.velocity_m_s),
    );
    ours.state = State::from_quaternion(position, velocity, &mixed, now.state.rates_rad_s).unwrap_or(now.state);
    Some(ours)
}
