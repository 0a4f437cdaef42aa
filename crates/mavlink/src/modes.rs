//! The vehicle's available and current modes: AVAILABLE_MODES and CURRENT_MODE.

use crate::message::{MessageFormat, PAYLOAD_MAX};
use crate::wire::MessageLayout;
use mavlink::dialects::common::{AVAILABLE_MODES_DATA, CURRENT_MODE_DATA};

/// AVAILABLE_MODES (435): one of the available modes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AvailableMode {
    /// Number of available modes.
    pub count: u8,
    /// Index of this mode, from 1.
    pub index: u8,
    /// `MAV_STANDARD_MODE`; 0 if it is none of them.
    pub standard: u8,
    /// `custom_mode` in HEARTBEAT.
    pub custom: u32,
    /// `MAV_MODE_PROPERTY`.
    pub properties: u32,
    /// Name, padded with zeros.
    pub name: [u8; 35],
}

/// CURRENT_MODE (436).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CurrentMode {
    /// `MAV_STANDARD_MODE`; 0 if it is none of them.
    pub standard: u8,
    /// `custom_mode` in HEARTBEAT.
    pub custom: u32,
    /// `custom_mode` of the mode that was requested last.
    pub intended: u32,
}

const AVAILABLE: MessageLayout<AVAILABLE_MODES_DATA, ([u32; 2], [u8; 3], [u8; 35])> = MessageLayout::NEW;
const CURRENT: MessageLayout<CURRENT_MODE_DATA, ([u32; 2], u8)> = MessageLayout::NEW;

impl AvailableMode {
    pub(crate) fn format() -> MessageFormat {
        AVAILABLE.format()
    }

    pub(crate) fn read(payload: &[u8]) -> Self {
        let ([custom, properties], [count, place, standard], name) = AVAILABLE.read(payload);
        AvailableMode { count, index: place, standard, custom, properties, name }
    }

    pub(crate) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        let AvailableMode { count, index: place, standard, custom, properties, name } = *self;
        AVAILABLE.write(&([custom, properties], [count, place, standard], name), payload)
    }
}

impl CurrentMode {
    pub(crate) fn format() -> MessageFormat {
        CURRENT.format()
    }

    pub(crate) fn read(payload: &[u8]) -> Self {
        let ([custom, intended], standard) = CURRENT.read(payload);
        CurrentMode { standard, custom, intended }
    }

    pub(crate) fn write(&self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        CURRENT.write(&([self.custom, self.intended], self.standard), payload)
    }
}
