//! L1-adaptive augmentation of the geometric controller.
//!
//! Wu, Cheng, Ackerman, Gahlawat, Lakshmanan, Zhao, Hovakimyan, *L1 adaptive augmentation for geometric tracking
//! control of quadrotors*, ICRA 2022, and *L1Quad*, IEEE TCST 33(2), 2025: a predictor of velocity and body rates, a
//! piecewise-constant adaptation law that explains the prediction error within one step, and a low-pass filter between
//! the estimated uncertainty and the rotors. The augmented law is [`crate::geometric`]. In frames with z up:
//!
//! ```text
//! predictor   dv^/dt     = -g e_z + U4/m R e_z + s_v - a (v^ - v)
//!             dOmega^/dt = G u - I^-1 (Omega x I Omega) + s_Omega - a (Omega^ - Omega)
//! adaptation  s_v = -k (v^ - v),  s_Omega = -k (Omega^ - Omega),  k = a e^(-a dt) / (1 - e^(-a dt)), within bounds
//! filter      C_1 = w_1 / (s + w_1),  C_2 = w_2^2 / (s + w_2)^2
//! law         U4 = U4 geometric - m C_1 (s_v . R e_z),  dOmega/dt = dOmega/dt geometric - C_2 s_Omega
//! actuators   U4, u of the predictor: omega_i += (1 - exp(-dt/tau)) (omega_i commanded - omega_i), after rotor limits
//! ```
//!
//! # Decisions
//!
//! * **Matched and unmatched**: the rotors can and do cancel the part of s_v along the thrust and all of s_Omega. The
//!   part of s_v across the thrust only explains the prediction error, as in the source. Against that part the
//!   geometric controller keeps its position integrals ([`Gains::BY_HAND`]); the source has none ([`Gains::WU_2022`]).
//! * **Frame**: s_v is in the earth frame. The source uses body axes, which is equivalent, because s_v is estimated
//!   anew in each step.
//! * **Rotor lag**: the source assumes ideal rotors. Here the predictor knows the rotor lag
//!   ([`Gains::rotor_time_constant_s`], 20 ms), like INDI; 0 is the source's assumption.
//! * **Bounds**: the estimates are bounded by +-20 m/s2 and +-100 rad/s2 per coordinate, so that a jump of the state,
//!   as after an outage, does not shake the vehicle. Without a new measurement nothing advances, and the predictor
//!   restarts at the next measurement.
//! * **On the ground**, the ground's force counts as uncertainty: see [`crate::indi`].

use crate::attitude::{r_earth_body, unit};
use crate::differentiator::{Differentiator, DifferentiatorMemory};
use crate::geometric::{self, Geometric};
use crate::rotor_model::{RotorModel, RotorModelMemory};
use afbc_control::{Action, FlightController, Mixer, Settings, Smoothing, Trace, math};
use afbc_types::{Airframe, Declared, Inputs, OutOfRange, Setpoint, State, parameters};
use nalgebra::Vector3;

/// Largest estimate of s_v, per coordinate \[m/s2\].
const FORCE_MAX_M_S2: f32 = 20.0;
/// Largest estimate of s_Omega, per coordinate \[rad/s2\].
const MOMENT_MAX_RAD_S2: f32 = 100.0;

parameters! {
    /// Gains and limits. Defaults are the result of `sitl tune` for the paper's vehicle with a rotor lag of 20 ms
    /// (`docs/tuning.md`).
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct Gains {
        /// Gains of the geometric controller. Its attitude integrals are 0: moments are left to the adaptation.
        #[group("")]
        pub geometric: geometric::Gains = Gains::TUNED_BASE,
        /// a: decay of the prediction errors.
        #[parameter(PREDICTOR, "1/s", 0.1..=100.0)]
        pub predictor_1_s: f32 = 5.0,
        /// w_1: bandwidth of the filter on the thrust's compensation.
        #[parameter(THRUST_BW, "rad/s", 1.0..=200.0, tuned)]
        pub thrust_bandwidth_rad_s: f32 = 29.42,
        /// w_2: bandwidth of the filter on the moments' compensation.
        #[parameter(MOMENT_BW, "rad/s", 1.0..=200.0, tuned)]
        pub moment_bandwidth_rad_s: f32 = 8.337,
        /// tau: time constant of the rotor model.
        #[parameter(ROT_LAG, "s", 0.0..=0.5)]
        pub rotor_time_constant_s: f32 = 0.02,
    }
}

