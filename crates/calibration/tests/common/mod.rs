//! Simulated sensors of a vehicle that is held in any attitude.
#![allow(dead_code, unreachable_pub, clippy::unwrap_used, reason = "shared by tests")]

use afbc_calibration::{CalibrationEvent, RawSample, Side};
use afbc_plant::instruments::ImuModel;
use afbc_plant::{Environment, InstrumentSuite, Motion, Plant, PlantModel, SimulatedInstruments, Truth};
use afbc_types::Parameters;
use nalgebra::{Rotation3, UnitQuaternion, Vector3};

const STEP_S: f64 = 0.001;
/// Number of readings averaged into a sample.
const READINGS: u32 = 20;
pub const GRAVITY: f64 = 9.81;

/// Vehicle in somebody's hands.
pub struct Hands {
    pub instruments: SimulatedInstruments,
    still: Truth,
    steps: u32,
    pub attitude: UnitQuaternion<f64>,
    /// Turn rate about the vertical \[rad/s\].
    pub spin_rad_s: f64,
    /// Amplitude of a tremor at 4 Hz about each body axis \[rad\].
    pub tremor_rad: f64,
}

impl Hands {
    pub fn new(suite: &InstrumentSuite, seed: u64) -> Self {
        let calm = Environment::calm(Parameters::PAPER).unwrap();
        let still = Plant::new(PlantModel::RigidBody, Motion::default(), calm).truth();
        Hands {
            instruments: SimulatedInstruments::new(suite, &[], seed, STEP_S).unwrap(),
            still: Truth { thrust_share: 0.0, rotor_speeds_rad_s: still.rotor_speeds_rad_s * 0.0, ..still },
            steps: 0,
            attitude: UnitQuaternion::identity(),
            spin_rad_s: 0.0,
            tremor_rad: 0.0,
        }
    }

    pub fn with_imu(imu: ImuModel, seed: u64) -> Self {
        Hands::new(&InstrumentSuite { imu: Some(imu), ..InstrumentSuite::default() }, seed)
    }

    /// Puts the vehicle on a side, askew by this roll and pitch.
    pub fn put(&mut self, side: Side, askew_rad: [f64; 2]) {
        let up: Vector3<f64> = side.up().cast();
        let turn = Rotation3::rotation_between(&up, &Vector3::z());
        // Upside down is a half turn about any level axis.
        let turn = turn.unwrap_or_else(|| Rotation3::from_euler_angles(std::f64::consts::PI, 0.0, 0.0));
        let askew = Rotation3::from_euler_angles(askew_rad[0], askew_rad[1], 0.0);
        self.attitude = UnitQuaternion::from_rotation_matrix(&(askew * turn));
    }

    fn truth(&mut self) -> Truth {
        let time_s = f64::from(self.steps) * STEP_S;
        self.steps += 1;
        let spin = Vector3::new(0.0, 0.0, self.spin_rad_s);
        self.attitude = UnitQuaternion::from_scaled_axis(spin * STEP_S) * self.attitude;
        let phase = std::f64::consts::TAU * 4.0 * time_s;
        let shake = |offset: f64| self.tremor_rad * (phase + offset).sin();
        let shaken = Vector3::new(shake(0.0), shake(1.0), shake(2.0));
        let rates = |offset: f64| self.tremor_rad * std::f64::consts::TAU * 4.0 * (phase + offset).cos();
        let attitude = self.attitude * UnitQuaternion::from_scaled_axis(shaken);
        Truth {
            time_s,
            attitude: attitude.into_inner(),
            rates_rad_s: attitude.inverse() * spin + Vector3::new(rates(0.0), rates(1.0), rates(2.0)),
            velocity_m_s: Vector3::zeros(),
            acceleration_m_s2: Vector3::zeros(),
            angular_acceleration_rad_s2: Vector3::zeros(),
            ..self.still
        }
    }

    /// Returns the sample of the next 20 ms.
    pub fn sample(&mut self) -> RawSample {
        let (mut rates, mut force, mut field, mut fields) = (Vector3::zeros(), Vector3::zeros(), Vector3::zeros(), 0.0);
        for _ in 0..READINGS {
            let truth = self.truth();
            let readings = self.instruments.measure(&truth);
            let imu = readings.imu.unwrap();
            rates += imu.rates_rad_s;
            force += imu.specific_force_m_s2;
            for fix in readings.magnetometer {
                field += fix.field_ut;
                fields += 1.0;
            }
        }
        RawSample {
            at_us: u64::from(self.steps) * 1000,
            rates_rad_s: (rates / f64::from(READINGS)).cast(),
            specific_force_m_s2: (force / f64::from(READINGS)).cast(),
            field_ut: (fields > 0.0).then(|| (field / fields).cast()),
        }
    }

    /// Turns the vehicle by hand to the attitude of `put` within half a second.
    pub fn turn_to(&mut self, side: Side, askew_rad: [f64; 2], mut step: impl FnMut(&RawSample)) {
        let (from, spin_rad_s) = (self.attitude, std::mem::take(&mut self.spin_rad_s));
        self.put(side, askew_rad);
        let to = self.attitude;
        for number in 0..25 {
            self.attitude = from.try_slerp(&to, f64::from(number) / 25.0, 1e-6).unwrap_or(to);
            let rates = (from.inverse() * to).scaled_axis() / 0.5;
            let mut sample = self.sample();
            sample.rates_rad_s += rates.cast::<f32>();
            step(&sample);
        }
        (self.attitude, self.spin_rad_s) = (to, spin_rad_s);
    }
}

/// Collects the reported events.
pub fn keep(told: &mut Vec<CalibrationEvent>) -> impl FnMut(CalibrationEvent) {
    |event| told.push(event)
}
