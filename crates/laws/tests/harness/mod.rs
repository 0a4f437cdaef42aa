//! Flights of any controller: a rigid body with rotor lag, delayed commands and measurement noise.

pub(crate) mod steps;

use afbc_control::{Action, FlightController, Settings, Validated};
use afbc_plant::{Environment, Gust, GustKind, Motion, Plant, PlantModel, PlantParameter, PlantParameterChange};
use afbc_types::{Axis, Parameters, RotorSpeeds, Setpoint, State};
use nalgebra::{Vector3, Vector4};
use std::collections::VecDeque;

/// Settings for 1 kHz and 3 N per rotor.
pub(crate) const SETTINGS: Settings = Settings { rotor_force_max_n: 3.0, ..Settings::DEFAULT };

pub(crate) fn vehicle() -> Parameters {
    Parameters::PAPER.to_f32()
}

/// Actuator and sensor imperfections.
#[derive(Clone, Copy)]
pub(crate) struct Rig {
    /// First-order lag of each rotor's speed \[s\].
    pub(crate) lag_s: f64,
    /// Steps from command to rotor.
    pub(crate) delay: usize,
    /// Standard deviation of the noise on every coordinate, in its unit.
    pub(crate) noise: f64,
}

impl Rig {
    pub(crate) const LAG: Rig = Rig { lag_s: 0.02, delay: 0, noise: 0.0 };
    pub(crate) const ALL: Rig = Rig { lag_s: 0.02, delay: 1, noise: 0.001 };
}

/// Uniform random numbers in 0..1 by xorshift64*.
pub(crate) struct Random(pub u64);

impl Random {
    pub(crate) fn uniform(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Returns a normal random number as a sum of twelve uniform ones, with tails cut at 6.
    pub(crate) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }

    pub(crate) fn noisy(&mut self, state: &State, sigma: f64) -> State {
        if sigma == 0.0 {
            return *state;
        }
        let mut add = |v: &Vector3<f32>| v.map(|x| x + (sigma * self.normal()) as f32);
        State {
            position_m: add(&state.position_m),
            velocity_m_s: add(&state.velocity_m_s),
            attitude_rad: add(&state.attitude_rad),
            rates_rad_s: add(&state.rates_rad_s),
        }
    }
}

/// Figures of a flight from `settled_s` on, for x, y, z, psi.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Figures {
    pub(crate) rmse: Vector4<f64>,
    pub(crate) max_abs: Vector4<f64>,
    /// Mean |change of U4| per step \[N\].
    pub(crate) delta_u4_n: f64,
}

/// Flies `controller` along `reference` for `duration_s`.
pub(crate) fn fly<C: FlightController>(
    controller: &C,
    rig: Rig,
    environment: Environment,
    initial: Motion,
    reference: impl Fn(f64) -> Setpoint,
    times_s: [f64; 2],
) -> Figures {
    fly_on(controller, rig, environment, initial, reference, times_s).0
}

/// Flies like [`fly`], and also returns the controller's memory at the end.
pub(crate) fn fly_on<C: FlightController>(
    controller: &C,
    rig: Rig,
    environment: Environment,
    initial: Motion,
    reference: impl Fn(f64) -> Setpoint,
    [settled_s, duration_s]: [f64; 2],
) -> (Figures, Validated<C::Memory>) {
    let dt_s = 0.001;
    let mut plant = Plant::new(PlantModel::RigidBody, initial, environment);
    let mut memory = Validated::<C::Memory>::default();
    let hover = libm::sqrt(0.486 * 9.81 / 4.0 / 2.984e-5);
    let mut rotors = Vector4::repeat(hover);
    let mut queue: VecDeque<Action> = VecDeque::new();
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    let gain = if rig.lag_s > 0.0 { 1.0 - libm::exp(-dt_s / rig.lag_s) } else { 1.0 };
    let (mut sum, mut max_abs) = (Vector4::zeros(), Vector4::<f64>::zeros());
    let (mut count, mut delta, mut last_u4) = (0.0, 0.0, None);
    for step in 0..=(duration_s / dt_s).round() as u64 {
        let t = step as f64 * dt_s;
        let motion = plant.motion();
        let setpoint = reference(t);
        let measured = random.noisy(&motion.measure(), rig.noise);
        let command = controller.step(&mut memory, Some(&measured), &setpoint);
        assert!(command.speeds.0.iter().all(|speed| speed.is_finite() && *speed >= 0.0));
        let position = setpoint.position_m.cast::<f64>() - motion.position_m;
        let yaw = afbc_control::math::wrap_angle(setpoint.yaw_rad - motion.attitude_rad.z as f32);
        let error = Vector4::new(position.x, position.y, position.z, f64::from(yaw));
        if t > settled_s - 1e-9 {
            count += 1.0;
            sum += error.component_mul(&error);
            max_abs = max_abs.sup(&error.abs());
            let u4 = f64::from(command.forces.0.sum());
            delta += last_u4.replace(u4).map_or(0.0, |before: f64| (u4 - before).abs());
        }
        queue.push_back(command);
        if queue.len() > rig.delay {
            let command = queue.pop_front().unwrap();
            rotors += (command.speeds.0.cast::<f64>() - rotors) * gain;
        }
        plant.step(&RotorSpeeds(rotors.cast()), dt_s);
    }
    let figures = Figures { rmse: (sum / count).map(libm::sqrt), max_abs, delta_u4_n: delta / count };
    (figures, memory)
}