impl Gains {
    /// Geometric controller with position integrals only.
    const BASE: geometric::Gains = geometric::Gains {
        position_p_1_s2: 12.0,
        position_d_1_s: 6.0,
        position_i_1_s3: 12.0,
        height_i_1_s3: 30.0,
        tilt_p_1_s2: 150.0,
        tilt_d_1_s: 27.0,
        ..geometric::Gains::LEE_2010
    };

    /// Geometric controller as tuned with the adaptation, without attitude integrals.
    const TUNED_BASE: geometric::Gains = geometric::Gains {
        position_p_1_s2: 32.67,
        position_d_1_s: 15.58,
        position_i_1_s3: 200.0,
        height_p_1_s2: 44.29,
        height_d_1_s: 17.82,
        height_i_1_s3: 30.0,
        tilt_p_1_s2: 167.8,
        tilt_d_1_s: 83.34,
        yaw_p_1_s2: 60.82,
        yaw_d_1_s: 14.78,
        filter_rad_s: 28.1,
        smoothing: Smoothing {
            smooth_tilt_rad_s: 126.8,
            smooth_yaw_rad_s: 90.25,
            smooth_lift_rad_s: 115.5,
            lead_s: 0.01285,
        },
        ..Self::BASE
    };

    /// Gains tuned by `sitl tune` for the paper's vehicle with a rotor lag of 20 ms (`docs/tuning.md`).
    pub const TUNED: Self = Self::DEFAULT;

    /// Gains tuned by hand for the paper's vehicle with a rotor lag of 20 ms.
    pub const BY_HAND: Self = Gains {
        geometric: Self::BASE,
        predictor_1_s: 5.0,
        thrust_bandwidth_rad_s: 10.0,
        moment_bandwidth_rad_s: 10.0,
        rotor_time_constant_s: 0.02,
    };

    /// Law of the source, on the geometric controller without integrals. Hand-tuned for the same vehicle.
    pub const WU_2022: Self = Gains {
        geometric: geometric::Gains { position_i_1_s3: 0.0, height_i_1_s3: 0.0, ..Self::BASE },
        ..Self::BY_HAND
    };
}

/// L1 controller with its constants. Everything that changes in flight is in [`Memory`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct L1<const N: usize = 4> {
    geometric: Geometric<N>,
    rotors: RotorModel<N>,
    gravity_m_s2: f32,
    dt_s: f32,
    /// a
    decay_1_s: f32,
    /// k
    adaptation_1_s: f32,
    /// 1 - exp(-w_1 dt)
    thrust_filter: f32,
    moment_filter: Differentiator,
}

/// Predicted velocity and body rates.
#[derive(Clone, Copy, Debug, PartialEq)]
struct StatePrediction {
    velocity_m_s: Vector3<f32>,
    rates_rad_s: Vector3<f32>,
}

/// State of the controller between steps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Memory<const N: usize = 4> {
    /// State of the geometric controller.
    pub geometric: geometric::Memory,
    /// s_v: estimated force per mass that the model lacks, earth frame \[m/s2\].
    pub force_m_s2: Vector3<f32>,
    /// s_Omega: estimated angular acceleration that the model lacks, body frame \[rad/s2\].
    pub moment_rad_s2: Vector3<f32>,
    /// v^ and Omega^, `None` before the first measurement.
    prediction: Option<StatePrediction>,
    /// C_1 (s_v . R e_z) \[m/s2\]
    thrust: f32,
    /// C_2 s_Omega
    moment: DifferentiatorMemory,
    rotors: RotorModelMemory<N>,
}

