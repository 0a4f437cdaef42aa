//! Writes a simulated flight as a PX4 ULog, for the tests.
#![allow(dead_code, clippy::indexing_slicing, reason = "each test file uses a part")]

use afbc_replay::{Recording, Replayed, fly, read};
use std::fs;
use std::path::{Path, PathBuf};

/// Time of the log's start \[us\].
pub(crate) const BOOT_US: u64 = 50_000_000;
/// Place at which the flight begins: latitude, longitude \[degrees\], altitude \[m\].
pub(crate) const HOME: [f64; 3] = [47.397742, 8.545594, 488.0];
/// Metres per degree of latitude and of longitude at [`HOME`], on the ellipsoid.
pub(crate) const PER_DEGREE: [f64; 2] = [111_183.0, 75_512.0];
/// Declination at [`HOME`] \[rad\].
const DECLINATION_RAD: f64 = 0.059;

/// Properties of a log.
#[derive(Clone, Debug)]
pub(crate) struct Kind {
    pub(crate) old: bool,
    pub(crate) rate_hz: u64,
    pub(crate) duration_s: f64,
    /// Topics to leave out.
    pub(crate) without: Vec<&'static str>,
    /// Time of the flight at which the log begins \[s\]. The flight is at rest before 0, from -3 s on by default.
    pub(crate) begins_s: f64,
    /// Begin and end of a gap in the IMU samples, in the log's time \[s\].
    pub(crate) gap_s: (f64, f64),
    /// Time at which the log's position is reset and its reference changes \[s\].
    pub(crate) reset_s: f64,
    /// Bias of the magnetometer's y axis that EKF2 has learned \[gauss\].
    pub(crate) iron: f64,
    /// Unknown bias of the magnetometer in its axes \[gauss\].
    pub(crate) stray: [f64; 3],
    /// Number of receivers; all but the last have no fix.
    pub(crate) receivers: u8,
}

impl Default for Kind {
    fn default() -> Self {
        Kind {
            old: false,
            rate_hz: 250,
            duration_s: 25.0,
            without: Vec::new(),
            begins_s: -3.0,
            gap_s: (0.0, 0.0),
            reset_s: f64::INFINITY,
            iron: 0.0,
            stray: [0.0; 3],
            receivers: 1,
        }
    }
}

/// Position, velocity, acceleration \[m, s\] in north-east-down, and yaw with its rate \[rad, s\]; the vehicle is
/// always level.
pub(crate) struct Truth {
    pub(crate) position: [f64; 3],
    pub(crate) velocity: [f64; 3],
    pub(crate) acceleration: [f64; 3],
    pub(crate) yaw: (f64, f64),
}

/// Returns the flight's state at a time: first at rest, then on a smooth path.
pub(crate) fn truth(time_s: f64) -> Truth {
    let t = time_s.max(0.0);
    // size (1 - cos(w t)) has no jump in the velocity.
    let swing = |size: f64, w: f64| {
        let (s, c) = (w * t).sin_cos();
        (size * (1.0 - c), size * w * s, if time_s > 0.0 { size * w * w * c } else { 0.0 })
    };
    let (n, e, d, yaw) = (swing(6.0, 0.6), swing(-4.0, 0.45), swing(-2.0, 0.7), swing(0.4, 0.5));
    Truth { position: [n.0, e.0, d.0], velocity: [n.1, e.1, d.1], acceleration: [n.2, e.2, d.2], yaw: (yaw.0, yaw.1) }
}

/// The bytes of a log.
#[derive(Default)]
pub(crate) struct Ulog {
    pub(crate) bytes: Vec<u8>,
    ids: u16,
}

impl Ulog {
    pub(crate) fn new() -> Self {
        let mut log = Ulog::default();
        log.bytes.extend(b"ULog\x01\x12\x35\x01");
        log.bytes.extend(BOOT_US.to_le_bytes());
        log.record(b'B', &[0; 40]);
        log
    }

    pub(crate) fn record(&mut self, kind: u8, content: &[u8]) {
        self.bytes.extend((content.len() as u16).to_le_bytes());
        self.bytes.push(kind);
        self.bytes.extend(content);
    }

    fn parameter(&mut self, name: &str, value: f32) {
        let key = format!("float {name}");
        let mut content = vec![key.len() as u8];
        content.extend(key.bytes());
        content.extend(value.to_le_bytes());
        self.record(b'P', &content);
    }

    fn format(&mut self, name: &str, fields: &str) {
        self.record(b'F', format!("{name}:uint64_t timestamp;{fields}").as_bytes());
    }

    pub(crate) fn subscribe(&mut self, name: &str, instance: u8) -> u16 {
        let id = self.ids;
        self.ids += 1;
        let mut content = vec![instance];
        content.extend(id.to_le_bytes());
        content.extend(name.bytes());
        self.record(b'A', &content);
        id
    }

