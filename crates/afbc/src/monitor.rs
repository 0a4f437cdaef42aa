//! Monitor of AFBC, which trips when its estimates, errors or inputs leave their bounds. Not in the paper.
//!
//! | figure | of | trips beyond |
//! |---|---|---|
//! | \|Theta_hat\|, delta_hat | each subsystem | [`Bounds::theta`], [`Bounds::delta`] |
//! | V_e = e_1^2/2 + e_2^2/2g, the computable part of (29), mean over 1 s | each subsystem | [`Bounds::lyapunov`] |
//! | share of steps with a saturated rotor, over 1 s | all | [`Bounds::saturation_share`] |
//! | reversals of U1..U4 by more than [`Bounds::swing_n`], per second | each input | [`Bounds::swings_hz`] |
//!
//! The last is the limit-cycle detector: it counts turning points of the input that are further apart than a threshold.
//! So it detects chatter between steps as well as slow oscillations, but neither manoeuvres nor smaller noise.
//!
//! Norms and V_e are updated for one subsystem per step, so each is at most six steps old.

use crate::adaptive;
use crate::cascade::Cascade;
use crate::model::Model;
use afbc_control::{Estimate, Trip, math};
use afbc_types::{Axis, Declared, OutOfRange, Parameters, PerAxis, parameters};

/// Time over which figures are averaged \[s\].
pub const WINDOW_S: f32 = 1.0;

parameters! {
    /// Bounds of the monitor. The defaults are those that do not depend on gains and vehicle; [`Bounds::new`] computes
    /// the others.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Bounds {
        /// Bound on |Theta_hat|, in the subsystem's input.
        #[parameter(THETA, "input", 0.0..=1e9)]
        pub theta: PerAxis<f32> = PerAxis { roll: 1e9, pitch: 1e9, yaw: 1e9, z: 1e9, x: 1e9, y: 1e9 },
        /// Bound on delta_hat, in the subsystem's input.
        #[parameter(DELTA, "input", 0.0..=1e9)]
        pub delta: PerAxis<f32> = PerAxis { roll: 1e9, pitch: 1e9, yaw: 1e9, z: 1e9, x: 1e9, y: 1e9 },
        /// Bound on the mean of V_e, with the hover value of g.
        #[parameter(LYAPUNOV, "m2 or rad2", 0.0..=1e9)]
        pub lyapunov: PerAxis<f32> = PerAxis { roll: 0.5, pitch: 0.5, yaw: 10.0, z: 200.0, x: 1000.0, y: 1000.0 },
        /// Largest share of steps with a rotor at a limit.
        #[parameter(SAT_SHARE, "1", 0.01..=1.0)]
        pub saturation_share: f32 = 0.9,
        /// Smallest reversal of an input that is counted.
        #[parameter(SWING, "N", 1e-3..=1e4)]
        pub swing_n: f32 = 1e4,
        /// Largest number of reversals of one input per second.
        #[parameter(SWINGS, "Hz", 0.1..=1e4)]
        pub swings_hz: f32 = 16.0,
    }
}

impl Bounds {
    /// Computes bounds for a law with these gains on this vehicle, whose parameters must be valid: estimates that rely
    /// on their projection, errors far beyond any manoeuvre, and a limit cycle of half the weight. (With a fifth, noise
    /// of 20 mrad/s alone would give too many reversals of U3.)
    ///
    /// V_e weighs e_2 by 1/g, so its bound increases with 1/g relative to the paper's vehicle; it does not decrease,
    /// because of e_1.
    pub fn new(gains: &PerAxis<adaptive::Gains>, vehicle: &Parameters) -> Self {
        let (paper, own) = (Model::new(&Parameters::PAPER.to_f32()), Model::new(vehicle));
        let sluggish = |axis| math::max(paper.hover_gain(axis) / own.hover_gain(axis), 1.0);
        Bounds {
            theta: PerAxis::from_fn(|axis| 0.95 * gains[axis].safeguards.theta_max),
            // Projection normally holds delta_hat at its bound; beyond it projection has failed.
            delta: PerAxis::from_fn(|axis| 1.001 * gains[axis].safeguards.delta_max),
            lyapunov: PerAxis::from_fn(|axis| Self::DEFAULT.lyapunov[axis] * sluggish(axis)),
            swing_n: 0.5 * vehicle.weight_n(),
            ..Self::DEFAULT
        }
    }
}

/// Norms of the estimates of one subsystem.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Norm {
    /// |Theta_hat|^2
    pub theta_squared: f32,
    /// delta_hat
    pub delta: f32,
}

/// Detector of turning points of one input.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Swing {
    /// Extreme value in the present direction \[N\].
    extreme: f32,
    /// Present direction: 1 or -1.
    direction: f32,
    /// Reversals per second, averaged over [`WINDOW_S`].
    pub rate_hz: f32,
}

