//! Terrain heights: TERRAIN_CHECK and TERRAIN_REPORT.

use crate::message::{MessageFormat, PAYLOAD_MAX};
use crate::wire::{MessageLayout, Unused};
use mavlink::MessageData;
use mavlink::dialects::common::{TERRAIN_CHECK_DATA, TERRAIN_REPORT_DATA};

/// TERRAIN_CHECK (135), or TERRAIN_REPORT (136) for a position of unknown height.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Terrain {
    /// Latitude and longitude \[1e-7 degrees\].
    pub place_e7: [i32; 2],
}

pub(super) const CHECK_ID: u32 = TERRAIN_CHECK_DATA::ID;
pub(super) const REPORT_ID: u32 = TERRAIN_REPORT_DATA::ID;

const CHECK: MessageLayout<TERRAIN_CHECK_DATA, ([i32; 2],)> = MessageLayout::NEW;
/// Fields: position; heights, grid spacing (0: unknown), blocks pending and loaded.
const REPORT: MessageLayout<TERRAIN_REPORT_DATA, ([i32; 2], Unused<14>)> = MessageLayout::NEW;

pub(super) fn check_format() -> MessageFormat {
    CHECK.format()
}

pub(super) fn report_format() -> MessageFormat {
    REPORT.format()
}

impl Terrain {
    pub(super) fn read_check(payload: &[u8]) -> Self {
        Terrain { place_e7: CHECK.read(payload).0 }
    }

    pub(super) fn read_report(payload: &[u8]) -> Self {
        Terrain { place_e7: REPORT.read(payload).0 }
    }

    pub(super) fn write_check(self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        CHECK.write(&(self.place_e7,), payload)
    }

    pub(super) fn write_report(self, payload: &mut [u8; PAYLOAD_MAX]) -> (u32, u8) {
        REPORT.write(&(self.place_e7, Unused), payload)
    }
}
