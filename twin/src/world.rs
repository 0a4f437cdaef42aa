//! Converts the readings of the plant's instruments into signals of the board's transducers.

use afbc_estimator::{GeodeticOrigin, Measurement};
use afbc_onboard::Readings;
use nalgebra::Vector3;
use rigless::chip::nmea::Position;
use rigless::machine::flight::{AT_REST, Signals};

/// Origin of the local frame: PX4's usual place near Zurich \[degrees, m\].
const PLACE: [f64; 3] = [47.397_742, 8.545_594, 488.0];
/// Pressure of the standard atmosphere at sea level, from which the barometer's driver computes a height.
const SEA_LEVEL_PA: f64 = 101_325.0;
const GRAVITY_M_S2: f64 = 9.806_65;

/// Returns the signals at the start, where the vehicle stands. The receiver's first fix becomes the origin of the
/// local frame.
pub fn at_the_place() -> Signals {
    let [latitude, longitude, altitude] = PLACE;
    let [latitude, longitude] = [latitude, longitude].map(|degrees| (degrees * 1e7).round() as i32);
    let position = Position { latitude, longitude, altitude: (altitude * 1e3).round() as i32 };
    Signals { position, ..AT_REST }
}

/// Signals of the transducers, kept between two readings of an instrument.
#[derive(Clone)]
pub struct Transducers {
    signals: Signals,
    /// Metres per 1e-7 degrees to the north and to the east.
    scale: [f64; 2],
    fix_m: [f64; 3],
    height_m: f64,
}

impl Transducers {
    pub fn new() -> Self {
        let [latitude, longitude, altitude] = PLACE;
        let origin = GeodeticOrigin::new(latitude, longitude, altitude).expect("a place");
        let step = origin.local(latitude + 1e-3, longitude + 1e-3, altitude) * 1e-4;
        let scale = [step.x.into(), (-step.y).into()];
        Transducers { signals: at_the_place(), scale, fix_m: [0.0; 3], height_m: 0.0 }
    }

    /// Returns the newest fix in the world's frame [m].
    pub fn fix_m(&self) -> [f64; 3] {
        self.fix_m
    }

    /// Returns the newest height of the barometer [m].
    pub fn height_m(&self) -> f64 {
        self.height_m
    }

    /// Updates the signals by the instruments' readings, and returns them.
    pub fn signals(&mut self, readings: &Readings) -> Signals {
        if let Some(imu) = &readings.imu {
            let [rates, force] = imu.value.map(frd);
            self.signals.angular_rate = rates.map(|rate| (rate.to_degrees() * 1e3).round() as i32);
            self.signals.specific_force = force.map(|force| (force / GRAVITY_M_S2 * 1e6).round() as i32);
        }
        for aid in readings.aids.iter().flatten() {
            match aid.value {
                Measurement::Height { height_m, .. } => {
                    self.height_m = height_m.into();
                    let height_m = f64::from(height_m) + PLACE[2];
                    let pressure_pa = SEA_LEVEL_PA * (1.0 - height_m / 44_330.77).powf(1.0 / 0.190_263_2);
                    self.signals.pressure = pressure_pa.round() as u32;
                }
                // The field's unit is the earth's field near Zurich \[nT\].
                Measurement::MagneticField { field, .. } => {
                    self.signals.magnetic_field = frd(field).map(|field| (field * 1e3).round() as i32);
                }
                Measurement::Gnss { position_m, velocity_m_s, .. } => {
                    self.fix_m = position_m.cast::<f64>().into();
                    let [north, down] = [position_m.x, -position_m.z].map(f64::from);
                    let east = f64::from(-position_m.y);
                    let [latitude, longitude, altitude] = PLACE;
                    self.signals.position = Position {
                        latitude: (latitude * 1e7 + north / self.scale[0]).round() as i32,
                        longitude: (longitude * 1e7 + east / self.scale[1]).round() as i32,
                        altitude: ((altitude - down) * 1e3).round() as i32,
                    };
                    self.signals.velocity = frd(velocity_m_s).map(|speed| (speed * 1e3).round() as i32);
                }
                _ => {}
            }
        }
        self.signals
    }
}

/// Converts a vector to y right (east) and z down.
fn frd(vector: Vector3<f32>) -> [f64; 3] {
    [vector.x.into(), (-vector.y).into(), (-vector.z).into()]
}