impl Default for Swing {
    fn default() -> Self {
        Swing { extreme: 0.0, direction: 1.0, rate_hz: 0.0 }
    }
}

impl Swing {
    #[inline]
    fn advance(&mut self, input: f32, least: f32, forget: f32) {
        self.rate_hz -= forget * self.rate_hz;
        let onward = (input - self.extreme) * self.direction;
        if onward > 0.0 {
            self.extreme = input;
        } else if onward < -least {
            self.extreme = input;
            self.direction = -self.direction;
            self.rate_hz += 1.0 / WINDOW_S;
        }
    }
}

/// Present figures of the monitor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figures {
    /// Norms of the estimates.
    pub norms: PerAxis<Norm>,
    /// Mean of V_e.
    pub lyapunov: PerAxis<f32>,
    /// Share of steps with a saturated rotor.
    pub saturation_share: f32,
    /// Detectors of U1, U2, U3, U4.
    pub swings: [Swing; 4],
    /// Subsystem updated last.
    axis: Axis,
}

impl Default for Figures {
    fn default() -> Self {
        Figures {
            norms: PerAxis::default(),
            lyapunov: PerAxis::default(),
            saturation_share: 0.0,
            swings: [Swing::default(); 4],
            axis: Axis::Y,
        }
    }
}

impl Figures {
    /// Returns the subsystem updated last, and its norms.
    #[inline]
    pub fn latest(&self) -> (Axis, Norm) {
        (self.axis, self.norms[self.axis])
    }
}

/// A monitor. Constant; everything that changes in flight is in [`Figures`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Monitor {
    bounds: Bounds,
    theta_squared: PerAxis<f32>,
    /// 1/2g
    half_inverse_gain: PerAxis<f32>,
    /// Share of an average that is replaced per step.
    forget: f32,
}

impl Monitor {
    /// Creates a monitor that is called every `dt_s` seconds (valid in [`afbc_control::Settings::DT`]).
    ///
    /// # Errors
    /// The first bound or parameter out of range.
    pub fn new(vehicle: &Parameters, bounds: Bounds, dt_s: f32) -> Result<Self, OutOfRange> {
        vehicle.validate()?;
        bounds.validate()?;
        let model = Model::new(vehicle);
        Ok(Monitor {
            bounds,
            theta_squared: PerAxis::from_fn(|axis| bounds.theta[axis] * bounds.theta[axis]),
            half_inverse_gain: PerAxis::from_fn(|axis| 0.5 / model.hover_gain(axis)),
            forget: 1.0 - math::exp(-dt_s / WINDOW_S),
        })
    }

    /// Returns the largest |Theta_hat| to start with, which leaves room for adaptation.
    pub(crate) fn theta_start(&self, axis: Axis) -> f32 {
        0.75 * self.bounds.theta[axis]
    }

    /// Processes one step; returns why the monitor trips, if it does.
    #[inline]
    pub fn watch(&self, figures: &mut Figures, cascade: &Cascade<Estimate>, saturated: bool) -> Option<Trip> {
        let axis = figures.axis.next();
        figures.axis = axis;

        let estimate = &cascade.estimates[axis];
        let norm = Norm { theta_squared: estimate.theta.norm_squared(), delta: estimate.delta };
        figures.norms[axis] = norm;

        let errors = &cascade.errors[axis];
        let v = 0.5 * errors.e1 * errors.e1 + self.half_inverse_gain[axis] * errors.e2 * errors.e2;
        let lyapunov = &mut figures.lyapunov[axis];
        // Each subsystem is updated every sixth step.
        *lyapunov += 6.0 * self.forget * (v - *lyapunov);

        let saturated = if saturated { 1.0 } else { 0.0 };
        figures.saturation_share += self.forget * (saturated - figures.saturation_share);

        let [roll, pitch, yaw, thrust] = &mut figures.swings;
        let Bounds { swing_n, swings_hz, .. } = self.bounds;
        let cycles = |swing: &mut Swing, input| {
            swing.advance(input, swing_n, self.forget);
            swing.rate_hz > swings_hz
        };
        let inputs = &cascade.inputs;
        let cycles = [
            (cycles(roll, inputs.roll), Axis::Roll),
            (cycles(pitch, inputs.pitch), Axis::Pitch),
            (cycles(yaw, inputs.yaw), Axis::Yaw),
            (cycles(thrust, inputs.z), Axis::Z),
        ];

        if norm.theta_squared > self.theta_squared[axis] {
            Some(Trip::Theta(axis))
        } else if norm.delta > self.bounds.delta[axis] {
            Some(Trip::Delta(axis))
        } else if *lyapunov > self.bounds.lyapunov[axis] {
            Some(Trip::Lyapunov(axis))
        } else if figures.saturation_share > self.bounds.saturation_share {
            Some(Trip::Saturation)
        } else {
            cycles.iter().find(|(cycles, _)| *cycles).map(|(_, axis)| Trip::LimitCycle(*axis))
        }
    }
}
