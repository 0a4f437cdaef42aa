//! The motor controllers of a simulated vehicle.

use afbc_drivers::esc_telemetry::{ANSWER_LEN, EscReading};
use afbc_flight_core::dshot_reply::DshotReply;
use afbc_plant::Plant;
use afbc_types::ROTORS_MAX;

/// Steps from a question to the measurement, and to the end of the answer \[ms\]: the frame takes the first, ten bytes
/// at 115,200 baud most of another.
const MEASURES_MS: u32 = 1;
const ANSWERS_MS: u32 = 2;
/// Temperature in the shade, and warming by a hovering rotor's square \[deg C\].
const AIR_C: f32 = 20.0;
const WARMS_C: f32 = 25.0;

/// Motor controllers that answer over one line, as real ones do: what the plant's rotors do a millisecond after the
/// question, rounded down to 100 electrical revolutions per minute, and heard another millisecond later. Without a
/// battery in the plant they measure no voltage.
#[derive(Clone, Debug)]
pub struct SimulatedEscs {
    poles: u32,
    /// The one that has been asked, and how long ago \[ms\].
    asked: Option<(usize, u32)>,
    measured: Option<EscReading>,
    /// Charge that each has drawn \[mA h\].
    drawn_mah: [f64; ROTORS_MAX],
}

impl SimulatedEscs {
    /// Creates those of motors with so many magnetic poles.
    #[must_use]
    pub fn new(poles: u32) -> Self {
        SimulatedEscs { poles, asked: None, measured: None, drawn_mah: [0.0; ROTORS_MAX] }
    }

    /// Returns the electrical speeds with which they answer a frame by bidirectional DSHOT \[rev/min\]: what the
    /// plant's rotors do, as an answer has room for it.
    #[must_use]
    pub fn answers_rev_min(&self, plant: &Plant) -> [Option<u32>; ROTORS_MAX] {
        let mut answers = [None; ROTORS_MAX];
        for (answer, speed_rad_s) in answers.iter_mut().zip(&plant.truth().rotor_speeds_rad_s) {
            let speed_rev_min = speed_rad_s * (30.0 / std::f64::consts::TAU) * f64::from(self.poles);
            let reply = DshotReply::from_bits(DshotReply::bits_of_speed(speed_rev_min as u32));
            *answer = reply.ok().and_then(DshotReply::speed_rev_min);
        }
        answers
    }

    /// Advances them by a millisecond, at whose beginning a rotor's is asked ([`HostTick::asks_esc`]), and during which
    /// the plant has come to where it is; returns what comes over the line by its end.
    ///
    /// [`HostTick::asks_esc`]: crate::HostTick::asks_esc
    pub fn step(&mut self, asked: Option<u8>, plant: &Plant) -> Option<[u8; ANSWER_LEN]> {
        let truth = plant.truth();
        let speeds = truth.rotor_speeds_rad_s;
        let battery = plant.telemetry().and_then(|telemetry| telemetry.battery);
        let (current_a, voltage_v) = battery.map_or((0.0, 0.0), |battery| (battery.current_a, battery.voltage_v));
        // Power goes with the cube of the speed.
        let power: f64 = speeds.iter().map(|speed| speed.powi(3)).sum();
        // At rest the sum is zero: no share then, rather than no number.
        let share = |rotor: usize| speeds.get(rotor).map_or(0.0, |speed| speed.powi(3)) / power.max(1.0);
        for (rotor, drawn_mah) in self.drawn_mah.iter_mut().enumerate() {
            // An ampere for a millisecond is the 3,600th part of a milliampere hour.
            *drawn_mah += current_a * share(rotor) / 3_600.0;
        }
        if let Some(rotor) = asked {
            self.asked = Some((rotor.into(), 0));
        }
        let (rotor, since_ms) = self.asked.as_mut()?;
        *since_ms += 1;
        if *since_ms == MEASURES_MS {
            let speed_rad_s = speeds.get(*rotor).copied().unwrap_or_default() as f32;
            let ratio = speed_rad_s / (truth.hover_rad_s as f32).max(1.0);
            self.measured = Some(EscReading {
                temperature_c: (AIR_C + WARMS_C * ratio * ratio).min(120.0) as i8,
                voltage_cv: (voltage_v * 100.0) as u16,
                current_ca: (current_a * share(*rotor) * 100.0) as u16,
                consumed_mah: self.drawn_mah.get(*rotor).copied().unwrap_or_default() as u16,
                erpm_hundreds: EscReading::erpm_hundreds_of(speed_rad_s, self.poles),
            });
        }
        if *since_ms < ANSWERS_MS {
            return None;
        }
        self.asked = None;
        self.measured.take().map(|reading| reading.to_bytes())
    }
}