impl<const N: usize> L1<N> {
    /// Creates a controller for a vehicle with these nominal parameters.
    ///
    /// # Errors
    /// Returns the first parameter, setting or gain that is out of range.
    pub fn new(vehicle: impl Into<Airframe<N>>, settings: Settings, gains: Gains) -> Result<Self, OutOfRange> {
        let vehicle = vehicle.into();
        let geometric = Geometric::new(vehicle, settings, gains.geometric)?;
        gains.validate()?;
        let (vehicle, dt_s, decay_1_s) = (vehicle.parameters, settings.dt_s, gains.predictor_1_s);
        let left = math::exp(-decay_1_s * dt_s);
        Ok(L1 {
            rotors: RotorModel::new(&geometric.body, vehicle.weight_n(), gains.rotor_time_constant_s, dt_s),
            geometric,
            gravity_m_s2: vehicle.gravity_m_s2,
            dt_s,
            decay_1_s,
            adaptation_1_s: decay_1_s * left / (1.0 - left),
            thrust_filter: 1.0 - math::exp(-gains.thrust_bandwidth_rad_s * dt_s),
            moment_filter: Differentiator::new(gains.moment_bandwidth_rad_s, dt_s)?,
        })
    }

    /// Estimates both uncertainties from the prediction error of this step, and filters them.
    #[inline]
    fn adapt(&self, memory: &mut Memory<N>, state: &State, body_z: &Vector3<f32>) {
        if let Some(predicted) = memory.prediction {
            let within = |error: Vector3<f32>, max: f32| error.map(|e| (-self.adaptation_1_s * e).max(-max).min(max));
            memory.force_m_s2 = within(predicted.velocity_m_s - state.velocity_m_s, FORCE_MAX_M_S2);
            memory.moment_rad_s2 = within(predicted.rates_rad_s - state.rates_rad_s, MOMENT_MAX_RAD_S2);
        }
        memory.thrust += (memory.force_m_s2.dot(body_z) - memory.thrust) * self.thrust_filter;
        self.moment_filter.advance(&mut memory.moment, &memory.moment_rad_s2);
    }

    /// Returns the prediction for the next step, with the rotors giving `now`.
    #[inline]
    fn predict(&self, memory: &Memory<N>, state: &State, body_z: &Vector3<f32>, now: &Inputs) -> StatePrediction {
        let State { velocity_m_s, rates_rad_s, .. } = *state;
        let StatePrediction { velocity_m_s: v, rates_rad_s: omega } =
            memory.prediction.unwrap_or(StatePrediction { velocity_m_s, rates_rad_s });
        let body = &self.geometric.body;
        let gravity = Vector3::new(0.0, 0.0, self.gravity_m_s2);
        let acceleration = body_z * (now.thrust_n / body.mass_kg) - gravity + memory.force_m_s2;
        let angular = body.angular_acceleration(now) + body.coupling(&rates_rad_s) + memory.moment_rad_s2;
        StatePrediction {
            velocity_m_s: v + (acceleration - (v - velocity_m_s) * self.decay_1_s) * self.dt_s,
            rates_rad_s: omega + (angular - (omega - rates_rad_s) * self.decay_1_s) * self.dt_s,
        }
    }
}

impl<const N: usize> FlightController<N> for L1<N> {
    type Memory = Memory<N>;

    fn dt_s(&self) -> f32 {
        self.dt_s
    }

    fn mixer(&self) -> &Mixer<N> {
        self.geometric.mixer()
    }

    fn trace(memory: &Memory<N>) -> Trace {
        Geometric::<N>::trace(&memory.geometric)
    }

    #[inline]
    fn decide(&self, memory: &mut Memory<N>, state: &State, setpoint: &Setpoint, fresh: bool) -> Action<N> {
        let body = &self.geometric.body;
        let body_z = unit(&r_earth_body(&state.attitude_rad).column(2).into());
        if fresh {
            self.adapt(memory, state, &body_z);
        }

        let (mut demand, lesson) = self.geometric.demand(&mut memory.geometric, state, setpoint);
        demand.thrust_n = (demand.thrust_n - body.mass_kg * memory.thrust).max(0.0);
        demand.angular_acceleration_rad_s2 -= memory.moment.value();
        let (action, trace, unallocated) = body.act(&demand, &mut memory.geometric.smoothed);
        self.geometric.learn(&mut memory.geometric, &lesson, fresh, unallocated);
        memory.geometric.trace = trace;

        // The rotors advance before the prediction, which spans the step that this command begins.
        self.rotors.advance(&mut memory.rotors, &action.speeds);
        let now = self.rotors.inputs(body, &memory.rotors);
        memory.prediction = fresh.then(|| self.predict(memory, state, &body_z, &now));
        action
    }
}
