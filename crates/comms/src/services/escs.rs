//! ESC telemetry for stations: ESC_STATUS and ESC_INFO.

use crate::services::status::VehicleStatus;
use afbc_drivers::esc_telemetry::EscReading;
use afbc_mavlink::telemetry::{ESCS_PER_MESSAGE, EscInfo, EscStatus};
use afbc_types::Stamped;

/// Value for an unknown temperature.
const NO_TEMPERATURE: i16 = i16::MAX;
/// `ESC_FAILURE_GENERIC`, the flag of a failed rotor.
const GENERIC: u16 = 64;

/// Returns the number of the first ESC of a group of four, and the readings of the group.
fn four(status: &VehicleStatus, page: u8) -> Option<(u8, [Option<Stamped<EscReading>>; ESCS_PER_MESSAGE])> {
    let escs = &status.escs;
    let first = page * ESCS_PER_MESSAGE as u8;
    let readings = |at: usize| escs.readings.get(usize::from(first) + at).copied().flatten();
    (escs.is_known() && first < status.rotors.max(1)).then(|| (first, core::array::from_fn(readings)))
}

/// Returns ESC_STATUS of a group of four ESCs. Returns none unless an ESC has answered and the vehicle has that many
/// rotors.
pub fn status(status: &VehicleStatus, page: u8) -> Option<EscStatus> {
    // Converts rad/s to revolutions per minute.
    const RPM: f32 = 60.0 / core::f32::consts::TAU;
    let (first, readings) = four(status, page)?;
    let of = |value: fn(&EscReading) -> f32| readings.map(|reading| reading.map_or(0.0, |it| value(&it.value)));
    let poles = status.escs.poles.into();
    Some(EscStatus {
        first,
        time_us: status.time_us,
        speeds_rpm: readings.map(|it| it.map_or(0, |it| (it.value.speed_rad_s(poles) * RPM + 0.5) as i32)),
        voltages_v: of(|reading| f32::from(reading.voltage_cv) * 1e-2),
        currents_a: of(|reading| f32::from(reading.current_ca) * 1e-2),
    })
}

/// Returns ESC_INFO of a group of four ESCs, on the same conditions as [`status`].
pub fn info(status: &VehicleStatus, page: u8) -> Option<EscInfo> {
    let (first, readings) = four(status, page)?;
    let escs = &status.escs;
    let failed = |at: usize| escs.failures.get(usize::from(first) + at).copied().flatten().is_some();
    let celsius = |it: Stamped<EscReading>| i16::from(it.value.temperature_c) * 100;
    Some(EscInfo {
        first,
        time_us: status.time_us,
        counter: escs.counter,
        count: status.rotors,
        online: escs.online(status.time_us),
        failures: core::array::from_fn(|at| if failed(at) { GENERIC } else { 0 }),
        temperatures_cc: readings.map(|reading| reading.map_or(NO_TEMPERATURE, celsius)),
    })
}