/// Returns a motion at rest.
pub(crate) fn at(position_m: [f64; 3], yaw_rad: f64) -> Motion {
    Motion { position_m: position_m.into(), attitude_rad: Vector3::new(0.0, 0.0, yaw_rad), ..Motion::default() }
}

pub(crate) fn hover(position_m: [f32; 3], yaw_rad: f32) -> impl Fn(f64) -> Setpoint {
    move |_| Setpoint { position_m: position_m.into(), yaw_rad, ..Setpoint::default() }
}

/// Returns a level circle with one turn in `period_s` and the nose along the velocity.
pub(crate) fn circle(radius_m: f64, period_s: f64) -> impl Fn(f64) -> Setpoint {
    move |t| {
        let w = core::f64::consts::TAU / period_s;
        let (s, c) = libm::sincos(w * t);
        let radius = Vector3::new(c, s, 0.0) * radius_m;
        let velocity = Vector3::new(-radius.y, radius.x, 0.0) * w;
        Setpoint {
            position_m: (radius + Vector3::new(0.0, 0.0, 2.0)).cast(),
            velocity_m_s: velocity.cast(),
            acceleration_m_s2: (-radius * w * w).cast(),
            jerk_m_s3: (-velocity * w * w).cast(),
            snap_m_s4: (radius * w * w * w * w).cast(),
            yaw_rad: afbc_control::math::wrap_angle((w * t + core::f64::consts::FRAC_PI_2) as f32),
            yaw_rate_rad_s: w as f32,
            ..Setpoint::default()
        }
    }
}

/// Returns the paper's trajectory, Section IV.
pub(crate) fn paper(t: f64) -> Setpoint {
    let rate = core::f64::consts::PI / 30.0;
    let (s, c) = libm::sincos(rate * t);
    let velocity = Vector3::new(s, 2.0 * c, 3.0 * s) * rate;
    let acceleration = Vector3::new(c, -2.0 * s, 3.0 * c) * (rate * rate);
    Setpoint {
        position_m: Vector3::new(1.0 - c, 2.0 * s, 5.0 - 3.0 * c).cast(),
        velocity_m_s: velocity.cast(),
        acceleration_m_s2: acceleration.cast(),
        jerk_m_s3: (velocity * -(rate * rate)).cast(),
        snap_m_s4: (acceleration * -(rate * rate)).cast(),
        yaw_rad: (-0.43 * s) as f32,
        yaw_rate_rad_s: (-0.43 * rate * c) as f32,
        yaw_acceleration_rad_s2: (0.43 * rate * rate * s) as f32,
    }
}

/// Returns the start of the paper's flight: 1.5 m below the reference, 0.35 rad off.
pub(crate) fn paper_start() -> Motion {
    at([0.0, 0.0, 0.5], 0.35)
}

pub(crate) fn calm() -> Environment {
    Environment::calm(Parameters::PAPER).unwrap()
}

/// Returns the paper's disturbances: constant accelerations of 1.2, one axis after the other, and these factors on
/// inertia and thrust factor from 20 s to 40 s.
pub(crate) fn disturbed(inertia: f64, thrust: f64) -> Environment {
    let gusts =
        [(Axis::X, 7.5), (Axis::Roll, 15.0), (Axis::Y, 22.5), (Axis::Pitch, 30.0), (Axis::Z, 37.5), (Axis::Yaw, 45.0)]
            .map(|(axis, start_s)| Gust {
                axis,
                kind: GustKind::Acceleration,
                size: 1.2,
                start_s,
                end_s: f64::INFINITY,
            });
    let changes = [(PlantParameter::Inertia, inertia), (PlantParameter::ThrustFactor, thrust)]
        .map(|(quantity, factor)| PlantParameterChange { quantity, factor, start_s: 20.0, end_s: 40.0 });
    Environment::new(Parameters::PAPER, changes.to_vec(), gusts.to_vec()).unwrap()
}
