//! Synthetic flights in `f64`: truth, IMU samples that fit it exactly, and noisy sensors.
#![allow(dead_code, unreachable_pub, reason = "each test uses a part")]

pub mod checks;

use afbc_estimator::{Estimate, Estimator, ImuSample, Measurement, Memory, Settings, Stamped};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

pub const G: f64 = 9.81;
pub type V3 = Vector3<f64>;
pub type M3 = Matrix3<f64>;

/// Seeded normal random numbers (Box and Muller).
pub struct Noise(Xoshiro256PlusPlus);

impl Noise {
    pub fn new(seed: u64) -> Self {
        Noise(Xoshiro256PlusPlus::seed_from_u64(seed))
    }

    /// Returns a uniform number in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn normal(&mut self) -> f64 {
        let (u, v) = (1.0 - self.uniform(), self.uniform());
        (-2.0 * u.ln()).sqrt() * (core::f64::consts::TAU * v).cos()
    }

    pub fn vector(&mut self, sigma: f64) -> V3 {
        V3::new(self.normal(), self.normal(), self.normal()) * sigma
    }
}

pub fn skew(v: &V3) -> M3 {
    M3::new(0.0, -v.z, v.y, v.z, 0.0, -v.x, -v.y, v.x, 0.0)
}

/// Returns the rotation by a vector (Rodrigues).
pub fn exp(v: &V3) -> M3 {
    let angle = v.norm();
    if angle < 1e-9 {
        return M3::identity() + skew(v);
    }
    let k = skew(&(v / angle));
    M3::identity() + k * angle.sin() + k * k * (1.0 - angle.cos())
}

/// Returns the vector of a rotation of less than half a turn.
pub fn log(r: &M3) -> V3 {
    let vee = V3::new(r.m32 - r.m23, r.m13 - r.m31, r.m21 - r.m12) * 0.5;
    let angle = vee.norm().atan2((r.trace() - 1.0) * 0.5);
    if angle < 1e-7 { vee } else { vee * (angle / angle.sin()) }
}

/// Returns the matrix of a quaternion w, x, y, z.
pub fn matrix(q: [f32; 4]) -> M3 {
    let [w, x, y, z] = q.map(f64::from);
    M3::new(
        1.0 - 2.0 * (y * y + z * z),
        2.0 * (x * y - w * z),
        2.0 * (x * z + w * y),
        2.0 * (x * y + w * z),
        1.0 - 2.0 * (x * x + z * z),
        2.0 * (y * z - w * x),
        2.0 * (x * z - w * y),
        2.0 * (y * z + w * x),
        1.0 - 2.0 * (x * x + y * y),
    )
}

/// Returns the quaternion w, x, y, z of a rotation.
pub fn quaternion(r: &M3) -> [f32; 4] {
    let v = log(r);
    let angle = v.norm();
    let s = if angle < 1e-9 { 0.5 } else { (0.5 * angle).sin() / angle };
    [(0.5 * angle).cos(), v.x * s, v.y * s, v.z * s].map(|x| x as f32)
}

pub fn single(v: &V3) -> Vector3<f32> {
    v.map(|x| x as f32)
}

pub fn double(v: &Vector3<f32>) -> V3 {
    v.map(f64::from)
}

/// Truth at one millisecond.
#[derive(Clone, Copy)]
pub struct Moment {
    pub r: M3,
    pub v: V3,
    pub p: V3,
    pub rates: V3,
    pub force: V3,
}

/// Position and yaw over time.
pub type Path = fn(f64) -> (V3, f64);

/// Rests for two seconds, then flies a growing figure of eight of 4 by 2 m with changing height and heading, at most 3
/// m/s.
pub fn eight(t: f64) -> (V3, f64) {
    let x = ((t - 2.0) / 4.0).clamp(0.0, 1.0);
    let grown = x * x * x * x * (35.0 - 84.0 * x + 70.0 * x * x - 20.0 * x * x * x);
    let phase = 1.2 * (t - 2.0).max(0.0);
    let place = V3::new(2.0 * phase.sin(), (2.0 * phase).sin(), 1.0 + 0.5 * (0.7 * phase).sin());
    (place * grown, 0.8 * grown * (0.5 * phase).sin())
}

/// Rests.
pub fn rest(_: f64) -> (V3, f64) {
    (V3::zeros(), 0.3)
}

/// Hovers at 2 m from the beginning.
pub fn hover(t: f64) -> (V3, f64) {
    (V3::new(0.02 * (0.9 * t).sin(), 0.02 * (1.1 * t).cos(), 2.0 + 0.01 * (0.7 * t).sin()), 0.1)
}

