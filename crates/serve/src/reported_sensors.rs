//! Sensor data that a vehicle's services get outside the control tick: GNSS receiver, battery, barometer and
//! magnetometer state, and the local frame's place on the earth.

use afbc_comms::AuxSensors;
use afbc_comms::services::health::sensor;
use afbc_comms::services::origin::EarthOrigin;
use afbc_comms::services::status::{GnssReceiver, SensorBits};
use afbc_estimator::Measurement;
use afbc_mavlink::telemetry::BatteryStatus;
use afbc_onboard::Readings;
use afbc_plant::InstrumentSuite;
use afbc_scenario::Scenario;
use afbc_sim::flight::World;

/// Silence after which a sensor counts as failed \[ms\].
const SILENT_MS: u32 = 1000;
/// Number of satellites that the simulated receiver reports.
const SATELLITES: u8 = 14;

/// Watches the sensors of one vehicle.
pub(crate) struct ReportedSensors {
    suite: InstrumentSuite,
    origin: Option<EarthOrigin>,
    /// Time since the last reading of GNSS receiver, barometer and magnetometer \[ms\].
    silent_ms: [u32; 3],
    sigma_mm: [u32; 2],
}

impl ReportedSensors {
    pub(crate) fn new(scenario: &Scenario) -> Self {
        let suite = scenario.instruments;
        // Without a GNSS receiver, the frame's place on the earth is unknown.
        let origin = suite.gnss.and_then(|_| EarthOrigin::new(EarthOrigin::SIMULATED));
        // A sensor counts as failed until its first reading.
        ReportedSensors { suite, origin, silent_ms: [SILENT_MS; 3], sigma_mm: [0; 2] }
    }

    /// Returns the place of the local frame's origin on the earth, if known.
    pub(crate) fn origin(&self) -> Option<EarthOrigin> {
        self.origin
    }

    /// Moves the local frame's origin, if its place on the earth is known.
    pub(crate) fn move_origin(&mut self, origin: EarthOrigin) {
        self.origin = self.origin.map(|_| origin);
    }

    /// Returns the state of the sensors after these readings.
    pub(crate) fn observe(&mut self, world: &World, readings: &Readings) -> AuxSensors {
        for silent_ms in &mut self.silent_ms {
            *silent_ms = silent_ms.saturating_add(1);
        }
        let [receiver, barometer, magnetometer] = &mut self.silent_ms;
        for aid in readings.aids.iter().flatten() {
            match aid.value {
                Measurement::Gnss { horizontal_sigma_m, vertical_sigma_m, .. } => {
                    *receiver = 0;
                    self.sigma_mm = [horizontal_sigma_m, vertical_sigma_m].map(|sigma_m| (sigma_m * 1e3) as u32);
                }
                Measurement::Height { .. } => *barometer = 0,
                Measurement::MagneticField { .. } => *magnetometer = 0,
                _ => {}
            }
        }
        let heard = self.silent_ms.map(|silent_ms| silent_ms < SILENT_MS);
        let [receives, measures_height, measures_field] = heard;
        let sets = [
            (self.suite.barometer.is_some(), measures_height, sensor::BAROMETER),
            (self.suite.magnetometer.is_some(), measures_field, sensor::MAGNETOMETER),
        ];
        let mut sensors = SensorBits::default();
        for (_, well, bit) in sets.into_iter().filter(|(there, ..)| *there) {
            sensors.present |= bit;
            sensors.healthy |= if well { bit } else { 0 };
        }
        let charge = world.plant().telemetry().and_then(|telemetry| telemetry.battery);
        AuxSensors {
            origin: self.origin,
            receiver: self.suite.gnss.map(|_| {
                let known = GnssReceiver { sigma_mm: self.sigma_mm, ..GnssReceiver::NO_FIX };
                if receives {
                    GnssReceiver { kind: GnssReceiver::FIX_3D, satellites: SATELLITES, ..known }
                } else {
                    known
                }
            }),
            battery: charge.map(|charge| BatteryStatus {
                voltage_mv: (charge.voltage_v * 1e3) as u16,
                current_ca: (charge.current_a * 1e2) as i16,
                remaining_percent: (charge.charge * 1e2) as i8,
                consumed_mah: -1,
                charge: 0,
            }),
            sensors,
            powered_up_us: 0,
        }
    }
}