    fn data(&mut self, id: Option<u16>, at_us: u64, values: &[Value]) {
        let Some(id) = id else { return };
        let mut content = id.to_le_bytes().to_vec();
        content.extend(at_us.to_le_bytes());
        for value in values {
            match value {
                Value::F(value) => content.extend((*value as f32).to_le_bytes()),
                Value::D(value) => content.extend(value.to_le_bytes()),
                Value::I(value) => content.extend(value.to_le_bytes()),
                Value::B(value) => content.push(*value),
                Value::U(value) => content.extend(value.to_le_bytes()),
            }
        }
        self.record(b'D', &content);
    }
}

enum Value {
    F(f64),
    D(f64),
    I(i32),
    B(u8),
    U(u64),
}
use Value::{B, D, F, I, U};

/// Noise within +-1 that is the same in every run.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / f64::from(1_u32 << 30) - 1.0
    }
}

/// Writes a log of that kind.
pub(crate) fn log(kind: &Kind) -> Vec<u8> {
    let mut log = Ulog::new();
    let old = kind.old;
    for (name, new, before) in [
        (
            "sensor_combined",
            "float[3] gyro_rad;uint32_t gyro_integral_dt;float[3] accelerometer_m_s2",
            "float[3] gyro_rad;float gyro_integral_dt;float[3] accelerometer_m_s2;int32_t \
             magnetometer_timestamp_relative;float[3] magnetometer_ga;int32_t baro_timestamp_relative;float \
             baro_alt_meter",
        ),
        (
            "vehicle_gps_position",
            "double latitude_deg;double longitude_deg;double altitude_msl_m;uint64_t time_utc_usec;float eph;float \
             epv;float s_variance_m_s;float vel_n_m_s;float vel_e_m_s;float vel_d_m_s;uint8_t fix_type;bool \
             vel_ned_valid",
            "int32_t lat;int32_t lon;int32_t alt;uint64_t time_utc_usec;float eph;float epv;float \
             s_variance_m_s;float vel_n_m_s;float vel_e_m_s;float vel_d_m_s;uint8_t fix_type;bool vel_ned_valid",
        ),
        ("vehicle_magnetometer", "uint64_t timestamp_sample;float[3] magnetometer_ga", ""),
        ("vehicle_air_data", "uint64_t timestamp_sample;float baro_alt_meter", ""),
        ("vehicle_attitude", "float[4] q;uint8_t quat_reset_counter;uint8_t[3] _padding0", "float[4] q"),
        (
            "vehicle_local_position",
            "double ref_lat;double ref_lon;float ref_alt;float x;float y;float z;float vx;float vy;float vz;float[2] \
             delta_xy;uint8_t xy_reset_counter;bool xy_valid;bool z_valid;bool v_xy_valid;bool v_z_valid",
            "double ref_lat;double ref_lon;float ref_alt;float x;float y;float z;float vx;float vy;float vz;bool \
             xy_valid;bool z_valid;bool v_xy_valid;bool v_z_valid",
        ),
        ("vehicle_land_detected", "bool landed", "bool landed"),
    ] {
        let fields = if old { before } else { new };
        if !fields.is_empty() {
            log.format(name, &fields.replace("  ", ""));
        }
    }
    log.parameter("EKF2_GPS_DELAY", 120.0);
    log.parameter("EKF2_MAGBIAS_ID", 590.0);
    log.parameter("EKF2_MAGBIAS_Y", kind.iron as f32);
    let wanted = |name: &str| !kind.without.contains(&name);
    let mut id = |name: &str, instance: u8| wanted(name).then(|| log.subscribe(name, instance));
    let imu = id("sensor_combined", 0);
    let receivers: Vec<_> = (0..kind.receivers).map(|instance| id("vehicle_gps_position", instance)).collect();
    let mag = if old { None } else { id("vehicle_magnetometer", 0) };
    let baro = if old { None } else { id("vehicle_air_data", 0) };
    let (attitude, motion) = (id("vehicle_attitude", 0), id("vehicle_local_position", 0));
    let landed = id("vehicle_land_detected", 0);

    let mut noise = Noise(1);
    let step_us = 1_000_000 / kind.rate_hz;
    let steps = (kind.duration_s * kind.rate_hz as f64) as u64;
    let due = |index: u64, every_us: u64| (index * step_us) % every_us < step_us;
    for index in 0..steps {
        let at_us = BOOT_US + 200_000 + index * step_us;
        let log_s = (index * step_us) as f64 * 1e-6;
        let time_s = kind.begins_s + log_s;
        // The samples are means over the step before them.
        let now = truth(time_s - 0.5e-6 * step_us as f64);
        let body = |yaw: f64, [n, e, d]: [f64; 3]| {
            let (s, c) = yaw.sin_cos();
            [c * n + s * e, c * e - s * n, d]
        };
        let [fx, fy, fz] = body(now.yaw.0, now.acceleration);
        let mut shaken = |value: f64, size: f64| F(value + size * noise.next());
        let gyro = [shaken(0.002, 2e-3), shaken(-0.003, 2e-3), shaken(now.yaw.1, 2e-3)];
        let force = [shaken(fx, 0.02), shaken(fy, 0.02), shaken(fz - 9.81, 0.02)];
        let exact = truth(time_s);
        let (s, c) = DECLINATION_RAD.sin_cos();
        let [bx, by, bz] = body(exact.yaw.0, [0.21 * c, 0.21 * s, 0.43]);
        let [sx, sy, sz] = kind.stray;
        let field = [shaken(bx + sx, 1e-3), shaken(by + kind.iron + sy, 1e-3), shaken(bz + sz, 1e-3)];
        let height = shaken(HOME[2] + 3.0 - exact.position[2], 0.2);
        if !(kind.gap_s.0..kind.gap_s.1).contains(&log_s) {
            let mut values: Vec<Value> = gyro.into();
            values.push(if old { F(1e-6 * step_us as f64) } else { I(step_us as i32) });
            values.extend(force);
            if old {
                let fresh = |every_us| if due(index, every_us) { I(-500) } else { I(i32::MAX) };
                let [without_mag, without_baro] =
                    ["vehicle_magnetometer", "vehicle_air_data"].map(|name| !wanted(name));
                let nan = || F(f64::NAN);
                values.push(if without_mag { I(i32::MAX) } else { fresh(20_000) });
                let field_values: [Value; 3] = if without_mag { [nan(), nan(), nan()] } else { field };
                values.extend(field_values);
                values.push(if without_baro { I(i32::MAX) } else { fresh(20_000) });
                values.push(if without_baro { nan() } else { height });
                log.data(imu, at_us, &values);
            } else {
                log.data(imu, at_us, &values);
                if due(index, 20_000) {
                    let [x, y, z] = field;
                    log.data(mag, at_us, &[U(at_us), x, y, z]);
                    log.data(baro, at_us, &[U(at_us), height]);
                }
            }
        }
        if due(index, 200_000) {
            let then = truth(time_s - 0.12);
            let place = [
                HOME[0] + then.position[0] / PER_DEGREE[0],
                HOME[1] + then.position[1] / PER_DEGREE[1],
                HOME[2] - then.position[2],
            ];
            for (receiver, id) in receivers.iter().enumerate() {
                let fix = if receiver + 1 == receivers.len() { 3 } else { 0 };
                let mut values: Vec<Value> = if old {
                    let [lat, lon, alt] = place;
                    vec![I((lat * 1e7) as i32), I((lon * 1e7) as i32), I((alt * 1e3) as i32)]
                } else {
                    place.map(D).into()
                };
                values.extend([U(1_710_773_351_000_000), F(0.6), F(0.9), F(0.2)]);
                values.extend(then.velocity.map(|speed| F(speed + 0.02 * noise.next())));
                values.extend([B(fix), B(1)]);
                log.data(*id, at_us, &values);
            }
        }
        if due(index, 20_000) {
            let (s, c) = (0.5 * exact.yaw.0).sin_cos();
            let mut values = vec![F(c), F(0.0), F(0.0), F(s)];
            if !old {
                values.push(B(0));
            }
            log.data(attitude, at_us, &values);
            // After the reset the log's reference is 10 m further north.
            let (moved, count) = if log_s < kind.reset_s { (0.0, 4) } else { (10.0, 5) };
            let [n, e, d] = exact.position;
            let mut values = vec![D(HOME[0] + moved / PER_DEGREE[0]), D(HOME[1]), F(HOME[2]), F(n - moved), F(e), F(d)];
            values.extend(exact.velocity.map(F));
            if !old {
                values.extend([F(-moved), F(0.0), B(count)]);
            }
            values.extend([B(1), B(1), B(1), B(1)]);
            log.data(motion, at_us, &values);
        }
        if due(index, 500_000) {
            log.data(landed, at_us, &[B(u8::from(time_s < 0.0))]);
            log.record(b'S', &[0x2f, 0x73, 0x13, 0x20, 0x25, 0x0c, 0xbb, 0x12]);
        }
    }
    log.bytes
}

/// Returns the kind, begin and end of each record of a log.
pub(crate) fn records(bytes: &[u8]) -> Vec<(u8, usize, usize)> {
    let (mut at, mut records) = (16, Vec::new());
    while at < bytes.len() {
        let end = at + 3 + usize::from(u16::from_le_bytes([bytes[at], bytes[at + 1]]));
        records.push((bytes[at + 2], at, end));
        at = end;
    }
    records
}

/// Writes bytes into a file for a test and returns its path.
pub(crate) fn file(name: &str, bytes: &[u8]) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("replay");
    fs::create_dir_all(&folder).unwrap();
    let path = folder.join(name);
    fs::write(&path, bytes).unwrap();
    path
}

/// Reads a log and runs the estimator on it.
pub(crate) fn replay(name: &str, bytes: &[u8]) -> (Recording, Replayed) {
    let recording = read(&file(name, bytes)).unwrap();
    let replayed = fly(&recording, None).unwrap();
    (recording, replayed)
}