/// Returns the truth of a flight, one entry per millisecond.
pub fn fly(path: impl Fn(f64) -> (V3, f64), time_s: f64) -> Vec<Moment> {
    const H: f64 = 1e-3;
    // Fourth-order finite differences.
    let velocity =
        |t: f64| (path(t - 2.0 * H).0 - path(t + 2.0 * H).0 + (path(t + H).0 - path(t - H).0) * 8.0) / (12.0 * H);
    let acceleration = |t: f64| {
        let near = path(t + H).0 + path(t - H).0;
        let far = path(t + 2.0 * H).0 + path(t - 2.0 * H).0;
        (near * 16.0 - far - path(t).0 * 30.0) / (12.0 * H * H)
    };
    let attitude = |t: f64| {
        let z = (acceleration(t) + V3::new(0.0, 0.0, G)).normalize();
        let yaw = path(t).1;
        let y = z.cross(&V3::new(yaw.cos(), yaw.sin(), 0.0)).normalize();
        M3::from_columns(&[y.cross(&z), y, z])
    };
    let count = (time_s * 1e3) as usize + 1;
    let attitudes: Vec<M3> = (0..count + 2).map(|i| attitude((i as f64 - 1.0) * 1e-3)).collect();
    (0..count)
        .map(|i| {
            let t = i as f64 * 1e-3;
            let r = attitudes[i + 1];
            // Body rates: half of the rotation from the previous to the next sample.
            let rates = log(&(attitudes[i].transpose() * attitudes[i + 2])) / 2e-3;
            let force = r.transpose() * (acceleration(t) + V3::new(0.0, 0.0, G));
            Moment { r, v: velocity(t), p: path(t).0, rates, force }
        })
        .collect()
}

/// Noise of an IMU: densities, random walks of the biases and their standard deviations at the start.
#[derive(Clone, Copy)]
pub struct Imu {
    pub gyro: f64,
    pub accel: f64,
    pub gyro_walk: f64,
    pub accel_walk: f64,
    pub gyro_bias: f64,
    pub accel_bias: f64,
}

/// ICM-42688-P: 2.8 mdps and 70 ug per root of a hertz; biases of 0.5 dps and 10 mg (at most 20 mg).
pub const ICM: Imu =
    Imu { gyro: 4.9e-5, accel: 6.9e-4, gyro_walk: 1e-5, accel_walk: 1e-4, gyro_bias: 8.7e-3, accel_bias: 0.1 };

/// Returns settings with the true noise of `imu`.
pub fn settings(imu: &Imu) -> Settings {
    Settings {
        gyro_noise_rad_s_rthz: imu.gyro as f32,
        accel_noise_m_s2_rthz: imu.accel as f32,
        gyro_walk_rad_s_rts: imu.gyro_walk as f32,
        accel_walk_m_s2_rts: imu.accel_walk as f32,
        accel_bias_m_s2: imu.accel_bias as f32,
        baro_walk_m_rts: 0.02,
        // The whole reported deviation is noise.
        gnss_noise_m: 100.0,
        mag_slow_rad: 0.0,
        ..Settings::DEFAULT
    }
}

/// Sensors besides the IMU.
#[derive(Clone, Copy, Default)]
pub struct Sensors {
    /// Pose at 100 Hz, 10 +- 2 ms late: standard deviations of position [m] and attitude [rad].
    pub tracker: Option<(f64, f64)>,
    /// Fix at 10 Hz, 100 ms late: standard deviations of horizontal and vertical position [m] and velocity [m/s].
    pub gnss: Option<(f64, f64, f64)>,
    /// Slow error of the receiver's position per coordinate [m], with its correlation time [s].
    pub slow: Option<(f64, f64)>,
    /// Field of the vehicle itself along body x and y, in shares of the earth's horizontal field.
    pub iron: Option<f64>,
    /// Height at 50 Hz, 20 ms late: standard deviation [m].
    pub baro: Option<f64>,
    /// Field at 50 Hz, 10 ms late: standard deviation, for a field of strength 1 and an inclination of 63 degrees.
    pub mag: Option<f64>,
}

pub const NOTHING: Sensors = Sensors { tracker: None, gnss: None, slow: None, iron: None, baro: None, mag: None };
pub const MOCAP: Sensors =
    Sensors { tracker: Some((1e-3, 3.5e-3)), gnss: None, slow: None, iron: None, baro: None, mag: None };
