//! CRSF telemetry, shown and spoken by the pilot's transmitter. Numbers are big-endian. Source: see [`crate::crsf`].

use crate::crsf::{FRAME_MAX, framed};
use heapless::Vec;

/// Largest number of characters of a flight mode that transmitters show.
const MODE_MAX: usize = 14;

/// A telemetry frame to the transmitter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CrsfTelemetry<'a> {
    /// BATTERY_SENSOR (0x08).
    Battery {
        /// Voltage \[V\].
        voltage_v: f32,
        /// Current \[A\].
        current_a: f32,
        /// Charge drawn \[mAh\].
        drawn_mah: f32,
        /// Charge left, 0 to 1.
        left: f32,
    },
    /// ATTITUDE (0x1E), with axes forward, right, down.
    Attitude {
        /// Roll, pitch, yaw \[rad\].
        angles_rad: [f32; 3],
    },
    /// FLIGHT_MODE (0x21).
    Mode(&'a str),
    /// GPS (0x02).
    Gps {
        /// Latitude and longitude \[1e-7 degrees\].
        place_1e7deg: [i32; 2],
        /// Speed over ground \[m/s\].
        speed_m_s: f32,
        /// Course over ground \[rad\].
        course_rad: f32,
        /// Height above mean sea level \[m\].
        height_m: f32,
        /// Number of satellites.
        satellites: u8,
    },
}

impl CrsfTelemetry<'_> {
    /// Returns the frame's bytes.
    pub fn encode(&self) -> Vec<u8, FRAME_MAX> {
        let mut payload: Vec<u8, FRAME_MAX> = Vec::new();
        let mut put = |bytes: &[u8]| {
            // This never fails, because every payload fits.
            let _ = payload.extend_from_slice(bytes);
        };
        // `as` saturates and converts NaN to 0.
        let kind = match *self {
            CrsfTelemetry::Battery { voltage_v, current_a, drawn_mah, left } => {
                put(&((voltage_v * 10.0 + 0.5) as u16).to_be_bytes());
                put(&((current_a * 10.0 + 0.5) as u16).to_be_bytes());
                let [_, drawn @ ..] = (drawn_mah as u32).min(0xFF_FFFF).to_be_bytes();
                put(&drawn);
                put(&[((left * 100.0 + 0.5) as u8).min(100)]);
                0x08
            }
            CrsfTelemetry::Attitude { angles_rad: [roll, pitch, yaw] } => {
                // Order of the protocol: pitch, roll, yaw.
                for angle_rad in [pitch, roll, yaw] {
                    let ticks = angle_rad * 10_000.0;
                    put(&((if ticks < 0.0 { ticks - 0.5 } else { ticks + 0.5 }) as i16).to_be_bytes());
                }
                0x1E
            }
            CrsfTelemetry::Mode(name) => {
                name.bytes().filter(u8::is_ascii_graphic).take(MODE_MAX).for_each(|byte| put(&[byte]));
                put(&[0]);
                0x21
            }
            CrsfTelemetry::Gps { place_1e7deg, speed_m_s, course_rad, height_m, satellites } => {
                place_1e7deg.iter().for_each(|degrees| put(&degrees.to_be_bytes()));
                // Unit 0.1 km/h.
                put(&((speed_m_s * 36.0 + 0.5) as u16).to_be_bytes());
                let course = course_rad.to_degrees() * 100.0;
                put(&((if course < 0.0 { course + 36_000.0 } else { course }) as u16).to_be_bytes());
                // The number is unsigned and counts from 1000 m below sea level.
                put(&((height_m + 1000.0) as u16).to_be_bytes());
                put(&[satellites]);
                0x02
            }
        };
        framed(kind, &payload)
    }
}
