//! Checks that the images leave the flash's sectors 1 and 2 to the parameters (`memory.x`).
#![allow(clippy::unwrap_used, clippy::panic, missing_docs, unreachable_pub, reason = "test")]

mod common;

use common::start_or_skip;
use object::{Object, ObjectSection, ObjectSegment};
use pil::FirmwareImage;
use std::fs;
use std::ops::Range;

/// Address range of sectors 1 and 2.
const PARAMETERS: Range<u64> = 0x0800_4000..0x0800_C000;
/// Address range of sector 0.
const VECTORS: Range<u64> = 0x0800_0000..0x0800_4000;

#[test]
fn nothing_is_linked_into_the_sectors_of_the_parameters() {
    for image in [FirmwareImage::Flight, FirmwareImage::Pil] {
        let Some(bytes) = start_or_skip(image, |path| Ok(fs::read(path)?)) else { return };
        let file = object::File::parse(bytes.as_slice()).unwrap();
        let overlaps = |start: u64, size: u64| start < PARAMETERS.end && start + size > PARAMETERS.start;
        // Everything that a programmer writes, including the initial values of RAM.
        for segment in file.segments().filter(|segment| !segment.data().unwrap().is_empty()) {
            let Range { start, end } = {
                let (at, size) = (segment.address(), segment.data().unwrap().len() as u64);
                at..at + size
            };
            assert!(!overlaps(start, end - start), "{image:?}: {start:#x} to {end:#x}");
        }
        for section in file.sections().filter(|section| section.size() > 0) {
            let (name, at) = (section.name().unwrap(), section.address());
            assert!(!overlaps(at, section.size()), "{image:?}: {name} at {at:#x}");
            if name == ".vector_table" {
                assert_eq!(at, VECTORS.start);
                assert!(section.size() <= VECTORS.end - VECTORS.start);
            }
            if name == ".text" {
                assert_eq!(at, PARAMETERS.end);
            }
        }
    }
}
