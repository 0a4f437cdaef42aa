//! Simulates the motor controllers (ESCs) of a vehicle.

use afbc_drivers::esc_telemetry::{ANSWER_LEN, EscReading};
use afbc_flight_core::dshot_reply::DshotReply;
use afbc_plant::Plant;
use afbc_types::ROTORS_MAX;

/// Time from a request to the measurement, and to the end of the answer \[ms\]. The frame takes the first millisecond,
/// and ten bytes at 115,200 baud most of the second.
const MEASURES_MS: u32 = 1;
const ANSWERS_MS: u32 = 2;
/// Temperature of the air, and warming of a hovering rotor's controller \[deg C\]. The warming is proportional to the
/// squared speed.
const AIR_C: f32 = 20.0;
const WARMS_C: f32 = 25.0;

/// Motor controllers that share one telemetry line, like real ones. They measure the plant's rotor speed one
/// millisecond after the request, round it down to 100 electrical revolutions per minute, and finish the answer another
/// millisecond later. If the plant has no battery, they report no voltage.
#[derive(Clone, Debug)]
pub struct SimulatedEscs {
    poles: u32,
    /// Rotor whose controller was asked, and the time since then \[ms\].
    asked: Option<(usize, u32)>,
    measured: Option<EscReading>,
    /// Charge that each controller has drawn \[mA h\].
    drawn_mah: [f64; ROTORS_MAX],
}

impl SimulatedEscs {
    /// Creates the controllers of motors with this number of magnetic poles.
    #[must_use]
    pub fn new(poles: u32) -> Self {
        SimulatedEscs { poles, asked: None, measured: None, drawn_mah: [0.0; ROTORS_MAX] }
    }

    /// Returns the electrical speeds in the controllers' answers to a frame of bidirectional DSHOT \[rev/min\]: the
    /// plant's rotor speeds, rounded as the answer encodes them.
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

    /// Advances the controllers by a millisecond that has led to the plant's present state. `asked` is the rotor whose
    /// controller was asked at its beginning ([`HostTick::asks_esc`]). Returns the answer that is complete at its end.
    ///
    /// [`HostTick::asks_esc`]: crate::HostTick::asks_esc
    pub fn step(&mut self, asked: Option<u8>, plant: &Plant) -> Option<[u8; ANSWER_LEN]> {
        let truth = plant.truth();
        let speeds = truth.rotor_speeds_rad_s;
        let battery = plant.telemetry().and_then(|telemetry| telemetry.battery);
        let (current_a, voltage_v) = battery.map_or((0.0, 0.0), |battery| (battery.current_a, battery.voltage_v));
        // Power is proportional to the cube of the speed.
        let power: f64 = speeds.iter().map(|speed| speed.powi(3)).sum();
        // At rest the sum is zero; the limit avoids a division by zero.
        let share = |rotor: usize| speeds.get(rotor).map_or(0.0, |speed| speed.powi(3)) / power.max(1.0);
        for (rotor, drawn_mah) in self.drawn_mah.iter_mut().enumerate() {
            // One ampere for a millisecond is 1/3,600 mA h.
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
