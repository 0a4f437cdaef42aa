//! Health, battery, outputs and versions.

use crate::message::{MessageFormat, PAYLOAD_MAX};
use crate::wire::MessageLayout;
use mavlink::MessageData;
use mavlink::dialects::common::{
    ACTUATOR_OUTPUT_STATUS_DATA, AUTOPILOT_VERSION_DATA, BATTERY_STATUS_DATA, ESTIMATOR_STATUS_DATA,
    EXTENDED_SYS_STATE_DATA, PROTOCOL_VERSION_DATA, SYS_STATUS_DATA,
};

/// SYS_STATUS (1).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SystemStatus {
    /// Sensors present, as `MAV_SYS_STATUS_SENSOR`.
    pub present: u32,
    /// Sensors in use, as `MAV_SYS_STATUS_SENSOR`.
    pub enabled: u32,
    /// Healthy sensors, as `MAV_SYS_STATUS_SENSOR`.
    pub healthy: u32,
    /// Processor load of the control tick \[0.1 %\].
    pub load_permille: u16,
    /// Voltage of the battery \[mV\]; `u16::MAX` if unknown.
    pub voltage_mv: u16,
    /// Current of the battery \[0.01 A\]; -1 if unknown.
    pub current_ca: i16,
    /// Remaining charge \[%\]; -1 if unknown.
    pub remaining_percent: i8,
    /// Number of frames dropped since power-up.
    pub dropped_frames: u16,
}

/// BATTERY_STATUS (147) of one battery.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BatteryStatus {
    /// Voltage \[mV\], below 65,534.
    pub voltage_mv: u16,
    /// Current \[0.01 A\]; -1 if unknown.
    pub current_ca: i16,
    /// Charge drawn so far \[mA h\]; -1 if unknown.
    pub consumed_mah: i32,
    /// Remaining charge \[%\]; -1 if unknown.
    pub remaining_percent: i8,
    /// `MAV_BATTERY_CHARGE_STATE`: 0 unknown, 1 ok, 2 low, 3 critical.
    pub charge: u8,
}

/// ESTIMATOR_STATUS (230). Innovation test ratios are always sent as 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EstimatorStatus {
    /// Time since power-up \[us\].
    pub time_us: u64,
    /// `ESTIMATOR_STATUS_FLAGS`.
    pub flags: u16,
    /// Horizontal and vertical uncertainty of the position; NaN if unknown \[m\].
    pub sigma_m: [f32; 2],
}

/// ACTUATOR_OUTPUT_STATUS (375).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ActuatorOutputs {
    /// Time since power-up \[us\].
    pub time_us: u64,
    /// Number of outputs in use.
    pub active: u32,
    /// Throttle of each output, 0 to 1.
    pub throttles: [f32; 8],
}

/// AUTOPILOT_VERSION (148).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Version {
    /// `MAV_PROTOCOL_CAPABILITY`.
    pub capabilities: u64,
    /// Id of the board; 0 if unknown.
    pub uid: u64,
    /// Software version: major, minor, patch, and 255 for a release.
    pub software: [u8; 4],
    /// First bytes of the commit that was built; zeros if unknown.
    pub commit: [u8; 8],
}

/// Fields: sensors present, enabled, healthy; load, voltage; current; six counts; remaining charge; extended sensor
/// sets.
const SYSTEM: MessageLayout<SYS_STATUS_DATA, ([u32; 3], [u16; 2], i16, [u16; 6], i8, [u32; 3])> = MessageLayout::NEW;
/// Fields: consumed charge and energy; temperature; cells; current; id, function, type; remaining charge; remaining
/// time; charge state; further cells; mode; faults.
type BatteryFields = (([i32; 2], i16, [u16; 10], i16), [u8; 3], i8, i32, u8, [u16; 4], u8, u32);
const BATTERY: MessageLayout<BATTERY_STATUS_DATA, BatteryFields> = MessageLayout::NEW;
const LANDED: MessageLayout<EXTENDED_SYS_STATE_DATA, (u8, u8)> = MessageLayout::NEW;
/// Fields: time, six test ratios, two uncertainties, flags.
const ESTIMATOR: MessageLayout<ESTIMATOR_STATUS_DATA, (u64, [f32; 6], [f32; 2], u16)> = MessageLayout::NEW;
const OUTPUTS: MessageLayout<ACTUATOR_OUTPUT_STATUS_DATA, (u64, u32, [f32; 8], [f32; 24])> = MessageLayout::NEW;
/// Fields: capabilities, board id; software; versions of middleware, system, board; vendor, product; commits; long
/// board id.
type VersionFields = ([u64; 2], [u8; 4], [u32; 3], [u16; 2], [u8; 8], [u8; 16], [u8; 18]);
const VERSION: MessageLayout<AUTOPILOT_VERSION_DATA, VersionFields> = MessageLayout::NEW;
/// Fields: version, minimum, maximum; hashes of specification and library.
const PROTOCOL: MessageLayout<PROTOCOL_VERSION_DATA, ([u16; 3], [u8; 16])> = MessageLayout::NEW;

