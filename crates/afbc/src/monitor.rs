//! Monitor of AFBC: trips when estimates, errors or inputs leave their bounds. Not in the paper.
//!
//! | figure | of | trips beyond |
//! |---|---|---|
//! | \|Theta_hat\|, delta_hat | each subsystem | [`MonitorBounds::theta`], [`MonitorBounds::delta`] |
//! | \|e_1\| from the reference, mean over 1 s | each subsystem | [`MonitorBounds::error`] |
//! | share of steps with a saturated rotor, over 1 s | all | [`MonitorBounds::saturation_share`] |
//! | reversals of U1..U4 beyond [`MonitorBounds::swing_n`], per second | each input | [`MonitorBounds::swings_hz`] |
//!
//! The last row detects limit cycles: it counts turning points of an input that are further apart than a threshold. It
//! finds chatter between steps and slow oscillations, but ignores manoeuvres and smaller noise. Of U3 it counts only
//! what the vehicle can follow: the mean over six steps after two low-passes of [`FOLLOWS_RAD_S`]. Rotors have little
//! effect about yaw, so their vibration of 25 Hz and more causes U3 as large as the weight without turning the vehicle.
//! A law that oscillates about yaw does so below 15 Hz, because of the rotor lag.
//!
//! Norms, errors, U3 and rates are updated for one subsystem per step, so each is at most six steps old.

use crate::adaptive::{self, AdaptiveEstimate};
use crate::cascade::{CascadeMemory, Settings};
use crate::trip::Trip;
use afbc_control::math;
use afbc_types::{Axis, Declared, OutOfRange, Parameters, PerAxis, parameters};

/// Time over which figures are averaged \[s\].
pub const WINDOW_S: f32 = 1.0;

/// Corner of the low-passes on U3 \[rad/s\], that of a rotor lag of 16 ms: faster changes of U3 do not turn a vehicle.
pub const FOLLOWS_RAD_S: f32 = 63.0;

/// Number of steps in which each subsystem is checked once.
const ROUND: f32 = 6.0;

/// Largest |Theta_hat| as a share of what carries the vehicle: the weight for U1..U4, g for u5, u6.
pub const TRIM_SHARE: PerAxis<f32> = PerAxis { roll: 0.75, pitch: 0.75, yaw: 2.2, z: 1.6, x: 2.2, y: 2.2 };

/// Largest |Theta_hat| as a share of its projection's bound.
const THETA_SHARE: f32 = 0.95;

parameters! {
    /// Bounds of the monitor. The defaults suit every vehicle; [`MonitorBounds::new`] computes the bounds that
    /// depend on gains and vehicle.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct MonitorBounds {
        /// Bound on |Theta_hat|, in the unit of the subsystem's input.
        #[parameter(THETA, "input", 0.0..=1e9)]
        pub theta: PerAxis<f32> = PerAxis { roll: 1e9, pitch: 1e9, yaw: 1e9, z: 1e9, x: 1e9, y: 1e9 },
        /// Bound on delta_hat, in the unit of the subsystem's input.
        #[parameter(DELTA, "input", 0.0..=1e9)]
        pub delta: PerAxis<f32> = PerAxis { roll: 1e9, pitch: 1e9, yaw: 1e9, z: 1e9, x: 1e9, y: 1e9 },
        /// Bound on the mean distance from the reference, |e_1|.
        #[parameter(ERROR, "m or rad", 0.0..=1e9)]
        pub error: PerAxis<f32> = PerAxis { roll: 0.7, pitch: 0.7, yaw: 1.0, z: 1.0, x: 1.5, y: 1.5 },
        /// Largest share of steps with a rotor at a limit.
        #[parameter(SAT_SHARE, "1", 0.01..=1.0)]
        pub saturation_share: f32 = 0.9,
        /// Smallest swing of an input that counts as a reversal.
        #[parameter(SWING, "N", 1e-3..=1e4)]
        pub swing_n: f32 = 1e4,
        /// Largest number of reversals of one input per second.
        #[parameter(SWINGS, "Hz", 0.1..=1e4)]
        pub swings_hz: f32 = 16.0,
    }
}

