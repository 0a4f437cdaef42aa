//! Measurement of the true motion for a controller.

use crate::delay::{DelayLine, whole_steps};
use crate::dropouts::{MeasurementDropouts, SimulatedDropouts};
use crate::motion::Motion;
use crate::noise::{Noise, NoiseStream};
use afbc_types::{Declared, OutOfRange, State, parameters};
use nalgebra::Vector3;

parameters! {
    /// One number for each group of the state's coordinates, the same for its three coordinates.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct Deviations {
        /// Standard deviation of the position, per coordinate.
        #[parameter(POS, "m", 0.0..=100.0)]
        pub position_m: f64 = 0.0,
        /// Standard deviation of the velocity, per coordinate.
        #[parameter(VEL, "m/s", 0.0..=100.0)]
        pub velocity_m_s: f64 = 0.0,
        /// Standard deviation of roll, pitch and yaw.
        #[parameter(ATT, "rad", 0.0..=1.0)]
        pub attitude_rad: f64 = 0.0,
        /// Standard deviation of the angular rates, per axis.
        #[parameter(RATE, "rad/s", 0.0..=10.0)]
        pub rates_rad_s: f64 = 0.0,
    }
}

impl Deviations {
    /// Returns the same number for every group, each in its own unit.
    pub const fn all(size: f64) -> Self {
        Deviations { position_m: size, velocity_m_s: size, attitude_rad: size, rates_rad_s: size }
    }

    /// Draws normal numbers with these standard deviations.
    #[inline]
    fn draw(&self, noise: &mut Noise) -> Motion {
        let [x, y, z, u, v, w, phi, theta, psi, p, q, r] = noise.normals();
        Motion {
            position_m: Vector3::new(x, y, z) * self.position_m,
            velocity_m_s: Vector3::new(u, v, w) * self.velocity_m_s,
            attitude_rad: Vector3::new(phi, theta, psi) * self.attitude_rad,
            rates_rad_s: Vector3::new(p, q, r) * self.rates_rad_s,
        }
    }
}

parameters! {
    /// Properties of the measurement. The default is perfect.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize))]
    pub struct Sensing {
        /// Standard deviation of white noise, drawn in every step.
        #[group("noise")]
        pub noise: Deviations = Deviations::DEFAULT,
        /// Standard deviation of a constant bias, drawn once per flight.
        #[group("bias")]
        pub bias: Deviations = Deviations::DEFAULT,
        /// Delay from motion to measurement, rounded to whole steps.
        #[parameter(DELAY, "s", 0.0..=0.5)]
        pub delay_s: f64 = 0.0,
        /// Time between measured states, rounded to whole steps; 0 measures a state in every step. Between
        /// measurements, the last state stays.
        #[parameter(PERIOD, "s", 0.0..=0.5)]
        pub period_s: f64 = 0.0,
        /// Whether the angular rates arrive in every step and without delay, as from a gyroscope on the controller's
        /// board.
        #[switch(GYRO)]
        pub gyro: bool = false,
        /// Dropouts of measurements.
        pub dropouts: Option<MeasurementDropouts> = None,
    }
    together(sensing) {
        sensing.dropouts.map_or(Ok(()), |dropouts| dropouts.validate())
    }
}

/// Measurement in one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StateMeasurement {
    /// Newest state that has arrived. With `gyro`, its rates are from this step.
    pub state: State,
    /// Age of that state, apart from a gyro's rates \[s\]. The first state also stands for those before it.
    pub age_s: f64,
    /// False in a dropout, when `state` is the last one before it.
    pub fresh: bool,
    /// True if a state or a gyro's rates arrived in this step. Between samples `state` is held.
    pub new: bool,
}

/// Sensors in simulation: noise and bias, then sampling and delay, then dropouts. The first measurement always arrives.
#[derive(Clone, Debug)]
pub struct StateSensor {
    noise: Option<Deviations>,
    random: Noise,
    bias: Motion,
    delay: DelayLine<State>,
    delay_s: f64,
    /// Number of steps from one sample to the next, and until the next sample arrives.
    period: usize,
    until: usize,
    gyro: bool,
    outage: Option<SimulatedDropouts>,
    step_s: f64,
    /// Last state that arrived, if any.
    last: Option<State>,
    /// Number of steps since then.
    since: u32,
}

impl StateSensor {
    /// Creates sensors that are read every `step_s`. The seed may be the plant's, because the streams differ.
    ///
    /// # Errors
    /// Returns the first setting that is out of range.
    pub fn new(sensing: &Sensing, seed: u64, step_s: f64) -> Result<Self, OutOfRange> {
        sensing.validate()?;
        crate::realism::STEP.check(step_s)?;
        let mut random = Noise::new(seed, NoiseStream::Sensors);
        let steps = whole_steps(sensing.delay_s, step_s);
        let period = whole_steps(sensing.period_s, step_s).max(1);
        Ok(StateSensor {
            noise: (sensing.noise != Deviations::default()).then_some(sensing.noise),
            // The bias is drawn even if it is zero, so that a bias does not change the later noise.
            bias: sensing.bias.draw(&mut random),
            random,
            delay: DelayLine::new(steps, State::default()),
            delay_s: steps as f64 * step_s,
            period,
            // Number of steps until the next sample arrives. The first step's sample also stands for those before it.
            until: steps % period,
            gyro: sensing.gyro,
            outage: sensing
                .dropouts
                .as_ref()
                .map(|dropouts| SimulatedDropouts::new(dropouts, Noise::new(seed, NoiseStream::Dropouts), step_s)),
            step_s,
            last: None,
            since: 0,
        })
    }

    /// Returns the bias drawn for this flight.
    pub fn bias(&self) -> &Motion {
        &self.bias
    }

    /// Measures `motion`. Call it once per step.
    #[inline]
    pub fn measure(&mut self, motion: &Motion) -> StateMeasurement {
        let mut measured = sum(motion, &self.bias);
        // The noise is drawn in every step, sampled or not, so that the sampling rate does not change it.
        if let Some(spread) = &self.noise {
            measured = sum(&measured, &spread.draw(&mut self.random));
        }
        let state = measured.measure();
        let first = self.last.is_none();
        if first {
            self.delay.refill(state);
        }
        let arriving = self.delay.pass(state);
        let sampled = self.until == 0 || first;
        self.until = if self.until == 0 { self.period } else { self.until } - 1;
        let mut newest = self.last.unwrap_or(state);
        let fresh = first || !self.outage.as_mut().is_some_and(SimulatedDropouts::advance);
        if fresh && sampled {
            newest = arriving;
            self.since = 0;
        } else {
            self.since += 1;
        }
        if fresh && self.gyro {
            newest.rates_rad_s = state.rates_rad_s;
        }
        self.last = Some(newest);
        let age_s = self.delay_s + f64::from(self.since) * self.step_s;
        StateMeasurement { state: newest, age_s, fresh, new: fresh && (sampled || self.gyro) }
    }
}

#[inline]
fn sum(a: &Motion, b: &Motion) -> Motion {
    Motion {
        position_m: a.position_m + b.position_m,
        velocity_m_s: a.velocity_m_s + b.velocity_m_s,
        attitude_rad: a.attitude_rad + b.attitude_rad,
        rates_rad_s: a.rates_rad_s + b.rates_rad_s,
    }
}
