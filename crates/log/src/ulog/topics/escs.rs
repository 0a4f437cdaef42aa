//! Topic of motor controllers (ESCs) with telemetry.

use crate::ulog::layout::{LoggedField, Wire, message};
use crate::ulog::moment::Moment;
use crate::ulog::record::Content;

/// Number of motor controllers in a message.
const ESCS: usize = 8;
/// PX4's `ESC_CONNECTION_TYPE_DSHOT`.
const DSHOT: u8 = 5;
/// PX4's output function of the first motor.
const MOTOR_1: u8 = 101;
/// PX4's `FAILURE_GENERIC`.
const GENERIC: u16 = 128;

/// Fields of an [`EscReport`].
pub(crate) const ESC_REPORT: &[LoggedField] = &[
    LoggedField::of::<u64>("timestamp", "us"),
    LoggedField::of::<u32>("esc_errorcount", ""),
    LoggedField::of::<i32>("esc_rpm", "rev/min"),
    LoggedField::of::<f32>("esc_voltage", "V"),
    LoggedField::of::<f32>("esc_current", "A"),
    LoggedField::of::<f32>("esc_temperature", "deg C"),
    LoggedField::of::<u16>("failures", "flags"),
    LoggedField::of::<u8>("esc_address", ""),
    LoggedField::of::<u8>("esc_cmdcount", ""),
    LoggedField::of::<u8>("esc_state", ""),
    LoggedField::of::<u8>("actuator_function", ""),
    LoggedField::of::<i8>("esc_power", "%"),
    LoggedField::of::<[u8; 5]>("_padding0", ""),
];

/// Telemetry of one motor controller; all zeros if it has sent none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct EscReport {
    at_us: u64,
    rpm: i32,
    voltage_v: f32,
    current_a: f32,
    temperature_c: f32,
    failures: u16,
    function: u8,
}

impl Wire for EscReport {
    const KIND: &'static str = "esc_report";

    fn put(self, to: &mut Content<'_>) {
        let EscReport { at_us, rpm, voltage_v, current_a, temperature_c, failures, function } = self;
        at_us.put(to);
        0_u32.put(to);
        rpm.put(to);
        [voltage_v, current_a, temperature_c].put(to);
        failures.put(to);
        // The bytes are address, count of commands, state, function, power and padding.
        [0, 0, 0, function, 0, 0, 0, 0, 0, 0_u8].put(to);
    }
}

message! {
    /// Motor controllers, in PX4's order of the motors on an X frame of four.
    "esc_status" EscStatusReport {
        counter: u16 = "readings, modulo 65,536",
        esc_count: u8 = "",
        esc_connectiontype: u8 = "",
        esc_online_flags: u8 = "a bit for each",
        esc_armed_flags: u8 = "a bit for each",
        _padding0: [u8; 2] = "",
        esc: [EscReport; ESCS] = "for each ESC: `timestamp`, `esc_rpm`, `esc_voltage`, `esc_current`, \
             `esc_temperature` (deg C), `failures`, `actuator_function`; the other fields of `esc_report` are 0",
    }
}

impl EscStatusReport {
    /// Returns none until a motor controller has answered.
    pub(crate) fn of(moment: &Moment<'_>) -> Option<Self> {
        // Converts rad/s to revolutions per minute: 60 s / 2 pi.
        const RPM: f32 = 60.0 / core::f32::consts::TAU;
        let (escs, known, now_us) = (moment.beside.escs.filter(|escs| escs.is_known())?, moment.known, moment.now_us());
        let (mut esc, mut online) = ([EscReport::default(); ESCS], 0_u8);
        let answers = escs.online(now_us);
        for ((to, rotor), motor) in esc.iter_mut().zip(known.rotor_of_motor).zip(0_u8..) {
            let Some(reading) = escs.readings.get(rotor).copied().flatten() else { continue };
            let value = reading.value;
            let fails = escs.failures.get(rotor).is_some_and(Option::is_some);
            *to = EscReport {
                at_us: reading.at_us,
                rpm: (value.speed_rad_s(escs.poles.into()) * RPM + 0.5) as i32,
                voltage_v: f32::from(value.voltage_cv) * 1e-2,
                current_a: f32::from(value.current_ca) * 1e-2,
                temperature_c: value.temperature_c.into(),
                failures: if fails { GENERIC } else { 0 },
                function: MOTOR_1 + motor,
            };
            // Both shifts are below 8: `rotor` has a reading, and `motor` has a place in the message.
            online |= u8::from(answers.wrapping_shr(rotor as u32) & 1 != 0).wrapping_shl(motor.into());
        }
        Some(EscStatusReport {
            timestamp: now_us,
            counter: escs.counter,
            esc_count: known.rotors as u8,
            esc_connectiontype: DSHOT,
            esc_online_flags: online,
            esc_armed_flags: if moment.report.mode.armed() { online } else { 0 },
            _padding0: [0; 2],
            esc,
        })
    }
}