impl MonitorBounds {
    /// Computes bounds for a law with these gains and settings on this vehicle, whose parameters must be valid. They
    /// trip when an estimate is about to reach its projection, and at a limit cycle of half the weight. (With a fifth
    /// of the weight, noise of 20 mrad/s alone would cause too many reversals of U3.) With feed-forward the estimates
    /// are zero in a nominal hover, so they are also bounded to [`TRIM_SHARE`].
    pub fn new(gains: &PerAxis<adaptive::Gains>, vehicle: &Parameters, settings: &Settings) -> Self {
        let weight_n = vehicle.weight_n();
        let theta = |axis: Axis| {
            let projection = THETA_SHARE * gains[axis].safeguards.theta_max;
            let carries = if matches!(axis, Axis::X | Axis::Y) { vehicle.gravity_m_s2 } else { weight_n };
            if settings.feed_forward { math::min(TRIM_SHARE[axis] * carries, projection) } else { projection }
        };
        MonitorBounds {
            theta: PerAxis::from_fn(theta),
            // Projection normally keeps delta_hat within its bound, so a larger value means that projection has failed.
            delta: PerAxis::from_fn(|axis| 1.001 * gains[axis].safeguards.delta_max),
            swing_n: 0.5 * weight_n,
            ..Self::DEFAULT
        }
    }
}

/// Norms of the estimates of one subsystem.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EstimateNorms {
    /// |Theta_hat|^2
    pub theta_squared: f32,
    /// delta_hat
    pub delta: f32,
}

/// Detector of turning points of one input.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OscillationDetector {
    /// Extreme value since the last turning point \[N\].
    extreme: f32,
    /// Present direction: 1 or -1.
    direction: f32,
    /// Reversals per second, averaged over [`WINDOW_S`].
    pub rate_hz: f32,
}

impl Default for OscillationDetector {
    fn default() -> Self {
        OscillationDetector { extreme: 0.0, direction: 1.0, rate_hz: 0.0 }
    }
}

impl OscillationDetector {
    /// Counts a reversal by more than `least` if this input is one.
    #[inline]
    fn advance(&mut self, input: f32, least: f32) {
        let onward = (input - self.extreme) * self.direction;
        if onward > 0.0 {
            self.extreme = input;
        } else if onward < -least {
            self.extreme = input;
            self.direction = -self.direction;
            // `rate_hz` decays at 1/WINDOW_S, so n such increments per second settle at n.
            self.rate_hz += 1.0 / WINDOW_S;
        }
    }

    /// Lets this share of the reversals decay; returns the remaining reversals per second.
    #[inline]
    fn forget(&mut self, share: f32) -> f32 {
        self.rate_hz = math::settled(self.rate_hz - share * self.rate_hz);
        self.rate_hz
    }
}

/// Part of an input that the vehicle can follow: the mean over a round after two low-passes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct FollowableInput {
    /// Sum of the inputs since the last round \[N\].
    sum_n: f32,
    /// Input after one low-pass and after both \[N\].
    passed_n: [f32; 2],
}

impl FollowableInput {
    /// Ends a round; its mean enters the low-passes with this share. Returns the output \[N\].
    #[inline]
    fn end_round(&mut self, share: f32) -> f32 {
        let mean = self.sum_n * (1.0 / ROUND);
        self.sum_n = 0.0;
        let [once, twice] = &mut self.passed_n;
        *once = math::settled(*once + share * (mean - *once));
        *twice = math::settled(*twice + share * (*once - *twice));
        *twice
    }
}

/// Figures of the monitor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MonitorFigures {
    /// Norms of the estimates.
    pub norms: PerAxis<EstimateNorms>,
    /// Mean of |e_1| \[m or rad\].
    pub error: PerAxis<f32>,
    /// Share of steps with a saturated rotor.
    pub saturation_share: f32,
    /// Detectors of U1, U2, U3, U4.
    pub swings: [OscillationDetector; 4],
    /// Part of U3 that the vehicle can follow.
    yaw: FollowableInput,
    /// Subsystem updated last.
    axis: Axis,
}