/// Values for a missing cell and an unknown temperature.
const NO_CELL: u16 = u16::MAX;
const NO_TEMPERATURE: i16 = i16::MAX;

pub(super) fn format(id: u32) -> Option<MessageFormat> {
    Some(match id {
        SYS_STATUS_DATA::ID => SYSTEM.format(),
        BATTERY_STATUS_DATA::ID => BATTERY.format(),
        EXTENDED_SYS_STATE_DATA::ID => LANDED.format(),
        ESTIMATOR_STATUS_DATA::ID => ESTIMATOR.format(),
        ACTUATOR_OUTPUT_STATUS_DATA::ID => OUTPUTS.format(),
        AUTOPILOT_VERSION_DATA::ID => VERSION.format(),
        PROTOCOL_VERSION_DATA::ID => PROTOCOL.format(),
        _ => return None,
    })
}

impl SystemStatus {
    pub(super) fn read(payload: &[u8]) -> Self {
        let ([present, enabled, healthy], [load_permille, voltage_mv], current_ca, counts, remaining_percent, _) =
            SYSTEM.read(payload);
        let [_, dropped_frames, ..] = counts;
        SystemStatus {
            present,
            enabled,
            healthy,
            load_permille,
            voltage_mv,
            current_ca,
            remaining_percent,
            dropped_frames,
        }
    }

    pub(super) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        let numbers = [self.load_permille, self.voltage_mv];
        let sets = [self.present, self.enabled, self.healthy];
        let counts = [0, self.dropped_frames, 0, 0, 0, 0];
        SYSTEM.write(&(sets, numbers, self.current_ca, counts, self.remaining_percent, [0; 3]), payload)
    }
}

impl BatteryStatus {
    pub(super) fn read(payload: &[u8]) -> Self {
        let (([consumed_mah, _], _, [voltage_mv, ..], current_ca), _, remaining_percent, _, charge, ..) =
            BATTERY.read(payload);
        BatteryStatus { voltage_mv, current_ca, consumed_mah, remaining_percent, charge }
    }

    pub(super) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        let BatteryStatus { voltage_mv, current_ca, consumed_mah, remaining_percent, charge } = *self;
        // The voltage of all cells is sent as one cell.
        let mut cells = [NO_CELL; 10];
        cells.iter_mut().take(1).for_each(|cell| *cell = voltage_mv);
        let numbers = ([consumed_mah, -1], NO_TEMPERATURE, cells, current_ca);
        BATTERY.write(&(numbers, [0; 3], remaining_percent, 0, charge, [0; 4], 0, 0), payload)
    }
}

impl EstimatorStatus {
    pub(super) fn read(payload: &[u8]) -> Self {
        let (time_us, _, sigma_m, flags) = ESTIMATOR.read(payload);
        EstimatorStatus { time_us, flags, sigma_m }
    }

    pub(super) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        ESTIMATOR.write(&(self.time_us, [0.0; 6], self.sigma_m, self.flags), payload)
    }
}

impl ActuatorOutputs {
    pub(super) fn read(payload: &[u8]) -> Self {
        let (time_us, active, throttles, _) = OUTPUTS.read(payload);
        ActuatorOutputs { time_us, active, throttles }
    }

    pub(super) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        OUTPUTS.write(&(self.time_us, self.active, self.throttles, [0.0; 24]), payload)
    }
}

impl Version {
    pub(super) fn read(payload: &[u8]) -> Self {
        let ([capabilities, uid], [rest @ .., major], _, _, commit, ..) = VERSION.read(payload);
        let [kind, patch, minor] = rest;
        Version { capabilities, uid, software: [major, minor, patch, kind], commit }
    }

    pub(super) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        let Version { capabilities, uid, software: [major, minor, patch, kind], commit } = *self;
        let software = [kind, patch, minor, major];
        VERSION.write(&([capabilities, uid], software, [0; 3], [0; 2], commit, [0; 16], [0; 18]), payload)
    }
}

/// Returns the landed state in EXTENDED_SYS_STATE.
pub(super) fn read_landed(payload: &[u8]) -> u8 {
    LANDED.read(payload).1
}

/// Writes EXTENDED_SYS_STATE; the VTOL state is always undefined.
pub(super) fn write_landed(state: u8, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
    LANDED.write(&(0, state), payload)
}

pub(super) fn write_protocol(payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
    // The present, oldest and newest version are 2.0, given in hundredths.
    PROTOCOL.write(&([200, 200, 200], [0; 16]), payload)
}