pub const OUTDOOR: Sensors =
    Sensors { tracker: None, gnss: Some((0.8, 1.2, 0.1)), slow: None, iron: None, baro: Some(0.15), mag: Some(0.01) };

/// Returns the magnetic field in the earth frame: north and down.
pub fn field() -> V3 {
    V3::new(0.45, 0.0, -0.893)
}

/// One flight with an estimator.
pub struct Flight<'a> {
    pub truth: &'a [Moment],
    pub estimator: Estimator,
    pub memory: Memory,
    pub noise: Noise,
    pub imu: Imu,
    pub sensors: Sensors,
    pub gyro_bias: V3,
    pub accel_bias: V3,
    pub baro_offset: f64,
    /// The receiver's slow error, drawn with the first fix.
    pub slow: Option<V3>,
    /// Field of the vehicle itself.
    pub iron: V3,
    /// Extra delay of all sensors [ms].
    pub late_ms: f64,
    /// Index of the next moment.
    pub now: usize,
    /// Measurements under way, with the millisecond of their arrival.
    under_way: Vec<(usize, Stamped<Measurement>)>,
    /// The last IMU sample.
    pub sample: ImuSample,
}

impl<'a> Flight<'a> {
    pub fn new(truth: &'a [Moment], imu: Imu, sensors: Sensors, seed: u64) -> Self {
        Self::with(truth, imu, sensors, seed, settings(&imu))
    }

    pub fn with(truth: &'a [Moment], imu: Imu, sensors: Sensors, seed: u64, settings: Settings) -> Self {
        let mut noise = Noise::new(seed);
        let (gyro_bias, accel_bias) = (noise.vector(imu.gyro_bias), noise.vector(imu.accel_bias));
        let iron = sensors.iron.map_or(V3::zeros(), |iron| noise.vector(iron * field().xy().norm()));
        Flight {
            truth,
            estimator: Estimator::new(settings).unwrap(),
            memory: Memory::default(),
            noise,
            imu,
            sensors,
            gyro_bias,
            accel_bias,
            baro_offset: 37.0,
            slow: None,
            iron: V3::new(iron.x, iron.y, 0.0),
            late_ms: 0.0,
            now: 0,
            under_way: Vec::new(),
            sample: ImuSample::default(),
        }
    }

    pub fn now_us(&self) -> u64 {
        1_000_000 + self.now as u64 * 1000
    }

    /// Returns the truth at the time of the last step.
    pub fn moment(&self) -> &Moment {
        &self.truth[self.now - 1]
    }

    fn sense(&mut self) {
        let at_us = self.now_us();
        let moment = self.truth[self.now];
        let late_ms = self.late_ms;
        let mut send = |delay_ms: f64, value| {
            self.under_way.push((self.now + (delay_ms + late_ms).round() as usize, Stamped { value, at_us }));
        };
        if let Some((position, attitude)) = self.sensors.tracker.filter(|_| self.now % 10 == 3) {
            let r = exp(&self.noise.vector(attitude)) * moment.r;
            let delay_ms = 8.0 + 4.0 * self.noise.uniform();
            send(
                delay_ms,
                Measurement::Pose {
                    position_m: single(&(moment.p + self.noise.vector(position))),
                    attitude: quaternion(&r),
                    position_sigma_m: position as f32,
                    attitude_sigma_rad: attitude as f32,
                },
            );
        }
        if let Some((horizontal, vertical, speed)) = self.sensors.gnss.filter(|_| self.now % 100 == 17) {
            let mut error = self.noise.vector(1.0).component_mul(&V3::new(horizontal, horizontal, vertical));
            let mut told = (horizontal, vertical);
            if let Some((sigma, time_s)) = self.sensors.slow {
                let (stays, new) = ((-0.1 / time_s).exp(), self.noise.vector(sigma));
                let slow = self.slow.map_or(new, |slow| slow * stays + new * (1.0 - stays * stays).sqrt());
                self.slow = Some(slow);
                error += slow;
                told = (horizontal.hypot(sigma), vertical.hypot(sigma));
            }
            send(
                100.0,
                Measurement::Gnss {
                    position_m: single(&(moment.p + error)),
                    velocity_m_s: single(&(moment.v + self.noise.vector(speed))),
                    horizontal_sigma_m: told.0 as f32,
                    vertical_sigma_m: told.1 as f32,
                    speed_sigma_m_s: speed as f32,
                    climb_sigma_m_s: speed as f32,
                },
            );
        }
        if let Some(sigma) = self.sensors.baro.filter(|_| self.now % 20 == 5) {
            let height_m = (moment.p.z + self.baro_offset + self.noise.normal() * sigma) as f32;
            send(20.0, Measurement::Height { height_m, sigma_m: sigma as f32 });
        }
        if let Some(sigma) = self.sensors.mag.filter(|_| self.now % 20 == 11) {
            let field = single(&(moment.r.transpose() * field() + self.iron + self.noise.vector(sigma)));
            send(10.0, Measurement::MagneticField { field, sigma: sigma as f32 });
        }
    }