impl Default for MonitorFigures {
    fn default() -> Self {
        MonitorFigures {
            norms: PerAxis::default(),
            error: PerAxis::default(),
            saturation_share: 0.0,
            swings: [OscillationDetector::default(); 4],
            yaw: FollowableInput::default(),
            // Y is the last subsystem of a round, so the first step updates roll.
            axis: Axis::Y,
        }
    }
}

impl MonitorFigures {
    /// Returns the subsystem updated last, and its norms.
    #[inline]
    pub fn latest(&self) -> (Axis, EstimateNorms) {
        (self.axis, self.norms[self.axis])
    }
}

/// Monitor with its constants. Everything that changes in flight is in [`MonitorFigures`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Monitor {
    bounds: MonitorBounds,
    theta_squared: PerAxis<f32>,
    /// Share of a mean that is replaced per step.
    forget: f32,
    /// Share of the low-passes on U3 that is replaced per round.
    follow: f32,
}

impl Monitor {
    /// Creates a monitor that is called every `dt_s` seconds (valid in [`afbc_control::Settings::DT`]).
    ///
    /// # Errors
    /// Returns the first bound that is out of range.
    pub fn new(bounds: MonitorBounds, dt_s: f32) -> Result<Self, OutOfRange> {
        bounds.validate()?;
        Ok(Monitor {
            bounds,
            theta_squared: PerAxis::from_fn(|axis| bounds.theta[axis] * bounds.theta[axis]),
            forget: 1.0 - math::exp(-dt_s / WINDOW_S),
            follow: 1.0 - math::exp(-ROUND * dt_s * FOLLOWS_RAD_S),
        })
    }

    /// Returns the largest |Theta_hat| for a restart, which leaves room for adaptation.
    pub(crate) fn theta_start(&self, axis: Axis) -> f32 {
        0.75 * self.bounds.theta[axis]
    }

    /// Processes one step; returns the reason if the monitor trips.
    #[inline]
    pub fn watch(
        &self,
        figures: &mut MonitorFigures,
        cascade: &CascadeMemory<AdaptiveEstimate>,
        saturated: bool,
    ) -> Option<Trip> {
        let axis = figures.axis.next();
        figures.axis = axis;

        let estimate = &cascade.estimates[axis];
        let norm = EstimateNorms { theta_squared: estimate.theta.norm_squared(), delta: estimate.delta };
        figures.norms[axis] = norm;

        let error = &mut figures.error[axis];
        // Each subsystem is updated every sixth step.
        *error = math::settled(*error + ROUND * self.forget * (cascade.last.distances[axis].abs() - *error));

        let (saturated, share) = (if saturated { 1.0 } else { 0.0 }, figures.saturation_share);
        figures.saturation_share = math::settled(share + self.forget * (saturated - share));

        let [roll, pitch, yaw, thrust] = &mut figures.swings;
        let MonitorBounds { swing_n, swings_hz, .. } = self.bounds;
        let asked = &cascade.last.commanded;
        roll.advance(asked.roll_n, swing_n);
        pitch.advance(asked.pitch_n, swing_n);
        thrust.advance(asked.thrust_n, swing_n);
        figures.yaw.sum_n += asked.yaw_n;
        let swing = match axis {
            Axis::Roll => Some(roll),
            Axis::Pitch => Some(pitch),
            Axis::Yaw => Some(yaw),
            Axis::Z => Some(thrust),
            // X has no input of its own, so the round of the yaw input ends in the step of X.
            Axis::X => {
                yaw.advance(figures.yaw.end_round(self.follow), swing_n);
                None
            }
            Axis::Y => None,
        };
        let cycles = swing.is_some_and(|swing| swing.forget(ROUND * self.forget) > swings_hz);

        if norm.theta_squared > self.theta_squared[axis] {
            Some(Trip::Theta(axis))
        } else if norm.delta > self.bounds.delta[axis] {
            Some(Trip::Delta(axis))
        } else if *error > self.bounds.error[axis] {
            Some(Trip::Error(axis))
        } else if figures.saturation_share > self.bounds.saturation_share {
            Some(Trip::Saturation)
        } else {
            cycles.then_some(Trip::LimitCycle(axis))
        }
    }
}