    /// Flies one millisecond. `imu` and `deliver` may change the estimator's input, or drop it by returning false.
    pub fn step_with(
        &mut self,
        imu: impl FnOnce(&mut ImuSample) -> bool,
        mut deliver: impl FnMut(&mut Stamped<Measurement>) -> bool,
    ) -> Estimate {
        self.sense();
        let now_us = self.now_us();
        let moment = self.truth[self.now];
        let root_dt = 1e-3_f64.sqrt();
        self.gyro_bias += self.noise.vector(self.imu.gyro_walk * root_dt);
        self.accel_bias += self.noise.vector(self.imu.accel_walk * root_dt);
        self.baro_offset += self.noise.normal() * 0.02 * root_dt;
        let rates = moment.rates + self.gyro_bias + self.noise.vector(self.imu.gyro / root_dt);
        let force = moment.force + self.accel_bias + self.noise.vector(self.imu.accel / root_dt);
        let mut sample = ImuSample { at_us: now_us, rates_rad_s: single(&rates), specific_force_m_s2: single(&force) };
        let given = imu(&mut sample);
        self.sample = sample;
        let now = self.now;
        let memory = &mut self.memory;
        self.under_way.retain_mut(|(at, measurement)| {
            let arrives = *at <= now;
            if arrives && deliver(measurement) {
                memory.offer(measurement);
            }
            !arrives
        });
        let estimate = self.estimator.step(&mut self.memory, now_us, given.then_some(&sample));
        self.now += 1;
        estimate
    }

    pub fn step(&mut self) -> Estimate {
        self.step_with(|_| true, |_| true)
    }

    /// Returns the errors, truth minus estimate, in the order of the covariance.
    pub fn errors(&self, estimate: &Estimate) -> SVector<f64, 16> {
        let truth = self.moment();
        let theta = log(&(truth.r * matrix(estimate.attitude).transpose()));
        let v = truth.v - double(&estimate.state.velocity_m_s);
        let p = truth.p - double(&estimate.state.position_m);
        let g = self.gyro_bias - double(&estimate.gyro_bias_rad_s);
        let a = self.accel_bias - double(&estimate.accel_bias_m_s2);
        let mut errors = SVector::<f64, 16>::zeros();
        for (i, part) in [theta, v, p, g, a].iter().enumerate() {
            errors.fixed_rows_mut::<3>(3 * i).copy_from(part);
        }
        errors[15] = self.baro_offset - f64::from(estimate.height_offset_m);
        errors
    }

    pub fn covariance(&self) -> SMatrix<f64, 16, 16> {
        let rows = self.memory.covariance();
        SMatrix::from_fn(|i, j| f64::from(rows[i][j]))
    }

    /// Returns the normalised estimation error squared of the first `N` errors; panics if the covariance is not
    /// positive.
    pub fn nees<const N: usize>(&self, estimate: &Estimate) -> f64 {
        let p: SMatrix<f64, N, N> = self.covariance().fixed_view::<N, N>(0, 0).into_owned();
        let e: SVector<f64, N> = self.errors(estimate).fixed_rows::<N>(0).into_owned();
        // Scaled, so that units do not matter.
        let scale = p.diagonal().map(f64::sqrt);
        let correlation = SMatrix::<f64, N, N>::from_fn(|i, j| p[(i, j)] / (scale[i] * scale[j]));
        let e = e.component_div(&scale);
        correlation.cholesky().expect("positive").solve(&e).dot(&e)
    }
}

/// Root mean square.
#[derive(Clone, Copy, Debug, Default)]
pub struct Rms {
    sum: f64,
    count: f64,
}

impl Rms {
    pub fn add(&mut self, value: f64) {
        self.sum += value * value;
        self.count += 1.0;
    }

    pub fn value(&self) -> f64 {
        assert!(self.count > 0.0);
        (self.sum / self.count).sqrt()
    }
}
